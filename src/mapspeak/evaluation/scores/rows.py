"""Rows of a table: trials of one task, agent and representation, and how sure their success is."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import NormalDist, fmean

from mapspeak.evaluation.scores.judging import spl
from mapspeak.evaluation.trials import Failure, TrialResult

CONFIDENCE = 0.95
COUNTED = (
    *("n_input_tokens", "n_output_tokens", "n_picture_tokens", "driven_m", "n_calls"),
    *("n_decisions", "n_errors", "n_collisions", "robot_s", "wall_s", "cpu_s"),
)
"""The numbers of a result that a mean says something about."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A figure, and the ends between which the true one lies with 95 % confidence."""

    value: float
    low: float
    high: float


def wilson_interval(n_successes: int, n_trials: int) -> Interval | None:
    """Return the share of successes with Wilson's score interval (1927); None without trials."""
    if n_trials == 0:
        return None
    z = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2)
    share, weight = n_successes / n_trials, z**2 / n_trials
    middle = (share + weight / 2) / (1 + weight)
    half = z / (1 + weight) * math.sqrt(share * (1 - share) / n_trials + weight / (4 * n_trials))
    return Interval(share, max(middle - half, 0.0), min(middle + half, 1.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class TableRow:
    """Results of the trials of one kind.

    Attributes:
        agent: The agent's name, with its level of thinking if set.
        n_broken: Number that crashed or hung; they count as trials.
        figures: Means of all figures of scores and results, by name; a broken trial has none of
            them, and an SPL of 0.
    """

    task: str
    agent: str
    representation: str
    n_trials: int
    n_successes: int
    n_broken: int
    figures: dict[str, float]
    failures: dict[Failure, int]


def count_rows(results: Iterable[TrialResult]) -> tuple[TableRow, ...]:
    """Count results: a row for each task, agent and representation."""
    groups: dict[tuple[str, str, str], list[TrialResult]] = {}
    for result in results:
        trial = result.trial
        key = (trial.task, trial.answerer, trial.representation)
        groups.setdefault(key, []).append(result)
    return tuple(_count(*key, results=group) for key, group in groups.items())


def _count(task: str, agent: str, representation: str, *, results: list[TrialResult]) -> TableRow:
    whole = [_figures_of(result) for result in results if not result.state.is_broken]
    names = dict.fromkeys(name for figures in whole for name in figures)
    figures = {name: fmean(each[name] for each in whole if name in each) for name in names}
    n_broken = len(results) - len(whole)
    if "spl" in figures:
        n_weighted = sum("spl" in each for each in whole)
        figures["spl"] *= n_weighted / (n_weighted + n_broken)
    failures = (result.score.failure for result in results)
    return TableRow(
        task=task,
        agent=agent,
        representation=representation,
        n_trials=len(results),
        n_successes=sum(result.score.is_success for result in results),
        n_broken=n_broken,
        figures=figures,
        failures=dict(Counter(failure for failure in failures if failure is not None)),
    )


def _figures_of(result: TrialResult) -> dict[str, float]:
    """Return every number of a result that a mean says something about."""
    weighted = spl(
        is_success=result.score.is_success,
        shortest_m=result.shortest_m,
        driven_m=result.driven_m,
    )
    counted = {name: getattr(result, name) for name in COUNTED} | {"spl": weighted}
    known = {name: float(value) for name, value in counted.items() if value is not None}
    return {**result.score.figures, **known}
