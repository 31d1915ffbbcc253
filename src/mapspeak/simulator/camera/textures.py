"""Drawn surfaces: signs, goods, devices, floor and walls, and the atlas that holds them.

The folder `surfaces` holds what `tools/worldgen/surfaces.py` has drawn; the signs follow the idea
of ISO 7010: red for fire equipment, green for escape and first aid. Grain is computed here. An
atlas is one large picture that holds many surfaces, each at several sizes (mip levels).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapspeak.simulator.worlds.models import Surface

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
Picture = NDArray[np.uint8]

TILED = frozenset({Surface.FLOOR, Surface.WALL, Surface.CEILING})
"""Surfaces that repeat without a seam beyond 0..1; all others are drawn once."""

GLOWING = frozenset(
    {Surface.EXIT_SIGN, Surface.SCREEN, Surface.PRINTER_PANEL, Surface.COFFEE_PANEL}
)
"""Surfaces that shine by themselves."""

_SEED = 7


@cache
def draw(surface: Surface) -> Picture:
    """Return a drawn surface as red, green and blue, 0 to 255, shape (height, width, 3)."""
    if surface in _COMPUTED:
        values = _COMPUTED[surface]()
    elif surface in _GRAINS:
        values = _read_drawn(surface) + _GRAINS[surface]()
    else:
        values = _read_drawn(surface).astype(np.float64)
    picture = np.clip(values, 0, 255).astype(np.uint8)
    picture.setflags(write=False)
    return picture


def _read_drawn(surface: Surface) -> Picture:
    """Return the drawing of a surface, shape (height, width, 3)."""
    folder = resources.files("mapspeak.simulator.camera").joinpath("surfaces")
    with folder.joinpath(f"{surface}.png").open("rb") as file:
        return np.asarray(Image.open(file).convert("RGB"))


# --- computed --------------------------------------------------------------------------------


def _compute_wood() -> FloatArray:
    """Compute the grain of a board along the picture's width; its tint is that of the part."""
    return 232.0 + 16.0 * _grain(256, 256, rows=0.25, columns=0.015)


def _compute_floor() -> FloatArray:
    """Compute four metres of sealed concrete with its joints."""
    n = 1024
    clouds = 3.5 * _ripples(n, n, rows=0.006, columns=0.006)
    grains = 2.2 * _ripples(n, n, rows=0.4, columns=0.4)
    grey = 158.0 + clouds + grains
    floor = np.stack([grey, grey * 0.995, grey * 0.97], axis=2)
    for edge in (slice(0, 3), slice(n - 2, n)):
        floor[edge, :] *= 0.72
        floor[:, edge] *= 0.72
    return floor


def _compute_wall() -> FloatArray:
    """Compute two metres of painted plaster."""
    n = 256
    clouds = 0.8 * _ripples(n, n, rows=0.02, columns=0.02)
    grains = 1.2 * _ripples(n, n, rows=0.4, columns=0.4)
    plaster = 240.0 + (clouds + grains)[:, :, None] + np.array([0.0, 0.0, -5.0])
    return np.asarray(plaster)


def _compute_ceiling() -> FloatArray:
    """Compute a suspended ceiling: two by two boards of 0.6 m."""
    n = 256
    ceiling = 232.0 + 3.0 * _ripples(n, n, rows=0.4, columns=0.4)
    for edge in (slice(0, 2), slice(n // 2 - 2, n // 2 + 2), slice(n - 2, n)):
        ceiling[edge, :] *= 0.86
        ceiling[:, edge] *= 0.86
    return np.repeat(ceiling[:, :, None], 3, axis=2)


def _grain(n_rows: int, n_columns: int, *, rows: float, columns: float) -> FloatArray:
    """Return ripples for all three colours alike, shape (n_rows, n_columns, 3)."""
    ripples = _ripples(n_rows, n_columns, rows=rows, columns=columns)
    return np.repeat(ripples[:, :, None], 3, axis=2)


def _ripples(n_rows: int, n_columns: int, *, rows: float, columns: float) -> FloatArray:
    """Return noise that repeats without a seam; the arguments are its highest frequencies."""
    noise = np.random.default_rng(_SEED).normal(size=(n_rows, n_columns))
    across = np.fft.fftfreq(n_rows)[:, None] / rows
    along = np.fft.fftfreq(n_columns)[None, :] / columns
    smooth = np.fft.ifft2(np.fft.fft2(noise) * np.exp(-(across**2) - along**2)).real
    return np.asarray(smooth / smooth.std())


_COMPUTED: Mapping[Surface, Callable[[], FloatArray]] = MappingProxyType(
    {
        Surface.WOOD: _compute_wood,
        Surface.FLOOR: _compute_floor,
        Surface.WALL: _compute_wall,
        Surface.CEILING: _compute_ceiling,
    }
)

_GRAINS: Mapping[Surface, Callable[[], FloatArray]] = MappingProxyType(
    {
        Surface.CARDBOARD: lambda: 7.0 * _grain(192, 256, rows=0.35, columns=0.02),
        Surface.CRATE_SIDE: lambda: 12.0 * _grain(256, 256, rows=0.3, columns=0.03),
    }
)
"""Roughness of paper and wood, added to the drawings on them."""


# --- packed ----------------------------------------------------------------------------------


N_LEVELS = 8
WIDTH_PX = 2048
_CHUNK = 4096


@dataclass(frozen=True, slots=True, eq=False)
class TextureAtlas:
    """Drawn surfaces, each at several sizes.

    Attributes:
        picture: All of them, shape (height, width, 3).
        places: Left, top, width and height of each surface at each level, shape (n, levels, 4).
        sizes_px: Width and height of each surface, shape (n, 2).
        repeats: Whether a surface goes on beyond 0..1, shape (n,).
    """

    picture: NDArray[np.uint8]
    places: Float32Array
    sizes_px: Float32Array
    repeats: NDArray[np.bool_]

    def sample(
        self, which: NDArray[np.intp], uv: Float32Array, spread: Float32Array
    ) -> NDArray[np.uint8]:
        """Return colours, shape (n, 3).

        Args:
            which: The surface of each sample.
            uv: Where on it, shape (n, 2).
            spread: The area of a pixel on the surface, in units of uv, shape (n,).
        """
        texels = spread * self.sizes_px.prod(axis=1)[which]
        level = np.clip(0.5 * np.log2(np.maximum(texels, 1e-9)) + 0.2, 0, N_LEVELS - 1)
        place = self.places[which, level.astype(np.intp)]
        repeats, at = self.repeats[which], np.empty_like(uv)
        # Column by column: numpy is slow over rows of two.
        for axis in (0, 1):
            along = uv[:, axis]
            within = np.where(repeats, along - np.floor(along), np.clip(along, 0.0, 1.0))
            at[:, axis] = place[:, axis] + within * place[:, 2 + axis] - np.float32(0.5)
        return look_up(self.picture, at)


def build_atlas(pictures: Sequence[NDArray[np.uint8]], repeats: Sequence[bool]) -> TextureAtlas:
    """Pack pictures with their mip levels, each with a border so that neighbours do not bleed."""
    levels = [
        np.pad(level, ((1, 1), (1, 1), (0, 0)), mode="wrap" if tiled else "edge")
        for picture, tiled in zip(pictures, repeats, strict=True)
        for level in _mip_levels(picture)
    ]
    sizes = np.array([level.shape[1::-1] for level in levels])
    corners, height = pack(sizes, WIDTH_PX)
    whole = np.zeros((height, WIDTH_PX, 3), dtype=np.uint8)
    for level, (x, y) in zip(levels, corners, strict=True):
        whole[y : y + level.shape[0], x : x + level.shape[1]] = level
    places = np.concatenate([corners + 1, sizes - 2], axis=1).astype(np.float32)
    by_surface = places.reshape(len(pictures), N_LEVELS, 4)
    return TextureAtlas(whole, by_surface, by_surface[:, 0, 2:].copy(), np.array(repeats))


def pack(sizes: NDArray[np.intp], width: int) -> tuple[NDArray[np.intp], int]:
    """Return the upper left corners of rectangles laid out in shelves, and the height needed."""
    corners = np.zeros_like(sizes)
    x = y = shelf = 0
    for i in np.argsort(-sizes[:, 1], kind="stable"):
        if x + sizes[i, 0] > width:
            x, y, shelf = 0, y + shelf, 0
        corners[i] = (x, y)
        x += int(sizes[i, 0])
        shelf = max(shelf, int(sizes[i, 1]))
    return corners, y + shelf


def look_up(picture: NDArray[Any], at: Float32Array) -> NDArray[Any]:
    """Return a picture's values between its pixels, at places (x, y) of shape (n, 2)."""
    n = len(at)
    # OpenCV looks up in a picture-shaped table, with fewer than 32768 columns.
    table = np.zeros((-(-max(n, 1) // _CHUNK), _CHUNK, 2), dtype=np.float32)
    table.reshape(-1, 2)[:n] = at
    # OpenCV's type stubs leave out that the second map may be None.
    found = cv2.remap(  # type: ignore[call-overload]
        picture, table, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(found).reshape(-1, *picture.shape[2:])[:n]


def _mip_levels(picture: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    levels = [picture]
    while len(levels) < N_LEVELS:
        height, width = levels[-1].shape[:2]
        half = (max(width // 2, 1), max(height // 2, 1))
        levels.append(np.asarray(cv2.resize(levels[-1], half, interpolation=cv2.INTER_AREA)))
    return levels
