"""Drawing with ink: smooth polygons, strokes, symbols and text on a canvas of palette numbers.

Coordinates are real pixels: the middle of the pixel in the top left corner is (0.5, 0.5).
Everything is drawn the same way: a patch says how much of each pixel is covered, which becomes a
step between white and the colour, on a white halo that keeps it apart from what lies below.
"""

import functools
import itertools
import math
import unicodedata

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from mapspeak.errors import MapspeakError
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.picture.marks import (
    N_RAMP_LEVELS,
    PAPER,
    RAMPS,
    Canvas,
    Colour,
    Line,
    LineStyle,
    Shape,
)
from mapspeak.spatial.picture.transform import Box, PictureView

LABEL_SIZE_PX = 16
NUMBER_SIZE_PX = 14
_SHIFT = 4
_HALO_FROM = 96
_INK_FROM = 24
_TALL_AND_DEEP = "Hg|"
_GAP_RATIO = 0.4


def draw_polygon(canvas: Canvas, corners: FloatArray, colour: Colour, *, halo_px: int = 2) -> None:
    """Fill a polygon with corners (u, v) of shape (n, 2)."""
    patch, top_left = _patch_around(corners, 2)
    cv2.fillPoly(patch, [_in_subpixels(corners, top_left)], (255,), cv2.LINE_AA, _SHIFT)
    stamp(canvas, patch, top_left, colour, halo_px=halo_px)


def draw_stroke(
    canvas: Canvas, points: FloatArray, colour: Colour, *, width_px: int, halo_px: int = 1
) -> None:
    """Draw a line through points (u, v) of shape (n, 2) that lie on the canvas or near it."""
    patch, top_left = _patch_around(points, width_px + 2)
    cv2.polylines(
        patch,
        [_in_subpixels(points, top_left)],
        isClosed=False,
        color=(255,),
        thickness=width_px,
        lineType=cv2.LINE_AA,
        shift=_SHIFT,
    )
    stamp(canvas, patch, top_left, colour, halo_px=halo_px)


def clip_segment(start: FloatArray, end: FloatArray, size: FloatArray) -> FloatArray | None:
    """Return the part of a segment inside the box from (0, 0) to size, shape (2, 2), or None.

    The method is that of Liang and Barsky (1984): the parameters at which each side is crossed.
    """
    step = end - start
    first, last = 0.0, 1.0
    for axis in (0, 1):
        if step[axis] == 0:
            if not 0 <= start[axis] <= size[axis]:
                return None
            continue
        crossings = sorted((-start[axis] / step[axis], (size[axis] - start[axis]) / step[axis]))
        first, last = max(first, crossings[0]), min(last, crossings[1])
    return np.stack([start + first * step, start + last * step]) if first < last else None


@functools.lru_cache(maxsize=2048)
def text_patch(text: str, size_px: int) -> Canvas:
    """Return lines of text as a patch, centred; all single lines of one size are equally high.

    A tab sets words apart that do not belong together. Patches are kept, and locked, because the
    same numbers and ids are written again and again.
    """
    height = _font(size_px)[2]
    gap = np.zeros((height, round(_GAP_RATIO * size_px)), dtype=np.uint8)
    rows = []
    for line in text.split("\n"):
        first, *others = (_word_patch(word, size_px) for word in line.split("\t"))
        rows.append(np.hstack([first, *(part for other in others for part in (gap, other))]))
    width = max(row.shape[1] for row in rows)
    patch = np.zeros((height * len(rows), width), dtype=np.uint8)
    for lines, row in zip(np.split(patch, len(rows)), rows, strict=True):
        left = (width - row.shape[1]) // 2
        lines[:, left : left + row.shape[1]] = row
    patch.setflags(write=False)
    return patch


def stamp(
    canvas: Canvas,
    patch: Canvas,
    top_left: tuple[int, int],
    colour: Colour = Colour.INK,
    *,
    halo_px: int = 2,
) -> None:
    """Put a patch on the canvas with its halo, cut off where it leaves the canvas.

    Args:
        canvas: Palette numbers; changed in place.
        patch: How much of each pixel is covered, 0 to 255.
        top_left: The column and row of the patch's first pixel.
        halo_px: How far white reaches around it.
    """
    padded = cv2.copyMakeBorder(
        patch, halo_px, halo_px, halo_px, halo_px, cv2.BORDER_CONSTANT, value=(0,)
    )
    left, top = top_left[0] - halo_px, top_left[1] - halo_px
    cut_left, cut_top = max(0, -left), max(0, -top)
    target = canvas[
        top + cut_top : max(0, top + padded.shape[0]),
        left + cut_left : max(0, left + padded.shape[1]),
    ]
    coverage = padded[cut_top : cut_top + target.shape[0], cut_left : cut_left + target.shape[1]]
    if coverage.size == 0:
        return
    halo = cv2.dilate(padded, _disc(halo_px))[cut_top:, cut_left:][
        : target.shape[0], : target.shape[1]
    ]
    target[halo >= _HALO_FROM] = PAPER
    is_inked = coverage >= _INK_FROM
    levels = coverage[is_inked].astype(np.intp) * N_RAMP_LEVELS // 256
    target[is_inked] = RAMPS[colour][levels]


@functools.cache
def _disc(radius_px: int) -> Canvas:
    side_px = 2 * radius_px + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side_px, side_px))
    return disc.astype(np.uint8, copy=False)


def _patch_around(points: FloatArray, rim_px: int) -> tuple[Canvas, tuple[int, int]]:
    """Return an empty patch with room for the points, and where its first pixel lies."""
    left, top = (int(value) - rim_px for value in np.floor(points.min(axis=0)))
    right, bottom = (int(value) + rim_px for value in np.ceil(points.max(axis=0)))
    return np.zeros((bottom - top, right - left), dtype=np.uint8), (left, top)


def _in_subpixels(points: FloatArray, top_left: tuple[int, int]) -> NDArray[np.int32]:
    """Return the points as OpenCV wants them: integers, and (0, 0) in the middle of a pixel."""
    local = points - np.array(top_left) - 0.5
    return np.asarray(np.rint(local * (1 << _SHIFT)), dtype=np.int32)


def _word_patch(text: str, size_px: int) -> Canvas:
    font, ascent_px, height_px = _font(size_px)
    # Accents are dropped, and letters that the font lacks replaced.
    plain = unicodedata.normalize("NFKD", text)
    kept = (sign for sign in plain if not unicodedata.combining(sign))
    written = "".join(sign if " " <= sign <= "~" or sign == "°" else "?" for sign in kept)
    picture = Image.new("L", ((len(written) + 2) * size_px, height_px))
    ImageDraw.Draw(picture).text((size_px, ascent_px), written, fill=255, font=font, anchor="ls")
    pixels = np.asarray(picture)
    used = np.flatnonzero(pixels.any(axis=0))
    return pixels[:, used[0] : used[-1] + 1] if used.size else pixels[:, :size_px]


@functools.cache
def _font(size_px: int) -> tuple[ImageFont.FreeTypeFont, int, int]:
    """Return Pillow's own scalable font, how far it rises over the base line, and a line's height.

    Raises:
        MapspeakError: Pillow was built without FreeType, and so has no such font.
    """
    font = ImageFont.load_default(size_px)
    if not isinstance(font, ImageFont.FreeTypeFont):
        raise MapspeakError(
            "This Pillow cannot draw text: it was built without FreeType.",
            hint="Install Pillow's own wheel: pip install --force-reinstall pillow.",
        )
    _, top, _, bottom = font.getbbox(_TALL_AND_DEEP, anchor="ls")
    return font, round(-top), round(bottom - top)


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
    """Return an arrow's displacements (u, v) in the picture (paper eq. 7).

    Args:
        arrow: Its points in the robot's frame, x forward and y left, shape (n, 2), in pixels.
        heading_rad: The robot's heading in the picture, counter-clockwise from its right.
    """
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    right = arrow[:, 0] * cos - arrow[:, 1] * sin
    down = -(arrow[:, 0] * sin + arrow[:, 1] * cos)
    return np.stack([right, down], axis=1)


def symbol_box(place: FloatArray, reach_px: float) -> Box:
    """Return the box of the map area that a symbol at (u, v) takes."""
    left, top = (math.floor(at - reach_px) for at in place)
    right, bottom = (math.ceil(at + reach_px) for at in place)
    return Box(left, top, right, bottom)


def draw_arrow(canvas: Canvas, place: FloatArray, heading_rad: float, *, scale: float = 1) -> None:
    """Draw the robot's arrow, with a white edge, at (u, v); see `arrow_pixels` for the heading."""
    arrow = arrow_pixels(scale * _ARROW_PX, heading_rad)
    draw_polygon(canvas, place + arrow, Colour.VERMILION, halo_px=3)


def draw_shape(canvas: Canvas, place: FloatArray, shape: Shape, colour: Colour) -> None:
    """Draw a shape around a place (u, v)."""
    corners = _CROSS_PX
    if shape is not Shape.CROSS:
        turns, reach = _CORNER_TURNS[shape], 6.0 if shape is Shape.CIRCLE else 8.0
        corners = reach * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    draw_polygon(canvas, place + corners, colour)


def draw_zero_ring(canvas: Canvas, place: FloatArray) -> None:
    """Draw the ring that marks the map's origin, around (u, v)."""
    turns = np.linspace(0.0, math.tau, 33)
    circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    draw_stroke(canvas, place + _ZERO_RADIUS_PX * circle, Colour.INK, width_px=2)
    draw_polygon(canvas, place + circle, Colour.INK, halo_px=0)


def draw_run(
    canvas: Canvas, run: FloatArray, style: LineStyle, colour: Colour, *, width_px: int
) -> None:
    """Draw an unbroken line through points (u, v) of shape (n, 2), solid or in dashes."""
    for piece in [run] if style is LineStyle.SOLID else _dashes(run):
        draw_stroke(canvas, piece, colour, width_px=width_px)


def find_runs(view: PictureView, line: Line) -> list[FloatArray]:
    """Return the pieces of a line inside the map area, each as an unbroken polyline."""
    points = view.area_pixels_at(np.array([[point.x, point.y] for point in line.points]))
    size = np.array([view.area.width, view.area.height], dtype=np.float64)
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
    """Cut a polyline into dashes of equal length along it, keeping its corners."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(run, axis=0).T))])
    dashes = []
    for start in np.arange(0.0, along[-1], _DASH_PX + _GAP_PX):
        end = min(start + _DASH_PX, along[-1])
        between = along[(along > start) & (along < end)]
        stops = np.concatenate([[start], between, [end]])
        columns = [np.interp(stops, along, run[:, axis]) for axis in (0, 1)]
        dashes.append(np.stack(columns, axis=1))
    return dashes
