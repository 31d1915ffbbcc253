"""What the judge of borders sees while places are joined, and what would have been right."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.rooms.people import count_hallways, find_agreement, find_overlap
from mapspeak.spatial.grid import FloatArray, IntArray
from mapspeak.spatial.rooms import RoomClass
from mapspeak.spatial.rooms.borders import MEASURES, PlaceGraph
from mapspeak.spatial.rooms.finding import (
    classify_all,
    find_openings,
    join_corridors,
    measure_regions,
)
from mapspeak.spatial.rooms.floor import Floor, build_floor
from mapspeak.spatial.rooms.joining import Judge, join_places, join_surest, number_by_area
from mapspeak.spatial.rooms.raster import Picture, Raster, build_raster
from mapspeak.spatial.rooms.segmentation import (
    Segmentation,
    draw_cuts,
    fill_cuts,
    find_borders,
    find_doorways,
)
from tools.roomfit.labelled import LabelledMap

LARGE_M2 = 3.0
"""A border between places larger than this is as important as one can be."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Samples:
    """Borders that were judged.

    Attributes:
        measures: Shape (n, len(MEASURES)).
        is_none: True where both sides are of one room.
        weights: How much each counts.
    """

    measures: NDArray[np.float32]
    is_none: NDArray[np.bool_]
    weights: FloatArray

    def __len__(self) -> int:
        return len(self.is_none)


def unite(parts: Sequence[Samples]) -> Samples:
    """Return all samples as one."""
    return Samples(
        measures=np.concatenate([part.measures for part in parts]),
        is_none=np.concatenate([part.is_none for part in parts]),
        weights=np.concatenate([part.weights for part in parts]),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """How well a map was divided.

    Attributes:
        f1: Of regions that agree with a room.
        hallways: Right, wrong and missed, of those whose class people gave.
    """

    f1: float
    hallways: tuple[int, int, int]


class KnownGraph(PlaceGraph):
    """Places whose rooms are known; writes down every border that is measured.

    Attributes:
        shared_m2: The area that each place shares with each room, shape (places, rooms).
    """

    shared_m2: FloatArray
    seen: list[tuple[FloatArray, NDArray[np.bool_], FloatArray]]
    last_is_none: NDArray[np.bool_]

    def measure(self, pairs: IntArray) -> FloatArray:
        """Measure borders, and note which of them divide rooms."""
        measures = super().measure(pairs)
        one, other = self.shared_m2[pairs[:, 0]], self.shared_m2[pairs[:, 1]]
        smaller_m2 = np.minimum(one.sum(axis=1), other.sum(axis=1))
        is_known = smaller_m2 > 0
        is_none = one.argmax(axis=1) == other.argmax(axis=1)
        self.last_is_none = is_none | ~is_known
        self.seen.append((measures[is_known], is_none[is_known], smaller_m2[is_known]))
        return measures

    def join(self, place: int, gone: int) -> None:
        """Join two places, and what is known of them."""
        self.shared_m2[place] += self.shared_m2[gone]
        super().join(place, gone)

    def judge_rightly(self, measures: FloatArray) -> FloatArray:
        """Return what somebody who knows the rooms would say of the borders just measured."""
        openness = np.clip(measures[:, MEASURES.index("width_to_narrower")], 0, 1)
        return np.where(self.last_is_none, 0.5 + openness / 2, 0.0)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Task:
    """A labelled map, ready to be divided again and again."""

    labelled: LabelledMap
    raster: Raster
    floor: Floor
    cut: Picture
    basins: NDArray[np.int32]
    graph: KnownGraph

    def play(self, judge: Judge | None) -> Samples:
        """Join places as this judge says, or rightly without one; return what was judged."""
        graph = copy.deepcopy(self.graph)
        join_surest(graph, judge or graph.judge_rightly)
        measures, is_none, smaller_m2 = (
            np.concatenate([part[i] for part in graph.seen]) for i in range(3)
        )
        importance = 0.1 + 0.9 * np.minimum(smaller_m2 / LARGE_M2, 1)
        return Samples(
            measures=measures.astype(np.float32),
            is_none=is_none.astype(bool),
            # A map with many borders counts more than one with few, but not by as much.
            weights=importance / np.sqrt(max(len(is_none), 1)),
        )

    def score(self, judge: Judge) -> Score:
        """Return how well rooms agree at an intersection over union of 0.5."""
        graph = copy.deepcopy(self.graph)
        join_places(graph, judge)
        places = fill_cuts(number_by_area(graph)[self.basins], self.cut)
        rooms = Segmentation(raster=self.raster, floor=self.floor, labels=places, doubts={})
        rooms = join_corridors(rooms, measure_regions(rooms), find_openings(rooms))
        found = self.raster.on_grid(rooms.labels).astype(np.intp)
        truth = self.labelled.truth.astype(np.intp)
        overlap = find_overlap(found, truth, self.labelled.grid.free & (truth > 0))
        n_found, n_true = ((overlap.sum(axis=axis)[1:] > 0).sum() for axis in (1, 0))
        n_right = (find_agreement(overlap) >= 0.5).sum()
        classes = classify_all(measure_regions(rooms), find_openings(rooms))
        return Score(
            f1=float(2 * n_right / max(n_found + n_true, 1)),
            hallways=self._count_hallways(classes, overlap),
        )

    def _count_hallways(
        self, classes: Sequence[RoomClass], overlap: NDArray[np.intp]
    ) -> tuple[int, int, int]:
        if not self.labelled.classes:
            return 0, 0, 0
        corridors = [each is RoomClass.CORRIDOR for each in classes]
        return count_hallways(corridors, self.labelled.classes, overlap)


def prepare(labelled: LabelledMap) -> Task:
    """Divide a map into basins, and count what each shares with each room."""
    raster = build_raster(labelled.grid)
    floor = build_floor(raster)
    doorways = find_doorways(raster, floor)
    cut = draw_cuts(doorways, floor.floor)
    basins, passes = find_borders(raster, floor, doorways, cut)
    truth = _truth_on(raster, labelled)
    cells = find_overlap(basins.labels.astype(np.intp), truth, np.ones(truth.shape, bool))
    cells[:, 0] = 0
    graph = KnownGraph(basins, passes, raster)
    graph.shared_m2 = cells * np.float64(raster.cell_area_m2)
    graph.seen = []
    return Task(
        labelled=labelled, raster=raster, floor=floor, cut=cut, basins=basins.labels, graph=graph
    )


def _truth_on(raster: Raster, labelled: LabelledMap) -> NDArray[np.intp]:
    truth = np.where(labelled.grid.free[: len(labelled.truth)], labelled.truth, 0)
    return raster.of_grid(truth.astype(np.int16)).astype(np.intp)
