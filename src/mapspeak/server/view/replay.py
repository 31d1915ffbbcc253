"""A replay as one document, made of a call log or an audit log, and the map that is kept for it."""

import json
import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from datetime import datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

from pydantic import ValidationError

from mapspeak.errors import ConfigError, say_cause
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMap
from mapspeak.safety import AuditLine, read_audit
from mapspeak.server.view.document import (
    CallView,
    GridView,
    PoseView,
    Spot,
    ViewPart,
    draw_tile,
    embed_tile,
)
from mapspeak.server.view.overlay import Overlay
from mapspeak.server.wire.calllog import CallNote, CallNoting
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Recollector

RADIUS_M = 0.2
"""Radius of an unknown robot; rooms do not depend on it."""
MAPS, MOMENTS = "maps", "moments.jsonl"
LOGGED_TILE_CELLS = 64
"""Smaller tiles than a live page's: fewer cells are kept again with each change."""

logger = logging.getLogger(__name__)


class PartChange(ViewPart):
    """A change of one part of the overlay, such as its frontiers.

    Attributes:
        names: Of all that is there now, in order.
        items: Those that are new or otherwise.
    """

    names: Sequence[str]
    items: Sequence[Mapping[str, Any]]


class Moment(ViewPart):
    """A change of the map.

    Attributes:
        n_calls: Calls that had ended, the one that brought the change included.
        map: The grid; None where it is as before.
        overlay: The parts of the overlay that changed.
    """

    n_calls: int
    map: GridView | None = None
    overlay: Mapping[str, PartChange] = {}


class MapLog:
    """Writes the map of one robot into a folder, after each call.

    It shows what the tools have found by then, and computes nothing of its own.

    Args:
        folder: It is made when there is something to write.
        log: Gets every call, too.
    """

    def __init__(self, session: Session, folder: Path, log: CallNoting | None = None) -> None:
        self._session = session
        self._folder = folder
        self._log = log
        self._n_calls = 0
        self._grid: OccupancyGrid | None = None
        self._overlay = Overlay()
        self._kept: set[str] = set()
        (folder / MOMENTS).unlink(missing_ok=True)

    @contextmanager
    def noting(self, tool: str, arguments: dict[str, Any]) -> Iterator[CallNote]:
        """Note the map when a call has come to its end."""
        with self._log.noting(tool, arguments) if self._log else nullcontext(CallNote()) as note:
            try:
                yield note
            finally:
                self._n_calls += 1
                try:
                    self._note()
                except OSError as error:
                    logger.warning("The map could not be noted: %s", error.strerror)

    def _note(self) -> None:
        world = self._session.world
        if world is None:
            return
        grid, overlay = world.grid, Overlay.of(world)
        is_new = grid is not self._grid
        before, now = self._overlay.model_dump(), overlay.model_dump()
        parts = {
            name: _compare(before[name], part)
            for name, part in now.items()
            # The first moment names every part: of several robots it follows another's last one.
            if self._grid is None or part != before[name]
        }
        if not is_new and not parts:
            return
        self._folder.mkdir(parents=True, exist_ok=True)
        view = GridView.of(grid, tile_cells=LOGGED_TILE_CELLS) if is_new else None
        if view is not None:
            self._keep_tiles(grid, view)
        moment = Moment(n_calls=self._n_calls, map=view, overlay=parts)
        with (self._folder / MOMENTS).open("a", encoding="utf-8") as file:
            file.write(moment.model_dump_json(exclude_none=True) + "\n")
        self._grid, self._overlay = grid, overlay

    def _keep_tiles(self, grid: OccupancyGrid, view: GridView) -> None:
        for row, names in enumerate(view.tiles):
            for col, name in enumerate(names):
                if name and name not in self._kept:
                    tile = draw_tile(grid, row, col, tile_cells=LOGGED_TILE_CELLS)
                    (self._folder / f"{name}.png").write_bytes(tile)
                    self._kept.add(name)


def _compare(before: Sequence[Mapping[str, Any]], now: Sequence[Mapping[str, Any]]) -> PartChange:
    known = {_name(item): item for item in before}
    return PartChange(
        names=[_name(item) for item in now],
        items=[item for item in now if known.get(_name(item)) != item],
    )


def _name(item: Mapping[str, Any]) -> str:
    # Areas of the policy have no id.
    return str(item.get("id") or item["title"])


def read_moments(folder: Path) -> tuple[Sequence[Moment], Mapping[str, str]]:
    """Return the kept moments, and their tiles as data URLs; nothing where there is no such log.

    Raises:
        ConfigError: It cannot be read, or is none.
    """
    path = folder / MOMENTS
    if not path.exists():
        return (), {}
    try:
        # A last line without an end was cut off by a crash.
        lines = path.read_text("utf-8").split("\n")[:-1]
        moments = [Moment.model_validate(json.loads(line)) for line in lines]
        grids = [each.map for each in moments if each.map is not None]
        names = {name for grid in grids for row in grid.tiles for name in row} - {""}
        # A name leads out of the folder in no file of ours.
        pictures = {
            name: embed_tile((folder / f"{int(name, 16):016x}.png").read_bytes()) for name in names
        }
    except (OSError, ValueError, ValidationError) as error:
        raise ConfigError(
            f"{path} is no log of maps.", hint="Delete its folder to replay without it."
        ) from error
    return moments, pictures


class StepView(ViewPart):
    """One thing that was said, and how the robot then stood.

    Attributes:
        at_s: Since the first.
        pose: Where the robot stood; None where it is not known.
        goal: Where it was sent.
        robot: Whose step it is, where there are several.
        trail: From which to which point of the trail the robot had come.
        n_moments: Moments of the map until then.
    """

    call: CallView
    at_s: float
    pose: PoseView | None = None
    goal: PoseView | None = None
    robot: str = ""
    trail: tuple[int, int] = (0, 0)
    n_moments: int = 0


class Replay(ViewPart):
    """Everything that a replay shows.

    Attributes:
        about: What it is, as names and values.
        back: Address of the page that lists others; empty where there is none.
        map: The map of all steps, and what lies on it; where there are moments, their pictures.
        moments: The map as it was, each time with what has changed.
    """

    about: Sequence[tuple[str, str]] = ()
    back: str = ""
    map: GridView | None = None
    overlay: Overlay = Overlay()
    moments: Sequence[Moment] = ()
    trail: Sequence[Spot] = ()
    steps: Sequence[StepView] = ()


def show_map(grid: OccupancyGrid, memory: SemanticMap | None = None) -> tuple[GridView, Overlay]:
    """Return a finished map as it is drawn, with its rooms and its memory."""
    start = grid.bounds()[0]
    world = WorldModel(
        grid,
        Pose(start.x, start.y),
        memory or SemanticMap(),
        radius_m=RADIUS_M,
        recollector=Recollector(lambda: None),
    )
    _ = world.rooms
    if memory is not None:
        _ = world.recollection
    return GridView.whole(grid), Overlay.of(world)


def replay_log(path: Path, grid: OccupancyGrid | None = None) -> Replay:
    """Return the replay of a call log or an audit log, whichever the file is.

    Raises:
        ConfigError: It cannot be read, or is neither.
    """
    first = next(iter(_read_lines(path)), None)
    if first is None:
        raise ConfigError(f"{path} is empty.", hint="Give a log in which something was noted.")
    is_audit = "event" in first
    about = [("log", path.name), ("kind", "audit log" if is_audit else "call log")]
    if is_audit:
        told = _join_robots(list(_steps_of_audit(read_audit(path))), None)
    else:
        told = _join_robots(list(_steps_of_calls(path)), path.with_suffix("") / MAPS)
    if grid is None:
        return told.model_copy(update={"about": about})
    shown, overlay = show_map(grid)
    finished = {"about": about, "map": shown, "overlay": overlay, "moments": ()}
    return told.model_copy(update=finished)


def _join_robots(steps: Sequence[StepView], maps: Path | None) -> Replay:
    """Return the replay of all robots; trail and moments of each follow those of the one before."""
    trail: list[Spot] = []
    moments: list[Moment] = []
    pictures: dict[str, str] = {}
    told: dict[int, StepView] = {}
    # Names in a log are untrusted: only a folder that is there is read.
    folders = {each.name: each for each in maps.glob("*/")} | {"": maps} if maps else {}
    for robot in dict.fromkeys(step.robot for step in steps):
        own = [step for step in steps if step.robot == robot]
        kept, drawn = read_moments(folders[robot]) if robot in folders else ((), {})
        n_before = len(trail)
        for n_calls, step in enumerate(own, start=1):
            if step.pose is not None:
                trail.append((step.pose.x, step.pose.y))
            come = step.model_copy(update={"trail": (n_before, len(trail))})
            told[step.call.number] = show_moments(
                come, kept, n_calls=n_calls, n_before=len(moments)
            )
        moments += kept
        pictures |= drawn
    return Replay(
        map=join_pictures(moments, pictures),
        moments=moments,
        trail=trail,
        steps=[told[step.call.number] for step in steps],
    )


def join_pictures(moments: Sequence[Moment], pictures: Mapping[str, str]) -> GridView | None:
    """Return the latest map of some moments with the pictures of all."""
    latest = next((each.map for each in reversed(moments) if each.map is not None), None)
    return None if latest is None else latest.model_copy(update={"pictures": pictures})


def show_moments(
    step: StepView, moments: Sequence[Moment], *, n_calls: int, n_before: int = 0
) -> StepView:
    """Return a step with the map as it was when that many calls had ended.

    Args:
        n_before: Moments of other robots, which come before these.
    """
    n_moments = sum(each.n_calls <= n_calls for each in moments)
    return step.model_copy(update={"n_moments": n_moments and n_before + n_moments})


def _read_lines(path: Path) -> Iterator[Mapping[str, Any]]:
    """Read JSON lines; a last one that was cut off by a crash is left out."""
    try:
        lines = path.read_text("utf-8", errors="replace").split("\n")
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be read: {say_cause(error)}.", hint="Give the file of a log."
        ) from error
    whole = [line for line in lines[:-1] if line] or [line for line in lines if line]
    for number, line in enumerate(whole, start=1):
        try:
            read = json.loads(line)
        except ValueError:
            read = None
        if not isinstance(read, dict):
            raise ConfigError(
                f"{path}, line {number} is no line of a log.",
                hint="Give the file that was named with --call-log or --audit.",
            )
        yield read


def _steps_of_calls(path: Path) -> Iterator[StepView]:
    at_s = 0.0
    for number, line in enumerate(_read_lines(path), start=1):
        at_s += _number(line.get("wall_s")) or 0.0
        pose = _find_pose(line.get("report"))
        pictures = [str(name) for name in line.get("pictures") or ()]
        call = CallView(
            number=number,
            tool=str(line.get("tool", "")),
            arguments=line.get("arguments") or {},
            is_error=bool(line.get("is_error")),
            text=str(line.get("text", "")),
            pictures=tuple(locate_pictures(pictures, path.with_suffix(""))),
            note=(robot := str(line.get("robot", ""))),
        )
        yield StepView(call=call, at_s=round(at_s, 2), pose=pose, robot=robot)


def locate_pictures(names: Iterable[str], folder: Path) -> Iterator[str]:
    """Return addresses of pictures in a folder beside the page.

    Names are untrusted: one that leads out of the folder, or does not exist, is left out.
    """
    for name in names:
        path = folder / name
        if path.name == name and path.resolve().parent == folder.resolve() and path.is_file():
            yield f"{quote(folder.name)}/{quote(name)}"


def _find_pose(report: object) -> PoseView | None:
    """Return where a report says that the robot was."""
    if not isinstance(report, dict):
        return None
    told = report.get("robot") or report.get("pose")
    if not isinstance(told, dict):
        return None
    numbers = [_number(told.get(name)) for name in ("x", "y", "yaw_deg")]
    if None in numbers:
        return None
    x, y, yaw_deg = (number or 0.0 for number in numbers)
    return PoseView(x=x, y=y, yaw_deg=yaw_deg)


def _number(value: object) -> float | None:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else None  # type: ignore[arg-type]  # checked just before


def _steps_of_audit(lines: Iterable[AuditLine]) -> Iterator[StepView]:
    begun: datetime | None = None
    for number, line in enumerate(lines, start=1):
        at = datetime.fromisoformat(line.wall_time)
        begun = begun or at
        goal = [_number(line.details.get(name)) for name in ("x", "y", "yaw_rad")]
        x, y, yaw_rad = (value or 0.0 for value in goal)
        said = [line.what if line.event == "decision" else "", line.verdict or line.event]
        call = CallView(
            number=number,
            tool=line.tool or "mapspeak",
            is_error=line.verdict == "refused",
            text="\n".join(filter(None, [" -> ".join(filter(None, said)), line.said])),
            note=f"{line.wall_time[:19]} {line.client} {line.robot}".strip(),
        )
        yield StepView(
            call=call,
            at_s=round((at - begun).total_seconds(), 2),
            robot=line.robot,
            goal=None if None in goal else PoseView.of(Pose(x, y, yaw_rad)),
        )
