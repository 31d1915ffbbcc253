"""The laws of a fair world: what must hold for every task to have one right answer."""

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.simulator.robot.gridmap import CELL_SIZE_M
from mapspeak.simulator.truth import TrueFloor, is_in_sight
from mapspeak.simulator.worlds.slices import fill_outlines, slice_world
from mapspeak.simulator.worlds.world import BODY_RADIUS_M, TrueRoom, World, WorldObject
from mapspeak.spatial.paths import clearance_m
from mapspeak.spatial.rooms import RoomClass

__all__ = ["APART_RATIO", "APPROACH_M", "find_faults"]

Mask = NDArray[np.bool_]

APART_RATIO = 1.15
"""The smallest room and the next one, the largest and the next one, differ by this."""
APPROACH_M = 1.5
"""The robot can come so near to every thing, and see it from there."""
LOST_M2 = 0.05
"""Floor that the robot fits on and cannot reach, at most."""
LEAST_STAND_M2 = 0.5
"""In each room the robot can stand on so much at least."""
N_TRIED = 12
LOW_M, HIGH_M = 1.0, 2.5
"""As high as walls and things are compared."""
OVERLAP_M2 = 0.01
"""Two things may have so much of the plan in common: what is left when places are rounded."""


def find_faults(world: World) -> Iterator[str]:
    """Return a sentence for every law that a world breaks."""
    floor = TrueFloor(world)
    yield from _find_unclear_sizes(floor)
    insides = {room.name: _inside(world, floor, room) for room in world.rooms}
    yield from _find_lost_floor(floor, list(insides.values()))
    yield from _find_closed_rooms(floor, insides)
    yield from _find_hidden_things(world, floor)
    yield from _find_overlaps(world)


def _find_unclear_sizes(floor: TrueFloor) -> Iterator[str]:
    rooms = [room for room in floor.rooms if room.room.room_class is RoomClass.ROOM]
    if len(rooms) < 2:
        yield "There are fewer than two rooms."
        return
    by_free = sorted(rooms, key=lambda room: room.free_area_m2)
    by_outline = sorted(rooms, key=lambda room: room.outline_area_m2)
    for which, end, next_one in (("smallest", 0, 1), ("largest", -1, -2)):
        if by_free[end] is not by_outline[end]:
            yield f"Another room is the {which} when furniture counts."
        free = sorted((by_free[end].free_area_m2, by_free[next_one].free_area_m2))
        outline = sorted((by_outline[end].outline_area_m2, by_outline[next_one].outline_area_m2))
        if any(high < APART_RATIO * low for low, high in (free, outline)):
            yield f"Two rooms could be the {which}."


def _find_lost_floor(floor: TrueFloor, insides: Sequence[Mask]) -> Iterator[str]:
    fits = clearance_m(floor.solid) >= BODY_RADIUS_M + CELL_SIZE_M
    lost = fits & np.logical_or.reduce(insides) & ~floor.standable
    lost_m2 = float(lost.sum()) * CELL_SIZE_M**2
    if lost_m2 > LOST_M2:
        yield f"The robot cannot reach {lost_m2:.2f} m2 of floor on which it fits."


def _find_closed_rooms(floor: TrueFloor, insides: Mapping[str, Mask]) -> Iterator[str]:
    for name, inside in insides.items():
        if (inside & floor.standable).sum() * CELL_SIZE_M**2 < LEAST_STAND_M2:
            yield f"The robot cannot get into the {name}."


def _find_hidden_things(world: World, floor: TrueFloor) -> Iterator[str]:
    places = floor.solid.points_at(*np.nonzero(floor.standable))
    for thing in world.objects:
        at = world.start.inverse().transform(thing.pose.point)
        far_m = np.hypot(places[:, 0] - at.x, places[:, 1] - at.y)
        near = places[far_m <= APPROACH_M]
        # Some of them, from one side of the thing to the other.
        tried = near[:: max(len(near) // N_TRIED, 1)]
        stands = (world.start.transform(Point(float(x), float(y))) for x, y in tried)
        if not any(is_in_sight(world, stand, thing) for stand in stands):
            yield f"The {thing.name} cannot be seen from within {APPROACH_M} m."


def _find_overlaps(world: World) -> Iterator[str]:
    hulls = [(thing.name, _hull(world, thing)) for thing in world.objects]
    for (name, hull), (other, other_hull) in itertools.combinations(hulls, 2):
        is_far = (hull.min(axis=0) > other_hull.max(axis=0)).any() or (
            hull.max(axis=0) < other_hull.min(axis=0)
        ).any()
        if not is_far and cv2.intersectConvexConvex(hull, other_hull)[0] > OVERLAP_M2:
            yield f"The {name} and the {other} stand within each other."
    walls = slice_world(dataclasses.replace(world, objects=()), low_m=0.0, high_m=LOW_M)
    for outline in walls.outlines:
        for name, hull in hulls:
            wall = cv2.convexHull(outline.astype(np.float32))[:, 0, :]
            if cv2.intersectConvexConvex(hull, wall)[0] > OVERLAP_M2:
                yield f"The {name} stands in a wall."


def _hull(world: World, thing: WorldObject) -> NDArray[np.float32]:
    alone = dataclasses.replace(world, walls=(), objects=(thing,))
    outlines = slice_world(alone, low_m=0.0, high_m=HIGH_M).outlines
    return np.asarray(cv2.convexHull(np.concatenate(outlines).astype(np.float32))[:, 0, :])


def _inside(world: World, floor: TrueFloor, room: TrueRoom) -> Mask:
    corners = [world.start.inverse().transform(corner) for corner in room.outline]
    return fill_outlines(
        [np.array([(corner.x, corner.y) for corner in corners])],
        shape=(floor.solid.n_rows, floor.solid.n_cols),
        origin=floor.solid.origin.point,
        cell_size_m=CELL_SIZE_M,
    )
