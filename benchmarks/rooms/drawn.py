"""How well the division of a simulated building agrees with its plan.

The map is the one that a perfect robot would make of it. A region belongs to the true space that
most of it covers. Corridors that meet without a wall between them count as one space, and as split
only if more regions than corridors belong to it: where a corridor bends is a matter of taste.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import click
import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.figure import Figure
from benchmarks.rooms.people import Numbers, find_agreement, find_overlap
from mapspeak.simulator import TrueFloor, TrueRoom, World, load_world, world_names
from mapspeak.simulator.worlds.worldfiles import parse_world
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomClass, RoomMap, find_rooms
from tools.worldgen import draw_plan, style_names

__all__ = [
    "DEVELOPED_ON",
    "HELD_OUT",
    "DrawnScore",
    "draw_worlds",
    "drawn_figures",
    "number_spaces",
    "score_world",
    "ship_worlds",
    "show_worlds",
]

DEVELOPED_ON = range(100, 104)
HELD_OUT = range(200, 204)
PIECE_M2 = 1.0
"""Smaller regions are not counted as pieces of a space."""
AGREEING_RATIO = 0.5
_SHIFT = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnScore:
    """How one building was divided.

    Attributes:
        name: Of the building.
        n_true: Spaces of the plan.
        n_found: Regions found.
        n_right: Spaces that agree with a region: an intersection over union of 0.5.
        n_split: Spaces that several regions belong to.
        n_joined: Regions that cover half or more of several spaces.
        n_misnamed: Spaces that agree with a region and are a corridor in one of the two alone.
        is_smallest_right: The room with the least floor, furniture counted or not, is the one.
    """

    name: str
    n_true: int
    n_found: int
    n_right: int
    n_split: int
    n_joined: int
    n_misnamed: int
    is_smallest_right: bool


def ship_worlds() -> Iterator[World]:
    """Return the worlds that are shipped."""
    return (load_world(name) for name in world_names())


def draw_worlds(seeds: Iterable[int]) -> Iterator[World]:
    """Return a building of each style for each seed."""
    for seed in seeds:
        for style in style_names():
            yield parse_world(draw_plan(style, seed=seed), name=f"{style} {seed}")


def drawn_figures(family: str, worlds: Iterable[World]) -> Iterator[Figure]:
    """Return what is right and wrong in all worlds of a family together."""
    scores = [score_world(world, TrueFloor(world).visible) for world in worlds]
    n_true = sum(score.n_true for score in scores)
    n_found = sum(score.n_found for score in scores)
    title = f"{family}, {len(scores)} of {n_true} spaces"
    f1 = 2 * sum(score.n_right for score in scores) / (n_true + n_found)
    yield Figure(name=f"{title}, F1 at IoU 0.5", value=f1, unit="")
    for what, n in (
        ("regions found", n_found),
        ("split", sum(score.n_split for score in scores)),
        ("joined", sum(score.n_joined for score in scores)),
        ("corridor or room, wrong", sum(score.n_misnamed for score in scores)),
    ):
        yield Figure(name=f"{title}, {what}", value=n, unit="spaces")
    n_smallest = sum(score.is_smallest_right for score in scores)
    yield Figure(name=f"{title}, smallest room right", value=n_smallest, unit="worlds")


def show_worlds() -> None:
    """Write the scores of every world."""
    for worlds in (ship_worlds(), draw_worlds(DEVELOPED_ON), draw_worlds(HELD_OUT)):
        for world in worlds:
            click.echo(str(score_world(world, TrueFloor(world).visible)))


def score_world(world: World, grid: OccupancyGrid) -> DrawnScore:
    """Divide a map of a building, in the frame of the robot's map, and compare it with truth."""
    truth, classes = number_spaces(world, grid)
    rooms = find_rooms(grid)
    overlap = find_overlap(rooms.labels.astype(np.intp), truth, grid.free & (truth > 0))
    agreement = find_agreement(overlap)
    pairs = [(int(i), int(j)) for i, j in np.argwhere(agreement >= AGREEING_RATIO)]
    shares = overlap[1:, 1:] / np.maximum(overlap[:, 1:].sum(axis=0), 1)
    return DrawnScore(
        name=world.name,
        n_true=len(classes),
        n_found=int((overlap[1:].sum(axis=1) > 0).sum()),
        n_right=len(pairs),
        n_split=_count_split(world, classes, overlap * grid.resolution_m**2),
        n_joined=int(((shares >= AGREEING_RATIO).sum(axis=1) > 1).sum()),
        n_misnamed=sum(
            (rooms.regions[i - 1].room_class is RoomClass.CORRIDOR)
            != (classes[j - 1] is RoomClass.CORRIDOR)
            for i, j in pairs
        ),
        is_smallest_right=_is_smallest_right(rooms, truth, classes, pairs),
    )


def number_spaces(world: World, grid: OccupancyGrid) -> tuple[Numbers, list[RoomClass]]:
    """Return each cell the number of its space from 1, 0 outside; and what the spaces are."""
    others = [space for space in world.rooms if space.room_class is not RoomClass.CORRIDOR]
    corridors = [space for space in world.rooms if space.room_class is RoomClass.CORRIDOR]
    truth = np.zeros(grid.cells.shape, np.intp)
    _, hall = cv2.connectedComponents(_fill(world, grid, corridors), connectivity=4)
    truth[hall > 0] = hall[hall > 0]
    n_halls = int(hall.max(initial=0))
    for number, space in enumerate(others, start=n_halls + 1):
        truth[_fill(world, grid, [space]) > 0] = number
    return truth, [RoomClass.CORRIDOR] * n_halls + [space.room_class for space in others]


def _fill(world: World, grid: OccupancyGrid, spaces: Sequence[TrueRoom]) -> NDArray[np.uint8]:
    """Return 1 in the outlines of spaces."""
    picture = np.zeros(grid.cells.shape, np.uint8)
    grid_from_world = grid.origin.inverse() @ world.start.inverse()
    for space in spaces:
        corners = [grid_from_world.transform(corner) for corner in space.outline]
        places = np.array([(corner.x, corner.y) for corner in corners]) / grid.resolution_m - 0.5
        cv2.fillPoly(picture, [np.round(places * 2**_SHIFT).astype(np.int32)], 1, shift=_SHIFT)
    return picture


def _count_split(world: World, classes: Sequence[RoomClass], areas_m2: NDArray[np.floating]) -> int:
    n_pieces = np.zeros(len(classes), np.intp)
    for row in areas_m2[1:, 1:]:
        if row.sum() >= PIECE_M2:
            n_pieces[row.argmax()] += 1
    n_corridors = sum(space.room_class is RoomClass.CORRIDOR for space in world.rooms)
    most = [n_corridors if each is RoomClass.CORRIDOR else 1 for each in classes]
    return int((n_pieces > np.array(most)).sum())


def _is_smallest_right(
    rooms: RoomMap, truth: Numbers, classes: Sequence[RoomClass], pairs: Sequence[tuple[int, int]]
) -> bool:
    areas = np.bincount(truth.ravel(), minlength=len(classes) + 1)
    right = min(
        (int(areas[number]), number)
        for number, each in enumerate(classes, start=1)
        if each is RoomClass.ROOM
    )[1]
    found = [
        region
        for region in rooms.regions
        if region.room_class is RoomClass.ROOM and not rooms.find_doubtful_door(region)
    ]
    by_floor = min(found, key=lambda region: region.floor_area_m2, default=None)
    by_free = min(found, key=lambda region: region.free_area_m2, default=None)
    return all(each is not None and (each.index, right) in pairs for each in (by_floor, by_free))
