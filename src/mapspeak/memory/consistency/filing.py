"""Whether the room that a record names is the one it stands in, and shows what it names."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import groupby, pairwise

import numpy as np

from mapspeak.geometry import Point
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding
from mapspeak.memory.things.thing import Thing
from mapspeak.memory.waypoint import Waypoint
from mapspeak.spatial.rooms import Region, RoomMap

FARTHEST_M = 1e6
"""No map reaches as far: a position beyond it is none."""
BORDER_M = 1.0
"""A border found again moves by at most this; it covers pose errors too."""
DOOR_M = 1.5
"""Wider openings are not doors: the two regions may have been one."""
LEAST_OF_MANY = 3
"""If most of at least this many records are misfiled, the ids have changed instead."""


def find_misfiled(
    rooms: RoomMap, waypoints: Iterable[Waypoint]
) -> dict[str, tuple[Region, Region]]:
    """Return for each misfiled record the room that it names and the room that it stands in.

    Args:
        waypoints: All records, as only together they show whether ids have changed.
    """
    filed = [(each, *filing) for each in waypoints if (filing := file_of(rooms, each)) is not None]
    off = [each for each in filed if each[1].id != each[2].id]
    if len(off) >= LEAST_OF_MANY and 2 * len(off) > len(filed):
        return {}
    moved = _find_moved((told.id, here.id) for _, told, here in filed)
    return {
        waypoint.name: (told, here)
        for waypoint, told, here in off
        if moved.get(told.id) != here.id
        # The border between both rooms may be found anew where it is near or a wide opening.
        and not any(door.width_m > DOOR_M for door in rooms.doors_between(told.id, here.id))
        and _distance_m(rooms, told, waypoint.pose.point) > BORDER_M
    }


def file_of(rooms: RoomMap, waypoint: Waypoint) -> tuple[Region, Region] | None:
    """Return the room that a record names and the one it stands in; None where it is not known."""
    if not waypoint.room_id:
        return None
    told, point = rooms.find_region(waypoint.room_id), waypoint.pose.point
    is_near = max(abs(point.x), abs(point.y)) < FARTHEST_M
    here = rooms.find_region_at(point) if is_near else None
    return None if told is None or here is None else (told, here)


def _find_moved(filed: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Return the ids that moved: several records, and more than stayed, are in one other room."""
    standing: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for told, here in filed:
        standing[told][here] += 1
    commonest = {told: count.most_common(1)[0] for told, count in standing.items()}
    return {
        told: here
        for told, (here, n) in commonest.items()
        if n > 1 and n > standing[told][told] and here != told
    }


def _distance_m(rooms: RoomMap, region: Region, point: Point) -> float:
    rows, cols = np.nonzero(rooms.labels == region.index)
    centres = rooms.grid.points_at(rows, cols)
    return float(np.hypot(centres[:, 0] - point.x, centres[:, 1] - point.y).min())


DOOR_MARGIN_M = 0.6
"""A line of sight with an error of 10 degrees misses a door by about this much at 3 m."""
_STEP_M = 0.2


def check_rooms(
    rooms: RoomMap,
    waypoint: Waypoint,
    seen: Iterable[Thing],
    misfiled: Mapping[str, tuple[Region, Region]],
) -> Iterator[MemoryFinding]:
    """Return findings about the room that a record names; none for a record without a room.

    Args:
        seen: The things with a position that were seen from it.
        misfiled: By name of each misfiled record, the room that it names and its own.
    """
    if not waypoint.room_id:
        return
    if waypoint.name in misfiled:
        told, here = misfiled[waypoint.name]
        yield MemoryFinding(
            kind=FindingKind.WRONG_ROOM,
            waypoints=(waypoint.name,),
            ids=(told.id, here.id),
        )
        return
    filed = rooms.find_region(waypoint.room_id)
    for thing in seen:
        places = [view.place for view in thing.supporting if view.waypoint == waypoint.name]
        starts = [rooms.find_region_at(each) or filed for each in places]
        is_shown = any(map(partial(_is_shown, rooms, thing), places, starts))
        if starts[0] is not None and not is_shown:
            own = _regions_on(rooms, places[0], thing, back_m=0.0)[-1]
            yield MemoryFinding(
                kind=FindingKind.WRONG_ROOM,
                waypoints=(waypoint.name,),
                label=thing.label,
                things=(thing,),
                ids=(own.id, starts[0].id),
            )


def _is_shown(rooms: RoomMap, thing: Thing, place: Point, start: Region | None) -> bool:
    """Return True when doors lead along the line from a place to a thing, or nothing is known."""
    if start is None:
        return True
    way = _regions_on(rooms, place, thing, back_m=thing.uncertainty_m or 0.0)
    return _sees_through(rooms, place, thing, (start, *way))


def _regions_on(rooms: RoomMap, start: Point, thing: Thing, *, back_m: float) -> tuple[Region, ...]:
    """Return the rooms on the line from a place to a thing, up to a distance before the thing."""
    assert thing.position is not None, "only what has a place has a room"  # noqa: S101 - our belief
    end = thing.position
    far_m = start.distance_to(end)
    near_ratio = max(1.0 - back_m / max(far_m, 1e-9), 0.0)
    n_steps = max(math.ceil(near_ratio * far_m / _STEP_M), 1)
    shares = (near_ratio * step / n_steps for step in range(n_steps + 1))
    points = (
        Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
        for share in shares
    )
    passed = filter(None, map(rooms.find_region_at, points))
    return tuple(region for region, _ in groupby(passed))


def _sees_through(rooms: RoomMap, start: Point, thing: Thing, way: Sequence[Region]) -> bool:
    """Return True when a door on the line leads from each room on it to the next."""
    assert thing.position is not None, "only what has a place has a room"  # noqa: S101 - our belief
    end = thing.position
    return all(
        one.id == other.id
        or any(
            _off_line(start, end, door.place) <= door.width_m / 2 + DOOR_MARGIN_M
            for door in rooms.doors_between(one.id, other.id)
        )
        for one, other in pairwise(way)
    )


def _off_line(start: Point, end: Point, point: Point) -> float:
    length = max(start.distance_to(end), 1e-9)
    turn = start.bearing_to(point) - start.bearing_to(end)
    along = min(max(math.cos(turn) * start.distance_to(point), 0.0), length)
    share = along / length
    foot = Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
    return foot.distance_to(point)
