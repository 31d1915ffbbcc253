"""Rooms, corridors and doors found on an occupancy grid."""

from itertools import permutations

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.rooms.description import (
    Opening,
    RegionShape,
    classify,
    find_openings,
    measure_regions,
    walked_size,
)
from mapspeak.spatial.rooms.identity import match_rooms, sort_key
from mapspeak.spatial.rooms.raster import Raster, RoomSettings, build_raster
from mapspeak.spatial.rooms.room_map import LETTER, Door, Labels, Region, RoomClass, RoomMap
from mapspeak.spatial.rooms.segmentation import segment


def find_rooms(
    grid: OccupancyGrid,
    *,
    previous: RoomMap | None = None,
    settings: RoomSettings | None = None,
) -> RoomMap:
    """Divide a map into rooms, corridors and open spaces, joined by doors.

    Args:
        grid: The map; may be empty, unexplored, furnished, noisy or turned.
        previous: What was found on an earlier state of this map; its ids are kept.
        settings: Only for experiments; the default fits every building.

    Raises:
        MapError: The map has more cells than can be handled.
    """
    settings = settings or RoomSettings()
    raster = build_raster(grid, cell_size_m=settings.cell_size_m)
    segmentation = segment(raster, settings)
    openings = find_openings(segmentation)
    shapes = measure_regions(segmentation)
    labels = _labels_on_grid(raster, segmentation.labels)
    regions, doors = _name(shapes, openings)
    current = RoomMap(grid=grid, labels=labels, regions=regions, doors=doors)
    return current if previous is None else match_rooms(previous, current)


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
    classes = [
        classify(shape, n_neighbours=len(others))
        for shape, others in zip(shapes, behind, strict=True)
    ]
    ids = [f"{LETTER[room_class]}{number}" for number, room_class in enumerate(classes, start=1)]
    regions = []
    for index, (shape, room_class) in enumerate(zip(shapes, classes, strict=True)):
        is_corridor = room_class is RoomClass.CORRIDOR
        length_m, width_m = walked_size(shape) if is_corridor else (shape.length_m, shape.width_m)
        region = Region(
            id=ids[index],
            index=index + 1,
            room_class=room_class,
            free_area_m2=shape.free_area_m2,
            floor_area_m2=shape.floor_area_m2,
            length_m=length_m,
            width_m=width_m,
            heading_rad=shape.heading_rad,
            widest=shape.widest,
            clearance_m=shape.clearance_m,
            door_ids=tuple(door_ids[index]),
            neighbour_ids=tuple(sorted((ids[other] for other in behind[index]), key=sort_key)),
        )
        regions.append(region)
    doors = tuple(
        Door(
            id=f"D{number}",
            place=opening.place,
            width_m=opening.width_m,
            region_ids=(ids[opening.first - 1], ids[opening.second - 1]),
        )
        for number, opening in enumerate(openings, start=1)
    )
    return tuple(regions), doors


def _labels_on_grid(raster: Raster, labels: NDArray[np.int32]) -> Labels:
    """Take raster labels to the cells of the grid."""
    grid = raster.grid
    full = np.zeros(grid.cells.shape, np.int16)
    if labels.size == 0:
        return full
    high, wide = (round(side / raster.scale) for side in labels.shape)
    window = cv2.resize(labels.astype(np.int16), (wide, high), interpolation=cv2.INTER_NEAREST)
    part = full[raster.first_row :, raster.first_col :][:high, :wide]
    part[:] = window[: part.shape[0], : part.shape[1]]
    return full
