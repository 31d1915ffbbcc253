"""Parts that models are made of: triangles with a colour or a drawn surface; ways to shape them.

Everything is in an object's own frame: x to the front, y to the left, z up from its base, metres.
A part is convex (or stands for its convex hull where the laser and collisions are concerned).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mapspeak.simulator.models.surfaces import Surface

FloatArray = NDArray[np.float64]
Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255, as in a picture (sRGB)."""
Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Part:
    """One convex piece of a model.

    Attributes:
        corners: Triangles, shape (n, 3, 3), counter-clockwise as seen from outside.
        normals: The outward direction at each corner, of length 1, shape (n, 3, 3).
        uv: Where each corner lies on the surface, 0 to 1 from its upper left, shape (n, 3, 2).
        faces: Which face of the part each triangle belongs to, shape (n,); a face has no edges.
        colour: Of the part; it tints a drawn surface.
        surface: What is drawn on it; None for plain colour.
        is_solid: The laser and the bumper feel it; False for labels and cables.
    """

    corners: FloatArray
    normals: FloatArray
    uv: FloatArray
    faces: NDArray[np.intp]
    colour: Colour
    surface: Surface | None = None
    is_solid: bool = True


def box(
    low: Vector, high: Vector, colour: Colour, *, surface: Surface | None = None, taper: float = 1.0
) -> Part:
    """Gives an upright box between two opposite corners; `taper` scales its top face."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    centre = ((x0 + x1) / 2, (y0 + y1) / 2)
    outline = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    base = np.column_stack([outline, np.full(4, z0)])
    top = np.column_stack([(outline - centre) * taper + centre, np.full(4, z1)])
    return frustum(base, top, colour, surface=surface)


def frustum(
    base: FloatArray, top: FloatArray, colour: Colour, *, surface: Surface | None = None
) -> Part:
    """Gives the flat-faced solid between two counter-clockwise outlines of shape (n, 3)."""
    n = len(base)
    sides = [np.array([base[i], base[(i + 1) % n], top[(i + 1) % n], top[i]]) for i in range(n)]
    return _from_faces([*sides, top, base[::-1]], colour, surface=surface)


def prism(
    outline_xz: Sequence[tuple[float, float]], y_low: float, y_high: float, colour: Colour
) -> Part:
    """Gives a convex side view, counter-clockwise in (x, z), drawn out along y."""
    xz = np.array(outline_xz)
    right = np.column_stack([xz[:, 0], np.full(len(xz), y_low), xz[:, 1]])
    left = np.column_stack([xz[:, 0], np.full(len(xz), y_high), xz[:, 1]])
    n = len(xz)
    sides = [np.array([right[i], left[i], left[(i + 1) % n], right[(i + 1) % n]]) for i in range(n)]
    return _from_faces([right, left[::-1], *sides], colour)


def rod(start: Vector, end: Vector, radius_m: float, colour: Colour, *, n_sides: int = 12) -> Part:
    """Gives a round bar between two points."""
    return cone(start, end, (radius_m, radius_m), colour, n_sides=n_sides)


def cone(
    start: Vector, end: Vector, radii_m: tuple[float, float], colour: Colour, *, n_sides: int = 12
) -> Part:
    """Gives a round body between two points, with a radius at either end."""
    a, b = np.array(start, dtype=float), np.array(end, dtype=float)
    length = float(np.linalg.norm(b - a))
    profile = [(0.0, 0.0), (radii_m[0], 0.0), (radii_m[1], length), (0.0, length)]
    return _turned(lathe(profile, colour, n_sides=n_sides), _frame_along((b - a) / length), a)


def lathe(
    profile: Sequence[tuple[float, float]],
    colour: Colour,
    *,
    at: tuple[float, float] = (0.0, 0.0),
    n_sides: int = 20,
    surface: Surface | None = None,
) -> Part:
    """Gives a body of revolution about the vertical: `profile` is (radius, z) from the bottom up.

    A surface is wrapped around it once; its left edge meets its right edge at the back.
    """
    angles = np.linspace(-np.pi, np.pi, n_sides + 1)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    z_low, z_high = profile[0][1], profile[-1][1]
    span = max(z_high - z_low, 1e-9)
    pieces = [_band(lower, upper, circle, z_high, span) for lower, upper in pairwise(profile)]
    part = _join(pieces, colour, surface)
    part.corners[..., :2] += at
    return part


def ball(centre: Vector, radius_m: float, colour: Colour, *, n_sides: int = 12) -> Part:
    """Gives a sphere."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, max(n_sides // 2, 4) + 1)
    profile = [
        (radius_m * float(np.cos(angle)), centre[2] + radius_m * float(np.sin(angle)))
        for angle in angles
    ]
    return lathe(profile, colour, at=centre[:2], n_sides=n_sides)


def tube(
    points: Sequence[Vector], radius_m: float, colour: Colour, *, n_sides: int = 8
) -> tuple[Part, ...]:
    """Gives a bent pipe or hose as short bars along a line; not felt by the laser."""
    bars = (rod(a, b, radius_m, colour, n_sides=n_sides) for a, b in pairwise(points))
    return tuple(replace(bar, is_solid=False) for bar in bars)


def sheet(upper_left: Vector, right: Vector, down: Vector, surface: Surface) -> Part:
    """Gives a flat drawn surface, seen from the side where `right` points to the right."""
    origin, r, d = (np.array(vector, dtype=float) for vector in (upper_left, right, down))
    face = np.array([origin + d, origin + d + r, origin + r, origin])
    part = _from_faces([face], (255, 255, 255), surface=surface)
    return replace(part, is_solid=False)


def front_sheet(centre: Vector, width_m: float, height_m: float, surface: Surface) -> Part:
    """Gives an upright drawn surface that faces to the front."""
    x, y, z = centre
    upper_left = (x, y - width_m / 2, z + height_m / 2)
    return sheet(upper_left, (0.0, width_m, 0.0), (0.0, 0.0, -height_m), surface)


def moved(
    parts: Iterable[Part],
    *,
    by: Vector = (0.0, 0.0, 0.0),
    yaw_rad: float = 0.0,
    pitch_rad: float = 0.0,
) -> tuple[Part, ...]:
    """Gives the parts turned about y (front down for a positive pitch), then z, then shifted."""
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    cos, sin = np.cos(pitch_rad), np.sin(pitch_rad)
    nod = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    shift = np.array(by)
    return tuple(_turned(part, turn @ nod, shift) for part in parts)


def _turned(part: Part, rotation: FloatArray, shift: FloatArray) -> Part:
    return replace(
        part,
        corners=part.corners @ rotation.T + shift,
        normals=part.normals @ rotation.T,
    )


def _frame_along(axis: FloatArray) -> FloatArray:
    """Gives a rotation that takes the z axis to `axis`."""
    other = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    side = np.cross(axis, other)
    side /= np.linalg.norm(side)
    return np.column_stack([np.cross(side, axis), side, axis])


def _band(
    lower: tuple[float, float],
    upper: tuple[float, float],
    circle: FloatArray,
    z_high: float,
    span: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gives corners, normals and uv of the ring between two points of a profile."""
    (r0, z0), (r1, z1) = lower, upper
    n = len(circle) - 1
    rings = [
        np.column_stack([circle * radius, np.full(n + 1, z)]) for radius, z in ((r0, z0), (r1, z1))
    ]
    slope = np.hypot(z1 - z0, r1 - r0) or 1.0
    outward = np.column_stack([circle * (z1 - z0), np.full(n + 1, r0 - r1)]) / slope
    u = np.linspace(0.0, 1.0, n + 1)
    lower_uv, upper_uv = (
        np.column_stack([u, np.full(n + 1, (z_high - z) / span)]) for z in (z0, z1)
    )

    def triangles(low: FloatArray, high: FloatArray) -> FloatArray:
        first = np.stack([low[:-1], low[1:], high[1:]], axis=1)
        second = np.stack([low[:-1], high[1:], high[:-1]], axis=1)
        if r0 == 0.0:
            return second
        return first if r1 == 0.0 else np.concatenate([first, second])

    return triangles(*rings), triangles(outward, outward), triangles(lower_uv, upper_uv)


def _from_faces(
    faces: Sequence[FloatArray], colour: Colour, *, surface: Surface | None = None
) -> Part:
    """Gives flat convex faces as triangles; a four-cornered face carries the whole surface."""
    return _join([_fan(face) for face in faces], colour, surface)


def _join(
    faces: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
    colour: Colour,
    surface: Surface | None,
) -> Part:
    """Gives a part of faces, each with its corners, normals and uv."""
    corners, normals, uv = (np.concatenate(arrays) for arrays in zip(*faces, strict=True))
    return Part(
        corners=corners,
        normals=normals,
        uv=uv,
        faces=np.repeat(np.arange(len(faces)), [len(face[0]) for face in faces]),
        colour=colour,
        surface=surface,
    )


def _fan(face: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    n = len(face)
    order = np.array([[0, i, i + 1] for i in range(1, n - 1)])
    normal = np.cross(face[1] - face[0], face[2] - face[0])
    normal /= np.linalg.norm(normal)
    uv = np.zeros((n, 2))
    if n == 4:
        uv = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
    return face[order], np.broadcast_to(normal, (len(order), 3, 3)).copy(), uv[order]
