"""One large picture that holds many: drawn surfaces, each at several sizes (mip levels)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
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
