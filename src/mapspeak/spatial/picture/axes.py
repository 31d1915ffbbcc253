"""The metric grid of a picture: lines under the walls, numbers outside the map, and a legend."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.picture.ink import (
    NUMBER_SIZE_PX,
    clip_segment,
    draw_polygon,
    draw_stroke,
    stamp,
    text_patch,
)
from mapspeak.spatial.picture.palette import (
    FRAME,
    GRID_OVER,
    IS_BUSY,
    WALL,
    ZERO_LINE_OVER,
    Canvas,
    Colour,
)
from mapspeak.spatial.picture.plan import Extent, Margins
from mapspeak.spatial.picture.spacing import decimals_of, round_length_m
from mapspeak.spatial.picture.view import NORTH_UP_RAD, Box, View

__all__ = [
    "LegendEntry",
    "MetricLine",
    "draw_frame",
    "draw_legend",
    "draw_lines_under_walls",
    "draw_numbers",
    "draw_zero",
    "lines_in_view",
    "margins_for",
]


_ANGLE_SLACK_RAD = 1e-9
_NUMBER_GAP_PX = 6
_LEGEND_HEIGHT_PX = 30
_SCALE_BAR_PX = 80
_LEGEND_GAP_PX = 18
_SWATCH_PX = 14
_MIN_WIDTH_PX = 300
_ZERO_RADIUS_PX = 6


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


@dataclass(frozen=True, slots=True)
class LegendEntry:
    """A colour of the ground, by its palette number, and what it means."""

    palette_number: int
    text: str


def margins_for(extent: Extent, spacing_m: float, *, up_rad: float) -> Margins:
    """Gives the room that the numbers along the sides and the legend need."""
    height, width = _widest_number(extent, spacing_m, up_rad).shape
    return Margins(
        side_px=width + 2 * _NUMBER_GAP_PX,
        top_px=height + 2 * _NUMBER_GAP_PX,
        bottom_px=height + 2 * _NUMBER_GAP_PX + _LEGEND_HEIGHT_PX,
        min_width_px=_MIN_WIDTH_PX,
    )


def lines_in_view(view: View, spacing_m: float) -> tuple[MetricLine, ...]:
    """Gives the lines at whole multiples of the spacing that cross the map area."""
    corners = view.area_corners()
    lines = []
    for index, axis in enumerate("xy"):
        low, high = corners[:, index].min() / spacing_m, corners[:, index].max() / spacing_m
        for multiple in range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1):
            ends = _ends_in_area(view, index, multiple * spacing_m)
            if ends is not None:
                lines.append(MetricLine(axis=axis, multiple=multiple, ends=ends))
    return tuple(lines)


def draw_lines_under_walls(inside: Canvas, lines: tuple[MetricLine, ...]) -> None:
    """Draws the grid on the map area so that no wall pixel changes; zero's lines are stronger."""
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


def draw_numbers(
    canvas: Canvas, view: View, lines: tuple[MetricLine, ...], spacing_m: float
) -> None:
    """Writes each line's coordinate outside the map at both of its ends.

    Where the numbers would touch, only every second, fifth or tenth line gets one.
    """
    patches = {
        line: text_patch(_number(line, spacing_m, view.up_rad), NUMBER_SIZE_PX) for line in lines
    }
    widest_px = max((patch.shape[1] for patch in patches.values()), default=0)
    stride = _stride(widest_px + _NUMBER_GAP_PX, spacing_m * view.pixels_per_m)
    taken: list[Box] = []
    for line in (line for line in lines if line.multiple % stride == 0):
        boxes = [_box_outside(end, patches[line], view.area) for end in line.ends]
        if any(box.overlaps(other) for box in boxes for other in taken):
            continue
        taken.extend(boxes)
        for box in boxes:
            stamp(canvas, patches[line], (box.left, box.top), halo_px=0)


def draw_frame(canvas: Canvas, area: Box) -> None:
    """Draws a thin frame around the map, outside it."""
    cv2.rectangle(canvas, (area.left - 1, area.top - 1), (area.right, area.bottom), (FRAME,))


def draw_zero(inside: Canvas, view: View) -> None:
    """Marks the map's origin, (0, 0), with a ring under the walls, where the picture shows it."""
    if not view.shows(Point(0.0, 0.0)):
        return
    centre = view.area_pixels_at(np.zeros((1, 2)))
    turns = np.linspace(0.0, math.tau, 33)
    circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    before = inside.copy()
    draw_stroke(inside, centre + _ZERO_RADIUS_PX * circle, Colour.INK, width_px=2)
    draw_polygon(inside, centre + circle, Colour.INK, halo_px=0)
    np.copyto(inside, before, where=cv2.LUT(before, IS_BUSY) > 0)


def draw_legend(
    canvas: Canvas, view: View, spacing_m: float, entries: tuple[LegendEntry, ...]
) -> None:
    """Draws below the map: a scale bar, what the greys mean, the grid's spacing and direction."""
    middle = view.height_px - _LEGEND_HEIGHT_PX // 2
    left = _draw_scale_bar(canvas, view, _LEGEND_GAP_PX, middle)
    for entry in entries:
        left = _draw_swatch(canvas, left, middle, entry)
    for text in (f"grid {spacing_m:g} m", _direction(view.up_rad)):
        left = _write(canvas, left, middle, text)


def _ends_in_area(view: View, index: int, value_m: float) -> FloatArray | None:
    """Gives where the line of constant x (index 0) or y (1) meets the sides of the map area."""
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


def _box_outside(end: FloatArray, patch: Canvas, area: Box) -> Box:
    """Gives the box for a number beside the point in which its line leaves the map area."""
    height, width = patch.shape
    left, top = end[0] + area.left - width / 2, end[1] + area.top - height / 2
    if end[1] <= 1e-6:
        top = area.top - _NUMBER_GAP_PX - height
    elif end[1] >= area.height - 1e-6:
        top = area.bottom + _NUMBER_GAP_PX
    elif end[0] <= 1e-6:
        left = area.left - _NUMBER_GAP_PX - width
    else:
        left = area.right + _NUMBER_GAP_PX
    return Box(round(left), round(top), round(left) + width, round(top) + height)


def _number(line: MetricLine, spacing_m: float, up_rad: float) -> str:
    text = f"{line.multiple * spacing_m:.{decimals_of(spacing_m)}f}"
    return text if _is_north_up(up_rad) else f"{line.axis}={text}"


def _widest_number(extent: Extent, spacing_m: float, up_rad: float) -> Canvas:
    sides = (extent.left_m, extent.right_m, extent.bottom_m, extent.top_m)
    farthest = -math.ceil(max(abs(side) for side in sides) / spacing_m)
    line = MetricLine(axis="x", multiple=farthest, ends=np.zeros((2, 2)))
    return text_patch(_number(line, spacing_m, up_rad), NUMBER_SIZE_PX)


def _stride(needed_px: float, pitch_px: float) -> int:
    """Gives the smallest of 1, 2, 5, 10, 20, ... lines that leaves room for a number each."""
    ten = 1
    while True:
        for step in (1, 2, 5):
            if step * ten * pitch_px >= needed_px:
                return step * ten
        ten *= 10


def _is_north_up(up_rad: float) -> bool:
    return abs(math.remainder(up_rad - NORTH_UP_RAD, math.tau)) < _ANGLE_SLACK_RAD


def _direction(up_rad: float) -> str:
    if _is_north_up(up_rad):
        return "x right, y up"
    return f"up is yaw {math.degrees(math.remainder(up_rad, math.tau)):.0f}°"


def _draw_scale_bar(canvas: Canvas, view: View, left: int, middle: int) -> int:
    """Draws the bar and gives where the next thing may begin."""
    length_m = round_length_m(_SCALE_BAR_PX / view.pixels_per_m)
    right = left + round(length_m * view.pixels_per_m)
    cv2.line(canvas, (left, middle), (right, middle), (WALL,), 2)
    for end in (left, right):
        cv2.line(canvas, (end, middle - 5), (end, middle + 5), (WALL,), 2)
    return _write(canvas, right + 8, middle, f"{length_m:g} m")


def _draw_swatch(canvas: Canvas, left: int, middle: int, entry: LegendEntry) -> int:
    patch = text_patch(entry.text, NUMBER_SIZE_PX)
    right = left + 2 * _SWATCH_PX + patch.shape[1]
    if right > canvas.shape[1]:
        return left
    corners = (left, middle - _SWATCH_PX // 2), (left + _SWATCH_PX, middle + _SWATCH_PX // 2)
    cv2.rectangle(canvas, *corners, (entry.palette_number,), cv2.FILLED)
    cv2.rectangle(canvas, *corners, (FRAME,))
    return _write(canvas, left + _SWATCH_PX + 6, middle, entry.text)


def _write(canvas: Canvas, left: int, middle: int, text: str) -> int:
    """Writes a text if there is room for it, and gives where the next one may begin."""
    patch = text_patch(text, NUMBER_SIZE_PX)
    height, width = int(patch.shape[0]), int(patch.shape[1])
    if left + width > canvas.shape[1]:
        return left
    stamp(canvas, patch, (left, middle - height // 2), halo_px=0)
    return left + width + _LEGEND_GAP_PX
