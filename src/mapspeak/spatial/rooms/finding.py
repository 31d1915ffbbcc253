"""Rooms, corridors and doors found on an occupancy grid."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point
from mapspeak.spatial.grid import Mask, OccupancyGrid, Window
from mapspeak.spatial.paths.lattice import measure_away
from mapspeak.spatial.rooms.identity import match_rooms, sort_key
from mapspeak.spatial.rooms.joining import STRIP
from mapspeak.spatial.rooms.raster import build_raster, find_boxes, find_cells
from mapspeak.spatial.rooms.room_map import LETTER, Door, Region, RoomClass, RoomMap
from mapspeak.spatial.rooms.segmentation import Segmentation, segment

BEND = 2 * STRIP
"""Elongation from which a region is a strip on both sides of a bend.

What parts several regions from each other is a corridor with as much for all of them together.
"""
MANY_NEIGHBOURS = 3
"""An L-shaped room is as elongated as a strip, and leads to one or two others."""
ISLAND_RATIO = 0.1
"""Something that stands free in a region is ignored up to this share of its floor."""
HALL_WIDTH_M = 10.0
"""A region at least this wide all along is a hall, wherever it leads."""
RUN_ON_RATIO = 0.75
"""A way between two corridors that is as wide as this, beside the wider one, is a bend.

Between other strips it is as wide beside both at their widest.
"""
OPEN_SPACE_WIDTH_M = 8.0
OPEN_SPACE_AREA_M2 = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionShape:
    """A region before it has an id, with two more measures.

    Attributes:
        open_clearance_m: The largest clearance if what stands free in the region were gone.
        mean_clearance_m: The mean distance of its floor from the nearest wall.
    """

    region: Region
    open_clearance_m: float
    mean_clearance_m: float

    @property
    def elongation(self) -> float:
        """Area over the square of the widest clearance diameter: 1 for a square, more if long."""
        return self.region.floor_area_m2 / max(2 * self.open_clearance_m, 1e-6) ** 2

    @property
    def is_strip(self) -> bool:
        """True where it is much longer than wide, and hardly bends."""
        return self.elongation > STRIP and self.region.length_m > STRIP * self.region.width_m


def measure_regions(segmentation: Segmentation) -> list[RegionShape]:
    """Return the measures of every region, in the order of their numbers."""
    windows = _find_windows(segmentation.labels)
    return [_measure(segmentation, index, window) for index, window in enumerate(windows, start=1)]


def _find_windows(labels: NDArray[np.int32]) -> list[Window]:
    low, high = find_boxes(labels, int(labels.max(initial=0)) + 1)
    boxes = zip(low.T[1:].tolist(), high.T[1:].tolist(), strict=True)
    return [(slice(top, bottom), slice(left, right)) for (top, left), (bottom, right) in boxes]


def _measure(segmentation: Segmentation, index: int, window: Window) -> RegionShape:
    raster = segmentation.raster
    inside = segmentation.labels[window] == index
    clearance = np.where(inside, segmentation.floor.clearance_m[window], 0)
    row, col = np.unravel_index(int(np.argmax(clearance)), clearance.shape)
    length, width, heading = _bounding_rectangle(inside)
    region = Region(
        id="",
        index=index,
        room_class=RoomClass.ROOM,
        free_area_m2=int(np.count_nonzero(inside & (raster.free[window] > 0)))
        * raster.cell_area_m2,
        floor_area_m2=int(np.count_nonzero(inside)) * raster.cell_area_m2,
        length_m=length * raster.cell_size_m,
        width_m=width * raster.cell_size_m,
        heading_rad=(heading - raster.turn_rad + raster.grid.origin.yaw_rad) % math.pi,
        widest=raster.point_at(window[0].start + row + 0.5, window[1].start + col + 0.5),
        clearance_m=float(clearance[row, col]),
    )
    return RegionShape(
        region=region,
        open_clearance_m=max(clearance[row, col], _open_clearance(inside) * raster.cell_size_m),
        mean_clearance_m=float(clearance[inside].mean()),
    )


def _open_clearance(inside: Mask) -> float:
    """Return the clearance in cells once small holes are filled, such as a partition's; or 0."""
    outside = cv2.copyMakeBorder(
        (~inside).astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=1
    )
    n, label = cv2.connectedComponents(outside, connectivity=4)
    if n <= 2:
        return 0.0
    is_island = np.bincount(label.ravel(), minlength=n) <= ISLAND_RATIO * int(inside.sum())
    is_island[0] = is_island[label[0, 0]] = False
    if not is_island.any():
        return 0.0
    return float(measure_away((outside > 0) & ~is_island[label]).max()) - 0.5


def _bounding_rectangle(inside: Mask) -> tuple[float, float, float]:
    """Return length, width and direction of the smallest turned rectangle, in cells and radians."""
    outline, _ = cv2.findContours(
        inside.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
    )
    corners = cv2.convexHull(np.concatenate(outline))
    (_, (one, other), angle_deg) = cv2.minAreaRect(corners)
    if one < other:
        one, other, angle_deg = other, one, angle_deg + 90
    return one + 1, other + 1, math.radians(angle_deg)


def classify(shape: RegionShape, *, n_parted: int, exits_m: Sequence[float]) -> RoomClass:
    """Return the class of a region.

    Args:
        n_parted: How many neighbours it has, if it parts them; else 0.
        exits_m: The widths of the ways out of it.
    """
    _, width_m = walked_size(shape)
    # Closets and stairs are strips behind one door that is narrower than they are.
    is_closet = len(exits_m) == 1 and exits_m[0] < RUN_ON_RATIO * width_m
    leads_on = (shape.is_strip and not is_closet) or max(n_parted, 1) * shape.elongation > BEND
    if leads_on and width_m < HALL_WIDTH_M:
        return RoomClass.CORRIDOR
    is_wide = leads_on or 2 * shape.region.clearance_m >= OPEN_SPACE_WIDTH_M
    is_open = is_wide and shape.region.floor_area_m2 >= OPEN_SPACE_AREA_M2
    return RoomClass.OPEN_SPACE if is_open else RoomClass.ROOM


def walked_size(shape: RegionShape) -> tuple[float, float]:
    """Return length along and width across a corridor, however often it bends.

    In a long strip the mean distance from the nearer side is a quarter of the width.
    """
    width_m = 4 * shape.mean_clearance_m
    return shape.region.floor_area_m2 / width_m, width_m


_REACH_M = 0.3
"""Border cells nearer than this to each other are one opening."""
_LEAST_M = 0.4
"""Narrower gaps are cracks in the map of a wall: too narrow for people and most robots."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """A door before it has an id; `first` and `second` are region numbers, first the smaller."""

    first: int
    second: int
    place: Point
    width_m: float
    certainty: float


def find_openings(segmentation: Segmentation) -> list[Opening]:
    """Return every way between two regions, ordered by regions, widest first."""
    row, col, first, second = _border_cells(segmentation.labels)
    openings = []
    order = np.lexsort((col, row, second, first))
    starts = np.flatnonzero(np.diff(first[order]) | np.diff(second[order])) + 1
    for here in np.split(order, starts) if order.size else ():
        pair = int(first[here[0]]), int(second[here[0]])
        openings += _split(segmentation, pair, row[here], col[here])
    # Between the middles of cells and walls an opening is up to a cell too narrow.
    least_m = _LEAST_M - segmentation.raster.cell_size_m
    return [opening for opening in openings if opening.width_m >= least_m]


def _border_cells(labels: NDArray[np.int32]) -> tuple[NDArray[np.intp], ...]:
    """Return rows, columns and both regions of cells that touch a region with a higher number."""
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
    return tuple(np.concatenate(found, axis=1).astype(np.intp))


def _split(
    segmentation: Segmentation,
    pair: tuple[int, int],
    rows: NDArray[np.intp],
    cols: NDArray[np.intp],
) -> list[Opening]:
    """Return the separate openings of a pair of regions: connected border cells."""
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
                certainty=round(1 - segmentation.doubts.get(pair, 0.0), 3),
            )
        )
    return sorted(openings, key=lambda opening: -opening.width_m)


def find_rooms(
    grid: OccupancyGrid,
    *,
    previous: RoomMap | None = None,
) -> RoomMap:
    """Divide a map into rooms, corridors and open spaces, joined by doors.

    Args:
        grid: The map; may be empty, unexplored, furnished, noisy or turned.
        previous: The result for an earlier state of this map; its ids are kept.

    Raises:
        MapError: The map has more cells than can be handled.
    """
    raster = build_raster(grid)
    segmentation = segment(raster, previous)
    shapes, openings = measure_regions(segmentation), find_openings(segmentation)
    joined = join_corridors(segmentation, shapes, openings)
    if joined is not segmentation:
        segmentation = joined
        shapes, openings = measure_regions(segmentation), find_openings(segmentation)
    labels = raster.on_grid(segmentation.labels)
    regions, doors = _name(shapes, openings)
    current = RoomMap(grid=grid, labels=labels, regions=regions, doors=doors)
    return current if previous is None else match_rooms(previous, current)


def join_corridors(
    segmentation: Segmentation, shapes: list[RegionShape], openings: list[Opening]
) -> Segmentation:
    """Merge corridors that continue into one another, round a bend or past pillars."""
    classes = classify_all(shapes, openings)
    number = np.arange(len(shapes) + 1)
    for opening in openings:
        one, other = opening.first - 1, opening.second - 1
        sides = shapes[one], shapes[other]
        if classes[one] is classes[other] is RoomClass.CORRIDOR:
            across_m = max(walked_size(side)[1] for side in sides)
        else:
            across_m = max(map(_widest_across, sides))
        if opening.width_m >= RUN_ON_RATIO * across_m:
            joined = number[[opening.first, opening.second]]
            number[number == joined.max()] = joined.min()
    if np.array_equal(number, np.arange(len(number))):
        return segmentation
    labels = number[segmentation.labels]
    n_cells = np.bincount(labels.ravel(), minlength=len(number))
    n_cells[0] = labels.size + 1
    by_size = np.argsort(-n_cells, kind="stable")
    rank = np.argsort(by_size, kind="stable").astype(np.int32)
    doubts: dict[tuple[int, int], float] = {}
    for pair, share in segmentation.doubts.items():
        one, other = sorted(rank[number[list(pair)]].tolist())
        if one != other:
            doubts[one, other] = max(share, doubts.get((one, other), 0.0))
    return replace(segmentation, labels=rank[labels], doubts=doubts)


def _widest_across(shape: RegionShape) -> float:
    """Return the largest width of a strip, which may be no corridor by itself, else infinity."""
    length_m, width_m = walked_size(shape)
    return 2 * shape.region.clearance_m if length_m > STRIP * width_m else math.inf


def classify_all(shapes: list[RegionShape], openings: list[Opening]) -> list[RoomClass]:
    """Return the class of each region."""
    behind: list[set[int]] = [set() for _ in shapes]
    exits_m: list[list[float]] = [[] for _ in shapes]
    for opening in openings:
        for one, other in permutations((opening.first - 1, opening.second - 1)):
            behind[one].add(other)
            exits_m[one].append(opening.width_m)
    return [
        classify(
            shape,
            n_parted=len(behind[number]) if _is_only_way(behind, number) else 0,
            exits_m=exits_m[number],
        )
        for number, shape in enumerate(shapes)
    ]


def _is_only_way(behind: Sequence[set[int]], number: int) -> bool:
    """Return True if some neighbours of a region are reached from others only through it."""
    if len(behind[number]) < MANY_NEIGHBOURS:
        return False
    reached, waiting = {number}, [min(behind[number])]
    while waiting and not behind[number] <= reached:
        here = waiting.pop()
        reached.add(here)
        waiting += behind[here] - reached
    return not behind[number] <= reached


def _name(
    shapes: list[RegionShape], openings: list[Opening]
) -> tuple[tuple[Region, ...], tuple[Door, ...]]:
    """Return regions and doors with ids that count from 1, per class in order of area."""
    behind: list[set[int]] = [set() for _ in shapes]
    door_ids: list[list[str]] = [[] for _ in shapes]
    for number, opening in enumerate(openings, start=1):
        for one, other in permutations((opening.first - 1, opening.second - 1)):
            behind[one].add(other)
            door_ids[one].append(f"D{number}")
    classes = classify_all(shapes, openings)
    ids = [f"{LETTER[room_class]}{number}" for number, room_class in enumerate(classes, start=1)]
    regions = []
    for index, (shape, room_class) in enumerate(zip(shapes, classes, strict=True)):
        region = replace(
            shape.region,
            id=ids[index],
            room_class=room_class,
            door_ids=tuple(door_ids[index]),
            neighbour_ids=tuple(sorted((ids[other] for other in behind[index]), key=sort_key)),
        )
        if room_class is RoomClass.CORRIDOR:
            length_m, width_m = walked_size(shape)
            region = replace(region, length_m=length_m, width_m=width_m)
        regions.append(region)
    doors = tuple(
        Door(
            id=f"D{number}",
            place=opening.place,
            width_m=opening.width_m,
            certainty=opening.certainty,
            region_ids=(ids[opening.first - 1], ids[opening.second - 1]),
        )
        for number, opening in enumerate(openings, start=1)
    )
    return tuple(regions), doors
