"""Symbols and lines on the map area: marks, paths, the robot's arrow."""

import itertools
import math

import numpy as np

from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.picture.ink import clip_segment, draw_polygon, draw_stroke
from mapspeak.spatial.picture.marks import Line, LineStyle, Shape
from mapspeak.spatial.picture.palette import Canvas, Colour
from mapspeak.spatial.picture.view import Box, View

__all__ = [
    "ARROW_REACH_PX",
    "SYMBOL_REACH_PX",
    "arrow_pixels",
    "draw_arrow",
    "draw_line",
    "draw_run",
    "draw_shape",
    "draw_zero_ring",
    "is_in_view",
    "symbol_box",
]


ARROW_REACH_PX = 19.0
SYMBOL_REACH_PX = 9.0

_ARROW_PX = np.array([[17.0, 0.0], [-9.0, 9.0], [-4.0, 0.0], [-9.0, -9.0]])
"""The arrow in the robot's own frame, x forward and y left, around the robot's position."""

_DASH_PX, _GAP_PX = 11.0, 7.0
_ZERO_RADIUS_PX = 6
_CORNER_TURNS = {
    Shape.SQUARE: np.arange(4) * math.tau / 4 + math.tau / 8,
    Shape.DIAMOND: np.arange(4) * math.tau / 4,
    Shape.TRIANGLE: np.arange(3) * math.tau / 3 - math.tau / 4,
    Shape.CIRCLE: np.arange(24) * math.tau / 24,
}
_CROSS_PX = np.array(
    [
        [0, -3], [5, -8], [8, -5], [3, 0], [8, 5], [5, 8],
        [0, 3], [-5, 8], [-8, 5], [-3, 0], [-8, -5], [-5, -8],
    ],
    dtype=np.float64,
)  # fmt: skip


def arrow_pixels(arrow: FloatArray, heading_rad: float) -> FloatArray:
    """Gives an arrow's displacements (u, v) in the picture (paper eq. 7).

    Args:
        arrow: Its points in the robot's frame, x forward and y left, shape (n, 2), in pixels.
        heading_rad: The robot's heading in the picture, counter-clockwise from its right.
    """
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    right = arrow[:, 0] * cos - arrow[:, 1] * sin
    down = -(arrow[:, 0] * sin + arrow[:, 1] * cos)
    return np.stack([right, down], axis=1)


def symbol_box(place: FloatArray, reach_px: float) -> Box:
    """Gives the box of the map area that a symbol at (u, v) takes."""
    u, v = place
    return Box(
        math.floor(u - reach_px),
        math.floor(v - reach_px),
        math.ceil(u + reach_px),
        math.ceil(v + reach_px),
    )


def draw_arrow(canvas: Canvas, place: FloatArray, heading_rad: float, *, scale: float = 1) -> None:
    """Draws the robot's arrow, with a white edge, at (u, v); see `arrow_pixels` for the heading."""
    arrow = arrow_pixels(scale * _ARROW_PX, heading_rad)
    draw_polygon(canvas, place + arrow, Colour.VERMILION, halo_px=3)


def draw_shape(canvas: Canvas, place: FloatArray, shape: Shape, colour: Colour) -> None:
    """Draws a shape around a place (u, v)."""
    if shape is Shape.CROSS:
        draw_polygon(canvas, place + _CROSS_PX, colour)
        return
    turns = _CORNER_TURNS[shape]
    reach = 6.0 if shape is Shape.CIRCLE else 8.0
    corners = place + reach * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    draw_polygon(canvas, corners, colour)


def draw_zero_ring(canvas: Canvas, place: FloatArray) -> None:
    """Draws the ring that marks the map's origin, around (u, v)."""
    turns = np.linspace(0.0, math.tau, 33)
    circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    draw_stroke(canvas, place + _ZERO_RADIUS_PX * circle, Colour.INK, width_px=2)
    draw_polygon(canvas, place + circle, Colour.INK, halo_px=0)


def is_in_view(view: View, line: Line) -> bool:
    """True when some of a line lies in the map area."""
    points = view.area_pixels_at(np.array([[point.x, point.y] for point in line.points]))
    return bool(_runs_inside(points, view.area))


def draw_line(inside: Canvas, view: View, line: Line) -> None:
    """Draws the part of a line that lies in the map area."""
    points = view.area_pixels_at(np.array([[point.x, point.y] for point in line.points]))
    for run in _runs_inside(points, view.area):
        draw_run(inside, run, line.style, line.colour, width_px=line.width_px)


def draw_run(
    canvas: Canvas, run: FloatArray, style: LineStyle, colour: Colour, *, width_px: int
) -> None:
    """Draws an unbroken line through points (u, v) of shape (n, 2), solid or in dashes."""
    for piece in [run] if style is LineStyle.SOLID else _dashes(run):
        draw_stroke(canvas, piece, colour, width_px=width_px)


def _runs_inside(points: FloatArray, area: Box) -> list[FloatArray]:
    """Gives the pieces of a polyline inside the area, each as an unbroken polyline."""
    size = np.array([area.width, area.height], dtype=np.float64)
    if ((points >= 0) & (points <= size)).all():
        return [points]
    runs: list[list[FloatArray]] = []
    for start, end in itertools.pairwise(points):
        part = clip_segment(start, end, size)
        if part is None:
            continue
        if runs and np.allclose(runs[-1][-1], part[0]):
            runs[-1].append(part[1])
        else:
            runs.append([part[0], part[1]])
    return [np.array(run) for run in runs]


def _dashes(run: FloatArray) -> list[FloatArray]:
    """Cuts a polyline into dashes of equal length along it, keeping its corners."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(run, axis=0).T))])
    dashes = []
    for start in np.arange(0.0, along[-1], _DASH_PX + _GAP_PX):
        end = min(start + _DASH_PX, along[-1])
        between = along[(along > start) & (along < end)]
        stops = np.concatenate([[start], between, [end]])
        columns = [np.interp(stops, along, run[:, axis]) for axis in (0, 1)]
        dashes.append(np.stack(columns, axis=1))
    return dashes
