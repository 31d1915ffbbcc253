"""Models of objects: their looks, and the parts that the laser and the bumper detect.

`models.json` lists every kind of object with its parts. A part is written as a shape with the
arguments of the function of that name below; everything is in the object's own frame: x to the
front, y to the left, z up from its base, metres. A part is convex, or stands for its convex hull
where the laser and collisions are concerned. Some numbers go to their last digit, because the
shipped worlds were drawn with them; a test draws them again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from importlib import resources
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from mapspeak.errors import ConfigError
from mapspeak.simulator.worlds.world import WorldObject

FloatArray = NDArray[np.float64]
Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255, as in a picture (sRGB)."""
Vector = Sequence[float]
_Triangles = tuple[FloatArray, FloatArray, FloatArray]
"""Corners, normals and uv of faces of as many triangles each: (faces, triangles, 3, 3 or 2)."""


class Surface(StrEnum):
    """A drawn surface: signs first, then goods and devices, then the building."""

    EXTINGUISHER_SIGN = "extinguisher_sign"
    HOSE_REEL_SIGN = "hose_reel_sign"
    FIRST_AID_SIGN = "first_aid_sign"
    FIRST_AID_CROSS = "first_aid_cross"
    EXIT_SIGN = "exit_sign"
    EYE_WASH_SIGN = "eye_wash_sign"
    CHARGING_SIGN = "charging_sign"
    RECYCLING_SIGN = "recycling_sign"
    HAZARD_STRIPES = "hazard_stripes"

    EXTINGUISHER_LABEL = "extinguisher_label"
    FORKLIFT_LABEL = "forklift_label"
    CARDBOARD = "cardboard"
    CRATE_SIDE = "crate_side"
    WOOD = "wood"
    SCREEN = "screen"
    KEYBOARD = "keyboard"
    WHITEBOARD = "whiteboard"
    PRINTER_PANEL = "printer_panel"
    COFFEE_PANEL = "coffee_panel"
    MIRROR = "mirror"

    FLOOR = "floor"
    WALL = "wall"
    CEILING = "ceiling"


class ObjectCategory(StrEnum):
    """Class of a thing in the paper's semantic filtering policy; movable things are "other"."""

    SAFETY = "safety"
    FUNCTIONAL = "functional"
    OTHER = "other"


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectKind:
    """A kind of object.

    Attributes:
        name: As world files write it.
        category: Fixed safety equipment, fixed equipment with a use, or anything else.
        base_height_m: How high above the floor its base usually is.
        is_wall_hung: Its back is at x = 0 and belongs on a wall; else the origin is its middle.
    """

    name: str
    label: str
    category: ObjectCategory
    base_height_m: float = 0.0
    is_wall_hung: bool = False


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Mesh:
    """One convex part of an object as triangles.

    Attributes:
        corners: Triangles, shape (n, 3, 3), counter-clockwise as seen from outside.
        normals: The outward direction at each corner, of length 1, shape (n, 3, 3).
        uv: Where each corner lies on the surface, 0 to 1 from its upper left, shape (n, 3, 2).
        faces: Which face of the part each triangle belongs to, shape (n,); a face has no edges.
        colour: Colour of the part; it tints a drawn surface.
        surface: The drawing on it; None for plain colour.
        is_solid: The laser and the bumper detect it; False for labels and cables.
    """

    corners: FloatArray
    normals: FloatArray
    uv: FloatArray
    faces: NDArray[np.intp]
    colour: Colour
    surface: Surface | None = None
    is_solid: bool = True


def kind_names() -> tuple[str, ...]:
    """Return the names of all kinds, as world files write them."""
    return tuple(_read_models())


@cache
def find_kind(name: str) -> ObjectKind:
    """Return the description of a kind.

    Raises:
        ConfigError: No kind has that name.
    """
    if name not in _read_models():
        raise ConfigError(
            f"There is no kind of object called {name!r}.",
            hint=f"Use one of: {', '.join(sorted(kind_names()))}.",
        )
    model = _read_models()[name]
    return ObjectKind(
        name=name,
        label=model["label"],
        category=ObjectCategory(model["category"]),
        base_height_m=model.get("base_height_m", 0.0),
        is_wall_hung=model.get("is_wall_hung", False),
    )


def base_height_m(thing: WorldObject) -> float:
    """Return how high above the floor the base of an object is."""
    usual_m = find_kind(thing.kind).base_height_m
    return usual_m if thing.base_height_m is None else thing.base_height_m


@cache
def build_parts(kind: str) -> tuple[Mesh, ...]:
    """Return the parts of a kind in its own frame, with z from its base.

    Raises:
        ConfigError: There is no kind of that name.
    """
    name = find_kind(kind).name
    return tuple(_build_part(**part) for part in _read_models()[name]["parts"])


@cache
def _read_models() -> Mapping[str, Any]:
    """Read every kind by its name; the reader must not change anything in it."""
    text = resources.files("mapspeak.simulator.worlds").joinpath("models.json").read_bytes()
    return MappingProxyType(orjson.loads(text))


def _build_part(
    *,
    shape: str,
    is_solid: bool = True,
    moves: Sequence[Mapping[str, Any]] = (),
    **arguments: Any,  # noqa: ANN401 - those of the shape, as the file writes them
) -> Mesh:
    """Build a part as the file writes it: a shape, moved one time after the other."""
    part = _SHAPES[shape](**arguments)
    for move in moves:
        part = _move(part, **move)
    return part if is_solid else replace(part, is_solid=False)


# --- shapes ----------------------------------------------------------------------------------

_BOX_FACES = ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7), (3, 2, 1, 0))
"""The corners of each face of a box, of which the lower four come first."""


def _box(
    *, low: Vector, high: Vector, colour: Vector, surface: str | None = None, taper: float = 1.0
) -> Mesh:
    """Return an upright box between two opposite corners; `taper` scales its top face."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    centre = ((x0 + x1) / 2, (y0 + y1) / 2)
    outline = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=float)
    base = np.column_stack([outline, np.full(4, z0)])
    top = np.column_stack([(outline - centre) * taper + centre, np.full(4, z1)])
    return _from_faces([np.concatenate([base, top])[list(_BOX_FACES)]], colour, surface)


def _prism(*, outline_xz: Sequence[Vector], y_low: float, y_high: float, colour: Vector) -> Mesh:
    """Return a convex side view, counter-clockwise in (x, z), drawn out along y."""
    xz = np.array(outline_xz, dtype=float)
    right = np.column_stack([xz[:, 0], np.full(len(xz), y_low), xz[:, 1]])
    left = np.column_stack([xz[:, 0], np.full(len(xz), y_high), xz[:, 1]])
    n = len(xz)
    sides = [[right[i], left[i], left[(i + 1) % n], right[(i + 1) % n]] for i in range(n)]
    return _from_faces([np.array([right, left[::-1]]), np.array(sides)], colour)


def _sheet(*, upper_left: Vector, right: Vector, down: Vector, surface: str) -> Mesh:
    """Return a flat drawn surface, seen from the side where `right` points to the right."""
    origin, r, d = (np.array(vector, dtype=float) for vector in (upper_left, right, down))
    faces = np.array([[origin + d, origin + d + r, origin + r, origin]])
    return replace(_from_faces([faces], (255, 255, 255), surface), is_solid=False)


def _rod(*, start: Vector, end: Vector, radius_m: float, colour: Vector, n_sides: int = 12) -> Mesh:
    """Return a round bar between two points."""
    return _cone(start=start, end=end, radii_m=(radius_m, radius_m), colour=colour, n_sides=n_sides)


def _cone(
    *, start: Vector, end: Vector, radii_m: Vector, colour: Vector, n_sides: int = 12
) -> Mesh:
    """Return a round body between two points, with a radius at either end."""
    a, b = np.array(start, dtype=float), np.array(end, dtype=float)
    length = float(np.linalg.norm(b - a))
    profile = [(0.0, 0.0), (radii_m[0], 0.0), (radii_m[1], length), (0.0, length)]
    upright = _lathe(profile=profile, colour=colour, n_sides=n_sides)
    return _turn(upright, _frame_along((b - a) / length), a)


def _lathe(
    *,
    profile: Sequence[Vector],
    colour: Vector,
    at: Vector = (0.0, 0.0),
    n_sides: int = 20,
    surface: str | None = None,
) -> Mesh:
    """Return a body of revolution about the vertical: `profile` is (radius, z) from the bottom up.

    A surface is wrapped around it once; its left edge meets its right edge at the back.
    """
    angles = np.linspace(-np.pi, np.pi, n_sides + 1)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.linspace(0.0, 1.0, n_sides + 1)])
    z_low, z_high = profile[0][1], profile[-1][1]
    span = max(z_high - z_low, 1e-9)
    pieces = [_band(lower, upper, circle, z_high, span) for lower, upper in pairwise(profile)]
    part = _join(pieces, colour, surface)
    part.corners[..., :2] += at
    return part


_SHAPES: Mapping[str, Callable[..., Mesh]] = MappingProxyType(
    {
        "box": _box,
        "cone": _cone,
        "lathe": _lathe,
        "prism": _prism,
        "rod": _rod,
        "sheet": _sheet,
    }
)


def _move(part: Mesh, *, by: Vector, yaw_rad: float = 0.0, pitch_rad: float = 0.0) -> Mesh:
    """Return a part turned about y (front down for a positive pitch), then z, then shifted."""
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    cos, sin = np.cos(pitch_rad), np.sin(pitch_rad)
    nod = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    return _turn(part, turn @ nod, np.array(by, dtype=float))


def _turn(part: Mesh, rotation: FloatArray, shift: FloatArray) -> Mesh:
    return replace(
        part,
        corners=part.corners @ rotation.T + shift,
        normals=part.normals @ rotation.T,
    )


def _frame_along(axis: FloatArray) -> FloatArray:
    """Return a rotation that takes the z axis to `axis`."""
    other = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    side = np.cross(axis, other)
    side /= np.linalg.norm(side)
    return np.column_stack([np.cross(side, axis), side, axis])


def _band(
    lower: Vector, upper: Vector, circle: FloatArray, z_high: float, span: float
) -> _Triangles:
    """Return the ring between two points of a profile as one face."""
    (r0, z0), (r1, z1) = lower, upper
    rings = np.empty((2, len(circle), 8))
    for ring, (radius, z) in zip(rings, (lower, upper), strict=True):
        ring[:, :2] = circle[:, :2] * radius
        ring[:, 2] = z
        ring[:, 3:5] = circle[:, :2] * (z1 - z0)
        ring[:, 5] = r0 - r1
        ring[:, 6] = circle[:, 2]
        ring[:, 7] = (z_high - z) / span
    rings[..., 3:6] /= np.hypot(z1 - z0, r1 - r0) or 1.0
    low, high = rings
    first = np.stack([low[:-1], low[1:], high[1:]], axis=1)
    second = np.stack([low[:-1], high[1:], high[:-1]], axis=1)
    both = (second,) if r0 == 0.0 else (first,) if r1 == 0.0 else (first, second)
    corners, normals, uv = np.split(np.concatenate(both)[None], (3, 6), axis=3)
    return corners, normals, uv


def _from_faces(groups: Sequence[FloatArray], colour: Vector, surface: str | None = None) -> Mesh:
    """Return flat convex faces as triangles; a four-cornered face carries the whole surface.

    Args:
        groups: Faces of as many corners each, of shape (faces, corners, 3).
    """
    return _join([_fan(faces) for faces in groups], colour, surface)


def _fan(faces: FloatArray) -> _Triangles:
    n = faces.shape[1]
    order = [(0, i, i + 1) for i in range(1, n - 1)]
    corners = faces[:, order]
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.sqrt(np.vecdot(normals, normals))[:, None]
    uv = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]] if n == 4 else np.zeros((n, 2)))
    return (
        corners,
        np.broadcast_to(normals[:, None, None], corners.shape),
        np.broadcast_to(uv[order], (*corners.shape[:3], 2)),
    )


def _join(pieces: Sequence[_Triangles], colour: Vector, surface: str | None) -> Mesh:
    """Return a part of groups of faces."""
    corners, normals, uv = (
        np.concatenate([each.reshape(-1, *each.shape[2:]) for each in arrays])
        for arrays in zip(*pieces, strict=True)
    )
    n_triangles = np.concatenate([np.full(*piece[0].shape[:2]) for piece in pieces])
    red, green, blue = (int(value) for value in colour)
    return Mesh(
        corners=corners,
        normals=normals,
        uv=uv,
        faces=np.repeat(np.arange(len(n_triangles)), n_triangles),
        colour=(red, green, blue),
        surface=None if surface is None else Surface(surface),
    )
