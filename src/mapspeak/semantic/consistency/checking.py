"""All checks, in the order in which a reader wants them: the map, the places, the views, things."""

from mapspeak.semantic.consistency.company import check_company, check_duplicates
from mapspeak.semantic.consistency.filing import find_misfiled
from mapspeak.semantic.consistency.findings import Finding, FindingKind
from mapspeak.semantic.consistency.poses import check_pose
from mapspeak.semantic.consistency.rays import check_rays
from mapspeak.semantic.consistency.roomsides import check_rooms
from mapspeak.semantic.things import Things
from mapspeak.semantic.waypoint import SemanticMap
from mapspeak.spatial.paths import DistanceField
from mapspeak.spatial.rooms import RoomMap

__all__ = ["check_memory"]


def check_memory(
    places: SemanticMap,
    found: Things,
    *,
    distances: DistanceField | None = None,
    rooms: RoomMap | None = None,
    map_id: str | None = None,
) -> tuple[Finding, ...]:
    """Gives all that is odd about a memory, in the order of its places; the same every time.

    Args:
        places: The records.
        found: The things made of them, with the map.
        distances: From the robot, for whether it can get to a place; None leaves that out.
        rooms: Of that map; None leaves them out.
        map_id: The map that the robot is on; None takes the records for its.
    """
    findings: list[Finding] = []
    misfiled = find_misfiled(rooms, places.waypoints) if rooms else {}
    for waypoint in places.waypoints:
        findings += check_pose(found.sight.grid, waypoint, distances, map_id or places.map_id)
        if findings and findings[-1].kind is FindingKind.OFF_MAP:
            continue
        findings += check_rays(found, waypoint)
        findings += check_rooms(rooms, found, waypoint, misfiled) if rooms else []
    return (*findings, *check_duplicates(places.waypoints), *check_company(places, found))
