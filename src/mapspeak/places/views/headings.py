"""The heading in which the robot stops: where a picture shows what no other has shown."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.places.relations.choosing import CheckedGoal
from mapspeak.places.standing import COMFORT_M
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms import Region
from mapspeak.spatial.viewing import (
    N_RAYS,
    SIGHT_M,
    CameraView,
    find_half_view_rad,
    heading_of,
    look_all_around,
    mask_pictured,
    ray_at,
    sum_by_heading,
)
from mapspeak.worldmodel.model import WorldModel

BEYOND_M = 1.0
"""A ray that ends in the unknown meets a wall so much farther on."""
GOOD_RATIO = 0.9
"""A heading that shows this share of the best one's wall is as good: the least turn decides."""

LEAST_NEW_M = 0.5
"""Where no heading shows more new wall of a room, it is shown as a whole."""
MOVED_M = 1.0
"""A place farther from a goal is another one."""


Face = Callable[[WorldModel, Pose, Sequence[CameraView]], Pose]
"""Turns a pose to what a picture should show."""


def aim_for_picture(
    world: WorldModel, goal: CheckedGoal, views: Sequence[CameraView]
) -> CheckedGoal:
    """Turn the pose of a goal to where most wall is expected that no picture shows.

    A frontier stays in view, and a room is looked at, not out of: else the picture would not show
    what the drive is for.

    Args:
        views: The pictures so far, the latest last.
    """
    if isinstance(goal.place.thing, Region):
        pose = face_room(world, goal.pose, views)
        return replace(goal, pose=pose, check=replace(goal.check, goal=pose))
    half_rad = find_half_view_rad(views)
    within_rad = half_rad if isinstance(goal.place.thing, Frontier) else math.pi
    pose = face_new_walls(world, goal.pose, views, within_rad=within_rad)
    return replace(goal, pose=pose, check=replace(goal.check, goal=pose))


def face_new_walls(
    world: WorldModel, pose: Pose, views: Sequence[CameraView], *, within_rad: float = math.pi
) -> Pose:
    """Return a pose turned to where most wall is expected that no picture shows.

    Args:
        views: The pictures so far, the latest last.
        within_rad: The farthest it is turned.
    """
    half_rad = find_half_view_rad(views)
    return _turn_to_most(pose, _new_wall_m(world, pose, views, half_rad), within_rad)


def face_room(world: WorldModel, pose: Pose, views: Sequence[CameraView]) -> Pose:
    """Return a pose turned to most wall of its room that no picture shows, else to most wall.

    Args:
        views: The pictures so far, the latest last.
    """
    region = world.rooms.find_region_at(pose.point)
    if region is None:
        return face_new_walls(world, pose, views)
    half_rad = find_half_view_rad(views)
    new_m = _new_wall_m(world, pose, views, half_rad, region)
    if new_m.max() < LEAST_NEW_M:
        new_m = _new_wall_m(world, pose, (), half_rad, region)
    return _turn_to_most(pose, new_m, math.pi)


def _turn_to_most(pose: Pose, wall_m: FloatArray, within_rad: float) -> Pose:
    """Return a pose with the least turn to a heading that shows about the most wall."""
    turns_rad = np.array([abs(wrap_angle(heading_of(ray) - pose.yaw_rad)) for ray in range(N_RAYS)])
    wall_m = np.where(turns_rad <= within_rad, wall_m, 0.0)
    least_m = GOOD_RATIO * wall_m.max()
    if wall_m[ray_at(pose.yaw_rad)] >= least_m:
        return pose
    good = np.flatnonzero(wall_m >= least_m)
    return Pose(pose.x, pose.y, heading_of(int(good[np.argmin(turns_rad[good])])))


def find_room_near(world: WorldModel, goal: Point) -> Point | None:
    """Find the reachable place nearest to a goal where the robot has room around it.

    Returns:
        None where the goal is such a place itself, or none is near.
    """
    window = world.grid.window_around(goal, MOVED_M)
    top, left = window[0].start, window[1].start
    rows, cols = np.nonzero(world.map.clearance_m[window] >= world.radius_m + COMFORT_M)
    rows, cols = rows + top, cols + left
    is_reached = np.isfinite(world.distances.distances_at(rows, cols))
    points = world.grid.points_at(rows[is_reached], cols[is_reached])
    off_m = np.hypot(points[:, 0] - goal.x, points[:, 1] - goal.y)
    if not off_m.size or not world.grid.resolution_m < off_m.min() <= MOVED_M:
        return None
    x, y = points[int(off_m.argmin())].tolist()
    return Point(x, y)


def _new_wall_m(
    world: WorldModel,
    pose: Pose,
    views: Sequence[CameraView],
    half_rad: float,
    region: Region | None = None,
) -> FloatArray:
    """Return how much wall that no picture shows is to be expected in view, for each heading.

    Args:
        region: Only walls around it count; None for all.
    """
    near = [each for each in views if each.pose.point.distance_to(pose.point) <= 2 * SIGHT_M]
    around, shown = look_all_around(world.grid, pose.point), mask_pictured(world.grid, near)
    is_open = around.is_open
    if region is not None:
        is_outside = world.rooms.labels != region.index
        shown = shown | is_outside
        is_open = is_open & ~is_outside[world.grid.cells_at(around.ends_before(pose.point))]
    known_m = around.wall_m_by_heading(half_rad, but=shown)
    expected_m = np.where(is_open, (around.metres + BEYOND_M) * math.tau / N_RAYS, 0.0)
    return known_m + sum_by_heading(expected_m, half_rad)
