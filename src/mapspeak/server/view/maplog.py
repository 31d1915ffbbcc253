"""The map as the tools knew it after each call, kept for a replay: each time only what changed."""

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mapspeak.errors import ConfigError
from mapspeak.server.view.document import GridView, ViewPart, draw_tile, embed_tile
from mapspeak.server.view.overlay import Overlay
from mapspeak.server.wire.calllog import CallNote, CallNoting
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid

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
            name: _compare(before[name], part) for name, part in now.items() if part != before[name]
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
