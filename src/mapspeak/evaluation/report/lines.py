"""report.csv: one line for each trial that was asked for."""

import csv
import io
from collections.abc import Iterable

from mapspeak.evaluation.report.gathering import Attempt
from mapspeak.evaluation.scores import spl

__all__ = ["build_csv"]

OF_TRIALS = ("task", "world", "agent", "thinking", "representation", "number", "seed")
OF_RESULTS = (
    "answer",
    "driven_m",
    "shortest_m",
    "n_turns",
    "n_calls",
    "n_decisions",
    "n_errors",
    "n_input_tokens",
    "n_output_tokens",
    "n_picture_tokens",
    "robot_s",
    "wall_s",
    "cpu_s",
    "n_collisions",
    "error",
)
COLUMNS = (
    "id",
    *OF_TRIALS,
    "standing",
    "is_success",
    "failure",
    "reason",
    *OF_RESULTS,
    "spl",
    "problem",
)
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes for a formula; answers and notes may begin with it on purpose."""


def build_csv(attempts: Iterable[Attempt]) -> str:
    """Gives the lines; figures of scores follow the fixed columns, in the order of their names."""
    attempts = list(attempts)
    figures = sorted({name for each in attempts for name in _figures(each)})
    own = [name for name in figures if name not in COLUMNS]
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=[*COLUMNS, *own], lineterminator="\n", restval="")
    writer.writeheader()
    for each in attempts:
        writer.writerow({name: _cell(value) for name, value in _line(each).items()})
    return text.getvalue()


def _figures(attempt: Attempt) -> dict[str, float]:
    return {} if attempt.result is None else attempt.result.score.figures


def _line(attempt: Attempt) -> dict[str, object]:
    trial, result = attempt.trial, attempt.result
    line: dict[str, object] = {
        "id": trial.id,
        **{name: getattr(trial, name) for name in OF_TRIALS},
        "standing": str(attempt.standing),
        "problem": attempt.problem,
    }
    if result is None:
        return line
    score = result.score
    way = spl(is_success=score.is_success, shortest_m=result.shortest_m, driven_m=result.driven_m)
    return {
        **score.figures,
        **line,
        **{name: getattr(result, name) for name in OF_RESULTS},
        "is_success": score.is_success,
        "failure": None if score.failure is None else str(score.failure),
        "reason": score.reason,
        "spl": way,
    }


def _cell(value: object) -> object:
    """Gives a value as a cell holds it: text that looks like a formula is made plain text."""
    if isinstance(value, str) and value.startswith(FORMULA_STARTS):
        return f"'{value}"
    return value
