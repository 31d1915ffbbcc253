"""Whether one can see a thing from a place: for scoring alone."""

import math

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.lidar import BEAM_ANGLES_RAD, measure_ranges
from mapspeak.simulator.slices import slice_world
from mapspeak.simulator.world import World, WorldObject

__all__ = ["is_in_sight"]

EYE_BAND_M = (1.05, 1.15)
"""What is as high as the camera hides what lies behind it."""
OWN_SIZE_M = 0.5
"""The thing itself, and the wall it hangs on, do not hide it."""


def is_in_sight(world: World, place: Point, thing: WorldObject) -> bool:
    """True when nothing as high as the camera stands between a place and a thing's middle."""
    solids = slice_world(world, low_m=EYE_BAND_M[0], high_m=EYE_BAND_M[1])
    distance_m = place.distance_to(thing.pose.point)
    facing = Pose(place.x, place.y, place.bearing_to(thing.pose.point))
    ahead = int(np.argmin(np.abs(BEAM_ANGLES_RAD)))
    free_m = float(measure_ranges(solids.edges, facing)[ahead])
    return math.isinf(free_m) or free_m >= distance_m - OWN_SIZE_M
