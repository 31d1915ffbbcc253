"""Light: lamps under the ceiling, walls that block it, and dark creases where things touch.

It is computed once for a world. Values are encoded for a picture (to the power of 1 / 2.2), so that
the colour of a pixel is the drawn colour times the light.

Soft shadows lie where things touch: on the floor around standing things, on the wall around hanging
ones. Both are filled and blurred outlines. The light on the building's panels is one
picture, fine enough for them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.camera.building import TILE_M, Panel, find_bounds, find_ceiling
from mapspeak.simulator.camera.textures import look_up, pack
from mapspeak.simulator.robot.lidar import N_BEAMS, measure_ranges
from mapspeak.simulator.worlds.models import base_height_m, build_parts, find_kind
from mapspeak.simulator.worlds.slices import fill_outlines, slice_world
from mapspeak.simulator.worlds.world import World, WorldObject

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]

_CELL_M = 0.06
_LAYERS = (((0.0, 0.12), 0.05, 0.40), ((0.0, 0.4), 0.18, 0.50), ((0.1, 1.2), 0.40, 0.60))
"""Each has a band of heights, a blur radius and a darkness."""

_WALL_REACH_M = 0.12
_WALL_BLUR_M = 0.05
_WALL_DARKNESS = 0.4
_WALL_DROP_M = 0.04


@dataclass(frozen=True, slots=True, eq=False)
class Crowding:
    """Crowding of the floor: 0 free, 1 covered.

    Attributes:
        by_walls: Shape (rows, columns); row 0 is at the origin.
        by_all: Likewise, by walls and standing things.
        origin: The outer corner of the first cell.
    """

    by_walls: Float32Array
    by_all: Float32Array
    origin: Point

    def at(self, xy: Float32Array, z: Float32Array) -> Float32Array:
        """Return the crowding at places; things count up to about a man's height."""
        origin = np.array([self.origin.x, self.origin.y], dtype=np.float32)
        cells = (xy - origin) / np.float32(_CELL_M) - np.float32(0.5)
        walls, everything = look_up(self.by_walls, cells), look_up(self.by_all, cells)
        share = np.clip((1.5 - z) / 0.8, 0.0, 1.0)
        return np.asarray(walls + share * (everything - walls))


def find_crowding(world: World, low: Point, high: Point) -> Crowding:
    """Return how things crowd the floor between two corners of the plan."""
    by_walls = _blur_outlines(replace(world, objects=()), low, high)
    return Crowding(by_walls, _blur_outlines(world, low, high), low)


def cast_on_wall(light: Float32Array, panel: Panel, things: Sequence[WorldObject]) -> Float32Array:
    """Return the light on a panel, darker around the things that hang on it.

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
    """Return those things that hang on a panel."""
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
    """Return each part's corners on a panel, in metres right of and below its upper left corner."""
    width_m, height_m = panel.size_m
    offset = np.array([thing.pose.x, thing.pose.y, 0.0]) - panel.corner
    middle = float(offset @ panel.right) / width_m
    top = float(panel.corner[2]) + height_m
    return [
        np.column_stack(
            [middle + points[:, 1], top - base_height_m(thing) - points[:, 2] + _WALL_DROP_M]
        )
        for points in (part.corners.reshape(-1, 3) for part in build_parts(thing.kind))
    ]


_LAMP_SPACING_M = 3.2
_LAMP_REACH_M = 10.0
_LAMP_GAP_M = 0.3
"""Distance of lamps from walls."""
_LAMP_STRENGTH = 0.5
_ROUNDING_M = 1e-3
_AMBIENT = 0.38
_FROM_FLOOR = 0.22
_FROM_SIDE = (0.09, 0.05, 0.0)
"""A little light from one side, so that the faces of a box differ."""
_EXPOSURE = 1.6
_GAMMA = 2.2

_WALL_CUT_M = (1.2, 1.3)
"""Heights at which walls block light: above low partitions, below the tops of doors."""
_SOFT_EDGE_BEAMS = (-4, -2, 0, 2, 4)
"""Beams of half a degree over which the edge of a wall's shadow is spread."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Light:
    """All light of a world.

    Attributes:
        lamps: Their positions, shape (n, 3).
        reach_m: Range of each along each of the LiDAR's directions, shape (n, 720).
    """

    lamps: FloatArray
    reach_m: FloatArray
    crowding: Crowding
    ceiling_m: float

    def on(self, places: FloatArray, normals: FloatArray) -> Float32Array:
        """Return the light at places of shape (n, 3) that face along their normals."""
        points, directions = places.astype(np.float32), normals.astype(np.float32)
        from_floor = _FROM_FLOOR * np.maximum(-directions[:, 2], 0.0)
        light = _AMBIENT + from_floor + directions @ np.array(_FROM_SIDE, dtype=np.float32)
        lamps = self.lamps.astype(np.float32)
        # What is not below the lamps, or is turned away from one, gets nothing of it.
        below = np.flatnonzero(points[:, 2] < lamps[:, 2].max(initial=0.0))
        x, y, z = points[below].T.copy()
        across, along, up = directions[below].T.copy()
        ahead = across * x + along * y + up * z - np.float32(_ROUNDING_M)
        for lamp, reach in zip(lamps, self.reach_m, strict=True):
            is_lit = across * lamp[0] + along * lamp[1] + up * lamp[2] > ahead
            is_lit &= (x - lamp[0]) ** 2 + (y - lamp[1]) ** 2 < _LAMP_REACH_M**2
            lit = below[is_lit]
            there, facing = points.take(lit, axis=0), directions.take(lit, axis=0)
            light[lit] += _shine(lamp, reach, there, facing)
        exposed = 1.0 - np.exp(-_EXPOSURE * np.maximum(light, 0.0))
        exposed *= _occlude(self.crowding, self.ceiling_m, points, directions)
        return np.asarray(exposed ** (1 / _GAMMA), dtype=np.float32)


def find_light(world: World) -> Light:
    """Hang lamps in the rooms of a world, and find what blocks their light."""
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
    """Return lamp places in an outline: a grid in its bounds, as far as it lies inside."""
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
    """Return what one lamp adds, by Lambert's law; the lamp shines downwards."""
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
    """Return how much light crevices keep: near the floor, under the ceiling, beside things."""
    z = places[:, 2]
    upright = 1.0 - np.abs(normals[:, 2])
    low = 0.30 * np.exp(-z / 0.10) + 0.12 * np.exp(-z / 0.5)
    high = 0.15 * np.exp((z - ceiling_m) / 0.3)
    beside = crowding.at(places[:, :2] + 0.25 * normals[:, :2], z)
    is_floor = (normals[:, 2] > 0.9) & (z < 0.02)
    crowded = np.where(is_floor, 0.9 * beside, 0.30 * beside * upright)
    return np.asarray((1.0 - upright * (low + high)) * (1.0 - crowded), dtype=np.float32)


IntArray = NDArray[np.intp]

_FINEST_STEP_M = 0.06
_MOST_SAMPLES = 1_000_000
"""About the number for a building of 3,000 square metres of floor at the finest step."""
_WIDTH_PX = 2048


@dataclass(frozen=True, slots=True, eq=False)
class LightMap:
    """The light on all panels.

    Attributes:
        picture: Encoded for a picture, shape (height, width).
        places: For each panel, where uv (0, 0) lies on the picture, and how far a unit of uv
            reaches there, shape (n_panels, 4).
    """

    picture: Float32Array
    places: Float32Array

    def at(self, panels: IntArray, uv: Float32Array) -> Float32Array:
        """Return the light at places of shape (n, 2) on panels."""
        place = self.places[panels]
        at = np.empty_like(uv)
        for axis in (0, 1):
            at[:, axis] = place[:, axis] + uv[:, axis] * place[:, 2 + axis]
        return look_up(self.picture, at)


def map_light(panels: Sequence[Panel], things: Sequence[WorldObject], light: Light) -> LightMap:
    """Compute the light on all panels, with the shadows of things on walls."""
    n_samples = _count_samples(panels)
    corners, height = pack(n_samples, _WIDTH_PX)
    lit = _light_each(panels, n_samples, light)
    picture = np.ones((height, _WIDTH_PX), dtype=np.float32)
    for panel, (x, y), samples in zip(panels, corners, lit, strict=True):
        shaded = cast_on_wall(samples, panel, things)
        picture[y : y + shaded.shape[0], x : x + shaded.shape[1]] = shaded
    sizes_m = np.array([panel.size_m for panel in panels])
    tiles_m = np.array([[TILE_M[panel.surface]] for panel in panels])
    places = np.concatenate([corners, (n_samples - 1) / (sizes_m / tiles_m)], axis=1)
    return LightMap(picture, places.astype(np.float32))


def _light_each(panels: Sequence[Panel], n_samples: IntArray, light: Light) -> list[Float32Array]:
    """Return the light on each panel, shape (rows, columns) from its upper left corner."""
    grids = [_sample_places(panel, *n) for panel, n in zip(panels, n_samples, strict=True)]
    counts = [grid.shape[0] * grid.shape[1] for grid in grids]
    places = np.concatenate([grid.reshape(-1, 3) for grid in grids])
    normals = np.repeat([panel.normal for panel in panels], counts, axis=0)
    values = np.split(light.on(places, normals), np.cumsum(counts)[:-1])
    return [value.reshape(grid.shape[:2]) for value, grid in zip(values, grids, strict=True)]


def _count_samples(panels: Sequence[Panel]) -> IntArray:
    """Return how many samples lie across each panel and how many down, shape (n, 2)."""
    sizes_m = np.array([panel.size_m for panel in panels])
    step_m = max(_FINEST_STEP_M, math.sqrt(float(sizes_m.prod(axis=1).sum()) / _MOST_SAMPLES))
    return np.minimum((sizes_m / step_m).astype(np.intp) + 2, _WIDTH_PX)


def _sample_places(panel: Panel, n_across: int, n_down: int) -> FloatArray:
    across = np.linspace(0.0, 1.0, n_across)[None, :, None] * panel.right
    up = np.linspace(1.0, 0.0, n_down)[:, None, None] * panel.up
    return np.asarray(panel.corner + across + up)
