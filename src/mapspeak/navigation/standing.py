"""Where and how a robot stands when it is sent to a place."""

import math

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.navigation.atlas import Atlas, RememberedThing
from mapspeak.navigation.goals import FARTHEST_M
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms import Region, RoomClass

__all__ = ["arrival_pose", "facing_in", "find_standing_point", "stand_before"]

COMFORT_M = 0.15
"""How much more than its radius a robot should have around it where it is sent to stand."""
N_RAYS = 72
HALF_VIEW_RAD = math.radians(30)
"""What is seen at once: half the opening of a common camera."""


def find_standing_point(atlas: Atlas, region: Region) -> Point | None:
    """Finds a reachable point of a region with room around it, near its middle, or None."""
    known = atlas.reach.standing
    if region.id not in known:
        known[region.id] = _search_standing_point(atlas, region)
    return known[region.id]


def _search_standing_point(atlas: Atlas, region: Region) -> Point | None:
    middle = _middle_of(atlas, region)
    comfortable_m = atlas.radius_m + COMFORT_M
    cell = atlas.grid.cell_at(middle)
    is_roomy = atlas.map.clearance_m[cell.row, cell.col] >= comfortable_m
    if is_roomy and atlas.distances.is_reachable(middle):
        return middle
    window = atlas.rooms.window_of(region)
    rows, cols = np.nonzero(atlas.rooms.labels[window] == region.index)
    rows, cols = rows + window[0].start, cols + window[1].start
    distances_m = atlas.distances.distances_at(rows, cols)
    clear_m = atlas.map.clearance_m[rows, cols]
    reachable = np.flatnonzero(np.isfinite(distances_m))
    if not reachable.size:
        return None
    enough_m = min(comfortable_m, float(clear_m[reachable].max()))
    reachable = reachable[clear_m[reachable] >= enough_m]
    points = atlas.grid.points_at(rows[reachable], cols[reachable])
    away_m = np.hypot(points[:, 0] - middle.x, points[:, 1] - middle.y)
    best = points[int(np.argmin(away_m))]
    return Point(float(best[0]), float(best[1]))


def _middle_of(atlas: Atlas, region: Region) -> Point:
    """Gives the widest point of a room, and the middle of the walk along a corridor."""
    walk = atlas.map.walk_along(region) if region.room_class is RoomClass.CORRIDOR else None
    return region.widest if walk is None else walk.middle


def arrival_pose(atlas: Atlas, point: Point) -> Pose:
    """Gives the pose at a point in which the robot ends when it drives there straight on."""
    is_near = max(abs(point.x), abs(point.y)) < FARTHEST_M
    path = atlas.distances.path_to(point) if is_near else None
    if path is None or len(path.points) < 2 or path.length_m == 0.0:
        return Pose(point.x, point.y, atlas.robot.yaw_rad)
    before = next(
        (p for p in reversed(path.points[:-1]) if p.distance_to(point) > 0.05), path.points[0]
    )
    yaw_rad = before.bearing_to(point) if before != point else atlas.robot.yaw_rad
    return Pose(point.x, point.y, yaw_rad)


def stand_before(atlas: Atlas, remembered: RememberedThing) -> Pose:
    """Gives the pose that faces a thing from near, else one that it was seen from."""
    near = atlas.find_approach(remembered)
    if near is not None:
        return near
    thing = remembered.thing
    records = map(atlas.recollection.find_place, thing.waypoints)
    poses = [record.waypoint.pose for record in records if record is not None]
    pose = next((pose for pose in poses if atlas.path_m(pose.point) is not None), poses[0])
    if thing.position is None or thing.position == pose.point:
        return pose
    return Pose(pose.x, pose.y, pose.point.bearing_to(thing.position))


def facing_in(atlas: Atlas, region: Region, point: Point) -> float:
    """Gives the heading, in radians, in which most of a region lies before a robot at a point."""
    angles = np.linspace(0.0, math.tau, N_RAYS, endpoint=False)
    sights_m = _sights_in(atlas, region, point, angles)
    half = round(HALF_VIEW_RAD / (math.tau / N_RAYS))
    around = np.concatenate([sights_m[-half:], sights_m, sights_m[:half]])
    seen = np.convolve(around, np.ones(2 * half + 1), mode="valid")
    return math.remainder(float(angles[int(np.argmax(seen))]), math.tau)


def _sights_in(atlas: Atlas, region: Region, point: Point, angles: FloatArray) -> FloatArray:
    """Gives how far one sees over free floor of the region along each angle, in metres."""
    step_m = atlas.grid.resolution_m
    steps_m = np.arange(1, math.ceil(math.hypot(region.length_m, region.width_m) / step_m)) * step_m
    xs = point.x + np.outer(np.cos(angles), steps_m)
    ys = point.y + np.outer(np.sin(angles), steps_m)
    rows, cols = atlas.grid.cells_at(np.stack([xs.ravel(), ys.ravel()], axis=1))
    inside = (rows >= 0) & (rows < atlas.grid.n_rows) & (cols >= 0) & (cols < atlas.grid.n_cols)
    rows, cols = np.where(inside, rows, 0), np.where(inside, cols, 0)
    is_ours = (atlas.rooms.labels[rows, cols] == region.index) & atlas.grid.free[rows, cols]
    is_seen = np.logical_and.accumulate((inside & is_ours).reshape(xs.shape), axis=1)
    return np.asarray(is_seen.sum(axis=1) * step_m, dtype=np.float64)
