"""The content of a page as JSON documents: the grid, the robot, the calls; `overlay` has the rest.

A live page hears each as it changes, a chat asks for them, and a replay holds them step by step.
Points are metres in the map frame, angles degrees counter-clockwise from x.
"""

import base64
import hashlib
import math
from collections.abc import Collection, Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.geometry import Point, Pose
from mapspeak.robot import NavigationLook
from mapspeak.server.text.wording import say_pose_doubt
from mapspeak.server.text.world.drives import say_end
from mapspeak.server.text.world.maps import NAVIGATION_PARTS, say_navigation_part
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid

TILE_CELLS = 256
UNKNOWN_GREY = 127
Spot = tuple[float, float]


class ViewPart(BaseModel):
    """A part of the document."""

    model_config = ConfigDict(frozen=True)


class PoseView(ViewPart):
    """A place and a heading."""

    x: float
    y: float
    yaw_deg: float

    @classmethod
    def of(cls, pose: Pose) -> "PoseView":
        """Round a pose to the millimetre and a tenth of a degree."""
        return cls(x=round(pose.x, 3), y=round(pose.y, 3), yaw_deg=round(pose.yaw_deg, 1))


class GridView(ViewPart):
    """The grid: where it lies, and the names of its tiles from its origin on.

    Attributes:
        pictures: Tiles by their names, as data URLs; a page that has a server fetches them there.
    """

    origin: PoseView
    resolution_m: float
    n_rows: int
    n_cols: int
    tile_cells: int = TILE_CELLS
    tiles: list[list[str]]
    pictures: Mapping[str, str] | None = None

    @classmethod
    def of(cls, grid: OccupancyGrid, *, tile_cells: int = TILE_CELLS) -> "GridView":
        """Name the tiles of a map."""
        return cls(
            origin=PoseView.of(grid.origin),
            resolution_m=grid.resolution_m,
            n_rows=grid.n_rows,
            n_cols=grid.n_cols,
            tile_cells=tile_cells,
            tiles=name_tiles(grid, tile_cells=tile_cells),
        )

    @classmethod
    def whole(cls, grid: OccupancyGrid, known: Collection[str] = ()) -> "GridView":
        """Draw all tiles but those that the reader has already."""
        view = cls.of(grid)
        pictures = {
            name: embed_tile(draw_tile(grid, row, col))
            for row, names in enumerate(view.tiles)
            for col, name in enumerate(names)
            if name and name not in known
        }
        return view.model_copy(update={"pictures": pictures})


class DriveView(ViewPart):
    """A drive, as it was heard of last."""

    id: str
    place: str
    state: str
    reason: str
    goal: PoseView
    path: list[Spot]


class RobotView(ViewPart):
    """The robot as it is now.

    Attributes:
        doubt: Why it may be elsewhere; empty for a fresh pose on the map.
        held_by: The holder and the reason; None where it is not held.
        waiting: The commands that wait for approval, by their ids.
        cameras: Their names, the one that looks ahead first.
        camera_fov_deg: How wide that one sees; None until a picture has told.
    """

    pose: PoseView | None
    age_s: float
    doubt: str
    fault: str = ""
    held_by: str | None = None
    drive: DriveView | None = None
    waiting: Mapping[str, str] = {}
    cameras: tuple[str, ...] = ()
    camera_fov_deg: float | None = None


class QuestionView(ViewPart):
    """A question of a mission that waits.

    Attributes:
        said: In words, with the answers that are taken.
        answers: Those; any where there are none.
        picture: The address of what it is about, relative to the robot; empty without one.
    """

    id: str
    said: str
    answers: tuple[str, ...] = ()
    picture: str = ""


class NavigationView(ViewPart):
    """What the robot's navigation tells of one part of itself.

    Attributes:
        said: Its state in words, with its age.
        lines: The planned path, the footprint, or rings around what a costmap closes.
    """

    part: str
    said: str
    lines: list[list[Spot]]

    @classmethod
    def of(cls, look: NavigationLook) -> "NavigationView":
        """Round to the centimetre."""
        lines = [[(round(at.x, 2), round(at.y, 2)) for at in line] for line in look.lines]
        said = f"{NAVIGATION_PARTS[look.part]} {say_navigation_part(look)}"
        return cls(part=look.part.value, said=said, lines=lines)


class MissionsView(ViewPart):
    """The latest mission and the saved ones, each as a tree.

    Attributes:
        states: Of the latest mission's leaves that have begun, by their numbers.
        questions: Those that wait for an answer.
    """

    latest: Mapping[str, Any] | None = None
    is_over: bool = True
    states: Mapping[int, str] = {}
    questions: tuple[QuestionView, ...] = ()
    saved: tuple[Mapping[str, Any], ...] = ()


class CallView(ViewPart):
    """A call of a tool and its answer; in a replay also what else was said.

    Attributes:
        is_over: True once it has been answered.
        pictures: Addresses of those that came with it, relative to the page or the robot.
        age_s: Time since it began, when it is told; None in a replay.
        took_s: Time until its answer.
        note: Who and when, in a replay.
    """

    number: int
    tool: str
    arguments: Mapping[str, Any] = {}
    is_over: bool = True
    is_error: bool = False
    text: str = ""
    pictures: tuple[str, ...] = ()
    age_s: float | None = None
    took_s: float | None = None
    note: str = ""


class RobotLook:
    """Looks at one robot; keeps the way of its latest drive.

    Attributes:
        camera_fov_rad: How wide its camera sees; None until a picture has told.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._path: tuple[str, list[Spot]] = ("", [])
        self.camera_fov_rad: float | None = None

    async def look(self) -> RobotView:
        """Return how the robot stands."""
        robot, guard = self._session.robot, self._session.guard
        pose, here, age_s, doubt, fault = None, None, 0.0, "", ""
        try:
            stamped = await robot.fetch_pose()
        except MapspeakError as error:
            fault = str(error)
        else:
            pose, age_s = PoseView.of(stamped.pose), round(robot.now_s - stamped.stamp_s, 1)
            doubt = say_pose_doubt(stamped.find_doubt(robot.now_s))
            here = None if doubt else stamped.pose.point
        return RobotView(
            pose=pose,
            age_s=age_s,
            doubt=doubt,
            fault=fault,
            held_by=None if guard is None else guard.hold.read(),
            drive=await self._describe_drive(here),
            waiting={} if guard is None else guard.approvals.fresh_room().list_waiting(),
            cameras=self._name_cameras(),
            camera_fov_deg=self._find_fov_deg(),
        )

    def _name_cameras(self) -> tuple[str, ...]:
        try:
            return self._session.robot.description.cameras
        except LinkError:
            return ()

    def _find_fov_deg(self) -> float | None:
        """Return how wide the camera sees, as a page's or a tool's latest picture told."""
        ahead = (taken for taken in reversed(self._session.pictures.taken) if taken.is_ahead)
        latest = next(ahead, None)
        fov_rad = self.camera_fov_rad or (None if latest is None else latest.horizontal_fov_rad)
        return None if fov_rad is None else round(math.degrees(fov_rad), 1)

    async def _describe_drive(self, robot: Point | None) -> DriveView | None:
        """Return the latest drive; where the robot surely is tells how far it is from a thing."""
        drive, world = self._session.drives.latest, self._session.world
        if drive is None:
            return None
        status = drive.final or drive.heard
        path: list[Spot] = []
        if drive.final is None and world is not None:
            if self._path[0] != drive.goal_id:
                goal = drive.goal.point
                way = await self._session.compute(lambda: world.distances.way_to(goal))
                self._path = drive.goal_id, [(round(at.x, 2), round(at.y, 2)) for at in way or ()]
            path = self._path[1]
        return DriveView(
            id=drive.goal_id,
            place=drive.place,
            state=status.state.value,
            reason=say_end(status, drive.thing, robot),
            goal=PoseView.of(drive.goal),
            path=path,
        )


# --- the map as square pictures, of which a page fetches anew only those that have changed ---


def name_tiles(grid: OccupancyGrid, *, tile_cells: int = TILE_CELLS) -> list[list[str]]:
    """Return a name for what each tile shows, row by row from the grid's origin; "" for nothing."""
    return [
        [_name(_cut(grid, row, col, tile_cells)) for col in range(-(-grid.n_cols // tile_cells))]
        for row in range(-(-grid.n_rows // tile_cells))
    ]


def draw_tile(grid: OccupancyGrid, row: int, col: int, *, tile_cells: int = TILE_CELLS) -> bytes:
    """Return a tile as PNG, a pixel a cell, the row farthest from the origin on top.

    Grey 255 is free, 0 occupied, the unknown transparent: the page gives it its own colour.
    """
    cells = _cut(grid, row, col, tile_cells)[::-1]
    known = cells >= 0
    grey = np.where(known, np.round(255 - 2.55 * np.clip(cells, 0, 100)), UNKNOWN_GREY)
    drawn = np.dstack([grey, grey, grey, np.where(known, 255, 0)]).astype(np.uint8)
    return bytes(cv2.imencode(".png", drawn)[1])


def embed_tile(png: bytes) -> str:
    """Return a tile as a data URL, for a page without a server."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def _cut(grid: OccupancyGrid, row: int, col: int, tile_cells: int) -> NDArray[np.int8]:
    rows = slice(row * tile_cells, (row + 1) * tile_cells)
    cols = slice(col * tile_cells, (col + 1) * tile_cells)
    return grid.cells[rows, cols]


def _name(cells: NDArray[np.int8]) -> str:
    if (cells < 0).all():
        return ""
    content = hashlib.blake2b(np.ascontiguousarray(cells).data, digest_size=8)
    content.update(repr(cells.shape).encode())
    return content.hexdigest()
