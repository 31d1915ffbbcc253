"""Whether a robot can have stood and seen what a record says, on the map as it is now."""

import math
from collections.abc import Iterator

from mapspeak.geometry import Point
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding
from mapspeak.memory.things import Things
from mapspeak.memory.things.sight import BODY_M, OWN_M
from mapspeak.memory.waypoint import Landmark, Waypoint
from mapspeak.spatial import FREE_MAX, UNKNOWN, OccupancyGrid
from mapspeak.spatial.paths import DistanceField

FARTHEST_M = 1e6


def check_pose(
    grid: OccupancyGrid, waypoint: Waypoint, distances: DistanceField | None, map_id: str | None
) -> Iterator[MemoryFinding]:
    """Return what is odd about where a waypoint is."""
    of, point = (waypoint.name,), waypoint.pose.point
    if waypoint.map_id is not None and map_id is not None and waypoint.map_id != map_id:
        ids = (waypoint.map_id, map_id)
        yield MemoryFinding(kind=FindingKind.OTHER_MAP, waypoints=of, ids=ids)
    ground = _ground_at(grid, point)
    if ground is not None:
        yield MemoryFinding(kind=ground, waypoints=of, at=point)
    elif distances is not None and not distances.is_reachable(point):
        radius_m = distances.radius_m
        yield MemoryFinding(kind=FindingKind.UNREACHABLE, waypoints=of, at=point, radius_m=radius_m)


def _ground_at(grid: OccupancyGrid, point: Point) -> FindingKind | None:
    """Return what is wrong with the cell at a point; None where it is free."""
    if max(abs(point.x), abs(point.y)) > FARTHEST_M:
        return FindingKind.OFF_MAP
    cell = grid.cell_at(point)
    if not grid.contains(cell):
        return FindingKind.OFF_MAP
    occupancy = int(grid.cells[cell.row, cell.col])
    if occupancy > FREE_MAX:
        return FindingKind.IN_OBSTACLE
    return FindingKind.IN_UNKNOWN if occupancy == UNKNOWN else None


N_SIGMAS = 2.0


def check_rays(found: Things, waypoint: Waypoint) -> Iterator[MemoryFinding]:
    """Return landmarks of a waypoint that lie behind a wall or where nobody has seen."""
    for stand in waypoint.standpoints:
        for landmark in stand.landmarks:
            if landmark.bearing_rad is not None:
                yield from _check(found, stand, landmark, landmark.bearing_rad)


def _check(
    found: Things, waypoint: Waypoint, landmark: Landmark, bearing_rad: float
) -> Iterator[MemoryFinding]:
    pose = waypoint.pose
    way = pose.yaw_rad + bearing_rad
    ahead = Point(pose.x + math.cos(way), pose.y + math.sin(way))
    open_m = found.open_m(waypoint, ahead)
    if open_m <= OWN_M:
        return  # It stands in an obstacle, which is another finding.
    if _ends_in_unknown(found, waypoint, way, open_m):
        if landmark.range_m is None or landmark.range_m > open_m:
            yield _landmark_finding(FindingKind.THROUGH_UNKNOWN, waypoint, landmark, open_m)
        return
    if landmark.range_m is None:
        return
    noise = found.sight.noise
    spread_m = noise.range_m + noise.range_ratio * landmark.range_m
    if landmark.range_m > _widest_m(found, waypoint, way) + BODY_M + N_SIGMAS * spread_m:
        yield _landmark_finding(FindingKind.BEHIND_WALL, waypoint, landmark, open_m)


def _widest_m(found: Things, waypoint: Waypoint, way: float) -> float:
    """Return how far one sees at most within the noise of a direction."""
    noise_rad = found.sight.noise.bearing_rad
    pose = waypoint.pose
    return max(
        found.open_m(waypoint, Point(pose.x + math.cos(turned), pose.y + math.sin(turned)))
        for turned in (way - noise_rad, way, way + noise_rad)
    )


def _ends_in_unknown(found: Things, waypoint: Waypoint, way: float, open_m: float) -> bool:
    grid = found.sight.grid
    if open_m >= found.sight.noise.reach_m:
        return False
    pose = waypoint.pose
    end = grid.cell_at(Point(pose.x + open_m * math.cos(way), pose.y + open_m * math.sin(way)))
    if not grid.contains(end):
        return True
    around = grid.cells[max(end.row - 1, 0) : end.row + 2, max(end.col - 1, 0) : end.col + 2]
    # A ray that grazes a wall may end in the unknown behind it.
    return int(grid.cells[end.row, end.col]) == UNKNOWN and not (around > FREE_MAX).any()


def _landmark_finding(
    kind: FindingKind, waypoint: Waypoint, landmark: Landmark, open_m: float
) -> MemoryFinding:
    return MemoryFinding(
        kind=kind,
        waypoints=(waypoint.name,),
        label=landmark.label,
        told_m=landmark.range_m,
        open_m=open_m,
    )
