"""Labels that do not overlap: each beside its place, or joined to it by a thin line.

Every label tries positions around its place, from near to far, and takes the one that covers the
fewest walls and drawn things; a label with no free position is left out and named in the result.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.picture.ink import LABEL_SIZE_PX, draw_polygon, draw_stroke, stamp, text_patch
from mapspeak.spatial.picture.palette import IS_BUSY, Canvas, Colour
from mapspeak.spatial.picture.view import Box

__all__ = ["Label", "draw_labels", "find_poles"]


_HALO_PX = 3
_N_DIRECTIONS = 16
_LEADER_FROM_PX = 10.0
_COST_OF_COVERING = 12.0
_COST_OF_STRAYING = 6.0
_COST_OF_LEADER = 2.0
_COST_OF_CROSSING = 12.0
_COST_PER_BREAK = 0.5
_COST_PER_PX = 0.04
_GOOD_COST, _FAIR_COST = 0.5, 1.5
_N_LEADER_POINTS = 9
_N_CHECKED_FOR_CROSSING = 10
_CORNER_REACH = 1.5
"""A symbol's box reaches this much farther at its corners than the symbol itself."""

_SAMPLES_ACROSS = np.linspace(0, 1, 7)
_SAMPLES_DOWN = np.linspace(0, 1, 3)[:, np.newaxis]


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """A text and the place it belongs to, in pixels of the map area.

    Attributes:
        text: What it says.
        u: Column of the place.
        v: Row of the place.
        clearance_px: How far the symbol at that place reaches; 0 for a label that may lie on it.
        region: The number of the region it names; None where it names a point.
    """

    text: str
    u: float
    v: float
    clearance_px: float = 0.0
    region: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Placed:
    label: Label
    patch: Canvas
    box: Box
    has_leader: bool
    cost: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Rings:
    """Positions on and around a place, such as 16 directions at each of some distances.

    Attributes:
        gaps_px: How far each position is from the place.
        across: The horizontal part of each direction; 0 on the place itself.
        down: The vertical part of each direction; 0 on the place itself.
    """

    gaps_px: FloatArray
    across: FloatArray
    down: FloatArray

    def boxes_around(self, label: Label, patch: Canvas) -> IntArray:
        """Gives the label's box, as (left, top, right, bottom), in each position."""
        height, width = patch.shape
        reach = self.gaps_px + label.clearance_px
        u = label.u + self.across * (reach + width / 2)
        v = label.v + self.down * (reach + height / 2)
        corner = np.stack([u - width / 2, v - height / 2], axis=1)
        top_left = np.rint(corner).astype(np.intp)
        return np.hstack([top_left, top_left + np.array([width, height])])


def _build_rings(gaps_px: tuple[float, ...]) -> _Rings:
    turns = np.tile(np.arange(_N_DIRECTIONS) * math.tau / _N_DIRECTIONS, len(gaps_px))
    gaps = np.repeat(np.array(gaps_px), _N_DIRECTIONS)
    return _Rings(
        gaps_px=np.append(0.0, gaps),
        across=np.append(0.0, np.cos(turns)),
        down=np.append(0.0, -np.sin(turns)),
    )


_NEAR_RINGS = _build_rings((2.0,))
_FAR_RINGS = _build_rings((6.0, 14.0, 24.0, 36.0, 50.0, 66.0, 84.0, 104.0, 130.0, 160.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Field:
    """What a label meets on the map: drawn things, regions and other labels.

    Boxes are rows of (left, top, right, bottom).

    Attributes:
        covered_before: The number of busy pixels above and left of each pixel corner.
        regions: The region of each pixel.
        taken: Boxes that no label may touch.
    """

    covered_before: NDArray[np.int32]
    regions: NDArray[np.uint16] | None
    taken: IntArray

    def without(self, spot: _Placed) -> "_Field":
        """Gives the field with a label's box taken, and a rim around it and its leader."""
        rim = np.array([-_HALO_PX, -_HALO_PX, _HALO_PX, _HALO_PX])
        boxes = np.array([_corners(spot.box)])
        if spot.has_leader:
            leader = np.rint(_leaders(spot.label, boxes)[0]).astype(np.intp)
            boxes = np.vstack([boxes, np.hstack([leader, leader])])
        taken = np.vstack([self.taken, boxes + rim])
        return _Field(covered_before=self.covered_before, regions=self.regions, taken=taken)

    def is_on_map(self, boxes: IntArray) -> Mask:
        """Gives True for boxes that lie inside the map area with their halo."""
        n_rows, n_cols = self.covered_before.shape[0] - 1, self.covered_before.shape[1] - 1
        farthest = np.array([n_cols, n_rows]) - _HALO_PX
        return np.asarray((boxes[:, :2] >= _HALO_PX).all(1) & (boxes[:, 2:] <= farthest).all(1))

    def touches(self, boxes: IntArray) -> Mask:
        """Gives True for boxes that share a pixel with one already taken."""
        left, top, right, bottom = (boxes[:, index, np.newaxis] for index in range(4))
        overlaps = (left < self.taken[:, 2]) & (self.taken[:, 0] < right)
        overlaps &= (top < self.taken[:, 3]) & (self.taken[:, 1] < bottom)
        return np.asarray(overlaps.any(axis=1))

    def crossed_ratio(self, points: FloatArray) -> FloatArray:
        """Gives the share of the points of each line that lie in a box already taken."""
        u, v = points[..., 0, np.newaxis], points[..., 1, np.newaxis]
        is_in = (u >= self.taken[:, 0]) & (u < self.taken[:, 2])
        is_in &= (v >= self.taken[:, 1]) & (v < self.taken[:, 3])
        return np.asarray(is_in.any(axis=2).mean(axis=1), dtype=np.float64)

    def covered_ratio(self, boxes: IntArray) -> FloatArray:
        """Gives the share of each box that lies on walls or drawn things."""
        left, top, right, bottom = boxes.T
        before = self.covered_before
        covered = before[bottom, right] - before[top, right] - before[bottom, left]
        area_px = (right - left) * (bottom - top)
        return np.asarray((covered + before[top, left]) / area_px, dtype=np.float64)

    def strayed_ratio(self, boxes: IntArray, region: int | None, has_leader: Mask) -> FloatArray:
        """Gives the share of each box where it should not be, judged at a few points of it.

        That is outside its region, but for a box with a leader inside another region.
        """
        if region is None or self.regions is None:
            return np.zeros(len(boxes))
        left, top, right, bottom = (boxes[:, index, np.newaxis, np.newaxis] for index in range(4))
        cols = left + (right - 1 - left) * _SAMPLES_ACROSS
        rows = top + (bottom - 1 - top) * _SAMPLES_DOWN
        found = self.regions[rows.astype(np.intp), cols.astype(np.intp)]
        is_wrong = (found != region) & ((found > 0) | ~has_leader[:, np.newaxis, np.newaxis])
        return np.asarray(is_wrong.mean(axis=(1, 2)), dtype=np.float64)


def draw_labels(
    inside: Canvas,
    labels: tuple[Label, ...],
    *,
    obstacles: tuple[Box, ...],
    regions: NDArray[np.uint16] | None,
) -> tuple[str, ...]:
    """Writes the labels on the map area and gives the texts that found no place.

    Args:
        inside: The map area in palette numbers; changed in place.
        labels: In the order in which they may choose.
        obstacles: Boxes that no label may touch, such as symbols.
        regions: The region of each pixel, for labels that name one.
    """
    if not labels:
        return ()
    field = _Field(
        covered_before=cv2.integral(cv2.LUT(inside, IS_BUSY)).astype(np.int32, copy=False),
        regions=regions,
        taken=np.array([_corners(box) for box in obstacles], dtype=np.intp).reshape(-1, 4),
    )
    placed, left_out = [], []
    for label in labels:
        spot = _place(label, field)
        if spot is None:
            left_out.append(label.text)
        else:
            placed.append(spot)
            field = field.without(spot)
    for spot in placed:
        if spot.has_leader:
            _draw_leader(inside, spot)
    for spot in placed:
        stamp(inside, spot.patch, (spot.box.left, spot.box.top), halo_px=_HALO_PX)
    return tuple(left_out)


def find_poles(regions: NDArray[np.uint16]) -> dict[int, tuple[float, float]]:
    """Gives, for each region, (u, v) of the point farthest from its border, to two pixels.

    That is the pole of inaccessibility: the place with the most room for a label.
    """
    coarse = cv2.copyMakeBorder(regions[::2, ::2], 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(0,))
    kernel = np.ones((3, 3), dtype=np.uint8)
    is_inner = (cv2.dilate(coarse, kernel) == cv2.erode(coarse, kernel)) & (coarse > 0)
    depth = cv2.distanceTransform(is_inner.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    is_peak = (depth >= cv2.dilate(depth, kernel)) & (coarse > 0)
    rows, cols = np.nonzero(is_peak)
    order = np.argsort(-depth[rows, cols], kind="stable")
    labels, first = np.unique(coarse[rows[order], cols[order]], return_index=True)
    peaks = order[first]
    return {
        int(label): (2.0 * float(cols[peak]) - 1.5, 2.0 * float(rows[peak]) - 1.5)
        for label, peak in zip(labels, peaks, strict=True)
    }


def _place(label: Label, field: _Field) -> _Placed | None:
    """Gives the cheapest free position of a label, or None; near positions are tried first."""
    best: _Placed | None = None
    for rings in (_NEAR_RINGS, _FAR_RINGS):
        for text in _wordings(label):
            option = _best_position(label, text, rings, field)
            if option is not None and (best is None or option.cost < best.cost):
                best = option
            if best is not None and best.cost < _GOOD_COST:
                return best
        if best is not None and best.cost < _FAIR_COST:
            return best
    return best


def _wordings(label: Label) -> tuple[str, ...]:
    """Gives a region's label on one line and on two; any other on one."""
    if label.region is None or " " not in label.text:
        return (label.text,)
    return (label.text, label.text.replace(" ", "\n", 1))


def _best_position(label: Label, text: str, rings: _Rings, field: _Field) -> _Placed | None:
    patch = text_patch(text, LABEL_SIZE_PX)
    boxes = rings.boxes_around(label, patch)
    is_possible = field.is_on_map(boxes) & ~field.touches(boxes)
    if not is_possible.any():
        return None
    boxes, gaps = boxes[is_possible], rings.gaps_px[is_possible]
    needs_leader = _needs_leader(label, boxes, gaps, field)
    cost = (
        _COST_OF_COVERING * field.covered_ratio(boxes)
        + _COST_OF_STRAYING * field.strayed_ratio(boxes, label.region, needs_leader)
        + _COST_OF_LEADER * needs_leader
        + _COST_PER_PX * gaps
        + _COST_PER_BREAK * text.count("\n")
    )
    cheap = np.argsort(cost, kind="stable")[:_N_CHECKED_FOR_CROSSING]
    if needs_leader[cheap].any():
        crossed_ratio = field.crossed_ratio(_leaders(label, boxes[cheap]))
        cost[cheap] += _COST_OF_CROSSING * crossed_ratio * needs_leader[cheap]
    best = int(cheap[np.argmin(cost[cheap])])
    return _Placed(
        label=label,
        patch=patch,
        box=Box(*boxes[best].tolist()),
        has_leader=bool(needs_leader[best]),
        cost=float(cost[best]),
    )


def _needs_leader(label: Label, boxes: IntArray, gaps: FloatArray, field: _Field) -> Mask:
    """Gives True where a box is too far from its place, and not in the middle of its region."""
    is_far = gaps >= _LEADER_FROM_PX
    if label.region is None or field.regions is None:
        return is_far
    middle_row, middle_col = (boxes[:, 1] + boxes[:, 3]) // 2, (boxes[:, 0] + boxes[:, 2]) // 2
    return np.asarray(is_far & (field.regions[middle_row, middle_col] != label.region))


def _leaders(label: Label, boxes: IntArray) -> FloatArray:
    """Gives points (u, v) along the line from a place to each box, shape (boxes, points, 2)."""
    place = np.array([label.u, label.v])
    ends = np.clip(place, boxes[:, :2], boxes[:, 2:])
    way = ends - place
    length = np.maximum(1e-9, np.hypot(way[:, 0], way[:, 1]))[:, np.newaxis]
    starts = place + way * np.minimum(1.0, _CORNER_REACH * label.clearance_px / length)
    shares = np.linspace(0.0, 1.0, _N_LEADER_POINTS)[:, np.newaxis]
    points: FloatArray = starts[:, np.newaxis] + (ends - starts)[:, np.newaxis] * shares
    return points


def _draw_leader(inside: Canvas, spot: _Placed) -> None:
    """Draws a thin line from the place to the nearest point of the label's box."""
    label, box = spot.label, spot.box
    start = np.array([label.u, label.v])
    end = np.clip(start, (box.left, box.top), (box.right, box.bottom)).astype(np.float64)
    away = (end - start) / max(1e-9, float(np.hypot(*(end - start))))
    line = np.stack([start + label.clearance_px * away, end])
    draw_stroke(inside, line, Colour.INK, width_px=1)
    if label.region is not None:
        turns = np.linspace(0.0, math.tau, 9)
        dot = start + 3.0 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        draw_polygon(inside, dot, Colour.INK, halo_px=1)


def _corners(box: Box) -> tuple[int, int, int, int]:
    return box.left, box.top, box.right, box.bottom
