"""Whether a robot can have stood where a record says, on the map as it is now."""

from collections.abc import Iterator

from mapspeak.geometry import Point
from mapspeak.semantic.consistency.findings import Finding, FindingKind
from mapspeak.semantic.quoting import quote_name
from mapspeak.semantic.waypoint import Waypoint
from mapspeak.spatial import FREE_MAX, UNKNOWN, OccupancyGrid
from mapspeak.spatial.paths import DistanceField

__all__ = ["check_pose"]

FARTHEST_M = 1e6


def check_pose(
    grid: OccupancyGrid, waypoint: Waypoint, distances: DistanceField | None, map_id: str | None
) -> Iterator[Finding]:
    """Gives what is odd about where a waypoint is."""
    if None not in (map_id, waypoint.map_id) and waypoint.map_id != map_id:
        of, on = quote_name(waypoint.map_id or ""), quote_name(map_id or "")
        sentence = f"belongs to the map {of}, but the robot is on {on}"
        yield _finding(FindingKind.OTHER_MAP, waypoint, sentence)
    point = waypoint.pose.point
    ground = _ground_at(grid, point)
    if ground is not None:
        yield _finding(*_say_ground(ground, waypoint, point))
    elif distances is not None and not distances.is_reachable(point):
        sentence = (
            f"stands at {_say(point)}, where a robot of {distances.radius_m:.2f} m radius cannot "
            "get to now"
        )
        yield _finding(FindingKind.UNREACHABLE, waypoint, sentence)


def _ground_at(grid: OccupancyGrid, point: Point) -> FindingKind | None:
    """Gives what is wrong with the cell at a point; None where it is free."""
    if max(abs(point.x), abs(point.y)) > FARTHEST_M:
        return FindingKind.OFF_MAP
    cell = grid.cell_at(point)
    if not grid.contains(cell):
        return FindingKind.OFF_MAP
    occupancy = int(grid.cells[cell.row, cell.col])
    if occupancy > FREE_MAX:
        return FindingKind.IN_OBSTACLE
    return FindingKind.IN_UNKNOWN if occupancy == UNKNOWN else None


def _say_ground(
    kind: FindingKind, waypoint: Waypoint, point: Point
) -> tuple[FindingKind, Waypoint, str]:
    said = {
        FindingKind.OFF_MAP: f"stands at {_say(point)}, off the map",
        FindingKind.IN_OBSTACLE: f"stands at {_say(point)}, where the map has an obstacle now",
        FindingKind.IN_UNKNOWN: f"stands at {_say(point)}, where nobody has seen the floor",
    }
    return kind, waypoint, said[kind]


def _finding(kind: FindingKind, waypoint: Waypoint, what: str) -> Finding:
    sentence = f"{quote_name(waypoint.name)} {what}."
    return Finding(kind=kind, sentence=sentence, waypoints=(waypoint.name,))


def _say(point: Point) -> str:
    is_near = max(abs(point.x), abs(point.y)) < FARTHEST_M
    return f"({point.x:.2f}, {point.y:.2f})" if is_near else f"({point.x:g}, {point.y:g})"
