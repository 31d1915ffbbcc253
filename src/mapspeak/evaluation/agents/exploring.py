"""How the script explores and records, with nothing but what tools answer: the paper's Task 1."""

import math
import re
from collections.abc import Sequence

import cv2
import numpy as np

from mapspeak.evaluation.agent import ToolClient
from mapspeak.evaluation.agents.driver import ARRIVED, Row, ToolDriver, read_map_picture
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid
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
    depth = cv2.distanceTransform(
        np.pad(piece.view(np.uint8), 1), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
    )
    return point_of_largest(grid, np.where(piece, depth[1:-1, 1:-1] + clearance_m(grid), 0.0))


def point_of_largest(grid: OccupancyGrid, values: FloatArray) -> Point:
    """Return the middle of the cell that has the largest value."""
    row, col = np.unravel_index(int(np.argmax(values)), values.shape)
    return grid.point_at(Cell(int(row), int(col)))


def ways_to_floor_m(grid: OccupancyGrid, robot: Point, *, radius_m: float) -> FloatArray:
    """Return the way to each free cell; infinite for all others and where there is none."""
    rows, cols = np.nonzero(grid.free)
    ways_m = np.full(grid.cells.shape, np.inf)
    ways_m[rows, cols] = distances_from(grid, robot, radius_m=radius_m).distances_at(rows, cols)
    return ways_m


def _near_in_sight(grid: OccupancyGrid, place: Point) -> Mask:
    """Return the cells that can be seen from a place and are near it."""
    angles = np.linspace(-math.pi, math.pi, N_RAYS, endpoint=False)
    ahead = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    here, reach = np.array([place.x, place.y]), np.arange(0.0, SIGHT_M, grid.resolution_m)
    on_rays = here + ahead[:, None] * reach[:, None]
    is_open = grid.look_up(grid.free, on_rays, outside=False)
    n_open = np.where(is_open.all(axis=1), reach.size, np.argmin(is_open, axis=1))
    ends = here + ahead * (n_open * grid.resolution_m)[:, None]
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


MOST_GOALS = 80
WAIT_S = 20.0
LEAST_ROOM_M2 = 3.0
MOST_VIEWPOINTS = 60
MARGIN_M = 0.45
"""A viewpoint keeps this clear of walls: as much as the robot needs and a little more."""
LOOK_AROUND_EVERY_M = 4.0
LOOK_AROUND_DEG = (90.0, 180.0, 270.0)


class ScriptedExploration:
    """Explores, and records what is seen on the way."""

    _grid: OccupancyGrid
    _pose: Pose

    def __init__(self, tools: ToolClient) -> None:
        self._driver = ToolDriver(tools, wait_s=WAIT_S)
        self._n_goals = 0
        self._looked_at: list[Point] = []

    async def explore(self) -> None:
        """Drive to frontiers and record what is seen, until none is left to reach.

        It explores once more after the survey: by then more is known.
        """
        await self._look()
        await self._record_surroundings()
        await self._follow_frontiers()
        await self._survey()
        await self._look()
        await self._follow_frontiers()

    async def _look(self) -> None:
        plain = await self._driver.tools.demand("subscribe_map_as_image")
        self._pose = (await self._driver.look()).pose
        self._grid = read_map_picture(plain.text, plain.pictures[0].data)

    async def _follow_frontiers(self) -> None:
        """Let the robot explore, one frontier at a time, until none is left that it can reach."""
        while self._n_goals < MOST_GOALS and (n_goals := await self._explore_one()):
            self._n_goals += n_goals
            await self._look()
            await self._record_surroundings()

    async def _explore_one(self) -> int:
        """Return how many frontiers the robot set out to, none where nothing is left."""
        while True:
            answer = await self._driver.tools.demand("explore", n_goals=1, wait_s=WAIT_S)
            if answer.report["state"] != "driving":
                return int(answer.report["n_goals"])

    async def _survey(self) -> None:
        """Look around wherever floor has not been looked at from near."""
        for _ in range(MOST_VIEWPOINTS):
            here = self._pose.point
            point = find_viewpoint(self._grid, here, self._looked_at, radius_m=MARGIN_M)
            if point is None:
                return
            state = await self._driver.drive(x=point.x, y=point.y)
            await self._look()
            if state == ARRIVED:
                await self._record_surroundings()
            self._looked_at.append(point)

    async def _record_surroundings(self) -> None:
        """Record what is ahead and, where it has not looked around near by, to all sides."""
        pose = self._pose
        await self._record()
        if any(pose.point.distance_to(place) < LOOK_AROUND_EVERY_M for place in self._looked_at):
            return
        self._looked_at.append(pose.point)
        for turn_deg in LOOK_AROUND_DEG:
            yaw_deg = math.remainder(pose.yaw_deg + turn_deg, 360.0)
            await self._driver.tools.call("navigate_to", x=pose.x, y=pose.y, yaw_deg=yaw_deg)
            await self._record()

    async def _record(self) -> None:
        sightings = await self._driver.see()
        place = (await self._driver.tools.demand("get_robot_pose")).report
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
