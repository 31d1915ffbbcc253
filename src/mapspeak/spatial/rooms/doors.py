"""The narrow places where two regions meet."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.spatial.rooms.raster import find_cells
from mapspeak.spatial.rooms.segmentation import Segmentation

_REACH_M = 0.3
"""Border cells nearer than this to each other are one opening."""
_LEAST_M = 0.25
"""A narrower gap is a crack in the map of a wall: no person and hardly a robot gets through."""
_ROUNDING_M = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """A door before it has an id; `first` and `second` are region numbers, first the smaller."""

    first: int
    second: int
    place: Point
    width_m: float


def find_openings(segmentation: Segmentation) -> list[Opening]:
    """Gives every way between two regions, ordered by regions, widest first."""
    row, col, first, second = _border_cells(segmentation.labels)
    openings = []
    order = np.lexsort((second, first))
    starts = np.flatnonzero(np.diff(first[order]) | np.diff(second[order])) + 1
    for here in np.split(order, starts) if order.size else ():
        pair = int(first[here[0]]), int(second[here[0]])
        openings += _split(segmentation, pair, row[here], col[here])
    return [opening for opening in openings if opening.width_m >= _LEAST_M - _ROUNDING_M]


def _border_cells(labels: NDArray[np.int32]) -> tuple[NDArray[np.intp], ...]:
    """Gives rows, columns and both regions of cells that touch a region with a higher number."""
    found = []
    for here, there, down, right in (
        (np.s_[:-1, :], np.s_[1:, :], 1, 0),
        (np.s_[:, :-1], np.s_[:, 1:], 0, 1),
    ):
        one, other = labels[here], labels[there]
        rows, cols = find_cells((one != other) & (one > 0) & (other > 0))
        a, b = one[rows, cols], other[rows, cols]
        higher = a > b
        rows, cols = rows + down * higher, cols + right * higher
        found.append(np.stack([rows, cols, np.minimum(a, b), np.maximum(a, b)]))
    joined = np.unique(np.concatenate(found, axis=1), axis=1)
    return tuple(joined.astype(np.intp))


def _split(
    segmentation: Segmentation,
    pair: tuple[int, int],
    rows: NDArray[np.intp],
    cols: NDArray[np.intp],
) -> list[Opening]:
    """Gives the separate openings of a pair of regions: border cells that hang together."""
    cell_size_m = segmentation.raster.cell_size_m
    top, left = int(rows.min()), int(cols.min())
    picture = np.zeros((int(rows.max()) - top + 1, int(cols.max()) - left + 1), np.uint8)
    picture[rows - top, cols - left] = 1
    reach = 2 * round(_REACH_M / 2 / cell_size_m) + 1
    n, run = cv2.connectedComponents(cv2.dilate(picture, np.ones((reach, reach), np.uint8)))
    number = run[rows - top, cols - left]
    openings = []
    for i in range(1, n):
        mine = np.flatnonzero(number == i)
        clearance = segmentation.floor.clearance_m[rows[mine], cols[mine]]
        best = mine[int(np.argmax(clearance))]
        openings.append(
            Opening(
                first=pair[0],
                second=pair[1],
                place=segmentation.raster.point_at(rows[best] + 0.5, cols[best] + 0.5),
                width_m=2 * float(clearance.max()),
            )
        )
    return sorted(openings, key=lambda opening: -opening.width_m)
