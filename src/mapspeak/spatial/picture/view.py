"""Where a map lies in a picture: pixels, their conversion to the world, and grid spacings."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray

NORTH_UP_RAD = math.pi / 2
"""The view in which the map's y axis points up and its x axis to the right."""

_ANGLE_SLACK_RAD = 1e-9
_BORDER_SLACK_PX = 1e-6
"""Rounding in the last digits must not push a cell's corner into the pixel before it."""


def is_north_up(up_rad: float) -> bool:
    """Return True for the view with the map's y axis up."""
    return abs(math.remainder(up_rad - NORTH_UP_RAD, math.tau)) < _ANGLE_SLACK_RAD


@dataclass(frozen=True, slots=True)
class Pixel:
    """One pixel of a picture: column u from the left, row v from the top."""

    u: int
    v: int


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle of pixels; right and bottom are the first pixels outside."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def width(self) -> int:
        """Pixels from left to right."""
        return self.right - self.left

    @property
    def height(self) -> int:
        """Pixels from top to bottom."""
        return self.bottom - self.top

    def contains(self, pixel: Pixel) -> bool:
        """Return True when the pixel lies inside."""
        return self.left <= pixel.u < self.right and self.top <= pixel.v < self.bottom

    def overlaps(self, other: "Box") -> bool:
        """Return True when the two share a pixel."""
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureView:
    """The exact transform between metres in the map and pixels of one picture.

    Attributes:
        corner: The point of the map in the top left corner of the map area.
        up_rad: The direction in the map that points up in the picture; pi/2 is y up.
        pixels_per_m: The scale, the same along both axes.
        area: The part of the picture that shows the map.
    """

    corner: Point
    up_rad: float
    pixels_per_m: float
    area: Box
    width_px: int
    height_px: int

    def pixel_at(self, point: Point) -> Pixel:
        """Return the pixel a point falls in, which may lie outside the picture (see `shows`)."""
        u, v = self.fractional_pixels_at(np.array([[point.x, point.y]]))[0]
        return Pixel(math.floor(u + _BORDER_SLACK_PX), math.floor(v + _BORDER_SLACK_PX))

    def point_at(self, pixel: Pixel) -> Point:
        """Return the point of the map in the middle of a pixel."""
        x, y = self.points_at(np.array([[pixel.u + 0.5, pixel.v + 0.5]]))[0]
        return Point(float(x), float(y))

    def shows(self, point: Point) -> bool:
        """Return True when the point lies in the part of the map that the picture shows."""
        return self.area.contains(self.pixel_at(point))

    def fractional_pixels_at(self, points: FloatArray) -> FloatArray:
        """Return (u, v) of shape (n, 2) as real numbers; a pixel's middle is at +0.5, +0.5.

        For an unturned map that fills the picture at one pixel per cell this is eq. 3 of the paper.
        """
        dx, dy = points[:, 0] - self.corner.x, points[:, 1] - self.corner.y
        cos, sin = math.cos(self.up_rad), math.sin(self.up_rad)
        u = self.area.left + self.pixels_per_m * (sin * dx - cos * dy)
        v = self.area.top - self.pixels_per_m * (cos * dx + sin * dy)
        return np.stack([u, v], axis=1)

    def shows_each(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return `shows` for points of shape (n, 2)."""
        pixels = np.floor(self.fractional_pixels_at(points) + _BORDER_SLACK_PX)
        first, end = (self.area.left, self.area.top), (self.area.right, self.area.bottom)
        return np.asarray(((pixels >= first) & (pixels < end)).all(axis=1))

    def area_pixels_at(self, points: FloatArray) -> FloatArray:
        """Return (u, v) as real numbers, counted from the top left corner of the map area."""
        corner = np.array([self.area.left, self.area.top])
        return np.asarray(self.fractional_pixels_at(points) - corner)

    def area_of(self, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the map area of a picture's array, sharing its memory."""
        return picture[self.area.top : self.area.bottom, self.area.left : self.area.right]

    def points_at(self, pixels: FloatArray) -> FloatArray:
        """Return the points of the map for (u, v) as real numbers, shape (n, 2)."""
        right_m = (pixels[:, 0] - self.area.left) / self.pixels_per_m
        up_m = (self.area.top - pixels[:, 1]) / self.pixels_per_m
        cos, sin = math.cos(self.up_rad), math.sin(self.up_rad)
        x = self.corner.x + sin * right_m + cos * up_m
        y = self.corner.y - cos * right_m + sin * up_m
        return np.stack([x, y], axis=1)

    def area_corners(self) -> FloatArray:
        """Return the four corners of the map area as points of the map, shape (4, 2)."""
        left, top, right, bottom = dataclasses.astuple(self.area)
        corners = [[left, top], [right, top], [right, bottom], [left, bottom]]
        return self.points_at(np.array(corners, dtype=np.float64))

    def heading_at(self, yaw_rad: float) -> float:
        """Return a yaw of the map as an angle in the picture, counter-clockwise from its right."""
        return yaw_rad - self.up_rad + NORTH_UP_RAD


_N_LINES_ALONG_LONG_SIDE = 8.5
"""Between 6 and 12: enough to read coordinates from, few enough to see the map."""

_PAPER_N_LINES = 15
_PAPER_MAX_LINES = 90
_STEPS = (1.0, 2.0, 5.0)


def even_spacing_m(longest_m: float) -> float:
    """Return the spacing that puts about 6 to 12 lines across the longest side of a map."""
    return round_length_m(longest_m / _N_LINES_ALONG_LONG_SIDE)


def round_length_m(wanted_m: float) -> float:
    """Return the 1, 2 or 5 times a power of ten that comes nearest to a length."""
    return min(_candidates(wanted_m), key=lambda step_m: abs(math.log(step_m / wanted_m)))


def paper_spacing_m(width_m: float, height_m: float, resolution_m: float) -> float:
    """Return the paper's adaptive spacing: the next intuitive value from s_base on (eq. 5).

    On maps more than six times as long as wide it grows beyond the paper's, for the same purpose:
    so that the lines across the long side do not merge into a grey floor.
    """
    base_m = max(min(width_m, height_m) / _PAPER_N_LINES, resolution_m)
    base_m = max(base_m, max(width_m, height_m) / _PAPER_MAX_LINES)
    return next(step_m for step_m in _candidates(base_m) if step_m >= base_m * (1 - 1e-9))


def _candidates(around_m: float) -> list[float]:
    exponent = math.floor(math.log10(around_m))
    return [step * 10.0**power for power in range(exponent - 1, exponent + 2) for step in _STEPS]
