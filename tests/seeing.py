"""Reading drawn maps as a person does: what colour is there, at this place of the map?"""

import io

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapspeak.geometry import Point
from mapspeak.spatial.picture import MapPicture
from mapspeak.spatial.picture.ink import text_patch
from mapspeak.spatial.picture.marks import (
    FREE,
    GREYS,
    N_RAMP_LEVELS,
    PALETTE,
    PAPER,
    RAMPS,
    UNKNOWN_GROUND,
    WALL,
    Colour,
)

WALL_RGB = tuple(PALETTE[WALL].tolist())
FREE_RGB = tuple(PALETTE[FREE].tolist())
UNKNOWN_RGB = tuple(PALETTE[UNKNOWN_GROUND].tolist())
INK_FROM = 24
PAPER_OCCUPIED_RGB = tuple(PALETTE[GREYS[-1]].tolist())


def pixels_of(picture: MapPicture) -> NDArray[np.uint8]:
    """Decodes the PNG to red, green, blue; shape (rows, cols, 3)."""
    return np.asarray(Image.open(io.BytesIO(picture.png)).convert("RGB"))


def colour_at(picture: MapPicture, point: Point) -> tuple[int, ...]:
    """Gives the colour of the pixel in which a point of the map lies."""
    return tuple(colours_at(picture, np.array([[point.x, point.y]]))[0].tolist())


def colours_at(picture: MapPicture, points: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Gives the colours at points of shape (n, 2) that the picture shows; shape (n, 3)."""
    u, v = picture.view.pixels_at(points).T
    return np.asarray(pixels_of(picture)[v, u])


def is_colour(pixels: NDArray[np.uint8], colour: tuple[int, ...]) -> NDArray[np.bool_]:
    """Gives True where pixels have exactly that colour."""
    return np.asarray((pixels == np.array(colour, dtype=np.uint8)).all(axis=-1))


def full_colour(colour: Colour) -> tuple[int, ...]:
    """Gives the colour of the middle of a mark or line of that name."""
    return tuple(PALETTE[RAMPS[colour][-1]].tolist())


def find_text(picture: MapPicture, text: str, size_px: int) -> list[tuple[float, float]]:
    """Gives the middles (u, v) of all places where a text stands whole and unbroken."""
    patch = text_patch(text, size_px)
    inked = np.full(patch.shape, PAPER, dtype=np.uint8)
    is_ink = patch >= INK_FROM
    inked[is_ink] = RAMPS[Colour.INK][patch[is_ink].astype(int) * N_RAMP_LEVELS // 256]
    wanted = PALETTE[inked][..., 0].astype(np.float32)
    seen = pixels_of(picture)[..., 0].astype(np.float32)
    apart = cv2.matchTemplate(seen, wanted, cv2.TM_SQDIFF, mask=is_ink.astype(np.float32))
    rows, cols = np.nonzero(apart < 0.5)
    height, width = patch.shape
    return [(col + width / 2, row + height / 2) for row, col in zip(rows, cols, strict=True)]
