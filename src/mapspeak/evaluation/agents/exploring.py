"""Two explorers to compare with: the nearest frontier, and the paper's loop from pictures alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.evaluation.client import ToolClient
from mapspeak.evaluation.driver import ARRIVED, ToolDriver, find_label, gave_up
from mapspeak.evaluation.policy import MARGIN_M, SIGHT_M, ways_to_floor_m
from mapspeak.evaluation.reading import Row, read_map_picture
from mapspeak.evaluation.trials import AgentEnd, Assignment, ServerAccess
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray, Mask
from mapspeak.spatial.paths import clearance_m

EXPLORING = "Update the map"
SMALLEST = "Go to the smallest room"
MOST_GOALS = 120
FARTHEST_MISS_M = 0.5
"""Two goals that lie nearer to each other are the same one."""
STEP_M = 5.0
"""The paper's prompt asks for waypoints at least so far away, ..."""
BACK_M = 3.0
"""... and for none so near to one that was visited."""
LEAST_EDGE_M = 0.6
"""A border with the unknown that is shorter is a crack."""
DOOR_M = 1.2
"""Free floor no wider counts as a doorway when rooms are told apart by eye."""
LEAST_ROOM_M2 = 1.0


async def _record(driver: ToolDriver) -> Pose:
    """Record what is ahead, and return where that was."""
    sightings = await driver.see()
    pose = await driver.find_pose()
    await driver.record(f"{pose.x:.1f}, {pose.y:.1f}", sightings)
    return pose


@dataclass(frozen=True, slots=True)
class NearestFrontierAgent:
    """Drives to the frontier with the shortest way, until there is none: the plain baseline.

    It only explores; asked for anything else it gives up.
    """

    name: str = "nearest-frontier"
    connection: ServerAccess = ServerAccess.MEMORY

    async def run(self, task: Assignment, tools: ToolClient) -> AgentEnd:
        """Carry out the assignment."""
        if not task.prompt.startswith(EXPLORING):
            return gave_up("I only explore.")
        driver, missed = ToolDriver(tools), list[Point]()
        await _record(driver)
        for _ in range(MOST_GOALS):
            rows = (await driver.look()).rows("Frontiers")
            goals = [(row.number("path m"), row.id, _point_of(row)) for row in rows]
            left = [
                goal
                for goal in goals
                if all(goal[2].distance_to(place) >= FARTHEST_MISS_M for place in missed)
            ]
            if not left:
                return AgentEnd(answer="No frontier is left that I can reach.")
            _, frontier, point = min(left, key=lambda goal: goal[:2])
            if await driver.drive(place=frontier) == ARRIVED:
                await _record(driver)
            else:
                missed.append(point)
        return gave_up("There are too many frontiers.")


@dataclass(frozen=True, slots=True)
class PaperLoopAgent:
    """Does by script what the paper's prompt tells a model, with the paper's tools and the picture.

    It sees free, unknown and occupied pixels and its own pose: no rooms, no frontiers, no tables.
    Task 1 follows the prompt's steps. In Task 2 it takes for rooms what is left of the free floor
    when narrow places are closed, and cannot tell a corridor from a room. In Task 3 it goes to the
    nearest waypoint whose landmarks fit. Asked for anything else it gives up.
    """

    name: str = "paper-loop"
    connection: ServerAccess = ServerAccess.MEMORY

    async def run(self, task: Assignment, tools: ToolClient) -> AgentEnd:
        """Carry out the assignment."""
        driver = ToolDriver(tools)
        if task.prompt.startswith(EXPLORING):
            return await _explore_by_picture(driver)
        if task.prompt.startswith(SMALLEST):
            return await _go_to_smallest_patch(driver)
        label = find_label(task.prompt)
        return gave_up("I do not know how.") if label is None else await _recall(driver, label)


async def _explore_by_picture(driver: ToolDriver) -> AgentEnd:
    pose = await _record(driver)
    visited, missed = [pose.point], list[Point]()
    for _ in range(MOST_GOALS):
        grid = await _see_map(driver)
        goal = _choose_waypoint(grid, pose.point, visited, missed)
        if goal is None:
            return AgentEnd(answer="No unexplored area is left.")
        state = await driver.drive(x=goal.x, y=goal.y, yaw_deg=goal.yaw_deg)
        if state == ARRIVED:
            pose = await _record(driver)
            visited.append(pose.point)
        else:
            missed.append(goal.point)
    return gave_up("There is always something left to explore.")


async def _see_map(driver: ToolDriver) -> OccupancyGrid:
    """Look at all three of the paper's pictures, and read the first as it is drawn."""
    plain = await driver.tools.demand("subscribe_map_as_image")
    await driver.tools.demand("draw_map_axis")
    await driver.tools.demand("draw_robot_pose")
    return read_map_picture(plain.text, plain.pictures[0].data)


def _choose_waypoint(
    grid: OccupancyGrid, robot: Point, visited: Sequence[Point], missed: Sequence[Point]
) -> Pose | None:
    """Find the place that sees most of the border with the unknown, by the prompt's rules.

    A place at least 5 m away comes first; where there is none, one that is nearer.
    """
    edge = _edge_of_unknown(grid)
    cells = round(2 * SIGHT_M / grid.resolution_m) | 1
    in_sight = cv2.blur(edge.astype(np.float32), (cells, cells), borderType=cv2.BORDER_CONSTANT)
    rows, cols = np.nonzero(np.isfinite(ways_to_floor_m(grid, robot, radius_m=MARGIN_M)))
    if not rows.size:
        return None
    points = grid.points_at(rows, cols)
    worth = in_sight[rows, cols].astype(np.float64) * cells**2 * grid.resolution_m
    worth[worth < LEAST_EDGE_M] = 0.0
    for place in visited:
        worth[_ways_m(points, place) < BACK_M] = 0.0
    for place in missed:
        worth[_ways_m(points, place) < FARTHEST_MISS_M] = 0.0
    is_far = _ways_m(points, robot) >= STEP_M
    chosen = worth * is_far if (worth * is_far).any() else worth
    if not chosen.any():
        return None
    x, y = points[int(np.argmax(chosen))].tolist()
    return Pose(x, y, Point(x, y).bearing_to(_nearest(grid, edge, Point(x, y))))


def _edge_of_unknown(grid: OccupancyGrid) -> Mask:
    """Return free cells beside unknown ones."""
    beside = cv2.dilate(grid.unknown.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    return np.asarray(grid.free & beside)


def _nearest(grid: OccupancyGrid, cells: Mask, point: Point) -> Point:
    points = grid.points_at(*np.nonzero(cells))
    x, y = points[int(np.argmin(_ways_m(points, point)))].tolist()
    return Point(x, y)


def _ways_m(points: FloatArray, place: Point) -> FloatArray:
    return np.asarray(np.hypot(points[:, 0] - place.x, points[:, 1] - place.y))


async def _go_to_smallest_patch(driver: ToolDriver) -> AgentEnd:
    """Go into the smallest piece of floor that is left when narrow places are closed."""
    grid = await _see_map(driver)
    room_m = clearance_m(grid)
    n_patches, labels, statistics, _ = cv2.connectedComponentsWithStats(
        (grid.free & (room_m > DOOR_M / 2)).astype(np.uint8)
    )
    areas_m2 = statistics[:, cv2.CC_STAT_AREA] * grid.resolution_m**2
    patches = [label for label in range(1, n_patches) if areas_m2[label] >= LEAST_ROOM_M2]
    for label in sorted(patches, key=lambda each: float(areas_m2[each])):
        deepest = int(np.argmax(np.where(labels == label, room_m, -1.0)))
        row, col = np.unravel_index(deepest, room_m.shape)
        x, y = grid.points_at(np.array([row]), np.array([col]))[0].tolist()
        if await driver.drive(x=x, y=y) == ARRIVED:
            return AgentEnd(answer="This looks like the smallest room.")
    return gave_up("I see no room that I can get to.")


async def _recall(driver: ToolDriver, label: str) -> AgentEnd:
    """Go to the nearest waypoint, in a straight line, that remembers the thing."""
    seen, pose = await driver.recall(label), await driver.find_pose()
    if not seen:
        return gave_up(f"I remember no {label}.")
    nearest = min(seen, key=lambda each: each.view.point.distance_to(pose.point))
    return AgentEnd(answer=f"{nearest.place}: {await driver.drive(place=nearest.place)}.")


def _point_of(frontier: Row) -> Point:
    x, y = frontier.cells["go to x, y, yaw"].split(",")[:2]
    return Point(float(x), float(y))
