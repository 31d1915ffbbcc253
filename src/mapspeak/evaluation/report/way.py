"""The way a robot drove, drawn over its map: all of it, the part so far, and where it stood."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

import numpy as np

from mapspeak.errors import MapError
from mapspeak.evaluation.report.sheet import Album, Html, Sheet, draw_sheet, element, text
from mapspeak.evaluation.trials import (
    MAP,
    STATES,
    TURNS,
    Trial,
    Turn,
    read_turns,
    say_fault,
    trial_folder,
)
from mapspeak.geometry import Pose
from mapspeak.simulator import StateRecord, read_state_log
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.mapfiles import load_map

_Value = TypeVar("_Value")

MOST_POINTS = 500
APART_M = 0.3
"""Stops nearer than this to the last one get no mark of their own."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Course:
    """How a trial went, as far as it can be read.

    Attributes:
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


@dataclass(frozen=True, slots=True, kw_only=True)
class StepMark:
    """Where the robot stood at a step of the replay, on the picture of its map.

    Attributes:
        heading_deg: Clockwise from the picture's right.
        driven_ratio: The share of the whole line that lies behind it.
    """

    anchor: str
    u: float
    v: float
    heading_deg: float
    driven_ratio: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DrivenPath:
    """A way on a map.

    Attributes:
        line: As SVG writes it; empty for a robot that never moved.
    """

    sheet: Sheet
    line: str
    stops: dict[str, StepMark]


def lay_out_way(
    course: Course, poses: Sequence[tuple[str, Pose | None, float | None]]
) -> DrivenPath | None:
    """Lay a trial's way out on its map; None where there is no map.

    Args:
        poses: Of each step: its id, where the robot truly stood, and the robot time.
    """
    sheet = None if course.grid is None else draw_sheet(course.grid)
    if sheet is None:
        return None
    line, times_s, ratios = _lay_line(sheet, course.states)
    stops = {}
    for anchor, pose, robot_s in poses:
        if pose is None:
            continue
        driven_ratio = np.interp(robot_s, times_s, ratios) if line and robot_s is not None else 0.0
        u, v = sheet.pixels_at(np.array([[pose.x, pose.y]]))[0].tolist()
        stops[anchor] = StepMark(
            anchor=anchor,
            u=round(u, 1),
            v=round(v, 1),
            heading_deg=round(sheet.heading_deg(pose), 1),
            driven_ratio=round(float(driven_ratio), 4),
        )
    return DrivenPath(sheet=sheet, line=line, stops=stops)


def _lay_line(sheet: Sheet, states: Sequence[StateRecord]) -> tuple[str, FloatArray, FloatArray]:
    """Return the line of a way, robot times along it, and the share of the line up to each.

    The moments at which the robot only turned are left out.
    """
    moved = [now for before, now in pairwise(states) if now.driven_m > before.driven_m]
    if not moved:
        return "", np.zeros(0), np.zeros(0)
    every = -(-len(moved) // MOST_POINTS)
    chosen = [states[0], *moved[::every], moved[-1]]
    pixels = sheet.pixels_at(np.array([[state.x, state.y] for state in chosen]))
    lengths = np.cumsum([0.0, *np.linalg.norm(np.diff(pixels, axis=0), axis=1)])
    line = " ".join(f"{u:.1f},{v:.1f}" for u, v in pixels.tolist())
    times_s = np.array([state.time_s for state in chosen])
    return line, times_s, lengths / max(float(lengths[-1]), 1e-9)


def draw_way(way: DrivenPath, album: Album) -> Html:
    """Return the map with the way on it; each mark leads to its step."""
    sheet, stops = way.sheet, list(way.stops.values())
    name = album.keep(sheet.png, "image/png", sheet.width_px, sheet.height_px)
    size_px = 0.012 * (sheet.width_px + sheet.height_px)
    drawn = [element("use", {"href": f"#{name}"})]
    if way.line:
        drawn.append(element("polyline", {"class": "way", "points": way.line}))
        drawn.append(element("polyline", {"class": "so-far", "points": way.line, "pathLength": 1}))
    drawn += _marks(stops, APART_M * sheet.px_per_m, size_px * 0.55)
    if stops:
        drawn.append(_robot(stops[-1], size_px))
    box = f"0 0 {sheet.width_px} {sheet.height_px}"
    label = "The map in the end and the way the robot drove"
    return element("svg", {"class": "sheet", "viewBox": box, "aria-label": label}, *drawn)


def _marks(stops: Sequence[StepMark], least_px: float, radius_px: float) -> Iterator[Html]:
    last: StepMark | None = None
    for stop in stops:
        if last is not None and (stop.u - last.u) ** 2 + (stop.v - last.v) ** 2 < least_px**2:
            continue
        last = stop
        dot = {"class": "stop", "cx": stop.u, "cy": stop.v, "r": f"{radius_px:.1f}"}
        title = element("title", {}, text(f"To step {stop.anchor.rpartition('-')[2]}"))
        yield element("a", {"href": f"#{stop.anchor}"}, element("circle", dot, title))


def _robot(stop: StepMark, size_px: float) -> Html:
    place = f"translate({stop.u} {stop.v}) rotate({stop.heading_deg})"
    corners = ((1.5, 0), (-1.0, 0.9), (-0.5, 0), (-1.0, -0.9))
    arrow = " ".join(f"{x * size_px:.1f},{y * size_px:.1f}" for x, y in corners)
    shape = element("polygon", {"points": arrow})
    return element("g", {"class": "robot", "transform": place}, shape)
