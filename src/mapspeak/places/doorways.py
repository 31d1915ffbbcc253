"""Doorways: which way each leads, its two sides, and where to stand before it."""

import math

import numpy as np

from mapspeak.geometry import Point
from mapspeak.places.standing import point_ahead
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel

AROUND_DOOR_M = 0.6
"""Floor within this distance on both sides of a door tells which way it leads."""


def find_normal(world: WorldModel, door: Door, side: Region) -> float:
    """Return the direction in which a door leads into one of its two regions, as a yaw.

    It is at right angles to the line through its two posts where the floor near it shows no other.
    """
    reach_m = door.width_m / 2 + AROUND_DOOR_M
    offsets, labels = offsets_around(world, world.rooms.labels, door.place, reach_m)
    is_near = np.hypot(*offsets.T) <= reach_m
    middles = []
    for region in (side, other_side(world, door, side)):
        near = offsets[is_near & (labels == region.index)]
        middles.append(near.mean(axis=0) if len(near) else np.zeros(2))
    into = middles[0] - middles[1]
    return _squared(world, door, math.atan2(float(into[1]), float(into[0])))


def _squared(world: WorldModel, door: Door, rough_rad: float) -> float:
    """Turn a direction through a door until the posts beside it lie square to it."""
    reach_m = door.width_m / 2 + AROUND_DOOR_M
    points, _ = offsets_around(world, world.grid.occupied, door.place, reach_m)
    across = np.array([-math.sin(rough_rad), math.cos(rough_rad)])
    posts = []
    for sign in (1.0, -1.0):
        beside = points[(points @ (sign * across)) > 0.5 * np.hypot(*points.T)]
        if not len(beside):
            return rough_rad
        posts.append(beside[int(np.argmin(np.hypot(*beside.T)))])
    line = posts[0] - posts[1]
    square_rad = math.atan2(float(line[1]), float(line[0])) - math.pi / 2
    off_rad = math.remainder(square_rad - rough_rad, math.tau)
    return math.remainder(square_rad, math.tau) if abs(off_rad) < math.pi / 4 else rough_rad


def offsets_around(
    world: WorldModel, values: np.ndarray, centre: Point, reach_m: float
) -> tuple[FloatArray, np.ndarray]:
    """Return where cells that are not 0 lie from a point, in metres, and their values."""
    window = world.grid.window_around(centre, reach_m)
    rows, cols = np.nonzero(values[window])
    points = world.grid.points_at(rows + window[0].start, cols + window[1].start)
    return points - np.array([centre.x, centre.y]), values[window][rows, cols]


def other_side(world: WorldModel, door: Door, side: Region) -> Region:
    """Return the region beyond a door."""
    return world.rooms.region(next(each for each in door.region_ids if each != side.id))


def find_near_side(world: WorldModel, door: Door) -> Region:
    """Return the region of a door on whose side the robot comes to it."""
    sides = [world.rooms.region(region_id) for region_id in door.region_ids]
    here = world.find_room_id(world.robot.point)
    standing = next((side for side in sides if side.id == here), None)
    if standing is not None:
        return standing

    def path_m(side: Region) -> float:
        ahead_m = world.radius_m + AROUND_DOOR_M
        found_m = world.path_m(point_ahead(door.place, find_normal(world, door, side), ahead_m))
        return math.inf if found_m is None else found_m

    return min(sides, key=path_m)


def point_before(world: WorldModel, door: Door, side: Region) -> Point:
    """Return the point before a door on one side, as far off as the robot is wide on one side."""
    return point_ahead(door.place, find_normal(world, door, side), world.radius_m)
