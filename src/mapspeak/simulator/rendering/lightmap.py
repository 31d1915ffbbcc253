"""The light on the building's panels as one picture, fine enough for soft shadows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.simulator.rendering.atlas import look_up, pack
from mapspeak.simulator.rendering.building import TILE_M, Panel
from mapspeak.simulator.rendering.lighting import Light
from mapspeak.simulator.rendering.shadows import cast_on_wall
from mapspeak.simulator.world import WorldObject

__all__ = ["LightMap", "map_light"]

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
IntArray = NDArray[np.intp]

_FINEST_STEP_M = 0.06
_MOST_SAMPLES = 1_000_000
"""About as many as a building of 3,000 square metres of floor has at the finest step."""
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
        """Gives the light at places of shape (n, 2) on panels."""
        place = self.places[panels]
        at = np.empty_like(uv)
        for axis in (0, 1):
            at[:, axis] = place[:, axis] + uv[:, axis] * place[:, 2 + axis]
        return look_up(self.picture, at)


def map_light(panels: Sequence[Panel], things: Sequence[WorldObject], light: Light) -> LightMap:
    """Computes the light on all panels, with the shadows of what hangs on walls."""
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
    """Gives the light on each panel, shape (rows, columns) from its upper left corner."""
    grids = [_sample_places(panel, *n) for panel, n in zip(panels, n_samples, strict=True)]
    counts = [grid.shape[0] * grid.shape[1] for grid in grids]
    places = np.concatenate([grid.reshape(-1, 3) for grid in grids])
    normals = np.repeat([panel.normal for panel in panels], counts, axis=0)
    values = np.split(light.on(places, normals), np.cumsum(counts)[:-1])
    return [value.reshape(grid.shape[:2]) for value, grid in zip(values, grids, strict=True)]


def _count_samples(panels: Sequence[Panel]) -> IntArray:
    """Gives how many samples lie across each panel and how many down, shape (n, 2)."""
    sizes_m = np.array([panel.size_m for panel in panels])
    step_m = max(_FINEST_STEP_M, math.sqrt(float(sizes_m.prod(axis=1).sum()) / _MOST_SAMPLES))
    return np.minimum((sizes_m / step_m).astype(np.intp) + 2, _WIDTH_PX)


def _sample_places(panel: Panel, n_across: int, n_down: int) -> FloatArray:
    across = np.linspace(0.0, 1.0, n_across)[None, :, None] * panel.right
    up = np.linspace(1.0, 0.0, n_down)[:, None, None] * panel.up
    return np.asarray(panel.corner + across + up)
