"""Positions for labels: where each could stand, and how much it would hide there."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.picture.ink import LABEL_SIZE_PX, text_patch
from mapspeak.spatial.picture.palette import Canvas
from mapspeak.spatial.picture.view import Box

HALO_PX = 3
_N_DIRECTIONS = 16
_LEADER_FROM_PX = 10.0
_COST_OF_COVERING = 12.0
_COST_OF_STRAYING = 6.0
_COST_OF_MISLEADING = 12.0
_COST_OF_LEADER = 2.0
_COST_PER_BREAK = 0.5
_COST_PER_PX = 0.04
_SAMPLES_ACROSS = np.linspace(0, 1, 7)
_SAMPLES_DOWN = np.linspace(0, 1, 3)[:, np.newaxis]


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """A text and the place it belongs to, in pixels of the map area.

    Attributes:
        wordings: Ways to write it, the best first; see `text_patch`.
        names: What it names, for a reader who has to do without it.
        u: Column of the place.
        v: Row of the place.
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
        label: What was placed.
        patch: Its text as drawn.
        box: Where it stands.
        has_leader: A line joins it to what it names.
    """

    label: Label
    patch: Canvas
    box: Box
    has_leader: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rings:
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Positions:
    """Possible positions of one label, in all its wordings.

    Attributes:
        label: What is to be placed.
        wording: The number of the wording in each position.
        boxes: Rows of (left, top, right, bottom).
        needs_leader: It would need a line to what it names.
        is_astray: Some of it would lie outside its region.
        cost: How bad the position is, other labels left aside.
    """

    label: Label
    wording: IntArray
    boxes: IntArray
    needs_leader: Mask
    is_astray: Mask
    cost: FloatArray

    def placed(self, index: int) -> Placed:
        """Gives the label in one of the positions."""
        return Placed(
            label=self.label,
            patch=text_patch(self.label.wordings[self.wording[index]], LABEL_SIZE_PX),
            box=Box(*self.boxes[index].tolist()),
            has_leader=bool(self.needs_leader[index]),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabelField:
    """What labels meet on the map: drawn things and regions.

    Attributes:
        covered_before: The number of busy pixels above and left of each pixel corner.
        regions: The region of each pixel.
    """

    covered_before: NDArray[np.int32]
    regions: NDArray[np.uint16] | None

    def is_on_map(self, boxes: IntArray) -> Mask:
        """Gives True for boxes that lie inside the map area with their halo."""
        n_rows, n_cols = self.covered_before.shape[0] - 1, self.covered_before.shape[1] - 1
        farthest = np.array([n_cols, n_rows]) - HALO_PX
        return np.asarray((boxes[:, :2] >= HALO_PX).all(1) & (boxes[:, 2:] <= farthest).all(1))

    def covered_ratio(self, boxes: IntArray) -> FloatArray:
        """Gives the share of each box that lies on walls or drawn things."""
        left, top, right, bottom = boxes.T
        before = self.covered_before
        covered = before[bottom, right] - before[top, right] - before[bottom, left]
        area_px = (right - left) * (bottom - top)
        return np.asarray((covered + before[top, left]) / area_px, dtype=np.float64)

    def needs_leader(self, boxes: IntArray, gaps_px: FloatArray, region: IntArray) -> Mask:
        """Gives True where a box is too far from its place, and not in the middle of its region."""
        is_far = gaps_px >= _LEADER_FROM_PX
        if self.regions is None:
            return is_far
        row, col = (boxes[:, 1] + boxes[:, 3]) // 2, (boxes[:, 0] + boxes[:, 2]) // 2
        return np.asarray(is_far & ((region == 0) | (self.regions[row, col] != region)))

    def strayed_ratio(self, boxes: IntArray, region: IntArray, needs_leader: Mask) -> FloatArray:
        """Gives the share of each box where it should not be, judged at a few points of it.

        That is outside its region, but for a box with a leader inside another region.
        """
        strayed = np.zeros(len(boxes))
        if self.regions is None or not region.any():
            return strayed
        named = np.flatnonzero(region)
        left, top, right, bottom = (boxes[named, i, np.newaxis, np.newaxis] for i in range(4))
        cols = left + (right - 1 - left) * _SAMPLES_ACROSS
        rows = top + (bottom - 1 - top) * _SAMPLES_DOWN
        found = self.regions[rows.astype(np.intp), cols.astype(np.intp)]
        is_wrong = found != region[named, np.newaxis, np.newaxis]
        is_wrong &= (found > 0) | ~needs_leader[named, np.newaxis, np.newaxis]
        strayed[named] = is_wrong.mean(axis=(1, 2))
        return strayed

    def positions(self, labels: tuple[Label, ...], rings: Rings) -> list[Positions]:
        """Gives the positions of each label that lie on the map; all are judged in one go."""
        if not labels:
            return []
        spread = _spread(labels, rings).where(self.is_on_map)
        boxes = spread.boxes
        region = np.array([label.region or 0 for label in labels])[spread.owner]
        needs_leader = self.needs_leader(boxes, spread.gaps_px, region)
        strayed_ratio = self.strayed_ratio(boxes, region, needs_leader)
        cost = (
            _COST_OF_COVERING * self.covered_ratio(boxes)
            + _COST_OF_STRAYING * strayed_ratio * np.where(needs_leader, 0.5, 1.0)
            + _COST_OF_MISLEADING * np.maximum(0.0, strayed_ratio - 0.5) * ~needs_leader
            + _COST_OF_LEADER * needs_leader
            + _COST_PER_PX * spread.gaps_px
            + _COST_PER_BREAK * spread.n_breaks
        )
        starts = np.searchsorted(spread.owner, np.arange(len(labels) + 1))
        parts = [slice(first, last) for first, last in itertools.pairwise(starts)]
        return [
            Positions(
                label=label,
                wording=spread.wording[part],
                boxes=boxes[part],
                needs_leader=needs_leader[part],
                is_astray=strayed_ratio[part] > 0,
                cost=cost[part],
            )
            for label, part in zip(labels, parts, strict=True)
        ]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Spread:
    """The positions of many labels, one after the other.

    Attributes:
        boxes: Rows of (left, top, right, bottom).
        gaps_px: How far each is from its place.
        owner: The number of the label.
        wording: The number of its wording.
        n_breaks: In that wording.
    """

    boxes: IntArray
    gaps_px: FloatArray
    owner: IntArray
    wording: IntArray
    n_breaks: IntArray

    def where(self, is_kept: Callable[[IntArray], Mask]) -> "_Spread":
        """Gives those positions whose boxes are kept."""
        kept = np.flatnonzero(is_kept(self.boxes))
        return _Spread(
            boxes=self.boxes[kept],
            gaps_px=self.gaps_px[kept],
            owner=self.owner[kept],
            wording=self.wording[kept],
            n_breaks=self.n_breaks[kept],
        )


def _spread(labels: tuple[Label, ...], rings: Rings) -> _Spread:
    boxes, wordings = [], []
    for owner, label in enumerate(labels):
        for wording, text in enumerate(label.wordings):
            boxes.append(rings.boxes_around(label, text_patch(text, LABEL_SIZE_PX)))
            wordings.append((owner, wording, text.count("\n")))
    of_wording = np.repeat(np.array(wordings), len(rings.gaps_px), axis=0)
    return _Spread(
        boxes=np.concatenate(boxes),
        gaps_px=np.tile(rings.gaps_px, len(boxes)),
        owner=of_wording[:, 0],
        wording=of_wording[:, 1],
        n_breaks=of_wording[:, 2],
    )
