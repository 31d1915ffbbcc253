"""A small picture to draw on in units of a hundredth of its height, with smooth edges."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Colour = tuple[int, int, int]
Place = tuple[float, float]
Picture = NDArray[np.uint8]

_SMOOTHING = 3


class Canvas:
    """A picture in the making: x to the right and y down, 100 units high."""

    def __init__(self, width_px: int, height_px: int, background: Colour) -> None:
        self.width = 100.0 * width_px / height_px
        self._size = (width_px, height_px)
        self._scale = _SMOOTHING * height_px / 100.0
        large = (width_px * _SMOOTHING, height_px * _SMOOTHING)
        self._image = Image.new("RGB", large, background)
        self._draw = ImageDraw.Draw(self._image)

    def polygon(self, points: Sequence[Place], fill: Colour) -> None:
        """Fills a polygon."""
        self._draw.polygon([self._place(point) for point in points], fill=fill)

    def rectangle(self, low: Place, high: Place, fill: Colour, *, rounding: float = 0.0) -> None:
        """Fills a rectangle between its upper left and its lower right corner."""
        self._draw.rounded_rectangle(
            [self._place(low), self._place(high)], radius=rounding * self._scale, fill=fill
        )

    def disc(self, centre: Place, radius: float, fill: Colour) -> None:
        """Fills a circle."""
        self._draw.circle(self._place(centre), radius * self._scale, fill=fill)

    def line(self, points: Sequence[Place], width: float, fill: Colour) -> None:
        """Draws a line with round ends and joints."""
        pixels = round(width * self._scale)
        self._draw.line([self._place(point) for point in points], fill=fill, width=pixels)
        for point in points:
            self.disc(point, width / 2, fill)

    def arc(
        self, centre: Place, radius: float, turn_deg: Place, stroke: float, fill: Colour
    ) -> None:
        """Draws part of a circle, from one angle to the other; 0 is right, 90 is down."""
        n = max(int(abs(turn_deg[1] - turn_deg[0]) / 6), 2)
        angles = (turn_deg[0] + (turn_deg[1] - turn_deg[0]) * i / n for i in range(n + 1))
        turned = [
            (
                centre[0] + radius * math.cos(math.radians(angle)),
                centre[1] + radius * math.sin(math.radians(angle)),
            )
            for angle in angles
        ]
        self.line(turned, stroke, fill)

    def text(self, centre: Place, words: str, height: float, fill: Colour) -> None:
        """Writes words around a centre."""
        font = ImageFont.load_default(size=height * self._scale)
        self._draw.text(
            self._place(centre),
            words,
            fill=fill,
            font=font,
            anchor="mm",
            stroke_width=height * self._scale / 28,
            stroke_fill=fill,
        )

    def finish(self) -> Picture:
        """Gives the picture, shape (height, width, 3)."""
        return np.asarray(self._image.resize(self._size, Image.Resampling.BOX))

    def _place(self, point: Place) -> Place:
        return (point[0] * self._scale, point[1] * self._scale)
