"""Crates that neither map nor memory knows: across doors, and in the middle of rooms."""

import math
from collections.abc import Sequence

import numpy as np

from mapspeak.evaluation.scores import TruePassage, GroundTruth
from mapspeak.geometry import Pose
from mapspeak.simulator import MeasuredRoom, WorldDoor, WorldObject
from mapspeak.spatial.grid import Mask

__all__ = ["away_from", "close_door", "find_doors_into_rooms", "find_spacious_rooms"]

CRATE = "crate"
CRATE_M = 0.8
"""How wide one is."""
DOOR_REACH_M = 1.0
"""How far from a door the middle of its passage may lie."""
ROOM_LEFT_RATIO = 0.5
"""A thing in the way leaves the robot at least so much of the room."""


def find_doors_into_rooms(site: GroundTruth) -> list[tuple[WorldDoor, MeasuredRoom]]:
    """Gives doors with a space that they lead into and that is not the only one on that side."""
    found = []
    map_from_world = site.world.start.inverse()
    for door in site.world.doors:
        middle = map_from_world.transform(door.pose.point)
        passage = min(site.passages, key=lambda each: each.middle.distance_to(middle), default=None)
        if passage is not None and passage.middle.distance_to(middle) <= DOOR_REACH_M:
            found += [(door, room) for room in _smaller_side(site, passage)]
    return found


def _smaller_side(site: GroundTruth, passage: TruePassage) -> list[MeasuredRoom]:
    rooms = [room for room in site.rooms if room.room.name in passage.spaces]
    return sorted(rooms, key=lambda room: room.outline_area_m2)[:1] if len(rooms) > 1 else []


def close_door(door: WorldDoor) -> tuple[WorldObject, ...]:
    """Gives crates side by side across a door."""
    n_crates = max(math.ceil((door.width_m - 0.1) / CRATE_M), 1)
    pitch_m = door.width_m / n_crates
    return tuple(
        _crate(number, door.pose @ Pose((number + 0.5) * pitch_m - door.width_m / 2, 0.0))
        for number in range(n_crates)
    )


def _crate(number: int, pose: Pose) -> WorldObject:
    return WorldObject(name=f"added crate {number + 1}", kind=CRATE, pose=pose)


def find_spacious_rooms(site: GroundTruth) -> list[tuple[MeasuredRoom, tuple[WorldObject, ...]]]:
    """Gives rooms in which a crate in the middle leaves enough to stand on, with that crate."""
    found: list[tuple[MeasuredRoom, tuple[WorldObject, ...]]] = []
    for room in site.rooms:
        middle = site.middle_of(room)
        crates = (_crate(0, site.in_world(Pose(middle.x, middle.y))),)
        before = site.cells_of(room) & site.floor.standable
        after = before & site.with_more(crates).floor.standable
        if after.sum() >= ROOM_LEFT_RATIO * before.sum() and len(site.rooms) > 1:
            found.append((room, crates))
    return found


def away_from(site: GroundTruth, things: Sequence[WorldObject]) -> Mask:
    """Gives the cells that are not near any of some things."""
    near = [site.near(site.place_of(thing), 2 * CRATE_M) for thing in things]
    return np.asarray(~np.logical_or.reduce(near))
