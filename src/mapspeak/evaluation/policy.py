"""How the script explores and records, with nothing but what tools answer: the paper's Task 1."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from mapspeak.evaluation.client import ToolClient
from mapspeak.evaluation.driver import ARRIVED, ToolDriver
from mapspeak.evaluation.reading import MapReading, Row, read_map_picture, read_map_text
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray, Mask
from mapspeak.spatial.paths import clearance_m, distances_from

SIGHT_M = 4.0
"""How far a look-around counts: things beyond it are seen, but small."""
LEAST_AREA_M2 = 1.5
N_RAYS = 180


def find_viewpoint(
    grid: OccupancyGrid, robot: Point, looked_from: Sequence[Point], *, radius_m: float
) -> Point | None:
    """Find the middle of the nearest piece of floor that is still to be looked at, or None."""
    ways_m = ways_to_floor_m(grid, robot, radius_m=radius_m)
    is_left = np.isfinite(ways_m)
    for place in looked_from:
        is_left &= ~_near_in_sight(grid, place)
    piece = _find_nearest_piece(grid, is_left, ways_m)
    if piece is None:
        return None
    middle = np.argmax(np.where(piece, _depth(piece) + clearance_m(grid), 0.0))
    row, col = np.unravel_index(int(middle), piece.shape)
    x, y = grid.points_at(np.array([row]), np.array([col]))[0]
    return Point(float(x), float(y))


def ways_to_floor_m(grid: OccupancyGrid, robot: Point, *, radius_m: float) -> FloatArray:
    """Return the way to each free cell; infinite for all others and where there is none."""
    rows, cols = np.nonzero(grid.free)
    ways_m = np.full(grid.cells.shape, np.inf)
    ways_m[rows, cols] = distances_from(grid, robot, radius_m=radius_m).distances_at(rows, cols)
    return ways_m


def _near_in_sight(grid: OccupancyGrid, place: Point) -> Mask:
    """Return the cells that can be seen from a place and are near it."""
    angles = np.linspace(-math.pi, math.pi, N_RAYS, endpoint=False)
    reach = np.arange(0.0, SIGHT_M, grid.resolution_m)
    xs = place.x + np.cos(angles)[:, None] * reach
    ys = place.y + np.sin(angles)[:, None] * reach
    rows, cols = grid.cells_at(np.stack([xs.ravel(), ys.ravel()], axis=1))
    is_inside = grid.contains_cells(rows, cols)
    is_open = np.zeros(rows.shape, dtype=bool)
    is_open[is_inside] = grid.free[rows[is_inside], cols[is_inside]]
    is_open = is_open.reshape(xs.shape)
    n_open = np.where(is_open.all(axis=1), reach.size, np.argmin(is_open, axis=1))
    reached_m = n_open * grid.resolution_m
    ends = np.stack(
        [place.x + np.cos(angles) * reached_m, place.y + np.sin(angles) * reached_m], axis=1
    )
    corners = grid.fractional_cells_at(ends)[:, ::-1] - 0.5
    seen = np.zeros(grid.cells.shape, dtype=np.uint8)
    cv2.fillPoly(seen, [np.round(corners).astype(np.int32)], 1)
    return seen > 0


def _find_nearest_piece(grid: OccupancyGrid, is_left: Mask, ways_m: FloatArray) -> Mask | None:
    n_pieces, labels, statistics, _ = cv2.connectedComponentsWithStats(is_left.astype(np.uint8))
    areas_m2 = statistics[:, cv2.CC_STAT_AREA] * grid.resolution_m**2
    large = [label for label in range(1, n_pieces) if areas_m2[label] >= LEAST_AREA_M2]
    if not large:
        return None
    nearest = min(large, key=lambda label: float(ways_m[labels == label].min()))
    return np.asarray(labels == nearest)


def _depth(piece: Mask) -> FloatArray:
    """Return how many cells each cell lies inside its piece."""
    padded = np.pad(piece.astype(np.uint8), 1)
    depth = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(depth[1:-1, 1:-1], dtype=np.float64)


MOST_GOALS = 80
WAIT_S = 20.0
LEAST_ROOM_M2 = 3.0
MOST_VIEWPOINTS = 60
MARGIN_M = 0.45
"""A viewpoint keeps this clear of walls: as much as the robot needs and a little more."""
LOOK_AROUND_EVERY_M = 4.0
LOOK_AROUND_DEG = (90.0, 180.0, 270.0)


@dataclass(slots=True)
class ExplorationPolicy:
    """Explores, and records what is seen on the way."""

    tools: ToolClient
    _driver: ToolDriver = field(init=False)
    _n_goals: int = 0
    _looked_at: list[Point] = field(default_factory=list)
    _grid: OccupancyGrid = field(init=False)

    def __post_init__(self) -> None:
        self._driver = ToolDriver(self.tools, wait_s=WAIT_S)

    async def explore(self) -> None:
        """Drive to frontiers and record what is seen, until none is left to reach.

        It explores once more after the survey: by then more is known.
        """
        view = await self._look()
        await self._record_surroundings(view.pose)
        view = await self._follow_frontiers(view)
        await self._survey(view.pose)
        await self._follow_frontiers(await self._look())

    async def _follow_frontiers(self, view: MapReading) -> MapReading:
        """Let the robot explore, one frontier at a time, until none is left that it can reach."""
        while self._n_goals < MOST_GOALS and (n_goals := await self._explore_one()):
            self._n_goals += n_goals
            view = await self._look()
            await self._record_surroundings(view.pose)
        return view

    async def _explore_one(self) -> int:
        """Return how many frontiers the robot set out to, none where nothing is left."""
        state = "driving"
        while state == "driving":
            report = (await self.tools.demand("explore", n_goals=1, wait_s=WAIT_S)).report
            state = str(report["state"])
        return int(report["n_goals"])

    async def _survey(self, pose: Pose) -> None:
        """Look around wherever floor has not been looked at from near."""
        for _ in range(MOST_VIEWPOINTS):
            point = find_viewpoint(self._grid, pose.point, self._looked_at, radius_m=MARGIN_M)
            if point is None:
                return
            state = await self._driver.drive(x=point.x, y=point.y)
            pose = (await self._look()).pose
            if state == ARRIVED:
                await self._record_surroundings(pose)
            self._looked_at.append(point)

    async def _look(self) -> MapReading:
        plain = await self.tools.demand("subscribe_map_as_image")
        answer = await self.tools.demand("look_at_map")
        self._grid = read_map_picture(plain.text, plain.pictures[0].data)
        return read_map_text(answer.text)

    async def _record_surroundings(self, pose: Pose) -> None:
        """Record what is ahead and, where it has not looked around near by, to all sides."""
        await self._record()
        if any(pose.point.distance_to(place) < LOOK_AROUND_EVERY_M for place in self._looked_at):
            return
        self._looked_at.append(pose.point)
        for turn_deg in LOOK_AROUND_DEG:
            yaw_deg = math.remainder(pose.yaw_deg + turn_deg, 360.0)
            await self.tools.call("navigate_to", x=pose.x, y=pose.y, yaw_deg=yaw_deg)
            await self._record()

    async def _record(self) -> None:
        sightings = await self._driver.see()
        place = (await self.tools.demand("get_robot_pose")).report
        await self._driver.record(place["place"], sightings)


def is_room(row: Row, doors: tuple[Row, ...]) -> bool:
    """Return True for a room.

    What furniture cuts off is tiny, or open to one neighbour several times.
    """
    names = re.findall(r"D\d+", row.cells["doors"])
    ways_in = [
        door.cells["joins"]
        for door in doors
        if door.id in names and not door.cells["path m"].startswith("no way")
    ]
    is_nook = len(ways_in) > len(set(ways_in))
    is_large_enough = row.number("floor m2") >= LEAST_ROOM_M2
    return row.cells["kind"] == "room" and is_large_enough and not is_nook
