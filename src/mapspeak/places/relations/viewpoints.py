"""Viewpoints: where to look at a place from, which way to face, and what should be in view."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory.things.approach import COMFORT_M, FACED_M, LARGEST_OFF_M
from mapspeak.memory.things.labels import name_the_same
from mapspeak.places.goalcheck import check_goal
from mapspeak.places.naming import Place, Spot
from mapspeak.places.relations.choosing import CheckedGoal, check_place, choose_goal, find_place
from mapspeak.places.standing import choose_crossing, find_overlook_of, point_ahead, spread_places
from mapspeak.places.ways import stand_at
from mapspeak.spatial.fieldofview import (
    N_RAYS,
    SIGHT_M,
    CameraView,
    find_half_view_rad,
    floor_by_heading,
    heading_index,
    heading_of,
    heading_rad,
    is_in_sight,
    look_all_around,
    mask_pictured,
    ray_at,
    sum_by_heading,
)
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedThing

AWAY_M = 2.0
"""Preferred distance from which to look at a door or a point."""
FARTHEST_M = 4.0
GOOD_RATIO = 0.9
"""What shows this share of the best is as good: the nearest place, or the least turn, decides."""
PATH_WEIGHT = 0.1
"""A metre of path costs as much as this many metres off the best distance."""
OWN_DOOR_M = 0.3
OWN_THING_M = 0.6
THERE_M = 0.25
THERE_RAD = math.radians(12.0)
BEYOND_M = 1.0
"""A ray that ends in the unknown meets a wall so much farther on."""
LEAST_NEW_M = 0.5
"""Where no heading shows more new wall of a room, it is shown as a whole."""
NEARER_M = 0.6
"""A picture from so much nearer may miss what hangs high."""
MOVED_M = 1.0
"""A place farther from a goal is another one."""
Face = Callable[[WorldModel, Pose, Sequence[CameraView]], Pose]
"""Turns a pose to what a picture should show."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """Something that should be in a picture.

    Attributes:
        id: D4, T2.
        label: What a remembered thing is; empty for a door.
        bearing_rad: From the heading of the picture, left positive.
    """

    id: str
    label: str
    bearing_rad: float
    range_m: float

    def column_px(self, width_px: int, half_view_rad: float) -> float:
        """Return where it is in a picture, from the left edge; the lens is a pinhole."""
        half_px = width_px / 2
        return half_px - half_px / math.tan(half_view_rad) * math.tan(self.bearing_rad)


def choose_view(world: WorldModel, words: str, half_view_rad: float) -> CheckedGoal:
    """Return the place that is meant, with the pose from which a picture shows most of it.

    Raises:
        GoalError: There is no such place, or the robot cannot drive to where it is in view.
    """
    place = find_place(world, words)
    pose = find_viewpoint(world, place, half_view_rad)
    if isinstance(place.thing, RememberedThing):
        there = stand_at(world, place) if pose is None else pose
        if _shows_as_well(world, place, there, half_view_rad):
            return replace(check_place(world, place), pose=world.robot)
    if pose is None:
        return choose_goal(world, place=words, x=None, y=None, yaw_deg=None)
    check = check_goal(world.grid, world.distances, pose, opened=world.map.open.distances_from)
    return CheckedGoal(place, pose, check)


def _shows_as_well(world: WorldModel, place: Place, there: Pose, half_view_rad: float) -> bool:
    """Return True where the robot has a thing as near and as well in view as from a pose."""
    here = world.robot
    shown, best = (measure_shown(world, place, pose, half_view_rad) for pose in (here, there))
    if not shown or best is None:
        return False
    near_m = max(place.point.distance_to(there.point), FACED_M)
    is_near = place.point.distance_to(here.point) <= near_m
    return is_near and shown >= GOOD_RATIO * best and not is_missed_from_near(world, place)


def is_missed_from_near(world: WorldModel, place: Place) -> bool:
    """Return True where the latest picture from nearer than a thing was seen does not show it.

    By the robot's detector, from where the robot stands: the thing may hang above the picture.
    """
    here, remembered = world.robot, place.thing
    if not isinstance(remembered, RememberedThing):
        return False
    there = _look_from(world, remembered)
    if there is None:
        return False
    there_m, here_m = (place.point.distance_to(pose.point) for pose in (there, here))
    from_here = (
        each.reported
        for each in reversed(world.pictures)
        if each.reported is not None and is_there(each.pose, here)
    )
    shown, label = next(from_here, None), remembered.thing.label
    is_missed = shown is not None and not any(name_the_same(label, each) for each in shown)
    return is_missed and here_m < there_m - NEARER_M


def is_there(robot: Pose, pose: Pose) -> bool:
    """Return True for a robot that stands in a pose, as nearly as navigation brings it there."""
    return robot.is_near(pose, off_m=THERE_M, turn_rad=THERE_RAD)


def find_viewpoint(world: WorldModel, place: Place, half_view_rad: float) -> Pose | None:
    """Find the pose from which a picture shows most of a room, or a door or a point from near.

    Other places have a pose of their own.
    """
    match place.thing:
        case Region() as region:
            return _overlook(world, region, half_view_rad)
        case Door() as door:
            return _stand_off(world, choose_crossing(world, door))
        case Spot(point=point, yaw_rad=None):
            return _stand_off(world, point)
        case RememberedThing() as remembered:
            return _look_from(world, remembered)
        case _:
            return None


def _look_from(world: WorldModel, remembered: RememberedThing) -> Pose | None:
    """Find where to look at a thing from: no nearer than it was seen from, up to two metres.

    What hangs high is in no picture from before it, and how high it hangs nobody noted.
    """
    thing = remembered.thing
    if thing.position is None or find_overlook_of(world, remembered) is not None:
        return None
    seen_m = min((view.place.distance_to(thing.position) for view in thing.supporting), default=0.0)
    if seen_m <= LARGEST_OFF_M:
        return None
    return world.find_approach(remembered, off_m=min(seen_m, AWAY_M))


def measure_shown(
    world: WorldModel, place: Place, pose: Pose, half_view_rad: float
) -> float | None:
    """Return the share of a place that a picture shows.

    Of a room it is that of its floor; of a thing, that of the places where it may be; of a door or
    a point 1 or 0. None for other places.
    """
    match place.thing:
        case Region() as region:
            floor = world.rooms.labels == region.index
            here = np.array([[pose.x, pose.y]])
            shown_m2 = floor_by_heading(world.grid, floor, here, half_view_rad)
            n_cells = int(np.count_nonzero(floor & world.grid.free))
            whole_m2 = max(n_cells, 1) * world.grid.resolution_m * world.grid.resolution_m
            return min(float(shown_m2[0, heading_index(pose.yaw_rad)]) / whole_m2, 1.0)
        case RememberedThing() as remembered if remembered.thing.position is not None:
            whereabouts = remembered.thing.whereabouts
            if whereabouts is None:
                whereabouts = np.array([[remembered.thing.position.x, remembered.thing.position.y]])
            shown = [
                _shows(world, pose, Point(x, y), half_view_rad, own_m=OWN_THING_M)
                for x, y in whereabouts.tolist()
            ]
            return sum(shown) / len(shown)
        case Door(place=point) | Spot(point=point):
            return float(_shows(world, pose, point, half_view_rad, own_m=OWN_DOOR_M))
        case _:
            return None


def find_sights(world: WorldModel, pose: Pose, half_view_rad: float) -> tuple[Sight, ...]:
    """Find the doors and the remembered things that a picture should show, from left to right."""
    candidates = [*_list_candidates(world, pose)]
    sights = [
        Sight(
            id=name,
            label=label,
            bearing_rad=wrap_angle(pose.point.bearing_to(point) - pose.yaw_rad),
            range_m=pose.point.distance_to(point),
        )
        for name, label, point, own_m in candidates
        if _shows(world, pose, point, half_view_rad, own_m=own_m)
    ]
    return tuple(sorted(sights, key=lambda each: -each.bearing_rad))


def _list_candidates(world: WorldModel, pose: Pose) -> Iterator[tuple[str, str, Point, float]]:
    for door in world.rooms.doors:
        yield door.id, "", door.place, OWN_DOOR_M
    for remembered in world.things:
        point = remembered.thing.position
        if point is not None and _is_on_this_side(world, remembered, pose, point):
            yield remembered.id, remembered.thing.label, point, OWN_THING_M


def _is_on_this_side(
    world: WorldModel, remembered: RememberedThing, pose: Pose, point: Point
) -> bool:
    """Return False for a thing at a wall whose other side it was seen from."""
    before = world.rooms_before(remembered)
    front = point_ahead(point, point.bearing_to(pose.point), OWN_THING_M)
    room = world.find_room_id(front)
    return room is None or not before or room in before


def _shows(
    world: WorldModel, pose: Pose, point: Point, half_view_rad: float, *, own_m: float
) -> bool:
    off_rad = abs(wrap_angle(pose.point.bearing_to(point) - pose.yaw_rad))
    is_ahead = off_rad <= half_view_rad
    return is_ahead and is_in_sight(world.grid, pose.point, point, own_m=own_m)


def _overlook(world: WorldModel, region: Region, half_view_rad: float) -> Pose | None:
    """Find the pose in a region from which most of its floor is in view."""
    floor = world.rooms.labels == region.index
    points, ways_m = spread_places(world, within=floor)
    if not len(points):
        return None
    shown_m2 = floor_by_heading(world.grid, floor, points, half_view_rad)
    best_m2 = shown_m2.max(axis=1)
    good = np.flatnonzero(best_m2 >= GOOD_RATIO * best_m2.max())
    chosen = int(good[ways_m[good].argmin()])
    x, y = points[chosen].tolist()
    return Pose(x, y, heading_rad(int(shown_m2[chosen].argmax())))


def _stand_off(world: WorldModel, target: Point) -> Pose | None:
    """Find the pose from which a point is in view from about two metres."""
    points, ways_m = spread_places(world)
    away_m = np.hypot(points[:, 0] - target.x, points[:, 1] - target.y)
    costs_m = np.abs(away_m - AWAY_M) + PATH_WEIGHT * ways_m
    for index in np.argsort(np.where(away_m <= FARTHEST_M, costs_m, math.inf), kind="stable"):
        if away_m[index] > min(FARTHEST_M, SIGHT_M):
            return None
        point = Point(*points[index].tolist())
        if is_in_sight(world.grid, point, target, own_m=OWN_DOOR_M):
            return Pose(point.x, point.y, point.bearing_to(target))
    return None


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
