"""Labels that do not overlap: each beside its place, or joined to it by a thin line.

Marks in nearly the same place share one label, so that it is plain what it belongs to.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.picture.field import HALO_PX, Label, LabelField, Placed
from mapspeak.spatial.picture.ink import SYMBOL_REACH_PX, draw_polygon, draw_stroke, stamp
from mapspeak.spatial.picture.marks import Mark, PictureRegion
from mapspeak.spatial.picture.palette import IS_BUSY, Canvas, Colour
from mapspeak.spatial.picture.placing import find_places, leader_of
from mapspeak.spatial.picture.view import Box

_SAME_PLACE_PX = 10.0
"""Symbols that near cover each other by more than half."""

_TURNS = np.linspace(0.0, math.tau, 9)
_DOT = 3.0 * np.stack([np.cos(_TURNS), np.sin(_TURNS)], axis=1)
_N_SHARING = 12
_MAX_LINE_LETTERS = 16


def label_at(place: FloatArray, text: str, *, clearance_px: float) -> Label:
    """Return the label of something at (u, v) that reaches that far around."""
    return Label(
        wordings=(text,),
        names=(text,),
        u=float(place[0]),
        v=float(place[1]),
        clearance_px=clearance_px,
    )


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
    regions: tuple[PictureRegion, ...], poles: dict[int, tuple[float, float]]
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


def place_labels(
    inside: Canvas,
    labels: list[Label],
    *,
    obstacles: list[Box],
    regions: NDArray[np.uint16] | None,
) -> tuple[list[Placed], tuple[str, ...]]:
    """Return the labels with their places, and the names of those that found none.

    Args:
        inside: The map area in palette numbers, with the lines but without the symbols.
        labels: In the order in which they may choose.
        obstacles: Boxes that no label may touch, such as symbols.
        regions: The region of each pixel, for labels that name one.
    """
    if not labels:
        return [], ()
    covered_before = cv2.integral(cv2.LUT(inside, IS_BUSY)).astype(np.int32, copy=False)
    field = LabelField(covered_before=covered_before, regions=regions)
    placed, left_out = find_places(tuple(labels), field, tuple(obstacles))
    return placed, tuple(name for label in left_out for name in label.names)


def draw_leaders(inside: Canvas, placed: list[Placed]) -> None:
    """Draw thin lines from places to their labels; symbols belong above them."""
    for spot in placed:
        if spot.has_leader:
            draw_stroke(inside, leader_of(spot.label, spot.box), Colour.INK, width_px=1)


def draw_texts(inside: Canvas, placed: list[Placed]) -> None:
    """Write the labels, and draws a dot into each region whose label stands outside it."""
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
