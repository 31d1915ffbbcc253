"""A raster cut into rooms."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.doorways import Doorway, find_doorways
from mapspeak.spatial.rooms.floor import Floor, build_floor, cut_away
from mapspeak.spatial.rooms.merging import (
    BasinLabels,
    Frames,
    Saddle,
    build_basins,
    find_saddles,
    merge_basins,
)
from mapspeak.spatial.rooms.raster import Picture, Raster, RoomSettings, find_cells

Labels = NDArray[np.int32]

_CUT_CELLS = 2
"""Basins would leak through a thinner line that runs askew."""
_BESIDE_M = 0.3
"""How far off the middle of a doorway a place is on one side of it."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Segmentation:
    """Room numbers on a raster.

    Attributes:
        floor: The floor of it, without furniture.
        labels: 0 for no room, else from 1, the largest room first.
    """

    raster: Raster
    floor: Floor
    labels: Labels


def segment(raster: Raster, settings: RoomSettings) -> Segmentation:
    """Cut the floor at its narrow places, and at the doorways that these do not show."""
    floor = build_floor(raster, settings)
    labels = _divide(floor, floor, [], raster, settings)
    unseen = find_doorways(raster, floor, settings)
    beside = round(_BESIDE_M / raster.cell_size_m)
    doorways: list[Doorway] = []
    # A cut changes the clearances, by which other doorways were seen: so look again.
    while missed := [doorway for doorway in unseen if _is_inside(doorway, labels, beside)]:
        doorways += missed
        unseen = [doorway for doorway in unseen if doorway not in missed]
        cut = _draw(doorways, floor.floor)
        cut_floor = cut_away(floor, cut, raster.cell_size_m)
        labels = _divide(floor, cut_floor, doorways, raster, settings)
        labels = _fill(labels, cut)
    return Segmentation(raster=raster, floor=floor, labels=labels)


def _divide(
    floor: Floor,
    cut_floor: Floor,
    doorways: list[Doorway],
    raster: Raster,
    settings: RoomSettings,
) -> Labels:
    """Return room numbers; basins end where the floor has been cut at the doorways."""
    sigma = settings.smoothing_m / raster.cell_size_m
    height = _smooth(cut_floor.clearance_m, cut_floor.floor, sigma)
    standing = floor.standing_m
    basins = build_basins(height, cut_floor.floor)
    saddles = find_saddles(basins, height) + _find_saddles_at(doorways, basins)
    return merge_basins(
        basins,
        height,
        height if standing is None else _smooth(standing, floor.floor, sigma),
        sorted(saddles, key=lambda saddle: -saddle.height),
        frames=Frames(floor, raster.cell_size_m),
        cell_area_m2=raster.cell_area_m2,
        settings=settings,
    )


def _smooth(clearance_m: NDArray[np.float32], floor: Picture, sigma: float) -> NDArray[np.float32]:
    smooth = cv2.GaussianBlur(clearance_m, (0, 0), sigma)
    return np.where(floor > 0, smooth, np.float32(0))


def _draw(doorways: list[Doorway], floor: Picture) -> Picture:
    """Return 1 on the floor between the jambs, and on jambs that were taken for furniture."""
    cut = np.zeros_like(floor)
    for doorway in doorways:
        start, end = ([round(at) for at in root] for root in doorway.roots)
        cv2.line(cut, start, end, 1, thickness=_CUT_CELLS)
    return cut & floor


def _find_saddles_at(doorways: list[Doorway], basins: BasinLabels) -> list[Saddle]:
    saddles = []
    for doorway in doorways:
        one, other = (_first_number(doorway, basins, side) for side in (-1, 1))
        if 0 != one != other != 0:
            row, col = doorway.beside(0)
            saddles.append(
                Saddle(
                    height=doorway.width_m / 2,
                    first=min(one, other),
                    second=max(one, other),
                    row=row,
                    col=col,
                    is_doorway=True,
                )
            )
    return saddles


def _first_number(doorway: Doorway, numbers: Labels, side: int) -> int:
    """Return the first number that is not 0 on one side of a doorway that has been cut."""
    found = (_number_at(numbers, doorway.beside(side * off)) for off in range(1, 3 * _CUT_CELLS))
    return next(filter(None, found), 0)


def _is_inside(doorway: Doorway, labels: Labels, cells: int) -> bool:
    """Return True if both sides of a doorway belong to one region."""
    one, other = (_number_at(labels, doorway.beside(off)) for off in (-cells, cells))
    return one == other > 0


def _number_at(numbers: Labels, place: tuple[int, int]) -> int:
    row, col = place
    is_inside = 0 <= row < numbers.shape[0] and 0 <= col < numbers.shape[1]
    return int(numbers[row, col]) if is_inside else 0


def _fill(labels: Labels, cut: Picture) -> Labels:
    """Return the cells of a cut to the regions beside it."""
    rows, cols = (places + 1 for places in find_cells(cut > 0))
    framed = cv2.copyMakeBorder(labels, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    for _ in range(_CUT_CELLS + 1):
        own = framed[rows, cols]
        beside = [framed[rows + down, cols + right] for down, right in _STEPS]
        framed[rows, cols] = np.where(own > 0, own, np.max(beside, axis=0))
    return np.ascontiguousarray(framed[1:-1, 1:-1])


_STEPS = ((-1, 0), (1, 0), (0, -1), (0, 1))
