"""The same rooms on worse maps: turned, coarse, cluttered, with dashed walls, seen in part.

What is learned from a clean plan alone does not hold on a robot's map.
"""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import UNKNOWN
from tools.roomfit.labelled import LabelledMap, Truth

Cells = NDArray[np.int8]
Rng = np.random.Generator
OCCUPIED = 100
_SCALES = (0.8, 1.25)
_SQUARE = np.ones((3, 3), np.uint8)
_PLANS = frozenset({"bormann_plain", "cml_school", "cml_office", "drawn"})
_FLUSH_M = 1.0


def turn(labelled: LabelledMap, rng: Rng) -> LabelledMap:
    """Turn a map by any angle, and tell another size of its cells."""
    cells = labelled.grid.cells
    high, wide = cells.shape
    there = cv2.getRotationMatrix2D((wide / 2, high / 2), rng.uniform(3, 87), 1.0)
    corners = np.array([[0, 0, 1], [wide, 0, 1], [0, high, 1], [wide, high, 1]]) @ there.T
    there[:, 2] -= corners.min(axis=0)
    size = (np.ptp(corners, axis=0) + 1).astype(int).tolist()
    solid = np.asarray(cells > OCCUPIED // 2, np.uint8) * np.uint8(255)
    is_solid = np.asarray(cv2.warpAffine(solid, there, size)) > 100
    turned = cv2.warpAffine(
        cells.astype(np.int16), there, size, flags=cv2.INTER_NEAREST, borderValue=(UNKNOWN,)
    )
    rooms = cv2.warpAffine(labelled.truth.astype(np.float32), there, size, flags=cv2.INTER_NEAREST)
    resolution_m = labelled.grid.resolution_m * rng.uniform(*_SCALES)
    merged = np.where(is_solid, OCCUPIED, turned).astype(np.int8)
    return _remake(labelled, merged, np.asarray(rooms).astype(np.uint16), resolution_m)


def halve(labelled: LabelledMap, rng: Rng) -> LabelledMap:
    """Make cells of twice the size, where they are small, and tell another size of them."""
    grid, truth = labelled.grid, labelled.truth
    resolution_m = grid.resolution_m * rng.uniform(*_SCALES)
    if grid.resolution_m > 0.09:
        return _remake(labelled, grid.cells, truth, resolution_m)
    high, wide = (side // 2 for side in grid.cells.shape)
    blocks = grid.cells[: 2 * high, : 2 * wide].reshape(high, 2, wide, 2)
    is_solid = (blocks > OCCUPIED // 2).any(axis=(1, 3))
    is_free = ((blocks >= 0) & (blocks <= OCCUPIED // 2)).sum(axis=(1, 3)) >= 2
    cells = np.where(is_solid, OCCUPIED, np.where(is_free, 0, UNKNOWN)).astype(np.int8)
    return _remake(labelled, cells, truth[: 2 * high : 2, : 2 * wide : 2], 2 * resolution_m)


def clutter(labelled: LabelledMap, rng: Rng) -> LabelledMap:
    """Put furniture into plans, and noise over all."""
    cells = labelled.grid.cells.copy()
    if labelled.group in _PLANS or rng.random() < 0.5:
        _furnish(cells, labelled, rng)
    _add_noise(cells, labelled.grid.resolution_m, rng)
    return _remake(labelled, cells, labelled.truth, labelled.grid.resolution_m)


def see_in_part(labelled: LabelledMap, rng: Rng) -> LabelledMap:
    """Keep what a laser sees from some places in one part of the map, mostly cluttered."""
    cluttered = clutter(labelled, rng) if rng.random() < 0.7 else labelled
    cells = cluttered.grid.cells
    places = _choose_places(cells, cluttered.grid.resolution_m, rng)
    reach = rng.uniform(5, 12) / cluttered.grid.resolution_m
    is_seen = _look_around(cells, places, reach)
    is_seen |= (cv2.dilate(is_seen.astype(np.uint8), _SQUARE) > 0) & (cells > OCCUPIED // 2)
    part = np.where(is_seen, cells, UNKNOWN).astype(np.int8)
    return _remake(labelled, part, labelled.truth, labelled.grid.resolution_m)


VARIANTS: tuple[Callable[[LabelledMap, Rng], LabelledMap], ...] = (
    turn,
    halve,
    clutter,
    see_in_part,
)


def _remake(labelled: LabelledMap, cells: Cells, truth: Truth, resolution_m: float) -> LabelledMap:
    grid = OccupancyGrid(cells=np.ascontiguousarray(cells), resolution_m=resolution_m)
    return replace(labelled, grid=grid, truth=truth)


def _furnish(cells: Cells, labelled: LabelledMap, rng: Rng) -> None:
    """Put boxes into every room: some flush with a wall, some free, some only legs or outlines."""
    resolution_m = labelled.grid.resolution_m
    clear_m = cv2.distanceTransform((cells == 0).astype(np.uint8), cv2.DIST_L2, 5) * resolution_m
    for number in np.unique(labelled.truth[labelled.truth > 0]).tolist():
        rows, cols = np.nonzero(labelled.truth == number)
        area_m2 = rows.size * resolution_m**2
        for _ in range(rng.poisson(area_m2 / 6 * rng.uniform(0, 0.8))):
            i = int(rng.integers(rows.size))
            place = int(rows[i]), int(cols[i])
            is_free_standing = clear_m[place] > _FLUSH_M
            if is_free_standing and rng.random() < 0.6:
                continue
            depth, length = sorted(rng.uniform(0.3, 2.2, 2) / resolution_m)
            depth = min(depth, 1.0 / resolution_m)
            if is_free_standing or rng.random() < 0.3:
                angle_deg = rng.choice([0.0, 90.0]) if rng.random() < 0.8 else rng.uniform(0, 180)
                corners = cv2.boxPoints(((place[1], place[0]), (length, depth), angle_deg))
                _put_box(cells, corners, rng)
            else:
                _put_at_wall(cells, place, depth, length, _FLUSH_M / resolution_m, rng)


def _put_at_wall(
    cells: Cells, place: tuple[int, int], depth: float, length: float, reach: float, rng: Rng
) -> None:
    """Put a box flush with the nearest wall in a row or a column."""
    for down, right in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        steps = np.arange(round(reach) + 2)
        rows = np.clip(place[0] + down * steps, 0, cells.shape[0] - 1)
        cols = np.clip(place[1] + right * steps, 0, cells.shape[1] - 1)
        is_wall = cells[rows, cols] != 0
        if not is_wall.any():
            continue
        at = int(is_wall.argmax())
        middle = (
            place[1] + right * (at - depth / 2),
            place[0] + down * (at - depth / 2),
        )
        size = (depth, length) if right else (length, depth)
        _put_box(cells, cv2.boxPoints((middle, size, 0.0)), rng)
        return


def _put_box(cells: Cells, corners: cv2.typing.MatLike, rng: Rng) -> None:
    """Put a box where the floor is free: solid, an outline around what is not seen, or legs."""
    whole = np.round(corners).astype(np.int32)
    left, top = np.maximum(whole.min(axis=0) - 1, 0).tolist()
    right, bottom = (whole.max(axis=0) + 2).tolist()
    window = cells[top:bottom, left:right]
    if window.size == 0:
        return
    inside = np.zeros(window.shape, np.uint8)
    cv2.fillPoly(inside, [whole - np.array([left, top], np.int32)], (1,))
    kind = rng.random()
    if kind < 0.7:
        core = cv2.erode(inside, _SQUARE) > 0
        is_free = (inside > 0) & (window == 0)
        window[is_free] = OCCUPIED
        if kind > 0.35:
            window[is_free & core] = UNKNOWN
        return
    for col, row in (whole - np.array([left, top])).tolist():
        leg = window[max(row, 0) : row + 2, max(col, 0) : col + 2]
        leg[leg == 0] = OCCUPIED


def _add_noise(cells: Cells, resolution_m: float, rng: Rng) -> None:
    """Take pieces of walls away, let walls fray, and add specks."""
    is_solid = cells > OCCUPIED // 2
    high, wide = cells.shape
    patch = max(int(0.5 / resolution_m), 2)
    coarse = rng.random((high // patch + 2, wide // patch + 2)).astype(np.float32)
    blotch = np.asarray(cv2.resize(coarse, (wide, high), interpolation=cv2.INTER_LINEAR))
    cells[is_solid & (blotch > rng.uniform(0.85, 0.99))] = rng.choice([0, UNKNOWN])
    is_beside = (cv2.dilate(is_solid.astype(np.uint8), _SQUARE) > 0) & ~is_solid
    cells[is_beside & (rng.random(cells.shape) < rng.uniform(0, 0.15))] = OCCUPIED
    cells[(cells == 0) & (rng.random(cells.shape) < 0.0005)] = OCCUPIED


def _choose_places(cells: Cells, resolution_m: float, rng: Rng) -> NDArray[np.intp]:
    """Return places that a robot reaches from one of them, near to it, shape (n, 2)."""
    clear_m = cv2.distanceTransform((cells == 0).astype(np.uint8), cv2.DIST_L2, 5) * resolution_m
    n, label = cv2.connectedComponents((clear_m > 0.25).astype(np.uint8), connectivity=4)
    if n == 1:
        return np.argwhere(cells == 0)[:1]
    reachable = (label == np.bincount(label.ravel())[1:].argmax() + 1).astype(np.uint8)
    places = np.argwhere(reachable)
    grown = np.zeros_like(reachable)
    grown[tuple(places[rng.integers(len(places))])] = 1
    wanted, before = rng.uniform(0.15, 0.7) * len(places), 0
    while before < (now := int(grown.sum())) < wanted:
        before = now
        for _ in range(8):
            grown = np.asarray(cv2.dilate(grown, _SQUARE), np.uint8) & reachable
    found = np.argwhere(grown)
    n_places = int(np.clip(len(found) * resolution_m**2 / 3, 5, 250))
    return found[rng.choice(len(found), n_places)]


def _look_around(cells: Cells, places: NDArray[np.intp], reach: float) -> NDArray[np.bool_]:
    """Return True on the cells that rays from these places pass before the first that is not free.

    The cell where a ray ends is seen too.
    """
    is_seen = np.zeros(cells.shape, bool)
    angles = np.linspace(0, 2 * np.pi, 900, endpoint=False)
    steps = np.arange(0, reach, 0.7)
    for row, col in places.tolist():
        rows = np.clip(row + 0.5 + np.outer(np.sin(angles), steps), 0, cells.shape[0] - 1)
        cols = np.clip(col + 0.5 + np.outer(np.cos(angles), steps), 0, cells.shape[1] - 1)
        at = rows.astype(np.intp), cols.astype(np.intp)
        blocked = cells[at] != 0
        passed = np.cumsum(blocked, axis=1) - blocked == 0
        is_seen[at[0][passed], at[1][passed]] = True
    return is_seen
