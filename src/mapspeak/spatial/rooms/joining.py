"""Join places into rooms: the surest join first, each border judged again as its places grow.

The certainty of a join comes from a sum of small decision trees over the measures of the border
(Friedman, "Greedy function approximation", 2001), fitted on maps that people divided.
"""

import heapq
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import FloatArray, IntArray
from mapspeak.spatial.rooms.borders import MEASURES, PlaceGraph
from mapspeak.spatial.rooms.raster import SETTINGS

Judge = Callable[[FloatArray], FloatArray]
"""Maps measures, shape (n, len(MEASURES)), to the certainty that nothing divides, 0 to 1."""
STRIP = 3.0
"""Length over width from which a place is a strip: something to walk along, not a room."""
JOIN_SHARE, STRIPS_SHARE = 0.45, 0.5
"""Places are joined that nothing divides with at least this certainty; two strips need more.

Two corridors meet at a bend or a crossing, where no wall and no narrow place divides them.
"""
_STRIP_M2 = 3.0
"""A smaller strip is a nook, or what is seen through a gap."""
_OF_STRIPS = [MEASURES.index(name) for name in ("shorter_log_walk", "smaller_log_area")]
_LEAST_OF_STRIPS = np.log([STRIP, _STRIP_M2])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TreeSum:
    """A sum of decision trees; arrays of shape (trees, nodes), the root first.

    Attributes:
        measure: The number of the measure that a node looks at.
        most: Up to this the left child comes next; infinite in a leaf, which is its own child.
        value: What a leaf adds.
    """

    measure: IntArray
    most: FloatArray
    left: IntArray
    right: IntArray
    value: FloatArray
    depth: int

    def __call__(self, measures: FloatArray) -> FloatArray:
        """Return for each border the certainty that nothing divides, 0 to 1."""
        tree = np.arange(len(self.value))
        border = np.arange(len(measures))[:, None]
        node = np.zeros((len(measures), len(tree)), np.intp)
        for _ in range(self.depth):
            is_left = measures[border, self.measure[tree, node]] <= self.most[tree, node]
            node = np.where(is_left, self.left[tree, node], self.right[tree, node])
        return np.asarray(1 / (1 + np.exp(-self.value[tree, node].sum(axis=1))))


@cache
def load_judge() -> TreeSum:
    """Return the trees that come with mapspeak."""
    data = resources.files("mapspeak.spatial.rooms") / "data" / "joining.json"
    return read_trees(data.read_text(encoding="utf-8"))


def read_trees(text: str) -> TreeSum:
    """Return trees written as JSON: per node measure, most, left, right; of a leaf its value."""
    trees = json.loads(text)["trees"]
    n_nodes = max(map(len, trees))
    shape = len(trees), n_nodes
    measure, own = np.zeros(shape, np.intp), np.tile(np.arange(n_nodes), (len(trees), 1))
    left, right = own.copy(), own.copy()
    most, value = np.full(shape, np.inf), np.zeros(shape)
    for number, tree in enumerate(trees):
        for node, what in enumerate(tree):
            if isinstance(what, list):
                name, most[number, node], left[number, node], right[number, node] = what
                measure[number, node] = MEASURES.index(name)
            else:
                value[number, node] = what
    return TreeSum(
        measure=measure, most=most, left=left, right=right, value=value, depth=n_nodes // 2
    )


def join_places(graph: PlaceGraph, judge: Judge, before: IntArray | None = None) -> None:
    """Join places until each is a room and each border divides.

    Args:
        before: The region that each place was of on the map before; 0 for none.
    """
    join_surest(graph, judge, before)
    _absorb_small(graph, judge)


def join_surest(graph: PlaceGraph, judge: Judge, before: IntArray | None = None) -> None:
    """Join places, the surest first, until every remaining border surely divides.

    What one look divided and another joins, while nothing changes, is judged nearly alike by both.
    """
    waiting: list[tuple[float, int, int, int]] = []
    last_judged: dict[tuple[int, int], int] = {}

    def judge_anew(pairs: list[tuple[int, int]]) -> None:
        if not pairs:
            return
        measures = graph.measure(np.array(pairs))
        are_strips = (measures[:, _OF_STRIPS] > _LEAST_OF_STRIPS).all(axis=1)
        spare = judge(measures) - np.where(are_strips, STRIPS_SHARE, JOIN_SHARE)
        if before is not None:
            spare = spare + _lean(before[np.array(pairs)])
        for pair, share in zip(pairs, spare.tolist(), strict=True):
            last_judged[pair] = number = last_judged.get(pair, 0) + 1
            if share >= 0:
                heapq.heappush(waiting, (-share, *pair, number))

    judge_anew(
        [(one, other) for one, own in enumerate(graph.neighbours) for other in own if one < other]
    )
    while waiting:
        _, one, other, number = heapq.heappop(waiting)
        if last_judged[one, other] != number or other not in graph.neighbours[one]:
            continue
        if graph.area_m2(one) < graph.area_m2(other):
            one, other = other, one
        graph.join(one, other)
        judge_anew([(min(one, beside), max(one, beside)) for beside in graph.neighbours[one]])


def _lean(before: IntArray) -> FloatArray:
    """Return how much surer joins count for what the map before showed of both sides, (n, 2)."""
    is_known, is_one = (before > 0).all(axis=1), before[:, 0] == before[:, 1]
    return np.asarray(SETTINGS.keep_share * is_known * np.where(is_one, 1.0, -1.0))


def _absorb_small(graph: PlaceGraph, judge: Judge) -> None:
    """Join places too small for a room with the neighbour they most surely belong to."""
    small = [place for place in range(1, len(graph.neighbours)) if _is_small(graph, place)]
    while small:
        place = small.pop()
        beside = list(graph.neighbours[place])
        if not beside or not _is_small(graph, place):
            continue
        sure = judge(graph.measure(np.array([(place, other) for other in beside])))
        kept = beside[int(sure.argmax())]
        graph.join(kept, place)
        small.append(kept)


def _is_small(graph: PlaceGraph, place: int) -> bool:
    """Return True for a place that is not a room; a room hardly seen yet may be smaller.

    A strip too narrow for any robot is not a room, however long.
    """
    if graph.clearance_m(place) < SETTINGS.least_clearance_m:
        return True
    is_half_seen = graph.unseen_share(place) >= SETTINGS.half_seen_share
    least_m2 = SETTINGS.part_area_m2 if is_half_seen else SETTINGS.room_area_m2
    return graph.area_m2(place) < least_m2


def judge_left(graph: PlaceGraph, judge: Judge) -> dict[tuple[int, int], float]:
    """Return the certainty that nothing divides two places that were not joined, 0 to 1."""
    pairs = [
        (one, other) for one, own in enumerate(graph.neighbours) for other in own if one < other
    ]
    if not pairs:
        return {}
    return dict(zip(pairs, judge(graph.measure(np.array(pairs))).tolist(), strict=True))


MAX_ROOMS = int(np.iinfo(np.int16).max)
"""Most rooms that the labels can hold; smaller ones are left out."""


def number_by_area(graph: PlaceGraph) -> NDArray[np.int32]:
    """Return for each basin the number of its room from 1, the largest first; 0 for no room."""
    place_of = graph.place_of
    places = [
        place for place in np.unique(place_of).tolist() if place and not _is_small(graph, place)
    ]
    ordered = sorted(places, key=lambda place: (-graph.area_m2(place), place))
    number = np.zeros(len(place_of), np.int32)
    number[ordered[:MAX_ROOMS]] = np.arange(1, len(ordered[:MAX_ROOMS]) + 1)
    return number[place_of]
