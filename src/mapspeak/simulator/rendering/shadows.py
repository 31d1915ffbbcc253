"""Soft shadows where things touch: on the floor around what stands, on the wall around what hangs.

Both come from outlines that are filled and blurred, once for a world.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.simulator.models import build_parts, find_kind
from mapspeak.simulator.rendering.atlas import look_up
from mapspeak.simulator.rendering.building import Panel
from mapspeak.simulator.slices import fill_outlines, slice_world
from mapspeak.simulator.world import World, WorldObject

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]

_CELL_M = 0.06
_LAYERS = (((0.0, 0.12), 0.05, 0.40), ((0.0, 0.4), 0.18, 0.50), ((0.1, 1.2), 0.40, 0.60))
"""Each a band of heights, how far it blurs, and how dark it is."""

_WALL_REACH_M = 0.12
_WALL_BLUR_M = 0.05
_WALL_DARKNESS = 0.4
_WALL_DROP_M = 0.04


@dataclass(frozen=True, slots=True, eq=False)
class Crowding:
    """How closely the floor is crowded: 0 free, 1 covered.

    Attributes:
        by_walls: Shape (rows, columns); row 0 is at the origin.
        by_all: Likewise, by walls and by what stands there.
        origin: The outer corner of the first cell.
    """

    by_walls: Float32Array
    by_all: Float32Array
    origin: Point

    def at(self, xy: Float32Array, z: Float32Array) -> Float32Array:
        """Gives the crowding at places; things count up to about a man's height."""
        origin = np.array([self.origin.x, self.origin.y], dtype=np.float32)
        cells = (xy - origin) / np.float32(_CELL_M) - np.float32(0.5)
        walls, everything = look_up(self.by_walls, cells), look_up(self.by_all, cells)
        share = np.clip((1.5 - z) / 0.8, 0.0, 1.0)
        return np.asarray(walls + share * (everything - walls))


def find_crowding(world: World, low: Point, high: Point) -> Crowding:
    """Gives how things crowd the floor between two corners of the plan."""
    by_walls = _blur_outlines(replace(world, objects=()), low, high)
    return Crowding(by_walls, _blur_outlines(world, low, high), low)


def cast_on_wall(light: Float32Array, panel: Panel, things: Sequence[WorldObject]) -> Float32Array:
    """Gives the light on a panel, darker around the things that hang on it.

    Args:
        light: Shape (rows, columns) from the panel's upper left corner to its lower right one.
        panel: An upright one.
        things: Which hang on walls.
    """
    hanging = _find_hanging(panel, things)
    if not hanging:
        return light
    width_m, height_m = panel.size_m
    n_rows, n_columns = light.shape
    per_m = np.array([(n_columns - 1) / width_m, (n_rows - 1) / height_m])
    mask = np.zeros(light.shape, dtype=np.float32)
    for thing in hanging:
        for points in _project_on(thing, panel):
            hull = cv2.convexHull((points * per_m * 16).astype(np.int32))
            cv2.fillConvexPoly(mask, hull, 1.0, shift=4)
    soft = cv2.GaussianBlur(mask, (0, 0), _WALL_BLUR_M * float(per_m[0]))
    return np.asarray(light * (1.0 - _WALL_DARKNESS * soft), dtype=np.float32)


def _blur_outlines(world: World, low: Point, high: Point) -> Float32Array:
    shape = (math.ceil((high.y - low.y) / _CELL_M), math.ceil((high.x - low.x) / _CELL_M))
    crowding = np.zeros(shape, dtype=np.float32)
    for (bottom_m, top_m), blur_m, strength in _LAYERS:
        solids = slice_world(world, low_m=bottom_m, high_m=top_m).outlines
        mask = fill_outlines(solids, shape=shape, origin=low, cell_size_m=_CELL_M)
        crowding += strength * cv2.GaussianBlur(mask.astype(np.float32), (0, 0), blur_m / _CELL_M)
    return np.minimum(crowding, 1.0)


def _find_hanging(panel: Panel, things: Sequence[WorldObject]) -> list[WorldObject]:
    """Gives those things that hang on a panel."""
    normal = panel.normal
    if panel.glows or abs(normal[2]) > 0.5:
        return []
    along = panel.right / panel.size_m[0] ** 2
    found = []
    for thing in things:
        facing = math.cos(thing.pose.yaw_rad) * normal[0] + math.sin(thing.pose.yaw_rad) * normal[1]
        x, y = thing.pose.x - panel.corner[0], thing.pose.y - panel.corner[1]
        is_close = abs(x * normal[0] + y * normal[1]) < _WALL_REACH_M
        is_beside = 0.0 < x * along[0] + y * along[1] < 1.0
        if facing > 0.98 and is_close and is_beside and find_kind(thing.kind).is_wall_hung:
            found.append(thing)
    return found


def _project_on(thing: WorldObject, panel: Panel) -> list[FloatArray]:
    """Gives each part's corners on a panel, in metres right of and below its upper left corner."""
    usual_m = find_kind(thing.kind).base_height_m
    base_m = usual_m if thing.base_height_m is None else thing.base_height_m
    width_m, height_m = panel.size_m
    offset = np.array([thing.pose.x, thing.pose.y, 0.0]) - panel.corner
    middle = float(offset @ panel.right) / width_m
    top = float(panel.corner[2]) + height_m
    return [
        np.column_stack([middle + points[:, 1], top - base_m - points[:, 2] + _WALL_DROP_M])
        for points in (part.corners.reshape(-1, 3) for part in build_parts(thing.kind))
    ]
