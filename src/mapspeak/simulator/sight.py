"""Whether one can see a thing from a place: for scoring alone."""

import math

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.lidar import BEAM_ANGLES_RAD, measure_ranges
from mapspeak.simulator.models import find_kind
from mapspeak.simulator.slices import Slice, slice_world
from mapspeak.simulator.world import World, WorldObject

__all__ = ["is_in_sight", "slice_at_eye_level"]

EYE_BAND_M = (1.05, 1.15)
"""What is as high as the camera hides what lies behind it."""
OWN_SIZE_M = 0.5
"""The thing itself, and the wall it hangs on, do not hide it."""
SIDEWAYS_M = (-0.2, -0.1, 0.0, 0.1, 0.2)
"""A thing has some width: it is in sight when any part of it is."""


def slice_at_eye_level(world: World) -> Slice:
    """Gives what hides things: all that is as high as the camera."""
    return slice_world(world, low_m=EYE_BAND_M[0], high_m=EYE_BAND_M[1])


def is_in_sight(
    world: World, place: Point, thing: WorldObject, *, hiding: Slice | None = None
) -> bool:
    """True when nothing as high as the camera hides all of a thing from a place.

    What hangs on a wall is hidden from everywhere behind that wall.

    Args:
        world: With the thing.
        place: In the world's own frame.
        thing: Which one.
        hiding: The world at eye level, where it is at hand; else it is cut anew.
    """
    if find_kind(thing.kind).is_wall_hung and thing.pose.inverse().transform(place).x <= 0:
        return False
    solids = slice_at_eye_level(world) if hiding is None else hiding
    ahead = int(np.argmin(np.abs(BEAM_ANGLES_RAD)))
    across = Pose(thing.pose.x, thing.pose.y, place.bearing_to(thing.pose.point))
    for sideways_m in SIDEWAYS_M:
        part = across.transform(Point(0.0, sideways_m))
        facing = Pose(place.x, place.y, place.bearing_to(part))
        free_m = float(measure_ranges(solids.edges, facing)[ahead])
        if math.isinf(free_m) or free_m >= place.distance_to(part) - OWN_SIZE_M:
            return True
    return False
