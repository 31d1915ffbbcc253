"""Light: lamps under the ceiling, walls that hold it back, and the dark where things touch.

It is computed once for a world. Values are encoded for a picture (to the power of 1 / 2.2), so that
the colour of a pixel is the drawn colour times the light.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.lidar import N_BEAMS, measure_ranges
from mapspeak.simulator.rendering.building import find_bounds, find_ceiling
from mapspeak.simulator.rendering.shadows import Crowding, find_crowding
from mapspeak.simulator.slices import slice_world
from mapspeak.simulator.world import World

__all__ = ["Light", "find_light"]

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]

_LAMP_SPACING_M = 3.2
_LAMP_REACH_M = 10.0
_LAMP_GAP_M = 0.3
"""How far lamps stay from walls."""
_LAMP_STRENGTH = 0.5
_AMBIENT = 0.38
_FROM_FLOOR = 0.22
_FROM_SIDE = (0.09, 0.05, 0.0)
"""A little light from one side, so that the faces of a box differ."""
_EXPOSURE = 1.6
_GAMMA = 2.2

_WALL_CUT_M = (1.2, 1.3)
"""Where walls hold back light: above low partitions, below the tops of doors."""
_SOFT_EDGE_BEAMS = (-4, -2, 0, 2, 4)
"""Beams of half a degree over which the edge of a wall's shadow is spread."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Light:
    """All light of a world.

    Attributes:
        lamps: Where they hang, shape (n, 3).
        reach_m: How far each shines along each of the LiDAR's directions, shape (n, 720).
        crowding: Where things keep the light out.
        ceiling_m: The height of the ceiling.
    """

    lamps: FloatArray
    reach_m: FloatArray
    crowding: Crowding
    ceiling_m: float

    def on(self, places: FloatArray, normals: FloatArray) -> Float32Array:
        """Gives the light at places of shape (n, 3) that face along their normals."""
        points, directions = places.astype(np.float32), normals.astype(np.float32)
        from_floor = _FROM_FLOOR * np.maximum(-directions[:, 2], 0.0)
        light = _AMBIENT + from_floor + directions @ np.array(_FROM_SIDE, dtype=np.float32)
        x, y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
        for lamp, reach in zip(self.lamps.astype(np.float32), self.reach_m, strict=True):
            is_near = (x - lamp[0]) ** 2 + (y - lamp[1]) ** 2 < _LAMP_REACH_M**2
            near = np.flatnonzero(is_near)
            light[near] += _shine(lamp, reach, points[near], directions[near])
        exposed = 1.0 - np.exp(-_EXPOSURE * np.maximum(light, 0.0))
        exposed *= _occlude(self.crowding, self.ceiling_m, points, directions)
        return np.asarray(exposed ** (1 / _GAMMA), dtype=np.float32)


def find_light(world: World) -> Light:
    """Hangs lamps in the rooms of a world, and finds what keeps their light out."""
    walls = slice_world(replace(world, objects=()), low_m=_WALL_CUT_M[0], high_m=_WALL_CUT_M[1])
    low, high = find_bounds(world)
    everywhere = (low, Point(high.x, low.y), high, Point(low.x, high.y))
    outlines = [room.outline for room in world.rooms] or [everywhere]
    spots = [spot for outline in outlines for spot in _spread(outline)]
    spots = [spot for spot in spots if walls.distance_to(spot) > _LAMP_GAP_M]
    ceiling_m = find_ceiling(world)
    reach = [measure_ranges(walls.edges, Pose(spot.x, spot.y)) for spot in spots]
    return Light(
        lamps=np.array([(spot.x, spot.y, ceiling_m - 0.02) for spot in spots]).reshape(-1, 3),
        reach_m=np.array(reach).reshape(-1, N_BEAMS),
        crowding=find_crowding(world, low, high),
        ceiling_m=ceiling_m,
    )


def _spread(corners: Sequence[Point]) -> Iterator[Point]:
    """Gives lamp places in an outline: a grid in its bounds, as far as it lies inside."""
    outline = np.array([(corner.x, corner.y) for corner in corners], dtype=np.float32)
    low, high = outline.min(axis=0), outline.max(axis=0)
    counts = np.maximum(np.round((high - low) / _LAMP_SPACING_M), 1).astype(int)
    steps = (high - low) / counts
    for column in range(counts[0]):
        for row in range(counts[1]):
            x, y = (float(v) for v in low + (np.array([column, row]) + 0.5) * steps)
            if cv2.pointPolygonTest(outline, (x, y), measureDist=False) > 0:
                yield Point(x, y)


def _shine(
    lamp: Float32Array, reach_m: FloatArray, places: Float32Array, normals: Float32Array
) -> Float32Array:
    """Gives what one lamp adds, by Lambert's law; the lamp shines downwards."""
    to_lamp = lamp - places
    squared = np.einsum("ij,ij->i", to_lamp, to_lamp) + np.float32(0.3)
    facing = np.maximum(np.einsum("ij,ij->i", normals, to_lamp), 0.0)
    falloff = np.maximum(to_lamp[:, 2], 0.0) * facing / squared**2
    flat = np.hypot(to_lamp[:, 0], to_lamp[:, 1])
    angle = np.arctan2(-to_lamp[:, 1], -to_lamp[:, 0])
    beam = np.round((angle + math.pi) * (N_BEAMS / math.tau)).astype(np.intp) % N_BEAMS
    widest = np.maximum(np.maximum(reach_m, np.roll(reach_m, 1)), np.roll(reach_m, -1))
    lit = np.zeros(len(places), dtype=np.float32)
    for shift in _SOFT_EDGE_BEAMS:
        lit += flat < np.roll(widest, shift).astype(np.float32)[beam] + np.float32(0.1)
    strength = _LAMP_STRENGTH * float(lamp[2]) ** 2 / len(_SOFT_EDGE_BEAMS)
    return np.asarray(strength * falloff * lit)


def _occlude(
    crowding: Crowding, ceiling_m: float, places: Float32Array, normals: Float32Array
) -> Float32Array:
    """Gives how much light crevices keep: near the floor, under the ceiling, beside things."""
    z = places[:, 2]
    upright = 1.0 - np.abs(normals[:, 2])
    low = 0.30 * np.exp(-z / 0.10) + 0.12 * np.exp(-z / 0.5)
    high = 0.15 * np.exp((z - ceiling_m) / 0.3)
    beside = crowding.at(places[:, :2] + 0.25 * normals[:, :2], z)
    is_floor = (normals[:, 2] > 0.9) & (z < 0.02)
    crowded = np.where(is_floor, 0.9 * beside, 0.30 * beside * upright)
    return np.asarray((1.0 - upright * (low + high)) * (1.0 - crowded), dtype=np.float32)
