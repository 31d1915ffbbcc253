"""The replay of a trial: its map and path, and every step with its text and pictures."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from mapspeak.atomic import replace_file
from mapspeak.errors import MapspeakError
from mapspeak.evaluation.trials import (
    CALLS,
    MAP,
    MEMORY,
    PICTURES,
    STATES,
    TURNS,
    TrialResult,
    Turn,
    read_turns,
    say_fault,
)
from mapspeak.memory import SemanticMap, SemanticMapStore
from mapspeak.server.view.document import CallView, GridView, PoseView
from mapspeak.server.view.overlay import Overlay
from mapspeak.server.view.pages import build_replay_page
from mapspeak.server.view.replay import (
    MAPS,
    Moment,
    Replay,
    StepView,
    join_pictures,
    locate_pictures,
    read_moments,
    show_map,
    show_moments,
)
from mapspeak.simulator import StateRecord, read_state_log
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map

AT_LAST = "as it was in the end; ids in answers are those of their time"
GROWING = "as it was at each step"
MAP_LOG = f"{CALLS}/{MAPS}"
PAGE, REPLAY = "report.html", "replay.html"
MOST_POINTS = 500

_Value = TypeVar("_Value")


class ReplayWriter:
    """Writes the pages of a run's trials; many of them end on the same map."""

    def __init__(self) -> None:
        self._shown: dict[bytes, tuple[GridView, Overlay]] = {}

    def write(self, result: TrialResult, folder: Path) -> None:
        """Write the page of a trial into its folder; what cannot be read is left out and told."""
        trial = result.trial
        faults: list[tuple[str, str]] = []

        def attempt(name: str, read: Callable[[Path], _Value], default: _Value) -> _Value:
            path = folder / name
            try:
                return read(path) if path.exists() else default
            except (OSError, ValueError, TypeError, MapspeakError) as error:
                faults.append((f"{name} cannot be read", say_fault(error)))
                return default

        turns: tuple[Turn, ...] = attempt(TURNS, lambda _: read_turns(folder), ())
        states: tuple[StateRecord, ...] = attempt(STATES, read_state_log, ())
        memory = attempt(MEMORY, lambda path: SemanticMapStore(path).read(), SemanticMap())
        no_moments: tuple[Sequence[Moment], Mapping[str, str]] = ((), {})
        moments, pictures = attempt(MAP_LOG, read_moments, no_moments)
        nothing: tuple[GridView | None, Overlay] = (join_pictures(moments, pictures), Overlay())
        shown, overlay = nothing
        if not moments:
            shown, overlay = attempt(
                MAP, lambda path: self._show(load_map(path).grid, memory), nothing
            )
        thinned = [*states[:: -(-len(states) // MOST_POINTS) or 1], *states[-1:]]
        replay = Replay(
            about=[*_describe(result), ("map", GROWING if moments else AT_LAST), *faults],
            back=f"{'../' * (trial.id.count('/') + 2)}{PAGE}",
            map=shown,
            overlay=overlay,
            moments=moments,
            trail=[(round(state.x, 2), round(state.y, 2)) for state in thinned],
            steps=list(_steps(turns, thinned, moments, folder / PICTURES)),
        )
        title = f"mapspeak: {trial.task} {trial.world} {trial.number:03d}"
        replace_file(folder / REPLAY, build_replay_page(title, replay))

    def _show(self, grid: OccupancyGrid, memory: SemanticMap) -> tuple[GridView | None, Overlay]:
        if grid.unknown.all():
            return None, Overlay()
        told = f"{grid.origin} {grid.resolution_m} {memory.waypoints}"
        key = hashlib.blake2b(np.ascontiguousarray(grid.cells).data)
        key.update(told.encode(errors="replace"))
        if key.digest() not in self._shown:
            self._shown[key.digest()] = show_map(grid, memory)
        return self._shown[key.digest()]


def say_standing(result: TrialResult) -> tuple[str, str]:
    """Return a word for the end of a trial, and its kind."""
    if result.state.is_broken:
        return result.state.value, "broken"
    return ("done", "good") if result.score.is_success else ("not done", "bad")


def _describe(result: TrialResult) -> Iterator[tuple[str, str]]:
    trial, failure = result.trial, result.score.failure
    mistake = "" if failure is None else f" ({failure.replace('_', ' ')})"
    yield "trial", f"{trial.id}, seed {trial.seed}"
    yield "agent", f"{trial.answerer}, {trial.representation}"
    yield "result", f"{say_standing(result)[0]}{mistake}: {result.score.reason}"
    yield (
        "spent",
        (
            f"{result.driven_m:.1f} m driven, {result.n_calls} calls, {result.n_errors} refused, "
            f"{result.robot_s:.0f} s robot time, {result.wall_s:.1f} s wall time"
        ),
    )
    said = {"asked": result.prompt, "answered": result.answer, "broken by": result.error}
    yield from ((name, text) for name, text in said.items() if text)


def _steps(
    turns: Sequence[Turn],
    states: Sequence[StateRecord],
    moments: Sequence[Moment],
    pictures: Path,
) -> Iterator[StepView]:
    n_calls = 0
    for number, group in enumerate(_group(turns), start=1):
        first, last = group[0], group[-1]
        told = first.call
        names = [name for turn in group for name in turn.pictures]
        found = list(locate_pictures(names, pictures))
        texts = [turn.text for turn in group if turn.text]
        if len(found) < len(names):
            texts.append(f"{len(names) - len(found)} of {len(names)} pictures are missing.")
        robot_s = last.robot_s
        times = last.wall_s, "" if robot_s is None else f", robot {robot_s:.1f} s"
        call = CallView(
            number=number,
            tool=first.role if told is None else told.tool,
            arguments={} if told is None else json.loads(json.dumps(told.arguments, default=str)),
            is_error=last.is_error,
            text="\n".join(texts),
            pictures=tuple(found),
            note="{:.1f} s{}".format(*times),
        )
        n_calls += last.role == "tool"
        step = StepView(
            call=call,
            at_s=last.wall_s if robot_s is None else robot_s,
            pose=None if last.pose is None else PoseView.of(last.pose),
            trail=(0, sum(state.time_s <= (robot_s or 0.0) for state in states)),
        )
        yield show_moments(step, moments, n_calls=n_calls)


def _group(turns: Sequence[Turn]) -> list[list[Turn]]:
    """Return the turns of each step: one text, or a call with its answer."""
    groups: list[list[Turn]] = []
    for turn in turns:
        if turn.role == "tool" and groups and groups[-1][-1].role == "agent":
            groups[-1].append(turn)
        else:
            groups.append([turn])
    return groups
