"""Which records are filed under a room that is only called or cut otherwise by now.

Rooms are found anew as a map grows: one is cut in two, a border moves, and after a restart ids are
given out from the beginning. A record keeps the id that its room had then, and is right.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point
from mapspeak.semantic.consistency.poses import FARTHEST_M
from mapspeak.semantic.waypoint import Waypoint
from mapspeak.spatial.rooms import Region, RoomMap

__all__ = ["find_misfiled"]

BORDER_M = 1.0
"""A border that is found anew moves no farther, and a pose is off by some of that."""
DOOR_M = 1.5
"""What is wider is no door: the two regions may have been one."""
LEAST_OF_MANY = 3
"""From so many records on, most of which are off, it is the ids that are others."""


@dataclass(frozen=True, slots=True)
class _Filing:
    """A record with the room that it names and the one that it stands in."""

    waypoint: Waypoint
    told: Region
    here: Region

    @property
    def is_off(self) -> bool:
        return self.told.id != self.here.id


def find_misfiled(
    rooms: RoomMap, waypoints: Iterable[Waypoint]
) -> dict[str, tuple[Region, Region]]:
    """Gives the records whose room is another one: the room that they name, and where they stand.

    Args:
        rooms: As they are cut now.
        waypoints: All records, since together they tell whether ids have changed.
    """
    filed = [each for waypoint in waypoints for each in _file(rooms, waypoint)]
    off = [each for each in filed if each.is_off]
    if len(off) >= LEAST_OF_MANY and 2 * len(off) > len(filed):
        return {}
    moved = _find_moved(filed)
    return {
        each.waypoint.name: (each.told, each.here)
        for each in off
        if moved.get(each.told.id) != each.here.id and not _may_be_recut(rooms, each)
    }


def _file(rooms: RoomMap, waypoint: Waypoint) -> Iterable[_Filing]:
    told = rooms.find_region(waypoint.room_id) if waypoint.room_id else None
    point = waypoint.pose.point
    is_near = max(abs(point.x), abs(point.y)) < FARTHEST_M
    here = rooms.find_region_at(point) if is_near else None
    if told is not None and here is not None:
        yield _Filing(waypoint, told, here)


def _find_moved(filed: Iterable[_Filing]) -> dict[str, str]:
    """Gives the ids under which several records, and more than stand there, are in another room."""
    standing: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for each in filed:
        standing[each.told.id][each.here.id] += 1
    commonest = {told: count.most_common(1)[0] for told, count in standing.items()}
    return {
        told: here
        for told, (here, n) in commonest.items()
        if n > 1 and n > standing[told][told] and here != told
    }


def _may_be_recut(rooms: RoomMap, filing: _Filing) -> bool:
    """True where the border between both rooms is near, or is no more than a wide opening."""
    doors = rooms.doors_between(filing.told.id, filing.here.id)
    if any(door.width_m > DOOR_M for door in doors):
        return True
    return _distance_m(rooms, filing.told, filing.waypoint.pose.point) <= BORDER_M


def _distance_m(rooms: RoomMap, region: Region, point: Point) -> float:
    rows, cols = np.nonzero(rooms.labels == region.index)
    centres = rooms.grid.points_at(rows, cols)
    return float(np.hypot(centres[:, 0] - point.x, centres[:, 1] - point.y).min())
