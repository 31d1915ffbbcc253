"""What share of the regions stays when the same map is turned, mirrored, padded or resampled.

A region stays when the division of the changed map has one that covers the same free cells with
an intersection over union of at least 0.9. The map itself must not suffer from the change, so a
map is turned at twice its resolution, by nearest neighbour, and compared with itself upright at
that resolution. A map of half the resolution has lost something: a cell is occupied when any of
its four was, else free when any was; the compared cells are those of the coarse map.

The families are a drawn furnished building and, where `benchmarks.rooms` finds labelled maps, the
folders of those. Large regions count as much as small ones, and, as "floor", by their area.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.figure import Figure
from benchmarks.rooms import find_labelled_maps, list_labelled_maps
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_picture
from mapspeak.spatial.rooms import find_rooms

__all__ = ["measure"]

Cells = NDArray[np.int8]
Labels = NDArray[np.int16]
Change = Callable[[Cells, float], tuple[Labels, Labels, Cells]]
"""Gives the labels before and after on the same cells, and those cells."""

LEAST_IOU = 0.9
ANGLES_DEG = (7.0, 30.0, 45.0, 100.0)
PAD = 37


def measure() -> Iterator[Figure]:
    """Return the shares of regions and of floor that stay, by family and change."""
    cv2.setNumThreads(1)
    for family, grids in _families().items():
        for name, changes in CHANGES.items():
            kept = [_compare(*change(*grid)) for grid in grids for change in changes]
            ratios, areas = (np.concatenate(part) for part in zip(*kept, strict=True))
            stays = ratios >= LEAST_IOU
            title = f"{family}, {len(grids)} maps, {name}"
            yield Figure(name=f"{title}: regions", value=100 * float(stays.mean()), unit="%")
            floor = 100 * float(areas[stays].sum() / areas.sum())
            yield Figure(name=f"{title}: floor", value=floor, unit="%")


def _families() -> dict[str, list[tuple[Cells, float]]]:
    families: dict[str, list[tuple[Cells, float]]] = {"drawn": [(draw_building(), 0.05)]}
    maps = find_labelled_maps()
    for folder in list_labelled_maps(maps) if maps else []:
        families.setdefault(folder.parent.name, []).append(_load(folder))
    return families


def _load(folder: Path) -> tuple[Cells, float]:
    resolution_m = json.loads((folder / "meta.json").read_text())["resolution"]
    return load_picture(folder / "map.png", resolution_m=resolution_m).grid.cells, resolution_m


def draw_building() -> Cells:
    """Draw 24 x 16 m: offices on both sides of a corridor, with tables, chairs and cupboards."""
    generator = np.random.default_rng(11)
    cells = np.zeros((320, 480), np.int8)
    for row in (0, 136, 180, 316):
        cells[row : row + 4] = 100
    for col in (0, 96, 210, 330, 476):
        cells[:136, col : col + 4] = 100
    for col in (0, 150, 260, 390, 476):
        cells[180:, col : col + 4] = 100
    cells[:, :4] = cells[:, -4:] = 100
    for row, col in ((136, 40), (136, 150), (136, 270), (136, 400)):
        cells[row : row + 4, col : col + 18] = 0
    for row, col in ((180, 60), (180, 200), (180, 310), (180, 420)):
        cells[row : row + 4, col : col + 18] = 0
    for row, col in generator.integers((8, 8), (300, 460), (60, 2)).tolist():
        if not (cells[row - 3 : row + 7, col - 3 : col + 11] > 0).any() and not 118 < row < 200:
            cells[row : row + 2, col : col + 8] = 100
    cells[4:12, 60:90] = cells[300:316, 300:312] = cells[210:240, 4:10] = 100
    return cells


def _divide(cells: Cells, resolution_m: float, origin: Pose | None = None) -> Labels:
    origin = origin or Pose(0.0, 0.0, 0.0)
    grid = OccupancyGrid(cells=cells, resolution_m=resolution_m, origin=origin)
    return find_rooms(grid).labels


def _compare(before: Labels, after: Labels, cells: Cells) -> tuple[NDArray[np.float64], ...]:
    """Return for each region of before its best intersection over union, and its area in cells."""
    is_free = (cells >= 0) & (cells < 50)
    here, there = before[is_free].astype(np.intp), after[is_free].astype(np.intp)
    shape = (int(here.max(initial=0)) + 1, int(there.max(initial=0)) + 1)
    shared = np.bincount(here * shape[1] + there, minlength=shape[0] * shape[1]).reshape(shape)
    union = shared.sum(1, keepdims=True) + shared.sum(0, keepdims=True) - shared
    ratios = shared / np.maximum(union, 1)
    ratios[:, 0] = 0.0
    areas = shared.sum(axis=1)
    present = np.flatnonzero(areas[1:]) + 1
    return ratios[present].max(axis=1), areas[present].astype(np.float64)


def _doubled(cells: Cells) -> Cells:
    return np.repeat(np.repeat(cells, 2, axis=0), 2, axis=1)


def _turn(angle_deg: float) -> Change:
    def change(cells: Cells, resolution_m: float) -> tuple[Labels, Labels, Cells]:
        fine = _doubled(cells)
        n_rows, n_cols = fine.shape
        side = int(np.hypot(n_rows, n_cols)) + 4
        there = cv2.getRotationMatrix2D((n_cols / 2, n_rows / 2), angle_deg, 1.0)
        there[:, 2] += ((side - n_cols) / 2, (side - n_rows) / 2)
        shifted = (fine.astype(np.int16) + 1).astype(np.uint8)
        turned = cv2.warpAffine(shifted, there, (side, side), flags=cv2.INTER_NEAREST)
        found = _divide((turned.astype(np.int16) - 1).astype(np.int8), resolution_m / 2)
        back = cv2.invertAffineTransform(there)
        upright = cv2.warpAffine(found, back, (n_cols, n_rows), flags=cv2.INTER_NEAREST)
        return _divide(fine, resolution_m / 2), np.asarray(upright, np.int16), fine

    return change


def _mirror(axis: int) -> Change:
    def change(cells: Cells, resolution_m: float) -> tuple[Labels, Labels, Cells]:
        found = _divide(np.flip(cells, axis), resolution_m)
        return _divide(cells, resolution_m), np.flip(found, axis), cells

    return change


def _double(cells: Cells, resolution_m: float) -> tuple[Labels, Labels, Cells]:
    found = _divide(_doubled(cells), resolution_m / 2)
    return _divide(cells, resolution_m), found[::2, ::2], cells


def _halve(cells: Cells, resolution_m: float) -> tuple[Labels, Labels, Cells]:
    n_rows, n_cols = (side // 2 for side in cells.shape)
    coarse = cells[: 2 * n_rows, : 2 * n_cols].reshape(n_rows, 2, n_cols, 2).max(axis=(1, 3))
    before = _divide(cells, resolution_m)[: 2 * n_rows : 2, : 2 * n_cols : 2]
    return before, _divide(coarse, 2 * resolution_m), coarse


def _pad(cells: Cells, resolution_m: float) -> tuple[Labels, Labels, Cells]:
    padded = np.pad(cells, ((PAD, 2 * PAD), (2 * PAD + 1, PAD)), constant_values=-1)
    found = _divide(padded, resolution_m)
    inside = found[PAD : PAD + cells.shape[0], 2 * PAD + 1 : 2 * PAD + 1 + cells.shape[1]]
    return _divide(cells, resolution_m), inside, cells


def _move(cells: Cells, resolution_m: float) -> tuple[Labels, Labels, Cells]:
    found = _divide(cells, resolution_m, Pose(-31.7, 12.9, 2.1))
    return _divide(cells, resolution_m), found, cells


def _blur(cells: Cells, resolution_m: float) -> tuple[Labels, Labels, Cells]:
    doubt = np.random.default_rng(3).integers(0, 50, cells.shape).astype(np.int8)
    found = _divide(np.where(cells == 0, doubt, cells), resolution_m)
    return _divide(cells, resolution_m), found, cells


CHANGES: dict[str, tuple[Change, ...]] = {
    "turned": tuple(_turn(angle_deg) for angle_deg in ANGLES_DEG),
    "mirrored": (_mirror(0), _mirror(1)),
    "twice the resolution": (_double,),
    "half the resolution": (_halve,),
    "padded": (_pad,),
    "other origin and yaw": (_move,),
    "free values 0 to 49": (_blur,),
}
