"""A world as triangles with drawn surfaces and light: what the camera looks at."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.simulator.models import Surface, build_parts
from mapspeak.simulator.rendering.atlas import Atlas, build_atlas
from mapspeak.simulator.rendering.building import build_panels
from mapspeak.simulator.rendering.lighting import find_light
from mapspeak.simulator.rendering.lightmap import LightMap, map_light
from mapspeak.simulator.rendering.textures import TILED, draw
from mapspeak.simulator.rendering.triangles import (
    Triangles,
    join,
    shine_on,
    triangulate_object,
    triangulate_panel,
)
from mapspeak.simulator.world import World, WorldObject

__all__ = ["Scene", "build_scene"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Scene:
    """Everything the camera can see, prepared once for a world.

    Attributes:
        objects: The world's objects; `Triangles.owners` counts them.
        triangles: All of them.
        groups: Which group each triangle is in: each panel and each object is one.
        group_centres: Of a ball around each group, shape (n_groups, 3).
        group_radii_m: Of that ball, shape (n_groups,).
        atlas: The drawn surfaces.
        light_map: The light on the panels.
    """

    objects: tuple[WorldObject, ...]
    triangles: Triangles
    groups: IntArray
    group_centres: FloatArray
    group_radii_m: FloatArray
    atlas: Atlas
    light_map: LightMap


def build_scene(world: World) -> Scene:
    """Prepares a world for the camera."""
    light = find_light(world)
    panels = build_panels(world, light.lamps, light.ceiling_m)
    surfaces = _list_surfaces(world)
    pieces = [triangulate_panel(panel, i, surfaces) for i, panel in enumerate(panels)]
    pieces += [triangulate_object(thing, i, surfaces) for i, thing in enumerate(world.objects)]
    centres, radii_m = _find_balls(pieces)
    return Scene(
        objects=world.objects,
        triangles=shine_on(join(pieces), light),
        groups=np.repeat(np.arange(len(pieces)), [len(piece.faces) for piece in pieces]),
        group_centres=centres,
        group_radii_m=radii_m,
        atlas=build_atlas([draw(surface) for surface in surfaces], [s in TILED for s in surfaces]),
        light_map=map_light(panels, world.objects, light),
    )


def _list_surfaces(world: World) -> tuple[Surface, ...]:
    """Gives the surfaces that a world needs."""
    used = {part.surface for thing in world.objects for part in build_parts(thing.kind)}
    return tuple(surface for surface in Surface if surface in TILED or surface in used)


def _find_balls(pieces: Sequence[Triangles]) -> tuple[FloatArray, FloatArray]:
    """Gives centres and radii of balls around pieces."""
    boxes = [(p.corners.min(axis=(0, 1)), p.corners.max(axis=(0, 1))) for p in pieces]
    low, high = (np.array(ends) for ends in zip(*boxes, strict=True))
    return (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2
