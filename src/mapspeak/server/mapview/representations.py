"""The ways look_at_map can show a map, so that the same trial measures what each is worth.

Only the first is meant for work; the others leave out on purpose what it gives, as other servers
do. Each is a function from what is to be seen to a text and perhaps a picture.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

from mapspeak.server.mapview.captions import say_axes
from mapspeak.server.mapview.drawing import draw_atlas
from mapspeak.server.mapview.rawgrid import describe_raw_grid
from mapspeak.server.mapview.tables import describe_atlas
from mapspeak.server.mapview.views import MapView
from mapspeak.server.wording import say_pose, say_warnings
from mapspeak.spatial.picture import NORTH_UP_RAD, draw_robot_pose


class Representation(StrEnum):
    """How look_at_map shows the map."""

    PICTURE_TABLE = "picture-table"
    """The annotated picture and the same facts as tables; the default."""
    TABLE = "table"
    """The tables, and no picture."""
    PICTURE_ROOMS = "picture-rooms"
    """The annotated picture with rooms and ids, and no tables."""
    PICTURE_NUMBERS = "picture-numbers"
    """The map's picture with numbered axes and the robot, without rooms and ids."""
    PAPER_PICTURE = "paper-picture"
    """The paper's picture of the whole map with the robot as an arrow."""
    RAW_GRID = "raw-grid"
    """The occupancy grid as JSON."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """A map as it is shown.

    Attributes:
        text: What is said.
        png: The picture; None where there is none.
    """

    text: str
    png: bytes | None = None


def show(view: MapView, representation: Representation) -> Shown:
    """Shows what is to be seen of a map, in one of the ways."""
    return _WAYS[representation](view)


def _show_picture_and_tables(view: MapView) -> Shown:
    text, picture = describe_atlas(view), draw_atlas(view)
    return Shown(text=f"{text}\n\n{picture.caption}", png=picture.png)


def _show_tables(view: MapView) -> Shown:
    return Shown(text=f"{describe_atlas(view)}\n\nThere is no picture.")


def _show_rooms(view: MapView) -> Shown:
    picture = draw_atlas(view)
    return Shown(text=f"{_say_robot(view)}\n\n{picture.caption}", png=picture.png)


def _show_numbers(view: MapView) -> Shown:
    return _show_rooms(replace(view, look=replace(view.look, layers=frozenset())))


def _show_paper(view: MapView) -> Shown:
    grid, robot = view.atlas.grid, view.atlas.robot
    picture = draw_robot_pose(grid, robot)
    is_plain = view.look.zoom is None and view.look.up_rad == NORTH_UP_RAD
    ignored = "" if is_plain else " It always shows the whole map with y up."
    text = f"{_say_robot(view)}\n\n{say_axes(grid, picture)}{ignored}"
    return Shown(text=text, png=picture.png)


def _show_raw_grid(view: MapView) -> Shown:
    return Shown(text=describe_raw_grid(view))


def _say_robot(view: MapView) -> str:
    """Gives what a picture alone cannot be relied upon to say: where the robot is."""
    return "\n".join([*say_warnings(view.atlas), f"Robot: {say_pose(view.atlas.robot)}."])


_WAYS: dict[Representation, Callable[[MapView], Shown]] = {
    Representation.PICTURE_TABLE: _show_picture_and_tables,
    Representation.TABLE: _show_tables,
    Representation.PICTURE_ROOMS: _show_rooms,
    Representation.PICTURE_NUMBERS: _show_numbers,
    Representation.PAPER_PICTURE: _show_paper,
    Representation.RAW_GRID: _show_raw_grid,
}
