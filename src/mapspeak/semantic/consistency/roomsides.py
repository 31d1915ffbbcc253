"""Whether a record's room is that of its place, and its things are in it or behind its door."""

import math
from collections.abc import Iterator

from mapspeak.geometry import Point
from mapspeak.semantic.consistency.findings import Finding, FindingKind
from mapspeak.semantic.things import Thing, Things
from mapspeak.semantic.waypoint import Waypoint
from mapspeak.spatial.rooms import Region, RoomMap

__all__ = ["check_rooms"]

DOOR_MARGIN_M = 0.6
"""A line of sight that is off by 10 degrees passes a door by so much at 3 m."""
_STEP_M = 0.2


def check_rooms(rooms: RoomMap, found: Things, waypoint: Waypoint) -> Iterator[Finding]:
    """Gives what is odd about the room that a record names; one without a room has nothing."""
    told = rooms.find_region(waypoint.room_id) if waypoint.room_id else None
    if told is None:
        return
    here = rooms.find_region_at(waypoint.pose.point)
    if here is not None and here.id != told.id:
        yield Finding(
            kind=FindingKind.WRONG_ROOM,
            sentence=f"'{waypoint.name}' is filed under {told.id}, but stands in {here.id}.",
            waypoints=(waypoint.name,),
        )
        return
    for thing in found.seen_from(waypoint):
        room = _room_of(rooms, waypoint, thing)
        if (
            room is not None
            and room.id != told.id
            and not _sees_through(rooms, waypoint, thing, (told.id, room.id))
        ):
            yield Finding(
                kind=FindingKind.WRONG_ROOM,
                sentence=f"'{thing.label}' of '{waypoint.name}' lies in {room.id}, which no door "
                f"on the line from {told.id} opens to.",
                waypoints=(waypoint.name,),
                label=thing.label,
                things=(thing,),
            )


def _room_of(rooms: RoomMap, waypoint: Waypoint, thing: Thing) -> Region | None:
    """Gives the room before a thing, as seen from a place: the thing itself may be in a wall."""
    assert thing.position is not None, "only what has a place has a room"  # noqa: S101 - our belief
    start, end = waypoint.pose.point, thing.position
    far_m = start.distance_to(end)
    for back_m in (_STEP_M * i for i in range(max(math.floor(far_m / _STEP_M), 1))):
        share = 1 - back_m / max(far_m, _STEP_M)
        point = Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
        region = rooms.find_region_at(point)
        if region is not None:
            return region
    return None


def _sees_through(rooms: RoomMap, waypoint: Waypoint, thing: Thing, pair: tuple[str, str]) -> bool:
    """True when a door of two rooms lies on the line from a place to a thing."""
    assert thing.position is not None, "only what has a place has a room"  # noqa: S101 - our belief
    start, end = waypoint.pose.point, thing.position
    return any(
        _off_line(start, end, door.place) <= door.width_m / 2 + DOOR_MARGIN_M
        for door in rooms.doors_between(*pair)
    )


def _off_line(start: Point, end: Point, point: Point) -> float:
    """Gives the metres from a point to the line between two others."""
    length = max(start.distance_to(end), 1e-9)
    turn = start.bearing_to(point) - start.bearing_to(end)
    along = min(max(math.cos(turn) * start.distance_to(point), 0.0), length)
    share = along / length
    foot = Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
    return foot.distance_to(point)
