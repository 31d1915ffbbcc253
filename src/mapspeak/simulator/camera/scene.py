"""A world as triangles with drawn surfaces and light, for the camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from mapspeak.simulator.camera.building import TILE_M, Panel, build_panels
from mapspeak.simulator.camera.lighting import Light, LightMap, find_light, map_light
from mapspeak.simulator.camera.textures import GLOWING, TILED, TextureAtlas, build_atlas, draw
from mapspeak.simulator.worlds.models import Surface, base_height_m, build_parts
from mapspeak.simulator.worlds.world import World, WorldObject

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

PLAIN = -1
BUILDING = -1


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Triangles:
    """Triangles of a scene, n of them.

    Attributes:
        corners: In the world, counter-clockwise as seen from outside, shape (n, 3, 3).
        normals: At each corner, shape (n, 3, 3).
        uv: Where each corner lies on its drawn surface, shape (n, 3, 2).
        light: At each corner, encoded for a picture, shape (n, 3).
        colours: 0 to 255, as in a picture, shape (n, 3).
        surfaces: Which surface of the atlas; -1 for plain colour, shape (n,).
        faces: Which face each belongs to; there is no edge within a face, shape (n,).
        owners: Which object each belongs to; -1 for the building, shape (n,).
        panels: Which light map each has; -1 where the light is that of the corners, shape (n,).
        is_round: It belongs to a curved face, which shines, shape (n,).
    """

    corners: FloatArray
    normals: FloatArray
    uv: FloatArray
    light: FloatArray
    colours: FloatArray
    surfaces: IntArray
    faces: IntArray
    owners: IntArray
    panels: IntArray
    is_round: NDArray[np.bool_]


def triangulate_panel(panel: Panel, index: int, surfaces: Sequence[Surface]) -> Triangles:
    """Return the two triangles of a panel; its light comes from its light map unless it glows."""
    a, b = panel.corner, panel.corner + panel.right
    c, d = b + panel.up, panel.corner + panel.up
    width, height = (size / TILE_M[panel.surface] for size in panel.size_m)
    uv = np.array([(0.0, height), (width, height), (width, 0.0), (0.0, 0.0)])
    return Triangles(
        corners=np.array([[a, b, c], [a, c, d]]),
        normals=np.broadcast_to(panel.normal, (2, 3, 3)),
        uv=uv[[[0, 1, 2], [0, 2, 3]]],
        light=np.ones((2, 3)),
        colours=np.array([panel.colour] * 2, dtype=float),
        surfaces=np.full(2, surfaces.index(panel.surface)),
        faces=np.zeros(2, dtype=np.intp),
        owners=np.full(2, BUILDING),
        panels=np.full(2, PLAIN if panel.glows else index),
        is_round=np.zeros(2, dtype=bool),
    )


def triangulate_object(thing: WorldObject, owner: int, surfaces: Sequence[Surface]) -> Triangles:
    """Return the triangles of an object where it stands in the world, as yet without light."""
    parts = build_parts(thing.kind)
    counts = [len(part.corners) for part in parts]
    normals = _turn(np.concatenate([part.normals for part in parts]), thing)
    n_faces = [int(part.faces.max()) + 1 for part in parts]
    faces_before = np.repeat(np.cumsum([0, *n_faces[:-1]]), counts)
    numbers = [PLAIN if part.surface is None else surfaces.index(part.surface) for part in parts]
    glows = np.repeat([part.surface in GLOWING for part in parts], counts)
    return Triangles(
        corners=_to_world(np.concatenate([part.corners for part in parts]), thing),
        normals=normals,
        uv=np.concatenate([part.uv for part in parts]),
        light=np.where(glows[:, None], 1.0, np.zeros((len(normals), 3))),
        colours=np.repeat(np.array([part.colour for part in parts], dtype=float), counts, axis=0),
        surfaces=np.repeat(numbers, counts),
        faces=np.concatenate([part.faces for part in parts]) + faces_before,
        owners=np.full(len(normals), owner),
        panels=np.full(len(normals), PLAIN),
        is_round=(normals != normals[:, :1]).any(axis=(1, 2)),
    )


def join(pieces: Sequence[Triangles]) -> Triangles:
    """Return all triangles in one, with the faces counted on."""
    n_faces = [int(piece.faces.max()) + 1 for piece in pieces]
    faces_before = np.cumsum([0, *n_faces[:-1]])
    columns = {
        field.name: np.concatenate([getattr(piece, field.name) for piece in pieces])
        for field in fields(Triangles)
    }
    counts = [len(piece.faces) for piece in pieces]
    columns["faces"] += np.repeat(faces_before, counts)
    return Triangles(**columns)


def shine_on(triangles: Triangles, light: Light) -> Triangles:
    """Return the triangles with light on every corner that has none yet."""
    dark = np.flatnonzero((triangles.light == 0.0).any(axis=1))
    shone = triangles.light.copy()
    places, normals = triangles.corners[dark], triangles.normals[dark]
    shone[dark] = light.on(places.reshape(-1, 3), normals.reshape(-1, 3)).reshape(-1, 3)
    return replace(triangles, light=shone)


def _to_world(corners: FloatArray, thing: WorldObject) -> FloatArray:
    place = (thing.pose.x, thing.pose.y, base_height_m(thing))
    return np.asarray(_turn(corners, thing) + np.array(place))


def _turn(vectors: FloatArray, thing: WorldObject) -> FloatArray:
    cos, sin = math.cos(thing.pose.yaw_rad), math.sin(thing.pose.yaw_rad)
    turned = vectors @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turned)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Scene:
    """Everything the camera can see, prepared once for a world.

    Attributes:
        objects: The world's objects; `Triangles.owners` counts them.
        groups: Which group each triangle is in: each panel and each object is one.
        group_centres: Of a ball around each group, shape (n_groups, 3).
        group_radii_m: Of that ball, shape (n_groups,).
    """

    objects: tuple[WorldObject, ...]
    triangles: Triangles
    groups: IntArray
    group_centres: FloatArray
    group_radii_m: FloatArray
    atlas: TextureAtlas
    light_map: LightMap


def build_scene(world: World) -> Scene:
    """Prepare a world for the camera."""
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
    """Return the surfaces that a world needs."""
    used = {part.surface for thing in world.objects for part in build_parts(thing.kind)}
    return tuple(surface for surface in Surface if surface in TILED or surface in used)


def _find_balls(pieces: Sequence[Triangles]) -> tuple[FloatArray, FloatArray]:
    """Return centres and radii of balls around pieces."""
    boxes = [(p.corners.min(axis=(0, 1)), p.corners.max(axis=(0, 1))) for p in pieces]
    low, high = (np.array(ends) for ends in zip(*boxes, strict=True))
    return (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2
