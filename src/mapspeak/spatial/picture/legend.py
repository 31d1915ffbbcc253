"""The legend: a strip below the map with the scale, and what greys, symbols and patterns mean.

It has as many rows as its entries need at the width of the picture: below the map that costs the
fewest pixels, whatever the shape of the map.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np

from mapspeak.geometry import Pose
from mapspeak.spatial.picture.ink import (
    NUMBER_SIZE_PX,
    draw_arrow,
    draw_run,
    draw_shape,
    draw_zero_ring,
    stamp,
    text_patch,
)
from mapspeak.spatial.picture.marks import (
    FILLS,
    FRAME,
    FREE,
    RAMPS,
    WALL,
    Canvas,
    Colour,
    FillPart,
    LegendEntry,
    LegendSample,
    Line,
    LineStyle,
    Mark,
    PictureRegion,
    Shape,
    Zone,
)
from mapspeak.spatial.picture.regions import AUTOMATIC_COLOURS, ZONE_NUMBER
from mapspeak.spatial.picture.view import PictureView, is_north_up, round_length_m

ROW_PX = 23
_GAP_PX = 18
_TEXT_GAP_PX = 7
_SCALE_BAR_PX = 80
_SWATCH_PX = 14
_WIDE_SWATCH_PX = 24
_ARROW_SCALE = 0.6

Draw = Callable[[Canvas, int, int], None]
"""Draws a sample on a canvas, from a column on, around a row."""


@dataclass(frozen=True, slots=True)
class GroundEntry:
    """A colour of the ground, by its palette number, and what it means."""

    palette_number: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureScene:
    """What is to be seen in a picture, or may be, besides the ground.

    Attributes:
        has_origin: The map's origin is in the picture.
    """

    regions: tuple[PictureRegion, ...] = ()
    zones: tuple[Zone, ...] = ()
    lines: tuple[Line, ...] = ()
    marks: tuple[Mark, ...] = ()
    robot: Pose | None = None
    has_origin: bool = False

    def shows(self, sample: LegendSample) -> bool:
        """Return True when that kind of thing is to be seen."""
        regions = self.regions
        is_shown = {
            LegendSample.ZONE: bool(self.zones),
            LegendSample.ROBOT: self.robot is not None,
            LegendSample.ORIGIN: self.has_origin,
            LegendSample.HATCHED_REGION: any(region.is_hatched for region in regions),
            LegendSample.DOTTED_REGION: any(region.is_dotted for region in regions),
            LegendSample.HIGHLIGHTED_REGION: any(region.is_highlighted for region in regions),
            LegendSample.PLAIN_REGION: any(not (r.is_hatched or r.is_dotted) for r in regions),
        }
        return is_shown[sample]

    def find_colour(self, entry: LegendEntry) -> Colour | None:
        """Return the colour of the first mark or line that an entry explains."""
        found = [mark.colour for mark in self.marks if mark.shape is entry.sample]
        found += [line.colour for line in self.lines if line.style is entry.sample]
        return next((colour for colour in found if entry.colour in {None, colour}), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Legend:
    """What a legend has to explain.

    Attributes:
        spacing_m: Between the lines of the metric grid.
    """

    spacing_m: float
    grounds: tuple[GroundEntry, ...]
    entries: tuple[LegendEntry, ...] = ()

    def limited_to(self, scene: PictureScene) -> "Legend":
        """Return the legend with only the entries for what a scene shows, each with a colour."""
        shown = []
        for entry in self.entries:
            if isinstance(entry.sample, LegendSample):
                if scene.shows(entry.sample):
                    shown.append(entry)
            elif (colour := scene.find_colour(entry)) is not None:
                shown.append(replace(entry, colour=colour))
        return replace(self, entries=tuple(shown))

    def draw(self, canvas: Canvas, view: PictureView, top: int) -> int:
        """Draw the rows that have room from a row of the canvas on; gives the row below them."""
        for row in _rows(self, view):
            if top + ROW_PX > view.height_px:
                break
            left = _GAP_PX
            for item in row:
                item.draw_at(canvas, left, top + ROW_PX // 2)
                left += item.width_px + _GAP_PX
            top += ROW_PX
        return top


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Item:
    """A sample and the words beside it; either may be missing."""

    text: str
    sample_px: int = 0
    draw: Draw | None = None

    @property
    def width_px(self) -> int:
        gap_px = _TEXT_GAP_PX if self.draw is not None else 0
        return self.sample_px + gap_px + int(text_patch(self.text, NUMBER_SIZE_PX).shape[1])

    def draw_at(self, canvas: Canvas, left: int, middle: int) -> None:
        patch = text_patch(self.text, NUMBER_SIZE_PX)
        if self.draw is not None:
            self.draw(canvas, left, middle)
        text_left = left + self.width_px - int(patch.shape[1])
        stamp(canvas, patch, (text_left, middle - int(patch.shape[0]) // 2), halo_px=0)


def n_rows_of(legend: Legend, view: PictureView) -> int:
    """Return how many rows a legend takes at the width of a picture."""
    return len(_rows(legend, view))


def grounds_in(inside: Canvas, grounds: tuple[GroundEntry, ...]) -> tuple[GroundEntry, ...]:
    """Return those colours of the ground that are to be seen on the map area."""
    return tuple(entry for entry in grounds if (inside == entry.palette_number).any())


def _rows(legend: Legend, view: PictureView) -> list[list[_Item]]:
    rows: list[list[_Item]] = []
    right = view.width_px
    for item in _items(legend, view):
        if right + item.width_px + _GAP_PX // 2 > view.width_px:
            rows.append([])
            right = _GAP_PX
        rows[-1].append(item)
        right += item.width_px + _GAP_PX
    return rows


def _items(legend: Legend, view: PictureView) -> list[_Item]:
    length_m = round_length_m(_SCALE_BAR_PX / view.pixels_per_m)
    length_px = round(length_m * view.pixels_per_m)
    return [
        _Item(
            text=f"{length_m:g} m",
            sample_px=length_px,
            draw=partial(_draw_scale_bar, length_px=length_px),
        ),
        _Item(text=f"grid {legend.spacing_m:g} m"),
        _Item(text=_direction(view.up_rad)),
        *(
            _Item(
                text=entry.text,
                sample_px=_SWATCH_PX,
                draw=partial(_draw_swatch, number=entry.palette_number),
            )
            for entry in legend.grounds
        ),
        *(_item_of_entry(entry) for entry in legend.entries),
    ]


def _item_of_entry(entry: LegendEntry) -> _Item:
    sample, colour = entry.sample, entry.colour or Colour.INK
    if isinstance(sample, Shape):
        draw: Draw = partial(_draw_shape, shape=sample, colour=colour)
        return _Item(text=entry.text, sample_px=_SWATCH_PX, draw=draw)
    if isinstance(sample, LineStyle):
        draw = partial(_draw_line, style=sample, colour=colour)
    elif sample is LegendSample.ROBOT:
        draw = _draw_robot
    elif sample is LegendSample.ZONE:
        draw = _draw_zone
    elif sample is LegendSample.ORIGIN:
        return _Item(text=entry.text, sample_px=_SWATCH_PX, draw=_draw_origin)
    else:
        draw = partial(_draw_region, sample=sample)
    return _Item(text=entry.text, sample_px=_WIDE_SWATCH_PX, draw=draw)


def _direction(up_rad: float) -> str:
    if is_north_up(up_rad):
        return "x right, y up"
    return f"up is yaw {math.degrees(math.remainder(up_rad, math.tau)):.0f}°"


def _draw_scale_bar(canvas: Canvas, left: int, middle: int, *, length_px: int) -> None:
    right = left + length_px
    cv2.line(canvas, (left, middle), (right, middle), (WALL,), 2)
    for end in (left, right):
        cv2.line(canvas, (end, middle - 5), (end, middle + 5), (WALL,), 2)


def _draw_swatch(
    canvas: Canvas, left: int, middle: int, *, number: int, width_px: int = _SWATCH_PX
) -> None:
    corners = (left, middle - _SWATCH_PX // 2), (left + width_px, middle + _SWATCH_PX // 2)
    cv2.rectangle(canvas, *corners, (number,), cv2.FILLED)
    cv2.rectangle(canvas, *corners, (FRAME,))


def _draw_shape(canvas: Canvas, left: int, middle: int, *, shape: Shape, colour: Colour) -> None:
    draw_shape(canvas, np.array([left + _SWATCH_PX / 2, middle + 0.5]), shape, colour)


def _draw_line(canvas: Canvas, left: int, middle: int, *, style: LineStyle, colour: Colour) -> None:
    # Two dashes and the gap between them, so that the style can be seen.
    run = np.array([[left - 2.0, middle], [left + _WIDE_SWATCH_PX + 3.0, middle]])
    draw_run(canvas, run, style, colour, width_px=3)


def _draw_robot(canvas: Canvas, left: int, middle: int) -> None:
    place = np.array([left + _WIDE_SWATCH_PX / 2 - 2.0, middle + 0.5])
    draw_arrow(canvas, place, 0.0, scale=_ARROW_SCALE)


def _draw_origin(canvas: Canvas, left: int, middle: int) -> None:
    draw_zero_ring(canvas, np.array([left + _SWATCH_PX / 2, middle + 0.5]))


def _draw_zone(canvas: Canvas, left: int, middle: int) -> None:
    right, half_px = left + _WIDE_SWATCH_PX, _SWATCH_PX // 2
    cv2.rectangle(canvas, (left, middle - half_px), (right, middle + half_px), (FREE,), cv2.FILLED)
    inner = canvas[middle - half_px : middle + half_px, left:right]
    row, col = np.indices(inner.shape)
    inner[(row - col) % 6 < 2] = ZONE_NUMBER
    cv2.rectangle(canvas, (left, middle - half_px), (right, middle + half_px), (ZONE_NUMBER,), 2)


def _draw_region(canvas: Canvas, left: int, middle: int, *, sample: LegendSample) -> None:
    """Draw a swatch in two of the colours that regions have, with the pattern."""
    if sample is LegendSample.HIGHLIGHTED_REGION:
        _draw_swatch(canvas, left, middle, number=FREE, width_px=_WIDE_SWATCH_PX)
        corners = (left + 2, middle - 5), (left + _WIDE_SWATCH_PX - 2, middle + 5)
        cv2.rectangle(canvas, *corners, (int(RAMPS[Colour.VERMILION][-1]),), 4)
        return
    half_px = _WIDE_SWATCH_PX // 2
    for index, colour in enumerate(AUTOMATIC_COLOURS[:2]):
        number = FILLS[colour, FillPart.PLAIN]
        at = left + index * half_px
        _draw_swatch(canvas, at, middle, number=number, width_px=half_px)
        inner = canvas[middle - 5 : middle + 6, at + 2 : at + half_px - 1]
        row, col = np.indices(inner.shape)
        if sample is LegendSample.HATCHED_REGION:
            inner[(row + col) % 6 < 1] = FILLS[colour, FillPart.HATCH]
        elif sample is LegendSample.DOTTED_REGION:
            inner[(row % 5 < 2) & (col % 5 < 2)] = FILLS[colour, FillPart.HATCH]
