"""Exploring with the camera: which walls no picture shows yet, and from where to take one."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from mapspeak.driving.exploration.trips import Target
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.places.standing import spread_places
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.viewing import (
    CameraView,
    find_half_view_rad,
    heading_rad,
    mask_pictured,
    measure_pictured,
    new_wall_by_heading,
    sum_by_heading,
)
from mapspeak.worldmodel.model import WorldModel

TURN_WORTH_M = 1.0
"""So much new wall in one picture is worth a turn where the robot stands."""
DRIVE_WORTH_M = 1.0
"""So much new wall all around a place is worth a drive there."""
STOP_M = 1.0
"""What a stop costs beside the way to it."""
NEAR_FIRST = 1.5
"""Above 1, what is near comes before what shows more: it would else be returned to."""
DETOUR_M = 2.0
"""What is farther off the way to a frontier waits until later."""
APART_M = 1.0
APART_RAD = math.radians(25.0)


def is_view_due(robot: Pose, views: Sequence[CameraView]) -> bool:
    """Return True when a robot on its way has moved on from where the last picture was taken."""
    if not views:
        return True
    last = views[-1].pose
    is_apart = robot.point.distance_to(last.point) >= APART_M
    return is_apart or abs(wrap_angle(robot.yaw_rad - last.yaw_rad)) >= APART_RAD


def find_camera_target(
    world: WorldModel,
    views: Sequence[CameraView],
    frontier: Frontier | None,
    *,
    is_closed: Callable[[Point], bool],
) -> Target | None:
    """Find the pose to take the next picture in; None where the frontier comes first.

    First comes what can be seen by a turn in place, then most new wall for the way.

    Args:
        views: The pictures so far, the latest last.
        frontier: Where the exploration would go next.
        is_closed: Whether a drive to a place has just failed.
    """
    shown = mask_pictured(world.grid, views)
    half_rad = find_half_view_rad(views)
    here = world.robot.point
    around_m = new_wall_by_heading(world.grid, shown, np.array([[here.x, here.y]]))[0]
    if sum_by_heading(around_m, half_rad).max() >= TURN_WORTH_M and not is_closed(here):
        return _target(here, around_m, half_rad)
    points, ways_m = spread_places(world)
    if frontier is not None:
        # What lies on the way to the frontier, or hardly beside it.
        goal = frontier.pose.point
        on_m = np.hypot(points[:, 0] - goal.x, points[:, 1] - goal.y)
        ways_m = np.maximum(ways_m + on_m - frontier.distance_m, 0.0)
        is_beside = ways_m <= DETOUR_M
        points, ways_m = points[is_beside], ways_m[is_beside]
    new_m = new_wall_by_heading(world.grid, shown, points)
    total_m = new_m.sum(axis=1)
    rates = np.where(total_m >= DRIVE_WORTH_M, total_m / (ways_m + STOP_M) ** NEAR_FIRST, 0.0)
    for index in np.argsort(-rates, kind="stable")[: np.count_nonzero(rates)]:
        point = Point(*points[index].tolist())
        if not is_closed(point):
            return _target(point, new_m[index], half_rad)
    return None


def measure_pictured_on(world: WorldModel, views: Sequence[CameraView]) -> float:
    """Return the share that pictures show of the walls in sight of the floor in reach."""
    points, _ = spread_places(world)
    return measure_pictured(world.grid, mask_pictured(world.grid, views), points)


def _target(point: Point, by_heading_m: FloatArray, half_rad: float) -> Target:
    yaw_rad = heading_rad(int(sum_by_heading(by_heading_m, half_rad).argmax()))
    return Target(id=f"({point.x:.1f}, {point.y:.1f})", pose=Pose(point.x, point.y, yaw_rad))
