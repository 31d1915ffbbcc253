"""The places of a floor, and measures of the borders between them.

A place begins as one basin of clearance, and places are joined. A place is described by sums and
maxima over its basins, so that a join needs no access to the floor.
"""

import numpy as np

from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.rooms.basins import (
    CONTACT,
    FIRST,
    GAP,
    HALF_WIDTH,
    RISE,
    RISES_M,
    WALL,
    BasinLabels,
    Basins,
    Passes,
)
from mapspeak.spatial.rooms.raster import Raster, find_cells

MEASURES = (
    "half_width_m",
    "width_to_narrower",
    "width_to_wider",
    "width_to_narrower_mean",
    "width_to_wider_mean",
    "narrower_clearance_m",
    "narrower_to_wider",
    "narrower_log_area",
    "wider_log_area",
    "smaller_log_area",
    "shorter_log_walk",
    "wall_m",
    "wall_to_width",
    "gap_to_width",
    "contact_to_width",
    "contact_to_size",
    "contact_share_of_narrower",
    "contact_share_of_wider",
    "narrower_fill",
    "wider_fill",
    "joined_fill",
    "gained_fill",
    "n_borders_of_narrower",
    "n_borders_of_wider",
    "unseen_share_of_narrower",
    *(
        f"rise_{side}_{number}"
        for side in ("narrower", "wider")
        for number, _ in enumerate(RISES_M)
    ),
)
"""Measures of a border; its narrower side is the one with the smaller clearance.

Widths are halved, as clearances are. A walk is the length of a place, along its bends, over its
width. Fill is the area of a place over that of the rectangle with the same second moments.
"""

_CELLS, _ROW, _COL, _ROW_ROW, _COL_COL, _ROW_COL, _CLEARANCE, _EDGE, _UNSEEN = range(9)
_LEAST_M = 1e-3
_LEAST_EDGE_M = 0.1


class PlaceGraph:
    """The places of a floor, which can be joined, and the borders between them.

    Attributes:
        neighbours: For each place its neighbours, each with the number of the border to it. The
            numbers of places are those of basins; place 0 is what is no floor.
    """

    def __init__(self, basins: Basins, passes: Passes, raster: Raster) -> None:
        n = int(basins.labels.max(initial=0)) + 1
        self._cell_size_m = raster.cell_size_m
        self._sums = _sum_up(basins, raster, n)
        self._peak_m = np.zeros(n)
        of_peak = basins.labels.ravel()[basins.peaks]
        np.maximum.at(self._peak_m, of_peak, basins.heights.ravel()[basins.peaks])
        self._place_of = np.arange(n)
        self._borders = passes.values.copy()
        self.neighbours: list[dict[int, int]] = [{} for _ in range(n)]
        for number, (one, other) in enumerate(passes.pairs.tolist()):
            self._add_border(one, other, number)
        self._contact_m = np.array(
            [self._borders[list(own.values()), CONTACT].sum() for own in self.neighbours]
        )

    def _add_border(self, one: int, other: int, number: int) -> None:
        """Add a border, or merge it into the existing one, with the wider pass of both."""
        kept = self.neighbours[one].get(other)
        if kept is None:
            self.neighbours[one][other] = self.neighbours[other][one] = number
            return
        both = self._borders[[kept, number]]
        self._borders[kept] = both[both[:, HALF_WIDTH].argmax()]
        self._borders[kept, CONTACT] = both[:, CONTACT].sum()

    @property
    def place_of(self) -> IntArray:
        """Return for each basin the place that it is part of by now."""
        while not np.array_equal(further := self._place_of[self._place_of], self._place_of):
            self._place_of = further
        return self._place_of

    def area_m2(self, place: int) -> float:
        """Return the area of a place."""
        return float(self._sums[_CELLS, place]) * self._cell_size_m**2

    def clearance_m(self, place: int) -> float:
        """Return the largest clearance in a place."""
        return float(self._peak_m[place])

    def unseen_share(self, place: int) -> float:
        """Return how much of the outline of a place borders on unseen cells."""
        edge = self._sums[_EDGE, place]
        return float(self._sums[_UNSEEN, place] / edge) if edge else 0.0

    def join(self, place: int, gone: int) -> None:
        """Make a place part of its neighbour."""
        self._sums[:, place] += self._sums[:, gone]
        self._peak_m[place] = max(self._peak_m[place], self._peak_m[gone])
        self._place_of[gone] = place
        between_m = self._borders[self.neighbours[place].pop(gone), CONTACT]
        self._contact_m[place] += self._contact_m[gone] - 2 * between_m
        beyond, self.neighbours[gone] = self.neighbours[gone], {}
        del beyond[place]
        for other, number in beyond.items():
            del self.neighbours[other][gone]
            self._add_border(place, other, number)

    def measure(self, pairs: IntArray) -> FloatArray:
        """Return the measures of the borders between pairs of places.

        Args:
            pairs: Shape (n, 2).

        Returns:
            Shape (n, len(MEASURES)).
        """
        swap = self._peak_m[pairs[:, 0]] > self._peak_m[pairs[:, 1]]
        narrow, wide = np.where(swap, pairs[:, ::-1].T, pairs.T)
        numbers = [self.neighbours[one][other] for one, other in pairs.tolist()]
        border = self._borders[numbers]
        half_m = np.maximum(border[:, HALF_WIDTH], _LEAST_M)
        contact_m = border[:, CONTACT]
        columns = [
            *self._measure_widths(narrow, wide, half_m),
            *self._measure_sizes(narrow, wide),
            border[:, WALL],
            border[:, WALL] / (2 * half_m),
            border[:, GAP] / (2 * half_m),
            contact_m / (2 * half_m),
            contact_m / np.sqrt(self._areas_m2(narrow)),
            *(contact_m / np.maximum(self._contact_m[side], _LEAST_M) for side in (narrow, wide)),
            *self._measure_fill(narrow, wide),
            *([len(self.neighbours[place]) for place in side.tolist()] for side in (narrow, wide)),
            self._measure_unseen(narrow),
            *self._measure_rises(narrow, border).T / half_m,
        ]
        return np.stack(columns, axis=1).astype(np.float64)

    def _areas_m2(self, places: IntArray) -> FloatArray:
        areas: FloatArray = self._sums[_CELLS, places] * self._cell_size_m**2
        return areas

    def _measure_widths(
        self, narrow: IntArray, wide: IntArray, half_m: FloatArray
    ) -> list[FloatArray]:
        peak_n, peak_w = (np.maximum(self._peak_m[side], _LEAST_M) for side in (narrow, wide))
        mean_n, mean_w = (self._mean_clearance_m(self._sums[:, side]) for side in (narrow, wide))
        return [
            half_m,
            half_m / peak_n,
            half_m / peak_w,
            half_m / (2 * mean_n),
            half_m / (2 * mean_w),
            peak_n,
            peak_n / peak_w,
        ]

    def _mean_clearance_m(self, sums: FloatArray) -> FloatArray:
        return np.asarray(np.maximum(sums[_CLEARANCE] / sums[_CELLS], _LEAST_M))

    def _measure_sizes(self, narrow: IntArray, wide: IntArray) -> list[FloatArray]:
        log_n, log_w = (np.log(self._areas_m2(side)) for side in (narrow, wide))
        # In a long strip the mean distance from the nearer side is a quarter of the width.
        walks = (
            log - 2 * np.log(4 * self._mean_clearance_m(self._sums[:, side]))
            for log, side in ((log_n, narrow), (log_w, wide))
        )
        return [log_n, log_w, np.minimum(log_n, log_w), np.minimum(*walks)]

    def _measure_fill(self, narrow: IntArray, wide: IntArray) -> list[FloatArray]:
        sums_n, sums_w = self._sums[:, narrow], self._sums[:, wide]
        fill_n, fill_w, joined = (_fill(sums) for sums in (sums_n, sums_w, sums_n + sums_w))
        share = sums_n[_CELLS] / (sums_n[_CELLS] + sums_w[_CELLS])
        return [fill_n, fill_w, joined, joined - share * fill_n - (1 - share) * fill_w]

    def _measure_unseen(self, narrow: IntArray) -> FloatArray:
        edge_m = self._sums[_EDGE, narrow] * self._cell_size_m + self._contact_m[narrow]
        unseen_m = self._sums[_UNSEEN, narrow] * self._cell_size_m
        return np.asarray(unseen_m / np.maximum(edge_m, _LEAST_EDGE_M))

    def _measure_rises(self, narrow: IntArray, border: FloatArray) -> FloatArray:
        """Return the clearances on the way up, the narrower side's first."""
        first, second = np.split(border[:, RISE:], 2, axis=1)
        is_narrow = self.place_of[border[:, FIRST].astype(np.intp)] == narrow
        return np.where(is_narrow[:, None], np.hstack([first, second]), np.hstack([second, first]))


def _sum_up(basins: Basins, raster: Raster, n: int) -> FloatArray:
    """Return for each basin how many cells it has, their moments, clearances and outer edges."""
    unseen = (raster.free | raster.occupied) == 0
    # By runs of cells along rows, which the frame divides.
    labels = basins.labels
    starts = np.flatnonzero(labels.ravel()[1:] != labels.ravel()[:-1]) + 1
    of_run = labels.ravel()[starts]
    row, first = np.divmod(starts, labels.shape[1])
    length = np.diff(starts, append=labels.size)
    heights = basins.heights.ravel()
    clearance = np.add.reduceat(heights, starts, dtype=np.float64) if starts.size else starts
    middle = first + (length - 1) / 2
    # The squares of a run's columns sum up to that of its middle, and of a run around 0.
    squares = length * (middle**2 + (length**2 - 1) / 12)
    moments = (length * row, length * middle, length * row**2, squares, length * row * middle)
    sums = [
        np.bincount(of_run, weights=each, minlength=n) for each in (length, *moments, clearance)
    ]
    found = np.stack([*sums, *_count_edges(basins.labels, unseen, n)])
    found[:, 0] = 0.0
    return found


def _count_edges(labels: BasinLabels, unseen: Mask, n: int) -> tuple[FloatArray, FloatArray]:
    """Return for each basin how many of its cells' sides face no floor, and what is not seen."""
    edge, edge_unseen = np.zeros(n), np.zeros(n)
    is_floor = labels > 0
    for here, there in ((np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:])):
        places = find_cells(is_floor[here] != is_floor[there])
        one, other = labels[here][places], labels[there][places]
        faces_unseen = np.where(one > 0, unseen[there][places], unseen[here][places])
        edge += np.bincount(one + other, minlength=n)
        edge_unseen += np.bincount(one + other, weights=faces_unseen, minlength=n)
    return edge, edge_unseen


def _fill(sums: FloatArray) -> FloatArray:
    """Return area over that of the rectangle with the same second moments: 1 for a rectangle."""
    n = sums[_CELLS]
    row, col = sums[_ROW] / n, sums[_COL] / n
    # Each cell is a square with its own spread.
    high = sums[_ROW_ROW] / n - row**2 + 1 / 12
    wide = sums[_COL_COL] / n - col**2 + 1 / 12
    cross = sums[_ROW_COL] / n - row * col
    spread = np.maximum(high * wide - cross**2, (1 / 12) ** 2)
    return np.asarray(n / (12 * np.sqrt(spread)))
