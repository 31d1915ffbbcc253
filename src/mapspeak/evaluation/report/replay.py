"""The page of a trial: its map and way, and every step with what was said and seen."""

import base64
import io
import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
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
    TrialResult,
    Turn,
    read_turns,
    say_fault,
    trial_folder,
    write_whole,
)
from mapspeak.geometry import Pose
from mapspeak.simulator import StateRecord, read_state_log
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.mapfiles import load_map

PAGE, REPLAY = "report.html", "replay.html"
UNKNOWN, FREE, OCCUPIED = (244, 255, 60)
MARGIN_CELLS = 4
LONGEST_PX = 1200
MOST_POINTS = 500

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
    sheet = None if grid is None or grid.unknown.all() else MapSheet.of(grid)
    steps = _group(turns)
    places = [{} if sheet is None else sheet.place_of(each[-1]) for each in steps]
    last = next((place for place in reversed(places) if place), {})
    floor = paragraph("none", "There is no map of it.")
    if sheet is not None:
        floor = sheet.draw(states, last)
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
    write_whole(folder / REPLAY, page)


# --- the map and the way -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MapSheet:
    """The part of a map that is known, to be drawn with y up.

    Attributes:
        cells_per_px: Cells along the side of a pixel.
    """

    grid: OccupancyGrid
    cells_per_px: int

    @classmethod
    def of(cls, grid: OccupancyGrid) -> "MapSheet":
        """Return the sheet of a map that knows something."""
        part = grid.crop(*grid.window(*np.nonzero(~grid.unknown), margin=MARGIN_CELLS))
        return cls(grid=part, cells_per_px=math.ceil(max(part.cells.shape) / LONGEST_PX))

    def pixels_at(self, poses: Sequence[Pose]) -> FloatArray:
        """Return (u, v) of shape (n, 2), as real numbers."""
        points = np.array([(pose.x, pose.y) for pose in poses]).reshape(-1, 2)
        rows, cols = (self.grid.fractional_cells_at(points) / self.cells_per_px).T
        return np.stack([cols, -(-self.grid.n_rows // self.cells_per_px) - rows], axis=1)

    def place_of(self, turn: Turn) -> dict[str, float]:
        """Return where the robot stood: attributes that the page's script reads."""
        if turn.pose is None:
            return {}
        u, v = self.pixels_at([turn.pose])[0].tolist()
        # SVG turns clockwise, from the picture's right.
        heading_deg = -math.degrees(turn.pose.yaw_rad - self.grid.origin.yaw_rad)
        return {"data-u": round(u, 1), "data-v": round(v, 1), "data-heading": round(heading_deg, 1)}

    def draw(self, states: Sequence[StateRecord], last: dict[str, float]) -> Html:
        """Return the map with the way the robot truly drove, and the robot at its last place."""
        grid, step = self.grid, self.cells_per_px
        tones = np.select([grid.free, grid.occupied], [FREE, OCCUPIED], UNKNOWN).astype(np.uint8)
        picture = Image.fromarray(np.ascontiguousarray(np.flipud(tones[::step, ::step])))
        file = io.BytesIO()
        picture.save(file, "PNG", optimize=True)
        inside = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
        size = {"width": picture.width, "height": picture.height}
        drawn = [element("image", {**size, "href": inside})]
        every = -(-len(states) // MOST_POINTS) or 1
        way = self.pixels_at([state.pose for state in (*states[::every], *states[-1:])])
        line = " ".join(f"{u:.1f},{v:.1f}" for u, v in way.tolist())
        drawn.append(element("polyline", {"class": "way", "points": line}))
        if last:
            drawn.append(_draw_robot(last, 0.012 * (picture.width + picture.height)))
        label = "The map in the end and the way the robot drove"
        box = {"viewBox": f"0 0 {picture.width} {picture.height}", "aria-label": label}
        return element("svg", {"class": "sheet", **box}, *drawn)


def _draw_robot(place: dict[str, float], size_px: float) -> Html:
    corners = ((1.5, 0), (-1.0, 0.9), (-0.5, 0), (-1.0, -0.9))
    arrow = " ".join(f"{x * size_px:.1f},{y * size_px:.1f}" for x, y in corners)
    here = f"translate({place['data-u']} {place['data-v']}) rotate({place['data-heading']})"
    return element(
        "g", {"class": "robot", "transform": here}, element("polygon", {"points": arrow})
    )


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
    yield paragraph(
        "spent",
        f"{result.state.replace('_', ' ')}, {result.driven_m:.1f} m driven, "
        f"{result.n_calls} calls ({result.n_errors} with errors), {result.robot_s:.0f} s robot "
        f"time, {result.wall_s:.1f} s wall time, seed {result.trial.seed}",
    )
    quotes = {"Asked": result.prompt, "Answered": result.answer, "Broken by": result.error}
    for who, said in quotes.items():
        if said:
            yield element("div", {"class": "quote"}, element("b", {}, text(who)), _words(said))


def _group(turns: Sequence[Turn]) -> list[list[Turn]]:
    """Return what is shown at once: something said, or a call with its answer."""
    groups: list[list[Turn]] = []
    for turn in turns:
        if turn.role == "tool" and groups and groups[-1][-1].role == "agent":
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
    robot = "" if turn.robot_s is None else f", robot {turn.robot_s:.1f} s"
    yield element("small", {}, text(f"{turn.wall_s:.1f} s{robot}"))


def _words(said: str) -> Html:
    return element("pre", {"tabindex": "0"} if said.count("\n") > 20 else {}, text(said))
