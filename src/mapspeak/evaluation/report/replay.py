"""The page of a trial: its map and way, and every step with what was said and seen."""

import base64
import io
import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TypeVar
from urllib.parse import quote

import numpy as np
from PIL import Image

from mapspeak.errors import MapError
from mapspeak.evaluation.report.html import Html, document, element, paragraph, text
from mapspeak.evaluation.trials import (
    MAP,
    PICTURES,
    STATES,
    TURNS,
    TokenCounts,
    TrialResult,
    Turn,
    read_turns,
    say_fault,
    trial_folder,
    write_whole,
)
from mapspeak.simulator import StateRecord, read_state_log
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.mapfiles import load_map

PAGE, REPLAY = "report.html", "replay.html"
UNKNOWN, FREE, OCCUPIED = (244, 255, 60)
MARGIN_CELLS = 4
LONGEST_PX = 1200
MOST_POINTS = 500
APART_M = 0.3
"""Steps nearer than this to the last mark get no mark of their own."""

_Value = TypeVar("_Value")


def write_replay(run: Path, result: TrialResult) -> None:
    """Write the page of a trial into its folder; what cannot be read is left out and told."""
    trial, folder = result.trial, trial_folder(run, result.trial)
    problems: list[Html] = []

    def attempt(name: str, read: Callable[[Path], _Value], default: _Value) -> _Value:
        path = folder / name
        try:
            return read(path) if path.exists() else default
        except (OSError, ValueError, TypeError, MapError) as error:
            problems.append(paragraph("problem", f"{name} cannot be read: {say_fault(error)}."))
            return default

    turns: tuple[Turn, ...] = attempt(TURNS, lambda _: read_turns(run, trial), ())
    states: tuple[StateRecord, ...] = attempt(STATES, read_state_log, ())
    grid = attempt(MAP, lambda path: load_map(path).grid, None)
    drawn = None if grid is None or grid.unknown.all() else DrivenPath.on(grid, states)
    steps = _group(turns)
    places = [{} if drawn is None else drawn.place_of(each[-1]) for each in steps]
    floor = paragraph("none", "There is no map of it.") if drawn is None else drawn.draw(places)
    shown = [
        _show_step(number, each, place, folder / PICTURES)
        for number, (each, place) in enumerate(zip(steps, places, strict=True), start=1)
    ]
    said = element("ol", {"class": "steps"}, *shown)
    if not shown:
        said = paragraph("none", "There is no conversation of it.")
    up = "../" * (trial.id.count("/") + 2)
    page = document(
        f"mapspeak: {trial.id}",
        element("p", {}, element("a", {"href": f"{up}{PAGE}"}, text("All trials"))),
        element("h1", {}, text(f"{trial.task} {trial.world} {trial.number:03d} ")),
        element("p", {}, show_standing(result), text(f" {trial.answerer}, {trial.representation}")),
        *problems,
        *_head(result),
        element("div", {"class": "replay"}, element("div", {"class": "floor"}, floor), said),
    )
    write_whole(folder / REPLAY, [page])


# --- the map and the way -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DrivenPath:
    """A map as a picture with y up, and the way the robot truly drove on it.

    Attributes:
        grid: The part that is known.
        cells_per_px: Cells along the side of a pixel.
        line: The way, in pixels, shape (n, 2); empty for a robot that never moved.
        times_s: Robot time at each point of the line.
        ratios: The share of the line that lies behind each of its points.
    """

    grid: OccupancyGrid
    cells_per_px: int
    line: FloatArray
    times_s: FloatArray
    ratios: FloatArray

    @classmethod
    def on(cls, grid: OccupancyGrid, states: Sequence[StateRecord]) -> "DrivenPath":
        """Lay a way out on a map that knows something; moments of turning are left out."""
        known = grid.crop(*grid.window(*np.nonzero(~grid.unknown), margin=MARGIN_CELLS))
        moved = [now for before, now in pairwise(states) if now.driven_m > before.driven_m]
        every = -(-len(moved) // MOST_POINTS) or 1
        chosen = [states[0], *moved[::every], moved[-1]] if moved else []
        step = math.ceil(max(known.n_rows, known.n_cols) / LONGEST_PX)
        points = np.array([(state.x, state.y) for state in chosen]).reshape(-1, 2)
        line = _pixels_at(known, step, points)
        lengths = np.cumsum(np.linalg.norm(np.diff(line, axis=0, prepend=line[:1]), axis=1))
        return cls(
            grid=known,
            cells_per_px=step,
            line=line,
            times_s=np.array([state.time_s for state in chosen]),
            ratios=lengths / max(float(lengths[-1]), 1e-9) if chosen else lengths,
        )

    def place_of(self, turn: Turn) -> dict[str, float]:
        """Return where the robot stood: attributes that the page's script reads."""
        if turn.pose is None:
            return {}
        points = np.array([[turn.pose.x, turn.pose.y]])
        u, v = _pixels_at(self.grid, self.cells_per_px, points)[0].tolist()
        # SVG turns clockwise, from the picture's right.
        heading_deg = -math.degrees(turn.pose.yaw_rad - self.grid.origin.yaw_rad)
        is_timed = self.line.size > 0 and turn.robot_s is not None
        driven = np.interp(turn.robot_s or 0.0, self.times_s, self.ratios) if is_timed else 0.0
        return {
            "data-u": round(u, 1),
            "data-v": round(v, 1),
            "data-heading": round(heading_deg, 1),
            "data-driven": round(float(driven), 4),
        }

    def draw(self, places: Sequence[dict[str, float]]) -> Html:
        """Return the map with the way on it; each mark leads to its step."""
        png, width_px, height_px = self._picture()
        inside = f"data:image/png;base64,{base64.b64encode(png).decode()}"
        size = {"width": width_px, "height": height_px}
        drawn = [element("image", {**size, "href": inside})]
        if self.line.size:
            line = " ".join(f"{u:.1f},{v:.1f}" for u, v in self.line.tolist())
            drawn.append(element("polyline", {"class": "way", "points": line}))
            drawn.append(element("polyline", {"class": "so-far", "points": line, "pathLength": 1}))
        size_px = 0.012 * (width_px + height_px)
        drawn += self._marks(places, size_px * 0.55)
        if stood := [place for place in places if place]:
            drawn.append(_draw_robot(stood[-1], size_px))
        label = "The map in the end and the way the robot drove"
        box = {"viewBox": f"0 0 {width_px} {height_px}", "aria-label": label}
        return element("svg", {"class": "sheet", **box}, *drawn)

    def _picture(self) -> tuple[bytes, int, int]:
        """Return the map as PNG, with its width and height in pixels."""
        grid, step = self.grid, self.cells_per_px
        tones = np.select([grid.free, grid.occupied], [FREE, OCCUPIED], UNKNOWN).astype(np.uint8)
        picture = Image.fromarray(np.ascontiguousarray(np.flipud(tones[::step, ::step])))
        file = io.BytesIO()
        picture.save(file, "PNG", optimize=True)
        return file.getvalue(), picture.width, picture.height

    def _marks(self, places: Sequence[dict[str, float]], radius_px: float) -> Iterator[Html]:
        apart_px = APART_M / (self.grid.resolution_m * self.cells_per_px)
        last = (math.inf, math.inf)
        for number, place in enumerate(places, start=1):
            if not place:
                continue
            here = place["data-u"], place["data-v"]
            if math.dist(here, last) < apart_px:
                continue
            last = here
            dot = {"class": "stop", "cx": here[0], "cy": here[1], "r": f"{radius_px:.1f}"}
            title = element("title", {}, text(f"To step {number}"))
            yield element("a", {"href": f"#step-{number}"}, element("circle", dot, title))


def _draw_robot(place: dict[str, float], size_px: float) -> Html:
    corners = ((1.5, 0), (-1.0, 0.9), (-0.5, 0), (-1.0, -0.9))
    arrow = " ".join(f"{x * size_px:.1f},{y * size_px:.1f}" for x, y in corners)
    here = f"translate({place['data-u']} {place['data-v']}) rotate({place['data-heading']})"
    return element(
        "g", {"class": "robot", "transform": here}, element("polygon", {"points": arrow})
    )


def _pixels_at(grid: OccupancyGrid, cells_per_px: int, points: FloatArray) -> FloatArray:
    """Return (u, v) of shape (n, 2), as real numbers, for points in metres of shape (n, 2)."""
    rows, cols = (grid.fractional_cells_at(points) / cells_per_px).T
    return np.stack([cols, -(-grid.n_rows // cells_per_px) - rows], axis=1)


# --- what was said -------------------------------------------------------------------------------


def show_standing(result: TrialResult) -> Html:
    """Say in a coloured word how a trial ended."""
    kind, said = ("good", "done") if result.score.is_success else ("bad", "not done")
    if result.state.is_broken:
        kind, said = "broken", result.state.value
    return element("span", {"class": f"word {kind}"}, text(said))


def _head(result: TrialResult) -> Iterator[Html]:
    failure = result.score.failure
    kind = "" if failure is None else f"{failure.replace('_', ' ')}: "
    yield paragraph("reason", f"{kind}{result.score.reason}")
    spent = [] if result.state.is_broken else _say_spent(result)
    facts = (result.state.replace("_", " "), *spent, f"seed {result.trial.seed}")
    yield paragraph("spent", ", ".join(facts))
    quotes = {"Asked": result.prompt, "Answered": result.answer, "Broken by": result.error}
    for who, said in quotes.items():
        if said:
            yield element("div", {"class": "quote"}, element("b", {}, text(who)), _words(said))


def _say_spent(result: TrialResult) -> list[str]:
    return [
        f"{result.driven_m:.1f} m driven",
        *([] if result.shortest_m is None else [f"{result.shortest_m:.1f} m at the shortest"]),
        f"{result.n_calls} calls ({result.n_errors} with errors)",
        f"{result.n_decisions} decisions",
        *_tokens(result),
        f"{result.robot_s:.0f} s robot time",
        f"{result.wall_s:.1f} s wall time",
        f"{result.n_collisions} collisions",
    ]


def _tokens(spent: TokenCounts) -> list[str]:
    named = (
        (spent.n_input_tokens, "tokens read"),
        (spent.n_output_tokens, "tokens written"),
        (spent.n_picture_tokens, "of them pictures"),
    )
    return [f"{value:,} {name}" for value, name in named if value is not None]


def _group(turns: Sequence[Turn]) -> list[list[Turn]]:
    """Return what is shown at once: something said, or a call with its answer."""
    groups: list[list[Turn]] = []
    for turn in turns:
        before = groups[-1][-1] if groups else None
        if (
            turn.role == "tool"
            and turn.call is not None
            and before is not None
            and before.role != "tool"
            and before.call is not None
            and before.call.tool == turn.call.tool
        ):
            groups[-1].append(turn)
        else:
            groups.append([turn])
    return groups


def _show_step(number: int, turns: Sequence[Turn], place: dict[str, float], pictures: Path) -> Html:
    anchor = f"step-{number}"
    link = element("a", {"class": "number", "href": f"#{anchor}"}, text(number))
    shown = (_show_turn(turn, pictures) for turn in turns)
    return element("li", {"id": anchor, **place}, link, *shown)


def _show_turn(turn: Turn, pictures: Path) -> Html:
    parts = [element("p", {"class": "who"}, *_say_who(turn))]
    if turn.text:
        parts.append(_words(turn.text))
    for name in turn.pictures:
        path = pictures / name
        # A name may come from anywhere: it must not lead out of the trial's folder.
        if path.name == name and path.resolve().parent == pictures.resolve() and path.is_file():
            seen = {"class": "seen", "src": f"{PICTURES}/{quote(name)}", "loading": "lazy"}
            parts.append(element("img", {**seen, "alt": f"The picture {name} that the agent saw"}))
        else:
            parts.append(paragraph("none", f"The picture {name} is missing."))
    return element("div", {"class": "turn error" if turn.is_error else "turn"}, *parts)


def _say_who(turn: Turn) -> Iterator[Html]:
    yield element("b", {}, text(turn.role))
    if turn.call is not None:
        yield text(" answers " if turn.role == "tool" else " calls ")
        yield element("code", {}, text(turn.call.tool))
        if turn.call.arguments:
            written = json.dumps(turn.call.arguments, ensure_ascii=False)
            yield element("code", {"class": "arguments"}, text(written))
    if turn.is_error:
        yield element("span", {"class": "word bad"}, text("error"))
    robot = [] if turn.robot_s is None else [f"robot {turn.robot_s:.1f} s"]
    when = (f"{turn.wall_s:.1f} s", *robot, *_tokens(turn))
    yield element("small", {}, text(", ".join(when)))


def _words(said: str) -> Html:
    return element("pre", {"tabindex": "0"} if said.count("\n") > 20 else {}, text(said))
