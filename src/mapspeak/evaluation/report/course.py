"""Reads how a trial went from its folder, as far as it can be read."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from mapspeak.errors import MapError
from mapspeak.evaluation.trials import Trial, Turn, read_turns, say_fault, trial_folder
from mapspeak.simulator import StateRecord, read_state_log
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map

__all__ = ["PICTURES", "TURNS", "Course", "read_course"]

TURNS = "turns.jsonl"
STATES = "state.jsonl"
MAP = "map.yaml"
PICTURES = "pictures"

_Value = TypeVar("_Value")


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


def read_course(run: Path, trial: Trial) -> Course:
    """Read how a trial went; what cannot be read is left out and told."""
    folder = trial_folder(run, trial)
    states, grid = folder / STATES, folder / MAP
    problems: list[str] = []

    def attempt(name: str, read: Callable[[], _Value], default: _Value) -> _Value:
        try:
            return read()
        except (OSError, ValueError, TypeError, MapError) as error:
            problems.append(f"{name} cannot be read: {say_fault(error)}.")
            return default

    return Course(
        turns=attempt(TURNS, lambda: read_turns(run, trial), ()),
        states=attempt(STATES, lambda: read_state_log(states) if states.exists() else (), ()),
        grid=attempt(MAP, lambda: load_map(grid).grid if grid.exists() else None, None),
        problems=tuple(problems),
    )
