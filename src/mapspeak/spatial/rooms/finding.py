"""Rooms, corridors and doors found on an occupancy grid."""

from collections import defaultdict

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.rooms.description import Shape, classify, measure_regions, walked_size
from mapspeak.spatial.rooms.doors import Opening, find_openings
from mapspeak.spatial.rooms.identity import match_rooms
from mapspeak.spatial.rooms.raster import Raster, build_raster
from mapspeak.spatial.rooms.room_map import LETTER, Door, Labels, Region, RoomClass, RoomMap
from mapspeak.spatial.rooms.segmentation import segment
from mapspeak.spatial.rooms.settings import RoomSettings


def find_rooms(
    grid: OccupancyGrid,
    *,
    previous: RoomMap | None = None,
    settings: RoomSettings | None = None,
) -> RoomMap:
    """Divides a map into rooms, corridors and open spaces, joined by doors.

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
    shapes: list[Shape], openings: list[Opening]
) -> tuple[tuple[Region, ...], tuple[Door, ...]]:
    """Gives regions and doors with ids that count from 1, per class in order of area."""
    classes = [
        classify(shape, n_doors=len(own), n_neighbours=len(set(own)))
        for shape, own in zip(shapes, _others(len(shapes), openings), strict=True)
    ]
    ids = _ids([room_class for room_class, _ in classes])
    doors = tuple(
        Door(
            id=f"D{number}",
            place=opening.place,
            width_m=opening.width_m,
            region_ids=(ids[opening.first - 1], ids[opening.second - 1]),
        )
        for number, opening in enumerate(openings, start=1)
    )
    own_doors = _doors_by_region(doors)
    regions = tuple(
        _region(index, ids[index - 1], shape, classes[index - 1], own_doors[ids[index - 1]])
        for index, shape in enumerate(shapes, start=1)
    )
    return regions, doors


def _doors_by_region(doors: tuple[Door, ...]) -> defaultdict[str, list[Door]]:
    by_region: defaultdict[str, list[Door]] = defaultdict(list)
    for door in doors:
        for region_id in door.region_ids:
            by_region[region_id].append(door)
    return by_region


def _others(n_regions: int, openings: list[Opening]) -> list[list[int]]:
    """Gives for each region the region behind each of its doors."""
    others: list[list[int]] = [[] for _ in range(n_regions)]
    for opening in openings:
        others[opening.first - 1].append(opening.second)
        others[opening.second - 1].append(opening.first)
    return others


def _ids(classes: list[RoomClass]) -> list[str]:
    return [f"{LETTER[room_class]}{number}" for number, room_class in enumerate(classes, start=1)]


def _region(
    index: int,
    region_id: str,
    shape: Shape,
    room_class: tuple[RoomClass, str],
    doors: list[Door],
) -> Region:
    behind = {other for door in doors for other in door.region_ids if other != region_id}
    is_corridor = room_class[0] is RoomClass.CORRIDOR
    length_m, width_m = walked_size(shape) if is_corridor else (shape.length_m, shape.width_m)
    return Region(
        id=region_id,
        index=index,
        room_class=room_class[0],
        reason=room_class[1],
        free_area_m2=shape.free_area_m2,
        floor_area_m2=shape.floor_area_m2,
        length_m=length_m,
        width_m=width_m,
        heading_rad=shape.heading_rad,
        widest=shape.widest,
        clearance_m=shape.clearance_m,
        door_ids=tuple(door.id for door in doors),
        neighbour_ids=tuple(sorted(behind, key=lambda other: (other[0], int(other[1:])))),
    )


def _labels_on_grid(raster: Raster, labels: NDArray[np.int32]) -> Labels:
    """Takes raster labels to the cells of the grid."""
    grid = raster.grid
    full = np.zeros(grid.cells.shape, np.int16)
    if labels.size == 0:
        return full
    high, wide = (round(side / raster.scale) for side in labels.shape)
    window = cv2.resize(labels.astype(np.int16), (wide, high), interpolation=cv2.INTER_NEAREST)
    part = full[raster.first_row :, raster.first_col :][:high, :wide]
    part[:] = window[: part.shape[0], : part.shape[1]]
    return full
