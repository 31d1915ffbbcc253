"""Reading drawn maps as a person does: what colour is there, at this place of the map?"""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapspeak.geometry import Point
from mapspeak.spatial.picture import MapPicture
from mapspeak.spatial.picture.palette import (
    FREE,
    GREYS,
    PALETTE,
    RAMPS,
    UNKNOWN_GROUND,
    WALL,
    Colour,
)

WALL_RGB = tuple(PALETTE[WALL].tolist())
FREE_RGB = tuple(PALETTE[FREE].tolist())
UNKNOWN_RGB = tuple(PALETTE[UNKNOWN_GROUND].tolist())
PAPER_OCCUPIED_RGB = tuple(PALETTE[GREYS[-1]].tolist())


def pixels_of(picture: MapPicture) -> NDArray[np.uint8]:
    """Decodes the PNG to red, green, blue; shape (rows, cols, 3)."""
    return np.asarray(Image.open(io.BytesIO(picture.png)).convert("RGB"))


def colour_at(picture: MapPicture, point: Point) -> tuple[int, ...]:
    """Gives the colour of the pixel in which a point of the map lies."""
    return tuple(colours_at(picture, np.array([[point.x, point.y]]))[0].tolist())


def colours_at(picture: MapPicture, points: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Gives the colours at points of shape (n, 2) that the picture shows; shape (n, 3)."""
    pixels = [picture.view.pixel_at(Point(float(x), float(y))) for x, y in points]
    return pixels_of(picture)[[pixel.v for pixel in pixels], [pixel.u for pixel in pixels]]


def is_colour(pixels: NDArray[np.uint8], colour: tuple[int, ...]) -> NDArray[np.bool_]:
    """Gives True where pixels have exactly that colour."""
    return np.asarray((pixels == np.array(colour, dtype=np.uint8)).all(axis=-1))


def full_colour(colour: Colour) -> tuple[int, ...]:
    """Gives the colour of the middle of a mark or line of that name."""
    return tuple(PALETTE[RAMPS[colour][-1]].tolist())
