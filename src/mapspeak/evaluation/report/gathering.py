"""Reads a run's folder, whole or not: what was asked for, and how each trial of it stands."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TypeVar

from mapspeak.errors import ConfigError, MapError
from mapspeak.evaluation.trials import (
    Failure,
    RunPlan,
    Score,
    Trial,
    TrialResult,
    TrialState,
    Turn,
    is_done,
    read_plan,
    read_result,
    read_turns,
    trial_folder,
)
from mapspeak.evaluation.trials.records import say_fault
from mapspeak.simulator import StateRecord, read_state_log
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map

__all__ = ["Attempt", "Course", "Run", "Standing", "read_course", "read_run"]

TURNS = "turns.jsonl"
STATES = "state.jsonl"
MAP = "map.yaml"
PICTURES = "pictures"
UNFINISHED = "The trial was begun and has no result."

_Value = TypeVar("_Value")


class Standing(StrEnum):
    """How a trial stands: as it ended, or why it has no result."""

    FINISHED = "finished"
    GAVE_UP = "gave up"
    OUT_OF_BUDGET = "out of budget"
    CRASHED = "crashed"
    HUNG = "hung"
    UNFINISHED = "unfinished"
    """Begun, and nothing came of it yet; counts as not successful."""
    UNREADABLE = "unreadable"
    """Its result cannot be read; counts nowhere."""
    NOT_RUN = "not run"
    """Asked for and not begun; counts nowhere."""


_STANDINGS = {
    TrialState.FINISHED: Standing.FINISHED,
    TrialState.GAVE_UP: Standing.GAVE_UP,
    TrialState.OUT_OF_BUDGET: Standing.OUT_OF_BUDGET,
    TrialState.CRASHED: Standing.CRASHED,
    TrialState.HUNG: Standing.HUNG,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """A trial that was asked for, and what there is of it.

    Attributes:
        trial: Which one.
        folder: Where it lies.
        standing: How it stands.
        result: What came of it, a failure for one that was only begun; None where it counts
            nowhere.
        problem: Why its result cannot be read; None where it can.
    """

    trial: Trial
    folder: Path
    standing: Standing
    result: TrialResult | None = None
    problem: str | None = None

    @property
    def is_broken(self) -> bool:
        """True when it crashed, hung or was only begun: what it cost is not known."""
        return self.standing in (Standing.UNFINISHED, Standing.CRASHED, Standing.HUNG)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run's folder, read.

    Attributes:
        folder: Where it lies.
        plan: What was asked for.
        attempts: Every trial of the plan, in its order.
    """

    folder: Path
    plan: RunPlan
    attempts: tuple[Attempt, ...]

    @property
    def results(self) -> tuple[TrialResult, ...]:
        """All that count."""
        return tuple(each.result for each in self.attempts if each.result is not None)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Course:
    """How a trial went, as far as it can be read.

    Attributes:
        turns: The conversation.
        states: The simulator's truth; poses in a map without errors.
        grid: The robot's map in the end; None where there is none.
        problems: What could not be read, one sentence each.
    """

    turns: tuple[Turn, ...]
    states: tuple[StateRecord, ...]
    grid: OccupancyGrid | None
    problems: tuple[str, ...]


def read_run(folder: Path) -> Run:
    """Reads what was asked for and what came of it.

    Raises:
        ConfigError: The folder holds no run, or one whose run.json cannot be read.
    """
    try:
        plan = read_plan(folder)
    except FileNotFoundError as error:
        raise ConfigError(
            f"{folder} holds no evaluation: there is no run.json.",
            hint="Name the folder that was given as --out.",
        ) from error
    except (OSError, ValueError) as error:
        raise ConfigError(
            f"{folder / 'run.json'} cannot be read: {say_fault(error)}.",
            hint="Delete it and start the evaluation again with the same options; "
            "finished trials are kept.",
        ) from error
    return Run(
        folder=folder,
        plan=plan,
        attempts=tuple(_read_attempt(folder, trial) for trial in plan.trials),
    )


def _read_attempt(run: Path, trial: Trial) -> Attempt:
    folder = trial_folder(run, trial)
    if not is_done(run, trial):
        if not (folder / TURNS).exists():
            return Attempt(trial=trial, folder=folder, standing=Standing.NOT_RUN)
        unfinished = Standing.UNFINISHED
        return Attempt(trial=trial, folder=folder, standing=unfinished, result=_cut_short(trial))
    try:
        result = read_result(run, trial)
    except (OSError, ValueError) as error:
        return _unreadable(trial, folder, say_fault(error))
    if result.trial != trial:
        return _unreadable(trial, folder, "it is the result of another trial")
    standing = _STANDINGS[result.state]
    return Attempt(trial=trial, folder=folder, standing=standing, result=result)


def _unreadable(trial: Trial, folder: Path, problem: str) -> Attempt:
    return Attempt(trial=trial, folder=folder, standing=Standing.UNREADABLE, problem=problem)


def _cut_short(trial: Trial) -> TrialResult:
    """Gives the result of a trial that has none: it is as good as crashed until it is run again."""
    score = Score(is_success=False, failure=Failure.BROKEN, reason=UNFINISHED)
    return TrialResult(trial=trial, prompt="", state=TrialState.CRASHED, score=score)


def read_course(run: Path, trial: Trial) -> Course:
    """Reads how a trial went; what cannot be read is left out and told."""
    folder = trial_folder(run, trial)
    problems: list[str] = []
    return Course(
        turns=_try(TURNS, lambda: read_turns(run, trial), problems) or (),
        states=_try(STATES, lambda: _read_states(folder / STATES), problems) or (),
        grid=_try(MAP, lambda: _read_grid(folder / MAP), problems),
        problems=tuple(problems),
    )


def _try(name: str, read: Callable[[], _Value], problems: list[str]) -> _Value | None:
    try:
        return read()
    except (OSError, ValueError, TypeError, MapError) as error:
        problems.append(f"{name} cannot be read: {say_fault(error)}.")
        return None


def _read_states(path: Path) -> tuple[StateRecord, ...]:
    return read_state_log(path) if path.exists() else ()


def _read_grid(path: Path) -> OccupancyGrid | None:
    return load_map(path).grid if path.exists() else None
