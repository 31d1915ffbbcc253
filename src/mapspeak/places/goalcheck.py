"""Checks of a goal against the map: whether it works, why not, and what would work instead."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import cv2
import numpy as np

from mapspeak.errors import NextStep
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.fieldofview import is_in_sight
from mapspeak.spatial.paths import DistanceField, distances_from
from mapspeak.worldmodel.keepout import MARGIN_M, ClosedArea, ClosedFloor

Opened = Callable[[Point], DistanceField]


class GoalVerdict(StrEnum):
    """Verdict on a goal before driving to it."""

    OK = "ok"
    NOT_FINITE = "not_finite"
    OFF_MAP = "off_map"
    UNKNOWN = "unknown"
    OCCUPIED = "occupied"
    TOO_TIGHT = "too_tight"
    CLOSED = "closed"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalCheck:
    """A goal judged against a map.

    Attributes:
        radius_m: The robot's, around its centre.
        clearance_m: From the goal to the nearest obstacle; 0 in one, off the map and in the
            unknown.
        nearest: The pose nearest to the goal that would work, as the crow flies; None for a good
            goal, and without such a pose.
        bounds: The corners of the map with the least and the greatest x and y; None if the goal
            is not a valid position.
        areas: The closed areas in the way: the one that the goal is in or too near to, the one
            that the robot stands in, or those on the shortest way.
        is_robot_inside: The robot itself stands in the closed area.
        is_nearest_apart: The goal has free floor, and a wall hides it from the nearest pose.
    """

    verdict: GoalVerdict
    goal: Pose
    radius_m: float
    clearance_m: float
    path_m: float | None = None
    nearest: Pose | None = None
    bounds: tuple[Point, Point] | None = None
    areas: tuple[ClosedArea, ...] = ()
    is_robot_inside: bool = False
    is_nearest_apart: bool = False

    @property
    def is_ok(self) -> bool:
        """True when the robot can drive there and stand there."""
        return self.verdict is GoalVerdict.OK


FARTHEST_M = 1e6
"""No map is that large; larger numbers are typing errors, and overflow cell indices."""
SEARCH_M = 8.0
"""How far around a goal another one is looked for first."""
CLEAR_M = 8.0
"""How far around a goal an obstacle is looked for at all."""
TOLD_M = 0.01
"""Poses are told to the centimetre."""
NEAR_M = 1.0
"""How far around a goal an obstacle is looked for first."""
THICKEST_M = 0.5
"""Unseen space between faces no farther apart is the inside of a wall."""
LARGEST_M = 1.5
"""Unseen space with obstacles all around, no farther off than this, is the inside of one."""
SPARE_M = 0.02
"""Navigation plans with a little more than the radius, and refuses a goal that leaves less."""
TIGHT_OFF_M = 0.5
"""A pose without that counts as so much farther off."""
MOST_TRIED = 100


def check_goal(
    grid: OccupancyGrid, distances: DistanceField, goal: Pose, *, opened: Opened | None = None
) -> GoalCheck:
    """Judge a goal before driving, and find the nearest pose that would work.

    Args:
        distances: From the robot, on that map or on its floor without closed areas.
        opened: Gives the distances from a point on the map itself, if they are cached; to
            say which closed area cuts a goal off.
    """
    check = judge_goal(grid, distances, goal, opened=opened)
    if check.is_ok or check.verdict is GoalVerdict.NOT_FINITE:
        return check
    nearest = _find_nearest(grid, distances, goal)
    is_apart = (
        check.verdict in (GoalVerdict.UNREACHABLE, GoalVerdict.CLOSED)
        and nearest is not None
        and not is_in_sight(grid, nearest.point, goal.point, own_m=0.0)
    )
    return replace(check, nearest=nearest, is_nearest_apart=is_apart)


def judge_goal(
    grid: OccupancyGrid, distances: DistanceField, goal: Pose, *, opened: Opened | None = None
) -> GoalCheck:
    """Judge a goal as `check_goal`, without looking for another where it does not work."""
    radius_m = distances.radius_m
    if not goal.is_finite() or max(abs(goal.x), abs(goal.y)) > FARTHEST_M:
        return GoalCheck(
            verdict=GoalVerdict.NOT_FINITE, goal=goal, radius_m=radius_m, clearance_m=0.0
        )
    clear_m = _clearance_at(grid, goal.point)
    path_m = distances.distance_to(goal.point)
    verdict = _judge(grid, distances, goal, clear_m, path_m)
    areas: tuple[ClosedArea, ...] = ()
    closing, is_robot_inside = _find_closing(distances, goal, is_reachable=path_m is not None)
    if closing is not None:
        verdict, areas = GoalVerdict.CLOSED, (closing,)
    elif verdict is GoalVerdict.UNREACHABLE:
        areas = _find_cutting_off(grid, distances, goal, opened)
    return GoalCheck(
        verdict=verdict,
        goal=goal,
        radius_m=radius_m,
        clearance_m=clear_m,
        path_m=path_m,
        bounds=grid.bounds(),
        areas=areas,
        is_robot_inside=is_robot_inside,
    )


def _judge(
    grid: OccupancyGrid,
    distances: DistanceField,
    goal: Pose,
    clear_m: float,
    path_m: float | None,
) -> GoalVerdict:
    cell = grid.cell_at(goal.point)
    if not grid.contains(cell):
        return GoalVerdict.OFF_MAP
    if grid.is_unknown(cell) and not is_in_obstacle(grid, goal.point):
        return GoalVerdict.UNKNOWN
    if not grid.is_free(cell):
        return GoalVerdict.OCCUPIED
    if path_m is not None:
        return GoalVerdict.OK
    return GoalVerdict.TOO_TIGHT if clear_m < distances.radius_m else GoalVerdict.UNREACHABLE


def _find_cutting_off(
    grid: OccupancyGrid, distances: DistanceField, goal: Pose, opened: Opened | None
) -> tuple[ClosedArea, ...]:
    """Find the closed areas that cut a goal off; none where walls do."""
    floor, radius_m = distances.lattice.grid, distances.radius_m
    if not isinstance(floor, ClosedFloor):
        return ()
    start = distances.start
    field = opened(start) if opened else distances_from(grid, start, radius_m=radius_m)
    way = field.way_to(goal.point)
    reach_m = radius_m + MARGIN_M + 2 * floor.resolution_m
    return () if way is None else tuple(floor.find_areas_along(way, within_m=reach_m))


def _find_closing(
    distances: DistanceField, goal: Pose, *, is_reachable: bool
) -> tuple[ClosedArea | None, bool]:
    """Find the closed area that the robot would be over at a goal, or that it stands in itself.

    Returns:
        The area or None, and whether it is the robot that stands in it.
    """
    floor = distances.lattice.grid
    if not isinstance(floor, ClosedFloor):
        return None, False
    # Borders of areas and of cells differ: what is reachable decides between the two.
    cell_m = floor.resolution_m
    reach_m = distances.radius_m if is_reachable else distances.radius_m + MARGIN_M + 2 * cell_m
    area = floor.find_area(goal.point, within_m=reach_m)
    if area is not None or is_reachable:
        return area, False
    around = floor.find_area(distances.start, within_m=0.0)
    return around, around is not None


def _find_nearest(grid: OccupancyGrid, distances: DistanceField, goal: Pose) -> Pose | None:
    """Find the pose nearest to a goal, as the crow flies, that passes the same check."""
    centre = _into(grid, goal.point)
    near = grid.window_around(centre, SEARCH_M + 2 * grid.resolution_m)
    # What lies outside of that is farther from the goal than so much.
    nearest_outside_m = math.hypot(SEARCH_M, centre.distance_to(goal.point))
    found = _find_nearest_in(near, grid, distances, goal, within_m=nearest_outside_m)
    whole = slice(0, grid.n_rows), slice(0, grid.n_cols)
    return found or _find_nearest_in(whole, grid, distances, goal, within_m=math.inf)


def _find_nearest_in(
    window: tuple[slice, slice],
    grid: OccupancyGrid,
    distances: DistanceField,
    goal: Pose,
    *,
    within_m: float,
) -> Pose | None:
    rows, cols = np.nonzero(distances.reachable[window])
    rows, cols = rows + window[0].start, cols + window[1].start
    points = grid.points_at(rows, cols)
    if grid.resolution_m < 2 * TOLD_M:
        # What is told of a pose must lie in a cell that works, too.
        points = points.round(2)
    is_tight = distances.clearances_m[rows, cols] < distances.radius_m + SPARE_M
    off_m = np.hypot(points[:, 0] - goal.x, points[:, 1] - goal.y) + TIGHT_OFF_M * is_tight
    points, off_m = points[off_m <= within_m], off_m[off_m <= within_m]
    if len(off_m) > MOST_TRIED:
        first = np.argpartition(off_m, MOST_TRIED)[:MOST_TRIED]
        points, off_m = points[first], off_m[first]
    nearest = points[np.argsort(off_m, kind="stable")].tolist()
    poses = (Pose(x, y, goal.yaw_rad) for x, y in nearest)
    return next((pose for pose in poses if judge_goal(grid, distances, pose).is_ok), None)


def _into(grid: OccupancyGrid, point: Point) -> Point:
    """Return the point itself, or the centre of the nearest cell where it lies off the map."""
    cell = grid.cell_at(point)
    if grid.contains(cell):
        return point
    row, col = np.clip((cell.row, cell.col), 0, (grid.n_rows - 1, grid.n_cols - 1)).tolist()
    return grid.point_at(Cell(row, col))


def is_in_obstacle(grid: OccupancyGrid, point: Point) -> bool:
    """Return True for unseen space between both faces of a wall, or with faces all around it."""
    cell = grid.cell_at(point)
    if not grid.contains(cell) or not grid.is_unknown(cell):
        return False
    return _is_enclosed(grid, cell) or any(
        _to_face_m(grid, cell, down, across) + _to_face_m(grid, cell, -down, -across) <= THICKEST_M
        for down, across in ((0, 1), (1, 0), (1, 1), (1, -1))
    )


def _is_enclosed(grid: OccupancyGrid, cell: Cell) -> bool:
    """Return True where the unseen cells around one end at obstacles alone, near by."""
    margin = math.ceil(LARGEST_M / grid.resolution_m)
    window = grid.window(cell.row, cell.col, margin=margin)
    near = grid.crop(*window)
    _, parts = cv2.connectedComponents(near.unknown.astype(np.uint8), connectivity=4)
    own = parts == parts[cell.row - window[0].start, cell.col - window[1].start]
    if own[[0, -1]].any() or own[:, [0, -1]].any():
        return False
    around = cv2.dilate(own.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
    return not near.free[around > 0].any()


def _to_face_m(grid: OccupancyGrid, cell: Cell, down: int, across: int) -> float:
    """Return the metres to an obstacle behind unseen cells in a direction; infinite for none."""
    step_m = math.hypot(down, across) * grid.resolution_m
    for n in range(1, int(THICKEST_M / step_m) + 1):
        at = Cell(cell.row + n * down, cell.col + n * across)
        if not grid.contains(at) or grid.is_free(at):
            break
        if grid.is_occupied(at):
            return n * step_m
    return math.inf


def _clearance_at(grid: OccupancyGrid, point: Point) -> float:
    cell = grid.cell_at(point)
    if not grid.is_free(cell):
        return 0.0
    # Most goals have something near, and a small window is looked at in no time.
    near_m = _nearest_obstacle_m(grid, cell, NEAR_M)
    return near_m if math.isfinite(near_m) else _nearest_obstacle_m(grid, cell, CLEAR_M)


def _nearest_obstacle_m(grid: OccupancyGrid, cell: Cell, reach_m: float) -> float:
    """Return metres to the nearest obstacle within reach; infinite without one."""
    margin = math.ceil(reach_m / grid.resolution_m)
    down, across = grid.window(cell.row, cell.col, margin=margin)
    rows, cols = np.nonzero(grid.crop(down, across).occupied)
    off = np.hypot(rows - (cell.row - down.start), cols - (cell.col - across.start))
    off_m = float(off.min(initial=math.inf)) * grid.resolution_m
    # The corners of the square are farther than what lies beyond its sides.
    return off_m if off_m <= reach_m else math.inf


def say_refusal(name: str, check: GoalCheck) -> str:
    """Return why a place cannot be a goal, with its name if the sentence lacks it."""
    sentence = say_check(check)
    return sentence if name in sentence else f"{name}: {sentence}"


def say_instead(check: GoalCheck, *, has_heading: bool = False) -> tuple[str, NextStep]:
    """Return where the robot could drive instead of a refused goal, and the next step.

    Args:
        has_heading: The heading was asked for, so it is said too.
    """
    if check.areas and (check.verdict is GoalVerdict.UNREACHABLE or check.is_nearest_apart):
        return _say_wait(check.areas[0])
    near = check.nearest
    if near is None or check.is_nearest_apart:
        return "No place near it works either.", NextStep.CHOOSE_ON_MAP
    heading = f", yaw_deg={near.yaw_deg:.0f}" if has_heading else ""
    off_m = near.point.distance_to(check.goal.point)
    at = f"x={near.x:.2f}, y={near.y:.2f}{heading}, {off_m:.1f} m off"
    return f"The nearest pose that works is {at}.", NextStep.DRIVE_THERE


def _say_wait(area: ClosedArea) -> tuple[str, NextStep]:
    hint = f"Wait until {area.until}." if area.until else "It cannot be reached for now."
    return hint, NextStep.END_EVENT if area.event_id else NextStep.CHOOSE_ON_MAP


def say_check(check: GoalCheck) -> str:
    """Return what a check says of a goal, with numbers: the message where it is refused."""
    at = f"({check.goal.x:.2f}, {check.goal.y:.2f})"
    match check.verdict:
        case GoalVerdict.NOT_FINITE:
            at = f"({check.goal.x:g}, {check.goal.y:g})"
            said = f"{at} is not a valid goal: give x and y in metres."
        case GoalVerdict.OFF_MAP:
            said = f"{at} lies off the map{_say_bounds(check)}."
        case GoalVerdict.UNKNOWN:
            said = f"{at} lies in unexplored space."
        case GoalVerdict.OCCUPIED:
            said = f"{at} lies in a wall or an obstacle."
        case GoalVerdict.OK:
            said = f"{at} is {check.path_m:.1f} m away by path, {_say_clearance(check)}."
        case GoalVerdict.TOO_TIGHT:
            said = (
                f"{at} is {_say_clearance(check)}; the robot needs {check.radius_m:.2f} m "
                "around its centre."
            )
        case GoalVerdict.CLOSED:
            said = _say_closed(check, at)
        case GoalVerdict.UNREACHABLE:
            said = _say_unreachable(check, at)
    return said


def _say_bounds(check: GoalCheck) -> str:
    if check.bounds is None:
        return ""
    low, high = check.bounds
    if low.x <= check.goal.x <= high.x and low.y <= check.goal.y <= high.y:
        # Beside a map that is turned.
        return ""
    return f", which spans x {low.x:.1f} to {high.x:.1f}, y {low.y:.1f} to {high.y:.1f}"


def _say_clearance(check: GoalCheck) -> str:
    if math.isinf(check.clearance_m):
        return f"more than {CLEAR_M:.0f} m from any obstacle"
    return f"{check.clearance_m:.2f} m from the nearest obstacle"


def _say_closed(check: GoalCheck, at: str) -> str:
    area = check.areas[0]
    if check.is_robot_inside:
        event_id = area.event_id
        ended = f", or event {event_id} has to be ended where it is over" if event_id else ""
        return f"the robot itself stands in the {area.title}; a person has to lead it out{ended}."
    off_m = area.distance_to(check.goal.point)
    where = f"{off_m:.2f} m from" if off_m else "in"
    return f"{at} lies {where} the {area.title}."


def _say_unreachable(check: GoalCheck, at: str) -> str:
    if check.areas:
        titles = " and the ".join(area.title for area in check.areas)
        return f"every known way to {at} is closed; the shortest leads over the {titles}."
    return f"no known way as wide as the robot, {2 * check.radius_m:.2f} m, leads to {at}."
