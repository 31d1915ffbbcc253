"""The metric grid of a picture: lines under the walls, and numbers outside the map."""

import itertools
import math
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.picture.ink import (
    NUMBER_SIZE_PX,
    clip_segment,
    draw_zero_ring,
    stamp,
    text_patch,
)
from mapspeak.spatial.picture.marks import (
    FRAME,
    GRID_OVER,
    IS_BUSY,
    ZERO_LINE_OVER,
    Canvas,
)
from mapspeak.spatial.picture.plan import Extent, Margins
from mapspeak.spatial.picture.transform import Box, PictureView, is_north_up

_NUMBER_GAP_PX = 6
_CORNER_PX = 1e-6
_APART_PX = 10
"""Numbers that far apart along a line of text are not read as one; a space is 4 pixels."""
_MIN_WIDTH_PX = 300


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MetricLine:
    """One line of the metric grid where it crosses the map area.

    Attributes:
        axis: "x" for a line of constant x, "y" for one of constant y.
        multiple: That constant, in grid spacings.
        ends: The points (u, v) of the map area in which it meets its sides, shape (2, 2).
    """

    axis: str
    multiple: int
    ends: FloatArray


def margins_for(extent: Extent, spacing_m: float, *, up_rad: float, legend_px: int) -> Margins:
    """Return the room that the numbers along the sides need, and a legend of that height below."""
    sides = (extent.left_m, extent.right_m, extent.bottom_m, extent.top_m)
    farthest = -math.ceil(max(abs(side) for side in sides) / spacing_m)
    widest = _number("x", farthest, spacing_m, up_rad)
    height, width = text_patch(widest, NUMBER_SIZE_PX).shape
    return Margins(
        side_px=width + 2 * _NUMBER_GAP_PX,
        top_px=height + 2 * _NUMBER_GAP_PX,
        bottom_px=height + 2 * _NUMBER_GAP_PX + legend_px,
        min_width_px=_MIN_WIDTH_PX,
    )


def legend_top(view: PictureView) -> int:
    """Return the first row below the numbers under the map."""
    height = text_patch("0", NUMBER_SIZE_PX).shape[0]
    return view.area.bottom + int(height) + 2 * _NUMBER_GAP_PX


def draw_axes(canvas: Canvas, view: PictureView, spacing_m: float) -> None:
    """Draw the metric grid under the walls, and a thin frame and numbers around the map."""
    lines = lines_in_view(view, spacing_m)
    inside, area = view.area_of(canvas), view.area
    _draw_lines_under_walls(inside, lines)
    _draw_zero(inside, view)
    cv2.rectangle(canvas, (area.left - 1, area.top - 1), (area.right, area.bottom), (FRAME,))
    _draw_numbers(canvas, view, lines, spacing_m)


def lines_in_view(view: PictureView, spacing_m: float) -> tuple[MetricLine, ...]:
    """Return the lines at whole multiples of the spacing that cross the map area."""
    corners = view.area_corners()
    lines = []
    for index, axis in enumerate("xy"):
        low, high = corners[:, index].min() / spacing_m, corners[:, index].max() / spacing_m
        for multiple in range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1):
            ends = _ends_in_area(view, index, multiple * spacing_m)
            if ends is not None:
                lines.append(MetricLine(axis=axis, multiple=multiple, ends=ends))
    return tuple(lines)


def _draw_lines_under_walls(inside: Canvas, lines: tuple[MetricLine, ...]) -> None:
    """Draw the grid on the map area so that no wall pixel changes; zero's lines are stronger."""
    for over, wanted in (
        (GRID_OVER, [line for line in lines if line.multiple != 0]),
        (ZERO_LINE_OVER, [line for line in lines if line.multiple == 0]),
    ):
        mask = np.zeros(inside.shape, dtype=np.uint8)
        last = np.array(inside.shape[::-1]) - 1
        for line in wanted:
            start, end = np.clip(np.floor(line.ends + 1e-6), 0, last).astype(int).tolist()
            cv2.line(mask, start, end, (1,))
        crossed = mask > 0
        inside[crossed] = over[inside[crossed]]


def _draw_numbers(
    canvas: Canvas, view: PictureView, lines: tuple[MetricLine, ...], spacing_m: float
) -> None:
    """Write each line's coordinate outside the map at both of its ends.

    Where the numbers would touch, only every second, fifth or tenth line gets one. At a corner
    the number of one side gives way to that of the other: it is pulled in, or left out.
    """
    patches = {
        line: text_patch(_number(line.axis, line.multiple, spacing_m, view.up_rad), NUMBER_SIZE_PX)
        for line in lines
    }
    widest_px = max((patch.shape[1] for patch in patches.values()), default=0)
    stride = _stride(widest_px + _APART_PX, spacing_m * view.pixels_per_m)
    taken: list[Box] = []
    for line in (line for line in lines if line.multiple % stride == 0):
        for end in line.ends:
            on_line = _box_outside(line, end, patches[line], view.area)
            for box in (on_line, _pulled_in(on_line, view.area)):
                # Nearer numbers could be read as one.
                near = Box(box.left - _APART_PX, box.top - 2, box.right + _APART_PX, box.bottom + 2)
                if not any(near.overlaps(other) for other in taken):
                    taken.append(box)
                    stamp(canvas, patches[line], (box.left, box.top), halo_px=0)
                    break


def _draw_zero(inside: Canvas, view: PictureView) -> None:
    """Mark the map's origin, (0, 0), with a ring under the walls, where the picture shows it."""
    if not view.shows(Point(0.0, 0.0)):
        return
    before = inside.copy()
    draw_zero_ring(inside, view.area_pixels_at(np.zeros((1, 2)))[0])
    np.copyto(inside, before, where=cv2.LUT(before, IS_BUSY) > 0)


def _ends_in_area(view: PictureView, index: int, value_m: float) -> FloatArray | None:
    """Return where the line of constant x (index 0) or y (1) meets the sides of the map area."""
    corners = view.area_corners()
    along = 1 - index
    points = np.full((2, 2), value_m)
    points[:, along] = corners[:, along].min(), corners[:, along].max()
    start, end = view.area_pixels_at(points)
    if abs(start[0] - end[0]) < 1e-6:
        end[0] = start[0]
    if abs(start[1] - end[1]) < 1e-6:
        end[1] = start[1]
    return clip_segment(start, end, np.array([view.area.width, view.area.height], dtype=float))


def _box_outside(line: MetricLine, end: FloatArray, patch: Canvas, area: Box) -> Box:
    """Return the box for a number beside the point in which its line leaves the map area.

    In a corner that is on the side which the line runs towards.
    """
    height, width = patch.shape
    left, top = end[0] + area.left - width / 2, end[1] + area.top - height / 2
    away = np.abs(line.ends[1] - line.ends[0])
    is_at_side = min(end[0], area.width - end[0]) <= _CORNER_PX
    is_above_or_below = min(end[1], area.height - end[1]) <= _CORNER_PX
    if is_above_or_below and not (is_at_side and away[0] > away[1]):
        is_above = end[1] < area.height / 2
        top = area.top - _NUMBER_GAP_PX - height if is_above else area.bottom + _NUMBER_GAP_PX
    else:
        is_left = end[0] < area.width / 2
        left = area.left - _NUMBER_GAP_PX - width if is_left else area.right + _NUMBER_GAP_PX
    return Box(round(left), round(top), round(left) + width, round(top) + height)


def _pulled_in(box: Box, area: Box) -> Box:
    """Return a box beside the map area moved along its side until it does not pass the corner."""
    left, top = box.left, box.top
    if area.top < box.bottom and box.top < area.bottom:
        top = min(max(top, area.top), area.bottom - box.height)
    else:
        left = min(max(left, area.left), area.right - box.width)
    return Box(left, top, left + box.width, top + box.height)


def _number(axis: str, multiple: int, spacing_m: float, up_rad: float) -> str:
    n_decimals = max(0, -math.floor(math.log10(spacing_m) + 1e-9))
    text = f"{multiple * spacing_m:.{n_decimals}f}"
    return text if is_north_up(up_rad) else f"{axis}={text}"


def _stride(needed_px: float, pitch_px: float) -> int:
    """Return the smallest of 1, 2, 5, 10, 20, ... lines that leaves room for a number each."""
    steps = (step * int(10**power) for power in itertools.count() for step in (1, 2, 5))
    return next(step for step in steps if step * pitch_px >= needed_px)
