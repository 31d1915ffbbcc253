"""Whether a record's room is that of its place, and its things are in it or behind its door."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby, pairwise

from mapspeak.geometry import Point
from mapspeak.semantic.consistency.findings import Finding, FindingKind
from mapspeak.semantic.quoting import quote_name
from mapspeak.semantic.things import Thing, Things
from mapspeak.semantic.waypoint import Waypoint
from mapspeak.spatial.rooms import Region, RoomMap

__all__ = ["check_rooms"]

DOOR_MARGIN_M = 0.6
"""A line of sight that is off by 10 degrees passes a door by so much at 3 m."""
_STEP_M = 0.2


def check_rooms(
    rooms: RoomMap,
    found: Things,
    waypoint: Waypoint,
    misfiled: Mapping[str, tuple[Region, Region]],
) -> Iterator[Finding]:
    """Gives what is odd about the room that a record names; one without a room has nothing.

    Args:
        rooms: As they are cut now.
        found: The things of the memory.
        waypoint: The record.
        misfiled: Of every record that is, by its name, the room that it names and its own.
    """
    if not waypoint.room_id:
        return
    if waypoint.name in misfiled:
        told, here = misfiled[waypoint.name]
        yield Finding(
            kind=FindingKind.WRONG_ROOM,
            sentence=f"{quote_name(waypoint.name)} is filed under {told.id}, but stands in "
            f"{here.id}.",
            waypoints=(waypoint.name,),
        )
        return
    start = rooms.find_region_at(waypoint.pose.point) or rooms.find_region(waypoint.room_id)
    for thing in found.seen_from(waypoint) if start is not None else ():
        way = _regions_on(rooms, waypoint, thing)
        if start is not None and not _sees_through(rooms, waypoint, thing, (start, *way)):
            yield Finding(
                kind=FindingKind.WRONG_ROOM,
                sentence=f"{quote_name(thing.label)} of {quote_name(waypoint.name)} lies in "
                f"{way[-1].id}, which no door on the line from {start.id} opens to.",
                waypoints=(waypoint.name,),
                label=thing.label,
                things=(thing,),
            )


def _regions_on(rooms: RoomMap, waypoint: Waypoint, thing: Thing) -> tuple[Region, ...]:
    """Gives the rooms on the line from a place to a thing: the thing itself may be in a wall."""
    assert thing.position is not None, "only what has a place has a room"  # noqa: S101 - our belief
    start, end = waypoint.pose.point, thing.position
    n_steps = max(math.ceil(start.distance_to(end) / _STEP_M), 1)
    shares = (step / n_steps for step in range(n_steps + 1))
    points = (
        Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
        for share in shares
    )
    passed = filter(None, map(rooms.find_region_at, points))
    return tuple(region for region, _ in groupby(passed))


def _sees_through(rooms: RoomMap, waypoint: Waypoint, thing: Thing, way: Sequence[Region]) -> bool:
    """True when a door on the line leads from each room on it to the next."""
    assert thing.position is not None, "only what has a place has a room"  # noqa: S101 - our belief
    start, end = waypoint.pose.point, thing.position
    return all(
        one.id == other.id
        or any(
            _off_line(start, end, door.place) <= door.width_m / 2 + DOOR_MARGIN_M
            for door in rooms.doors_between(one.id, other.id)
        )
        for one, other in pairwise(way)
    )


def _off_line(start: Point, end: Point, point: Point) -> float:
    """Gives the metres from a point to the line between two others."""
    length = max(start.distance_to(end), 1e-9)
    turn = start.bearing_to(point) - start.bearing_to(end)
    along = min(max(math.cos(turn) * start.distance_to(point), 0.0), length)
    share = along / length
    foot = Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
    return foot.distance_to(point)
