"""Label placement: near what a label names, on nothing that should stay visible.

Every label tries positions around its place, from near to far, and takes the one that covers the
fewest walls and drawn things; a label with no free position gets none.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.picture.ink import LABEL_SIZE_PX, text_patch
from mapspeak.spatial.picture.labels import (
    FAR_RINGS,
    HALO_PX,
    NEAR_RINGS,
    Label,
    Placed,
    Rings,
    leader_of,
)
from mapspeak.spatial.picture.marks import IS_BUSY, Canvas
from mapspeak.spatial.picture.transform import Box

_COST_OF_CROSSING = 12.0
_COST_OF_HINDERING = 1.2
_FAIR_COST = 1.5
_N_LEADER_POINTS = 9
_LEADER_STEP_PX = 8.0
_N_CHECKED = 16
_BLOCK = 24
_CORNER_REACH = 1.5
"""A symbol's box reaches this much farther at its corners than the symbol itself."""
_LEADER_FROM_PX = 10.0
_COST_OF_COVERING = 12.0
_COST_OF_STRAYING = 6.0
_COST_OF_MISLEADING = 12.0
_COST_OF_LEADER = 2.0
_COST_PER_BREAK = 0.5
_COST_PER_PX = 0.04
_SAMPLES_ACROSS = np.linspace(0, 1, 7)
_SAMPLES_DOWN = np.linspace(0, 1, 3)[:, np.newaxis]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Positions:
    """Possible positions of one label, in all its wordings.

    Attributes:
        wording: The number of the wording in each position.
        boxes: Rows of (left, top, right, bottom).
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
        """Return the label in one of the positions."""
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
    """

    covered_before: NDArray[np.int32]
    regions: NDArray[np.uint16]

    def covered_ratio(self, boxes: IntArray) -> FloatArray:
        """Return the share of each box that lies on walls or drawn things."""
        left, top, right, bottom = boxes.T
        before = self.covered_before
        covered = before[bottom, right] - before[top, right] - before[bottom, left]
        area_px = (right - left) * (bottom - top)
        return np.asarray((covered + before[top, left]) / area_px, dtype=np.float64)

    def needs_leader(self, boxes: IntArray, gaps_px: FloatArray, region: IntArray) -> Mask:
        """Return True where a box is far from its place, and not in the middle of its region."""
        is_far = gaps_px >= _LEADER_FROM_PX
        row, col = (boxes[:, 1] + boxes[:, 3]) // 2, (boxes[:, 0] + boxes[:, 2]) // 2
        return np.asarray(is_far & ((region == 0) | (self.regions[row, col] != region)))

    def strayed_ratio(self, boxes: IntArray, region: IntArray, needs_leader: Mask) -> FloatArray:
        """Return the share of each box where it should not be, judged at a few points of it.

        That is outside its region, but for a box with a leader inside another region.
        """
        strayed = np.zeros(len(boxes))
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
        """Return the positions of each label that lie on the map; all are judged in one go."""
        if not labels:
            return []
        wordings = [
            (
                owner,
                wording,
                text.count("\n"),
                rings.boxes_around(label, text_patch(text, LABEL_SIZE_PX)),
            )
            for owner, label in enumerate(labels)
            for wording, text in enumerate(label.wordings)
        ]
        boxes = np.concatenate([each[3] for each in wordings])
        n_cols, n_rows = self.covered_before.shape[1] - 1, self.covered_before.shape[0] - 1
        is_on_map = (boxes[:, :2] >= HALO_PX).all(1)
        is_on_map &= (boxes[:, 2:] <= np.array([n_cols, n_rows]) - HALO_PX).all(1)
        boxes, gaps_px = boxes[is_on_map], np.tile(rings.gaps_px, len(wordings))[is_on_map]
        numbers = np.array([each[:3] for each in wordings])
        owner, wording, n_breaks = np.repeat(numbers, len(rings.gaps_px), axis=0)[is_on_map].T
        region = np.array([label.region or 0 for label in labels])[owner]
        needs_leader = self.needs_leader(boxes, gaps_px, region)
        strayed_ratio = self.strayed_ratio(boxes, region, needs_leader)
        cost = (
            _COST_OF_COVERING * self.covered_ratio(boxes)
            + _COST_OF_STRAYING * strayed_ratio * np.where(needs_leader, 0.5, 1.0)
            + _COST_OF_MISLEADING * np.maximum(0.0, strayed_ratio - 0.5) * ~needs_leader
            + _COST_OF_LEADER * needs_leader
            + _COST_PER_PX * gaps_px
            + _COST_PER_BREAK * n_breaks
        )
        starts = np.searchsorted(owner, np.arange(len(labels) + 1))
        parts = [slice(first, last) for first, last in itertools.pairwise(starts)]
        return [
            Positions(
                label=label,
                wording=wording[part],
                boxes=boxes[part],
                needs_leader=needs_leader[part],
                is_astray=strayed_ratio[part] > 0,
                cost=cost[part],
            )
            for label, part in zip(labels, parts, strict=True)
        ]


def place_labels(
    inside: Canvas,
    labels: list[Label],
    *,
    obstacles: list[Box],
    regions: NDArray[np.uint16],
) -> tuple[list[Placed], tuple[str, ...]]:
    """Return the placed labels, and the names of labels without room.

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
    search = _Search(tuple(labels), field, tuple(obstacles))
    of_regions = [label for label in labels if label.region is not None]
    # Regions too small for their labels choose first, because these need the free ground around;
    # then points, which have many good places, but spare the best one of a region's label; last
    # regions. Where points took all places in a region after all, those in its best place move.
    for label in of_regions:
        if label not in search.wishes:
            search.place(label)
    for label in labels:
        if label.region is None:
            search.place(label)
    for label in of_regions:
        if label in search.wishes:
            search.place_inside(label)
    left_out = (label for label in labels if label not in search.placed)
    return list(search.placed.values()), tuple(name for label in left_out for name in label.names)


class _Search:
    """The state of the search.

    Attributes:
        wishes: Where each region's label would stand inside it if there were no other labels.
    """

    def __init__(
        self, labels: tuple[Label, ...], field: LabelField, obstacles: tuple[Box, ...]
    ) -> None:
        self.placed: dict[Label, Placed] = {}
        self._field = field
        self._near = dict(zip(labels, field.positions(labels, NEAR_RINGS), strict=True))
        self._far: dict[Label, Positions] = {}
        self._taken = _Taken(obstacles)
        self._spared = np.zeros((0, 4), dtype=np.intp)
        self.wishes = {label: spot for label in labels if (spot := self._find_inside(label))}
        wished = [spot.box for spot in self.wishes.values()]
        self._spared = np.array(wished, dtype=np.intp).reshape(-1, 4)

    def place(self, label: Label) -> None:
        """Place a label anywhere, if there is room."""
        self._add(self._find(label, lambda positions: np.ones(len(positions.boxes), dtype=bool)))

    def place_inside(self, label: Label) -> None:
        """Place a region's label inside it, if need be where it wished to be.

        The labels of points that stand there move.
        """
        wish = self.wishes[label]
        # Nothing inside is better than what was wished for while no label was placed.
        spot = wish if self._taken.is_free(wish.box) else self._find_inside(label)
        in_its_way: list[Placed] = []
        if spot is None:
            in_its_way = [self.placed[other] for other in self._taken.owners_at(wish.box)]
            if any(other.label.region is not None for other in in_its_way):
                self.place(label)
                return
        for other in in_its_way:
            self._taken.remove(other.label)
            del self.placed[other.label]
        self._add(spot or wish)
        for other in in_its_way:
            self.place(other.label)

    def _add(self, spot: Placed | None) -> None:
        if spot is not None:
            self.placed[spot.label] = spot
            self._taken.add(spot)

    def _find_inside(self, label: Label) -> Placed | None:
        if label.region is None:
            return None
        return self._find(
            label,
            lambda positions: (
                ~(positions.needs_leader | positions.is_astray) & (positions.cost < _FAIR_COST)
            ),
        )

    def _find(self, label: Label, is_possible: Callable[[Positions], Mask]) -> Placed | None:
        """Return the cheapest possible place; far ones are tried where no near one is good."""
        best: Placed | None = None
        best_cost = math.inf
        for is_far in (False, True):
            if is_far and label not in self._far:
                self._far[label] = self._field.positions((label,), FAR_RINGS)[0]
            positions = self._far[label] if is_far else self._near[label]
            possible = np.flatnonzero(is_possible(positions))
            free = _cheapest_free(positions, possible, self._taken.boxes)
            if free.size:
                cost, cheapest = self._judge(positions, free)
                if cost < best_cost:
                    best, best_cost = positions.placed(cheapest), cost
            if best_cost < _FAIR_COST:
                break
        return best

    def _judge(self, positions: Positions, index: IntArray) -> tuple[float, int]:
        """Return the lowest cost among positions, the other labels counted, and where it is."""
        label, boxes = positions.label, positions.boxes[index]
        cost, needs_leader = positions.cost[index], positions.needs_leader[index]
        if label.region is None:
            cost += _COST_OF_HINDERING * _overlaps(boxes, self._spared).any(axis=1)
        if needs_leader.any():
            u, v = np.moveaxis(_leaders(label, boxes), 2, 0)[..., np.newaxis]
            left, top, right, bottom = self._taken.boxes.T
            is_crossing = (u >= left) & (u < right) & (v >= top) & (v < bottom)
            cost += _COST_OF_CROSSING * is_crossing.any(axis=2).mean(axis=1) * needs_leader
        best = int(np.argmin(cost))
        return float(cost[best]), int(index[best])


class _Taken:
    """Boxes that no label may touch; grows as labels find their places."""

    def __init__(self, obstacles: tuple[Box, ...]) -> None:
        self.boxes = np.array(obstacles, dtype=np.intp).reshape(-1, 4)
        self._owners: list[Label | None] = [None] * len(obstacles)

    def add(self, spot: Placed) -> None:
        """Take a label's box, and a rim around it and its leader."""
        rim = np.array([-HALO_PX, -HALO_PX, HALO_PX, HALO_PX])
        boxes = np.array([spot.box])
        if spot.has_leader:
            leader = leader_of(spot.label, spot.box)
            length_px = float(np.hypot(*(leader[1] - leader[0])))
            shares = np.linspace(0.0, 1.0, 2 + int(length_px / _LEADER_STEP_PX))[:, np.newaxis]
            points = np.rint(leader[0] + (leader[1] - leader[0]) * shares).astype(np.intp)
            boxes = np.vstack([boxes, np.hstack([points, points])])
        self.boxes = np.vstack([self.boxes, boxes + rim])
        self._owners += [spot.label] * len(boxes)

    def remove(self, label: Label) -> None:
        """Free a label's boxes."""
        is_kept = [owner is not label for owner in self._owners]
        self.boxes = self.boxes[is_kept]
        self._owners = [owner for owner in self._owners if owner is not label]

    def is_free(self, box: Box) -> bool:
        """Return True where nothing of a box is taken."""
        return not _overlaps(np.array([box]), self.boxes).any()

    def owners_at(self, box: Box) -> tuple[Label, ...]:
        """Return the labels that have taken some of a box, each once."""
        found = np.flatnonzero(_overlaps(np.array([box]), self.boxes)[0])
        owners = [self._owners[index] for index in found]
        return tuple(dict.fromkeys(owner for owner in owners if owner is not None))


def _cheapest_free(positions: Positions, index: IntArray, taken: IntArray) -> IntArray:
    """Return the cheapest of some positions that touch nothing taken, in order of cost.

    They are looked at in blocks, because the first few often do.
    """
    index = index[np.argsort(positions.cost[index], kind="stable")]
    free = index[:0]
    for start in range(0, index.size, _BLOCK):
        block = index[start : start + _BLOCK]
        free = np.append(free, block[~_overlaps(positions.boxes[block], taken).any(axis=1)])
        if free.size >= _N_CHECKED:
            break
    return np.asarray(free[:_N_CHECKED])


def _overlaps(boxes: IntArray, taken: IntArray) -> Mask:
    """Return True where a box, by row, shares a pixel with a taken one, by column."""
    left, top, right, bottom = (boxes[:, index, np.newaxis] for index in range(4))
    overlaps = (left < taken[:, 2]) & (taken[:, 0] < right)
    overlaps &= (top < taken[:, 3]) & (taken[:, 1] < bottom)
    return np.asarray(overlaps)


def _leaders(label: Label, boxes: IntArray) -> FloatArray:
    """Return points (u, v) along the line from a place to each box, shape (boxes, points, 2)."""
    place = np.array([label.u, label.v])
    ends = np.clip(place, boxes[:, :2], boxes[:, 2:])
    way = ends - place
    length = np.maximum(1e-9, np.hypot(way[:, 0], way[:, 1]))[:, np.newaxis]
    starts = place + way * np.minimum(1.0, _CORNER_REACH * label.clearance_px / length)
    shares = np.linspace(0.0, 1.0, _N_LEADER_POINTS)[:, np.newaxis]
    points: FloatArray = starts[:, np.newaxis] + (ends - starts)[:, np.newaxis] * shares
    return points
