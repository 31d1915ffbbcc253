"""To compare with: an oracle that knows the truth, chance, and two plain explorers."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np

from mapspeak.evaluation.agent import AgentEnd, Assignment, ToolClient, gave_up
from mapspeak.evaluation.agents.driver import ARRIVED, ToolDriver, find_label, read_map_picture
from mapspeak.evaluation.agents.scripted import follow_script
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.trials import Setting
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.grid import FloatArray, Mask
from mapspeak.spatial.paths import clearance_m, distances_from

# --- the oracle, and chance ----------------------------------------------------------------------

BESIDE_M = 3.0
MOST_STANDS = 6


async def answer_by_truth(
    setting: Setting, site: GroundTruth, task: Assignment, tools: ToolClient
) -> AgentEnd:
    """Drive to where truth says, look, and answer what truth says.

    It explores and does errands as the script does.
    """
    truth, driver = setting.truth, ToolDriver(tools)
    if "said" in truth:
        return AgentEnd(answer=f"ANSWER: {truth['said']}")
    if not setting.is_known or not truth or "steps" in truth:
        return await follow_script(task, tools)
    for goals in _stops(truth, site):
        if not await _drive_to_one(driver, goals):
            return AgentEnd(answer="The robot cannot get there.")
    await tools.call("look_through_camera")
    return AgentEnd(answer="ANSWER: there")


def _stops(truth: Mapping[str, Any], site: GroundTruth) -> list[list[Pose]]:
    """Return poses for each stop that are right, the roomiest first."""
    if "goal" in truth:
        goal = Point(*truth["goal"])
        return [[Pose(goal.x, goal.y), *_roomiest(site, site.near(goal, 0.3))]]
    if "rooms" in truth or "room" in truth:
        names = truth.get("rooms") or [truth["room"]]
        cells = [site.cells_of(site.room_named(name)) for name in names]
        return [_roomiest(site, np.logical_or.reduce(cells))]
    kinds = truth.get("kinds") or [truth["kind"]]
    return [_beside(site, kind, name=truth.get("name")) for kind in kinds]


def _beside(site: GroundTruth, kind: str, *, name: str | None) -> list[Pose]:
    """Return poses before things of a kind, or before the one of a name."""
    return [
        Pose(pose.x, pose.y, pose.point.bearing_to(site.place_of(thing)))
        for thing in site.things(kind)
        if name in (None, thing.name)
        for pose in _roomiest(site, site.seen_around(thing, BESIDE_M))
    ]


def _roomiest(site: GroundTruth, cells: Mask) -> list[Pose]:
    room = np.where(cells & site.drivable, clearance_m(site.grid), -1.0)
    best = np.argsort(room, axis=None)[::-1][: MOST_STANDS * 40 : 40]
    rows, cols = np.unravel_index(best[room.flat[best] > 0], room.shape)
    return [Pose(x, y) for x, y in site.grid.points_at(rows, cols).tolist()]


async def _drive_to_one(driver: ToolDriver, goals: list[Pose]) -> bool:
    for goal in goals:
        if await driver.drive(x=goal.x, y=goal.y, yaw_deg=goal.yaw_deg) == ARRIVED:
            return True
    return False


MOST_DRIVES = 3
MOST_SAID = 50.0


async def answer_at_random(task: Assignment, tools: ToolClient) -> AgentEnd:
    """Drive to some places that the map names, or answer: what chance alone is worth."""
    random, driver = np.random.default_rng(task.seed), ToolDriver(tools)
    if "Answer without driving" in task.prompt:
        return AgentEnd(answer=f"ANSWER: {await _say(task.prompt, random, driver)}")
    for _ in range(int(random.integers(1, MOST_DRIVES + 1))):
        view = await driver.look()
        ids = [row.id for rows in view.tables.values() for row in rows]
        if ids:
            await driver.drive(place=str(random.choice(ids)))
    return AgentEnd(answer="ANSWER: there")


async def _say(prompt: str, random: np.random.Generator, driver: ToolDriver) -> str:
    form = prompt.rpartition("ANSWER:")[2]
    if "-2.0" in form:
        here: Point = (await driver.find_pose()).point
        shift = random.normal(0.0, 3.0, 2)
        return f"{here.x + shift[0]:.1f}, {here.y + shift[1]:.1f}"
    if "none" in form:
        letters = sorted(set(re.findall(r"\b([A-H]) \(", prompt)))
        chosen = [letter for letter in letters if random.random() < 0.5]
        return ", ".join(chosen) or "none"
    if "m" in form:
        return f"{random.uniform(0.0, MOST_SAID):.1f} {'m2' if 'm2' in form else 'm'}"
    return str(int(random.integers(1, 6)))


# --- explorers -----------------------------------------------------------------------------------

EXPLORING = "Update the map"
SMALLEST = "Go to the smallest room"
MOST_GOALS = 120
FARTHEST_MISS_M = 0.5
"""Two goals that lie nearer to each other are the same one."""
STEP_M = 5.0
"""The paper's prompt asks for waypoints at least this far away, ..."""
BACK_M = 3.0
"""... and not this near to a visited one."""
LEAST_EDGE_M = 0.6
"""A border with the unknown that is shorter is a crack."""
DOOR_M = 1.2
"""Free floor no wider counts as a doorway when rooms are told apart by eye."""
LEAST_ROOM_M2 = 1.0
SIGHT_M = 4.0
"""A border counts as seen up to this distance; beyond, it looks small."""
MARGIN_M = 0.45
"""A goal keeps this clear of walls: as much as the robot needs and a little more."""


async def _record(driver: ToolDriver) -> Pose:
    """Record what is ahead, and return where that was."""
    sightings = await driver.see()
    pose = await driver.find_pose()
    await driver.record(sightings)
    return pose


async def explore_nearest_frontiers(task: Assignment, tools: ToolClient) -> AgentEnd:
    """Drive to the frontier with the shortest way, until none is left: the plain baseline.

    It only explores, and gives up on any other task.
    """
    if not task.prompt.startswith(EXPLORING):
        return gave_up("I only explore.")
    driver, missed = ToolDriver(tools), list[Point]()
    await _record(driver)
    for _ in range(MOST_GOALS):
        rows = (await driver.look()).rows("Frontiers")
        goals = [(row.number("path m"), row.id, row.goal()) for row in rows]
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


async def follow_paper(task: Assignment, tools: ToolClient) -> AgentEnd:
    """Do by script what the paper's prompt tells a model, with the paper's tools and the picture.

    It sees free, unknown and occupied pixels and its own pose: no rooms, no frontiers, no tables.
    Task 1 follows the prompt's steps. In Task 2 it takes for rooms what is left of the free floor
    when narrow places are closed, and cannot tell a corridor from a room. In Task 3 it goes to the
    nearest waypoint whose landmarks fit. Asked for anything else it gives up.
    """
    driver = ToolDriver(tools)
    if task.prompt.startswith(EXPLORING):
        return await _explore_by_picture(driver)
    if task.prompt.startswith(SMALLEST):
        return await _go_to_smallest_patch(driver)
    label = find_label(task.prompt)
    if label is None or not await driver.is_offered("get_semantic_data"):
        return gave_up("I do not know how.")
    return await _recall(driver, label)


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
    """Look at all three of the paper's pictures, and read the first."""
    plain = await driver.tools.demand("subscribe_map_as_image")
    await driver.tools.demand("draw_map_axis")
    await driver.tools.demand("draw_robot_pose")
    return read_map_picture(plain.text, plain.pictures[0].data)


def _choose_waypoint(
    grid: OccupancyGrid, robot: Point, visited: Sequence[Point], missed: Sequence[Point]
) -> Pose | None:
    """Find the place that sees most of the border with the unknown, by the prompt's rules.

    A place at least 5 m away is preferred to a nearer one.
    """
    # Free cells beside unknown ones.
    edge = grid.free & (cv2.dilate(grid.unknown.view(np.uint8), np.ones((3, 3), np.uint8)) > 0)
    cells = round(2 * SIGHT_M / grid.resolution_m) | 1
    in_sight = cv2.blur(edge.astype(np.float32), (cells, cells), borderType=cv2.BORDER_CONSTANT)
    rows, cols = np.nonzero(grid.free)
    ways_m = distances_from(grid, robot, radius_m=MARGIN_M).distances_at(rows, cols)
    rows, cols = rows[np.isfinite(ways_m)], cols[np.isfinite(ways_m)]
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
    borders = grid.points_at(*np.nonzero(edge))
    nearest = borders[int(np.argmin(_ways_m(borders, Point(x, y))))].tolist()
    return Pose(x, y, Point(x, y).bearing_to(Point(*nearest)))


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
        deepest = np.where(labels == label, room_m, -1.0).argmax()
        row, col = np.unravel_index(int(deepest), room_m.shape)
        middle = grid.point_at(Cell(int(row), int(col)))
        if await driver.drive(x=middle.x, y=middle.y) == ARRIVED:
            return AgentEnd(answer="This looks like the smallest room.")
    return gave_up("I see no room that I can get to.")


async def _recall(driver: ToolDriver, label: str) -> AgentEnd:
    """Go to the nearest waypoint, in a straight line, that remembers the thing."""
    places, pose = await driver.recall(label), await driver.find_pose()
    if not places:
        return gave_up(f"I remember no {label}.")
    nearest = min(places, key=lambda place: places[place].distance_to(pose.point))
    return AgentEnd(answer=f"{nearest}: {await driver.drive(place=nearest)}.")
