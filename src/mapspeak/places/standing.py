"""Where and how a robot stands when it is sent to a place."""

import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.memory.things.approach import (
    COMFORT_M,
    OVERLOOK_FAR_M,
    OVERLOOK_M,
    find_overlook,
)
from mapspeak.places.goalcheck import FARTHEST_M
from mapspeak.spatial import Cell
from mapspeak.spatial.fieldofview import HALF_VIEW_RAD, floor_by_heading, heading_rad, is_in_sight
from mapspeak.spatial.frontiers.viewpoints import NARROW_COMFORT_M
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.rooms import Door, Region, RoomClass, RoomMap
from mapspeak.worldmodel.model import WorldModel, find_crossing
from mapspeak.worldmodel.remembered import RememberedThing
from mapspeak.worldmodel.revision import MapRevision

EVERY_M = 1.0
"""Places to look from are this far from each other."""
REDRAWN_M = 0.1
"""A map that is drawn anew has a wall, or its first unseen cell, up to so far off."""
BEFORE_M = 0.1
"""So near to the last floor before a thing nothing hides that."""


def stand_again(world: WorldModel, pose: Pose) -> Pose:
    """Return a remembered pose, or the nearest beside it that the robot gets to on this map."""
    if world.path_m(pose.point) is not None:
        return pose
    steps_m = np.linspace(-REDRAWN_M, REDRAWN_M, 5).tolist()
    beside = (Point(pose.x + x, pose.y + y) for x, y in itertools.product(steps_m, repeat=2))
    reached = (each for each in beside if world.path_m(each) is not None)
    nearest = min(reached, key=pose.point.distance_to, default=pose.point)
    return Pose(nearest.x, nearest.y, pose.yaw_rad)


def find_standing_point(world: WorldModel, region: Region) -> Point | None:
    """Find a reachable point of a region with room around it, near its middle, or None."""
    known = world.reach.standing
    if region.id not in known:
        known[region.id] = _search(world, world.map, region)
    return known[region.id]


def choose_standing_point(world: WorldModel, region: Region) -> Point:
    """Return where the robot stands in a region, or would if it got there.

    What is asked about a region out of reach is then answered for the way there, and not for
    furniture that happens to be in the middle of it.
    """
    known = world.reach.out_of_reach
    found = find_standing_point(world, region) or known.get(region.id)
    if found is None:
        opened = world.map.open
        found = None if opened is world.map else _search(world, opened, region)
        found = known[region.id] = found or _roomiest(world, opened, region)
    return found


def choose_crossing(world: WorldModel, door: Door) -> Point:
    """Return where the robot passes a door, or would if nothing was closed; else its middle."""
    found = world.find_crossing(door)
    if found is None and world.map.open is not world.map:
        opened = world.map.open.distances_from(world.robot.point)
        found = find_crossing(world.rooms, opened, door)
    return found or door.place


def reach_doors(world: WorldModel, doors: Iterable[Door]) -> list[tuple[float, Door, Point]]:
    """Return the doors that the robot passes, nearest first: metres to it, the door, and where."""
    crossings = ((door, world.find_crossing(door)) for door in doors)
    reached = [(world.path_m(at) or 0.0, door, at) for door, at in crossings if at is not None]
    return sorted(reached, key=lambda each: (each[0], each[1].id))


def _search(world: WorldModel, revision: MapRevision, region: Region) -> Point | None:
    """Find where to stand by the ways and the clearances of one state of the map."""
    middle = _middle_of(world, region)
    distances = revision.distances_from(world.robot.point)
    comfortable_m = world.radius_m + COMFORT_M
    cell = world.grid.cell_at(middle)
    is_roomy = revision.clearance_m[cell.row, cell.col] >= comfortable_m
    if is_roomy and distances.is_reachable(middle):
        return middle
    rows, cols = cells_of(world.rooms, region)
    distances_m = distances.distances_at(rows, cols)
    clear_m = revision.clearance_m[rows, cols]
    reachable = np.flatnonzero(np.isfinite(distances_m))
    if not reachable.size:
        return None
    enough_m = min(comfortable_m, float(clear_m[reachable].max()))
    reachable = reachable[clear_m[reachable] >= enough_m]
    points = world.grid.points_at(rows[reachable], cols[reachable])
    away_m = np.hypot(points[:, 0] - middle.x, points[:, 1] - middle.y)
    best = points[int(np.argmin(away_m))]
    return Point(float(best[0]), float(best[1]))


def _roomiest(world: WorldModel, revision: MapRevision, region: Region) -> Point:
    """Return the point of a region that is farthest from what stands in it."""
    rows, cols = cells_of(world.rooms, region)
    clear_m = np.where(world.grid.free[rows, cols], revision.clearance_m[rows, cols], -1.0)
    best = int(np.argmax(clear_m))
    return world.grid.point_at(Cell(int(rows[best]), int(cols[best])))


def cells_of(rooms: RoomMap, region: Region) -> tuple[IntArray, IntArray]:
    """Return the rows and the columns of a region's cells."""
    window = rooms.window_of(region)
    rows, cols = np.nonzero(rooms.labels[window] == region.index)
    return rows + window[0].start, cols + window[1].start


def point_ahead(point: Point, heading_rad: float, away_m: float) -> Point:
    """Return the point at a distance from another, in a direction."""
    return Pose(point.x, point.y, heading_rad).transform(Point(away_m, 0.0))


def point_along(points: Sequence[Point], away_m: float) -> Point:
    """Return the point so far along a line, or its end where it is shorter."""
    for start, end in itertools.pairwise(points):
        leg_m = start.distance_to(end)
        if leg_m >= away_m > 0:
            share = away_m / leg_m
            return Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
        away_m -= leg_m
    return points[-1]


def _middle_of(world: WorldModel, region: Region) -> Point:
    """Return the widest point of a room, and the middle of the walk along a corridor."""
    walk = world.map.walk_along(region) if region.room_class is RoomClass.CORRIDOR else None
    return region.widest if walk is None else walk.middle


def arrival_pose(world: WorldModel, point: Point) -> Pose:
    """Return the pose at a point in which the robot ends when it drives there straight on.

    It is the direction of the last stretch of the way, as long as the robot: a way over cells may
    end with a step aside, and the robot should not turn for that, nor for a way shorter than its
    radius.
    """
    is_near = abs(point.x) < FARTHEST_M and abs(point.y) < FARTHEST_M
    path = world.map.find_path_over(world.distances, point) if is_near else None
    if path is None or path.length_m < world.radius_m:
        return Pose(point.x, point.y, world.robot.yaw_rad)
    before = point_along(path.points[::-1], 2 * world.radius_m)
    return Pose(point.x, point.y, before.bearing_to(point))


def stand_before(world: WorldModel, remembered: RememberedThing) -> Pose:
    """Return the pose that faces a thing from near, else from where it is in sight.

    A thing that is not known well enough for that is looked for from where most of the places where
    it may be are in view; one that cannot be come near to, from the nearest place in sight of it.
    """
    near = find_overlook_of(world, remembered) or world.find_approach(remembered)
    near = near or find_stand_off(world, remembered)
    if near is not None:
        return near
    thing = remembered.thing
    records = map(world.recollection.find_place, thing.waypoints)
    poses = [record.waypoint.pose for record in records if record is not None]
    poses = poses or [Pose(view.place.x, view.place.y) for view in thing.supporting]
    if (at := thing.position) is not None:
        poses.sort(key=lambda pose: at.distance_to(pose.point))
    pose = next((pose for pose in poses if world.path_m(pose.point) is not None), poses[0])
    if thing.position is None or thing.position == pose.point:
        return pose
    return Pose(pose.x, pose.y, pose.point.bearing_to(thing.position))


def find_stand_off(world: WorldModel, remembered: RememberedThing) -> Pose | None:
    """Return the nearest place in sight of a thing; None where it was seen from none farther.

    The floor before it has to be in sight, on the side that it was seen from: a thing at a wall is
    as near to the room behind that.
    """
    target = remembered.thing.position
    if target is None:
        return None
    seen_m = min(
        (view.place.distance_to(target) for view in remembered.thing.supporting), default=math.inf
    )
    stands, _ = spread_places(world, around=target, reach_m=seen_m)
    away_m = np.hypot(stands[:, 0] - target.x, stands[:, 1] - target.y)
    fronts = set(world.find_fronts(remembered))
    for index in np.argsort(away_m, kind="stable")[: np.count_nonzero(away_m < seen_m)]:
        x, y = stands[index].tolist()
        stand = Point(x, y)
        if any(is_in_sight(world.grid, stand, front, own_m=BEFORE_M) for front in fronts):
            return Pose(x, y, stand.bearing_to(target))
    return None


def find_overlook_of(world: WorldModel, remembered: RememberedThing) -> Pose | None:
    """Return from where to look for a thing that may be anywhere in 2.5 m; None for others."""
    thing, known = remembered.thing, world.reach.overlooks
    if thing.whereabouts is None or (thing.uncertainty_m or 0.0) <= OVERLOOK_M:
        return None
    if remembered not in known:
        middle = Point(*np.median(thing.whereabouts, axis=0).tolist())
        stands, ways_m = spread_places(world, around=middle, reach_m=OVERLOOK_FAR_M)
        seen_from = [view.place for view in thing.supporting]
        sight = world.recollection.found.sight
        known[remembered] = find_overlook(sight, stands, ways_m, seen_from, thing.whereabouts)
    return known[remembered]


def spread_places(
    world: WorldModel,
    *,
    within: Mask | None = None,
    around: Point | None = None,
    reach_m: float = math.inf,
) -> tuple[FloatArray, FloatArray]:
    """Return places spread over the reachable floor, each where its square has most room.

    Args:
        within: Which floor matters, as a mask of the map; None where all does.
        around: Squares that are wholly farther from it than `reach_m` may be left out.

    Returns:
        The places, shape (n, 2), and how far the robot has to drive to each, in metres.
    """
    every = max(round(EVERY_M / world.grid.resolution_m), 1)
    down, across = slice(0, world.grid.n_rows), slice(0, world.grid.n_cols)
    if around is not None and math.isfinite(reach_m):
        down, across = (
            slice(near.start // every * every, -(-near.stop // every) * every)
            for near in world.grid.window_around(around, reach_m)
        )
    window = down, across
    counts = world.distances.reachable[window]
    counts = counts if within is None else counts & within[window]
    clear_m = np.where(counts, world.map.clearance_m[window], 0.0)
    rows, cols = np.nonzero(clear_m >= world.radius_m + NARROW_COMFORT_M)
    roomiest_first = np.argsort(-clear_m[rows, cols], kind="stable")
    rows, cols = rows[roomiest_first] + down.start, cols[roomiest_first] + across.start
    squares = (rows // every) * (world.grid.n_cols // every + 1) + cols // every
    _, first = np.unique(squares, return_index=True)
    points = world.grid.points_at(rows[first], cols[first])
    ways_m = world.distances.distances_at(rows[first], cols[first])
    is_reached = np.isfinite(ways_m)
    return points[is_reached], ways_m[is_reached]


def facing_in(world: WorldModel, region: Region, point: Point) -> float:
    """Return the heading, in radians, in which most of a region lies before a robot at a point."""
    floor = world.rooms.labels == region.index
    here = np.array([[point.x, point.y]])
    areas_m2 = floor_by_heading(world.grid, floor, here, HALF_VIEW_RAD)
    return heading_rad(int(areas_m2[0].argmax()))
