"""Labels that do not overlap: each beside its place, or joined to it by a thin line.

Marks in nearly the same place share one label, so that it is clear what it belongs to.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mapspeak.spatial.grid import FloatArray, IntArray
from mapspeak.spatial.picture.ink import SYMBOL_REACH_PX, draw_polygon, draw_stroke, stamp
from mapspeak.spatial.picture.marks import Canvas, Colour, Mark, PictureRegion
from mapspeak.spatial.picture.transform import Box

HALO_PX = 3
_N_DIRECTIONS = 16
_SAME_PLACE_PX = 10.0
"""Symbols that near cover each other by more than half."""

_TURNS = np.linspace(0.0, math.tau, 9)
_DOT = 3.0 * np.stack([np.cos(_TURNS), np.sin(_TURNS)], axis=1)
_N_SHARING = 12
_MAX_LINE_LETTERS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """A text and the place it belongs to, in pixels of the map area.

    Attributes:
        wordings: Ways to write it, the best first; see `text_patch`.
        names: What it names, for a reader who has to do without it.
        clearance_px: How far the symbol at that place reaches; 0 for a label that may lie on it.
        region: The number of the region it names; None where it names a point.
    """

    wordings: tuple[str, ...]
    names: tuple[str, ...]
    u: float
    v: float
    clearance_px: float = 0.0
    region: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """A label with its place in the picture.

    Attributes:
        has_leader: A line joins it to what it names.
    """

    label: Label
    patch: Canvas
    box: Box
    has_leader: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rings:
    """Positions on and around a place: the directions to them, and their distances from it."""

    gaps_px: FloatArray
    across: FloatArray
    down: FloatArray

    def boxes_around(self, label: Label, patch: Canvas) -> IntArray:
        """Return the label's box, as (left, top, right, bottom), in each position."""
        height, width = patch.shape
        reach = self.gaps_px + label.clearance_px
        boxes = np.empty((len(reach), 4), dtype=np.intp)
        left = label.u - width / 2 + self.across * (reach + width / 2)
        top = label.v - height / 2 + self.down * (reach + height / 2)
        boxes[:, 0], boxes[:, 1] = np.rint(left), np.rint(top)
        boxes[:, 2], boxes[:, 3] = boxes[:, 0] + width, boxes[:, 1] + height
        return boxes


def _build_rings(gaps_px: tuple[float, ...]) -> Rings:
    turns = np.tile(np.arange(_N_DIRECTIONS) * math.tau / _N_DIRECTIONS, len(gaps_px))
    gaps = np.repeat(np.array(gaps_px), _N_DIRECTIONS)
    return Rings(
        gaps_px=np.append(0.0, gaps),
        across=np.append(0.0, np.cos(turns)),
        down=np.append(0.0, -np.sin(turns)),
    )


NEAR_RINGS = _build_rings((2.0,))
FAR_RINGS = _build_rings((6.0, 14.0, 24.0, 36.0, 50.0, 66.0, 84.0, 104.0, 130.0, 160.0))


def label_at(place: FloatArray, text: str, *, clearance_px: float) -> Label:
    """Return the label of something at (u, v) that reaches that far around."""
    u, v = place.tolist()
    return Label(wordings=(text,), names=(text,), u=u, v=v, clearance_px=clearance_px)


def labels_of_marks(marks: tuple[Mark, ...], places: FloatArray) -> list[Label]:
    """Return the labels of marks at (u, v), one for all that stand in nearly the same place."""
    is_open = np.array([bool(mark.label) for mark in marks], dtype=bool)
    labels = []
    for number, place in enumerate(places):
        if is_open[number]:
            away_px = np.hypot(*(places - place).T)
            near = np.flatnonzero(is_open & (away_px <= _SAME_PLACE_PX))[:_N_SHARING]
            is_open[near] = False
            members = [marks[index] for index in near]
            labels.append(_shared_label(members, place, float(away_px[near].max())))
    return labels


def labels_of_regions(
    regions: tuple[PictureRegion, ...], poles: Mapping[int, tuple[float, float]]
) -> list[Label]:
    """Return the labels of regions, each at the place with the most room."""
    return [
        Label(
            wordings=tuple(dict.fromkeys((region.text, region.text.replace(" ", "\n", 1)))),
            names=(region.text,),
            u=poles[region.label][0],
            v=poles[region.label][1],
            region=region.label,
        )
        for region in regions
        if region.text and region.label in poles
    ]


def draw_leaders(inside: Canvas, placed: list[Placed]) -> None:
    """Draw thin lines from places to their labels; symbols belong above them."""
    for spot in placed:
        if spot.has_leader:
            draw_stroke(inside, leader_of(spot.label, spot.box), Colour.INK, width_px=1)


def draw_texts(inside: Canvas, placed: list[Placed]) -> None:
    """Write the labels, and draw a dot into each region whose label stands outside it."""
    for spot in placed:
        if spot.has_leader and spot.label.region is not None:
            pole = np.array([spot.label.u, spot.label.v])
            draw_polygon(inside, pole + _DOT, Colour.INK, halo_px=1)
    for spot in placed:
        stamp(inside, spot.patch, (spot.box.left, spot.box.top), halo_px=HALO_PX)


def _shared_label(members: list[Mark], place: FloatArray, spread_px: float) -> Label:
    has_symbol = any(mark.shape is not None for mark in members)
    names = tuple(mark.label for mark in members)
    return Label(
        wordings=tuple(dict.fromkeys((_in_lines(names), "\n".join(names)))),
        names=names,
        u=float(place[0]),
        v=float(place[1]),
        clearance_px=spread_px + SYMBOL_REACH_PX if has_symbol else 0.0,
    )


def _in_lines(names: tuple[str, ...]) -> str:
    """Return names side by side, in as many lines as keep them short."""
    lines = [names[0]]
    for name in names[1:]:
        if len(lines[-1]) + 1 + len(name) <= _MAX_LINE_LETTERS:
            lines[-1] += "\t" + name
        else:
            lines.append(name)
    return "\n".join(lines)


def leader_of(label: Label, box: Box) -> FloatArray:
    """Return the line from what a label names to the nearest point of its box, shape (2, 2)."""
    start = np.array([label.u, label.v])
    end = np.clip(start, (box.left, box.top), (box.right, box.bottom)).astype(np.float64)
    away = (end - start) / max(1e-9, float(np.hypot(*(end - start))))
    return np.stack([start + label.clearance_px * away, end])
