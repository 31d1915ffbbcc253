"""The legend: a strip below the map with the scale, and what greys, symbols and patterns mean.

It has as many rows as its entries need at the width of the picture: below the map that costs the
fewest pixels, whatever the shape of the map.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np

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
    LineStyle,
    MapLayers,
    PictureRegion,
    Shape,
)
from mapspeak.spatial.picture.regions import AUTOMATIC_COLOURS, ZONE_NUMBER
from mapspeak.spatial.picture.transform import PictureView, is_north_up, round_length_m

ROW_PX = 23
_GAP_PX = 18
_TEXT_GAP_PX = 7
_SCALE_BAR_PX = 80
_SWATCH_PX = 14
_WIDE_SWATCH_PX = 24
_ARROW_SCALE = 0.6
_SMALL_SAMPLES = {*Shape, LegendSample.ORIGIN}

Draw = Callable[[Canvas, int, int], None]
"""Draws a sample on a canvas, from a column on, around a row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Legend:
    """What a legend has to explain.

    Attributes:
        spacing_m: Between the lines of the metric grid.
        grounds: What palette numbers of the ground mean.
    """

    spacing_m: float
    grounds: Mapping[int, str]
    entries: tuple[LegendEntry, ...] = ()

    def limited_to(
        self, layers: MapLayers, regions: tuple[PictureRegion, ...], *, has_origin: bool
    ) -> "Legend":
        """Return the legend with only the entries for what is visible, each with a colour."""
        shown = {
            LegendSample.ZONE: bool(layers.zones),
            LegendSample.ROBOT: layers.robot is not None,
            LegendSample.ORIGIN: has_origin,
            LegendSample.HATCHED_REGION: any(region.is_hatched for region in regions),
            LegendSample.DOTTED_REGION: any(region.is_dotted for region in regions),
            LegendSample.HIGHLIGHTED_REGION: any(region.is_highlighted for region in regions),
            LegendSample.PLAIN_REGION: any(not (r.is_hatched or r.is_dotted) for r in regions),
        }
        found = [(mark.shape, mark.colour) for mark in layers.marks]
        styles = [(line.style, line.colour) for line in layers.lines]
        kept = []
        for entry in self.entries:
            if isinstance(entry.sample, LegendSample):
                if shown[entry.sample]:
                    kept.append(entry)
                continue
            colours = [colour for sample, colour in (*found, *styles) if sample is entry.sample]
            first = next((colour for colour in colours if entry.colour in {None, colour}), None)
            if first is not None:
                kept.append(replace(entry, colour=first))
        return replace(self, entries=tuple(kept))

    def draw(self, canvas: Canvas, view: PictureView, top: int) -> int:
        """Draw the rows that have room from a row of the canvas on; return the row below."""
        for row in break_rows(self, view):
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


def break_rows(legend: Legend, view: PictureView) -> list[list[_Item]]:
    """Return the items of a legend in rows as wide as a picture."""
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
    draw_bar = partial(_draw_scale_bar, length_px=length_px)
    up_deg = math.degrees(math.remainder(view.up_rad, math.tau))
    return [
        _Item(text=f"{length_m:g} m", sample_px=length_px, draw=draw_bar),
        _Item(text=f"grid {legend.spacing_m:g} m"),
        _Item(text="x right, y up" if is_north_up(view.up_rad) else f"up is yaw {up_deg:.0f}°"),
        *(
            _Item(text=text, sample_px=_SWATCH_PX, draw=partial(_draw_swatch, number=number))
            for number, text in legend.grounds.items()
        ),
        *(
            _Item(
                text=entry.text,
                sample_px=_SWATCH_PX if entry.sample in _SMALL_SAMPLES else _WIDE_SWATCH_PX,
                draw=partial(_draw_sample, entry=entry),
            )
            for entry in legend.entries
        ),
    ]


def _draw_sample(canvas: Canvas, left: int, middle: int, *, entry: LegendEntry) -> None:
    sample, colour = entry.sample, entry.colour or Colour.INK
    place = np.array([left + _SWATCH_PX / 2, middle + 0.5])
    if isinstance(sample, Shape):
        draw_shape(canvas, place, sample, colour)
    elif isinstance(sample, LineStyle):
        # Two dashes and the gap between them, so that the style can be seen.
        run = np.array([[left - 2.0, middle], [left + _WIDE_SWATCH_PX + 3.0, middle]])
        draw_run(canvas, run, sample, colour, width_px=3)
    elif sample is LegendSample.ROBOT:
        place = np.array([left + _WIDE_SWATCH_PX / 2 - 2.0, middle + 0.5])
        draw_arrow(canvas, place, 0.0, scale=_ARROW_SCALE)
    elif sample is LegendSample.ORIGIN:
        draw_zero_ring(canvas, place)
    elif sample is LegendSample.ZONE:
        _draw_zone(canvas, left, middle)
    else:
        _draw_region(canvas, left, middle, sample=sample)


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
