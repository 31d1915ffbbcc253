"""Writes report.html: the paper's table with ours beside it, and the replay of every trial.

All else that is to be seen of a run, `inspect view` shows of its log.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from urllib.parse import quote

from mapspeak.evaluation.agents.finding import is_script
from mapspeak.evaluation.report.html import Html, document, element, paragraph, table, text
from mapspeak.evaluation.report.replay import PAGE, REPLAY, ReplayWriter, say_standing
from mapspeak.evaluation.scores.rows import TableRow, count_rows, wilson_interval
from mapspeak.evaluation.trials import TRIALS, TrialResult, TrialState, write_whole

MOST_SAID = 240
"""Characters of an error in the list; all of it is in the replay."""
NOT_RUN = "not run"

PAPER_TASKS = ("explore", "smallest-room", "fire-tool")
"""The names of its Tasks 1 to 3 here."""

PAPER_NOTE = (
    "The paper's figures are as it printed them: one warehouse in NVIDIA Isaac Sim, Task 1 once, "
    "Tasks 2 and 3 thirty times each, Claude Sonnet 4.6 and GPT-5.5. They were not measured here, "
    "and another simulator, other worlds and another robot stand behind ours. Its coverage is the "
    "free area of the map over the free area of the building, wherever it lies; ours is given by "
    "that ratio too, and as recall: the share of the floor in sight that the map shows as free. "
    "What is known is the share of the reachable floor that the map knows, be it as free or as "
    "solid. The intervals of its counts are ours, after Wilson."
)


PAPER_TRIALS = 30
PAPER_ROWS = (("Claude Sonnet 4.6", 0.9783, 26, 30), ("GPT-5.5", 0.9978, 28, 30))
"""Results of each model in the paper: the coverage of one run of Task 1 by its own ratio, and the
number of thirty trials of Task 2 and of Task 3 that succeeded."""


def write_page(run: Path, results: Sequence[TrialResult]) -> Path:
    """Write the page of a run into its folder, and that of each trial into the trial's."""
    rows = count_rows(results)
    page = document(
        "mapspeak: an evaluation",
        element("h1", {}, text("mapspeak: an evaluation")),
        *_show_paper(rows),
        *_list_trials(results),
    )
    writer = ReplayWriter(run)
    for result in results:
        writer.write(result)
    write_whole(run / PAGE, page)
    return run / PAGE


def _show_paper(rows: Sequence[TableRow]) -> Iterator[Html]:
    """Show the paper's table, where any of its tasks was run."""
    keys = dict.fromkeys((row.agent, row.representation) for row in rows if row.task in PAPER_TASKS)
    if not keys:
        return
    heading = ("who", "Task 1: coverage", "Task 2: smallest room", "Task 3: tool for fire")
    paper = (
        [
            _cell(model, "the paper, not run here"),
            _cell(f"{_percent(coverage_ratio)} of one warehouse"),
            *(_share(n_successes, PAPER_TRIALS) for n_successes in n_done),
        ]
        for model, coverage_ratio, *n_done in PAPER_ROWS
    )
    ours = (_our_row(agent, how, rows) for agent, how in keys)
    yield element("h2", {"id": "paper"}, text("Beside the paper"))
    yield table(heading, [*paper, *ours], kind="paper")
    yield paragraph("note", PAPER_NOTE)


def _our_row(agent: str, representation: str, rows: Iterable[TableRow]) -> list[Html]:
    found = {
        row.task: row for row in rows if (row.agent, row.representation) == (agent, representation)
    }
    explored, *others = (found.get(task) for task in PAPER_TASKS)
    kind = "a script, no model" if is_script(agent) else "a model or client program"
    return [
        _cell(agent, f"here, {representation}: {kind}"),
        _cell(NOT_RUN) if explored is None else _coverage(explored),
        *(
            _cell(NOT_RUN) if row is None else _share(row.n_successes, row.n_trials, row.n_broken)
            for row in others
        ),
    ]


def _coverage(row: TableRow) -> Html:
    names = {"paper_ratio": "by the paper's ratio", "recall": "recall", "known_ratio": "known"}
    figures = ((row.figures.get(f"coverage_{name}"), said) for name, said in names.items())
    said = ", ".join(f"{_percent(value)} {name}" for value, name in figures if value is not None)
    broken = f"; {row.n_broken} broken" if row.n_broken else ""
    return _cell(said or NOT_RUN, f"{row.n_successes}/{row.n_trials} done{broken}")


def _list_trials(results: Iterable[TrialResult]) -> Iterator[Html]:
    box = element("input", {"type": "checkbox", "id": "only-failed"})
    label = element("label", {"for": "only-failed"}, text(" only those that were not done"))
    yield element("h2", {"id": "trials"}, text("Every trial"))
    yield element("p", {"class": "choice"}, box, label)
    yield table(("trial", "", "mistake", "reason"), map(_line, results), kind="trials")


def _line(result: TrialResult) -> list[Html]:
    failure, (standing, kind) = result.score.failure, say_standing(result)
    link = quote(f"{TRIALS}/{result.trial.id}/{REPLAY}")
    # A trace ends with what went wrong.
    last = ((result.error or "").strip().splitlines() or [result.score.reason])[-1]
    mistake = "" if failure is None else failure.replace("_", " ")
    if failure is not None and result.state is TrialState.OUT_OF_BUDGET:
        mistake = f"{mistake}, out of budget"
    return [
        element("td", {"class": "id"}, element("a", {"href": link}, text(result.trial.id))),
        element("td", {}, element("span", {"class": f"word {kind}"}, text(standing))),
        _cell(mistake),
        _cell(last if len(last) <= MOST_SAID else f"{last[:MOST_SAID]}..."),
    ]


def _share(n_successes: int, n_trials: int, n_broken: int = 0) -> Html:
    """Return how many trials were done in a cell, with Wilson's interval."""
    share = wilson_interval(n_successes, n_trials)
    if share is None:
        return _cell(NOT_RUN)
    broken = f"; {n_broken} broken" if n_broken else ""
    span = f"{_percent(share.low)} to {_percent(share.high)}{broken}"
    return _cell(f"{n_successes}/{n_trials} ({_percent(share.value)})", span)


def _percent(ratio: float) -> str:
    return f"{100 * ratio:.2f} %"


def _cell(said: str, small: str = "") -> Html:
    below = (element("small", {}, text(small)),) if small else ()
    return element("td", {}, text(said), *below)
