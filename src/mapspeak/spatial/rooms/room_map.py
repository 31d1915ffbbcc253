"""A map divided into regions, with the doors that join them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.spatial.grid import OccupancyGrid

Labels = NDArray[np.int16]


class RoomClass(StrEnum):
    """Class of a region of the floor, as a person would name it."""

    ROOM = "room"
    CORRIDOR = "corridor"
    OPEN_SPACE = "open_space"


SURE = 0.9
"""A region is sure if all its doors are at least this certain.

In drawn buildings that nothing was fitted on, .99 of such regions were right, and of the others
.60; with clutter .98 and .51, with a part unseen .93 and .58.
"""
LIKELY = 0.8
"""With a door less certain than this, a region is more likely a part of its neighbour.

While the 14 shipped worlds were explored with the trees before these, 58 of 312 such regions were
right; of those between this and `SURE`, 90 of 162.
"""
BESIDE_RATIO = 0.5
"""A smaller neighbour, beside a region's own floor, would hardly change it."""
LETTER = {RoomClass.ROOM: "R", RoomClass.CORRIDOR: "C", RoomClass.OPEN_SPACE: "O"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """A room, a corridor or an open space.

    Attributes:
        id: "R3", "C1" or "O2". The number stays from call to call once regions were matched, and
            no two regions share it; the letter says what the region is now.
        index: The region's number in the label array of its map.
        free_area_m2: Floor without obstacles.
        floor_area_m2: Floor with the obstacles on it.
        length_m: The longer side of the smallest rectangle around it; of a corridor, along it.
        width_m: The shorter side; of a corridor, across it.
        heading_rad: Direction of the longer side in the map frame, from 0 up to pi.
        widest: The floor point farthest from any wall; a good place for a label.
        clearance_m: Distance of that point from the nearest wall.
    """

    id: str
    index: int
    room_class: RoomClass
    free_area_m2: float
    floor_area_m2: float
    length_m: float
    width_m: float
    heading_rad: float
    widest: Point
    clearance_m: float
    door_ids: tuple[str, ...] = ()
    neighbour_ids: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Door:
    """A narrow place where two regions meet, with or without a leaf in it.

    Attributes:
        id: "D4"; the same from call to call once regions were matched.
        place: The middle of its narrowest line.
        certainty: That two regions meet there and not parts of one, 0 to 1.
    """

    id: str
    place: Point
    width_m: float
    region_ids: tuple[str, str]
    certainty: float = 1.0

    @property
    def is_likely(self) -> bool:
        """True if two regions probably meet there, and not parts of one."""
        return self.certainty >= LIKELY


@dataclass(frozen=True, slots=True, kw_only=True)
class Vanished:
    """A region or door of an earlier map that is no longer found.

    Attributes:
        place: Its position; for a region its widest point.
        floor_area_m2: Of a region; None for a door.
        became: The regions that now cover its place; empty when nothing does.
    """

    id: str
    place: Point
    floor_area_m2: float | None
    became: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RoomMap:
    """A map divided into regions; compared by identity.

    Attributes:
        labels: `Region.index` of each cell of the grid, 0 for no region. Furniture belongs to the
            region around it.
        regions: Ordered by index, largest first when nothing came before.
        vanished: Ids of earlier maps that are no longer used; reused only when the same thing is
            back in its place.
        former_ids: Former ids of regions whose class has changed, with their present ids:
            {"R3": "C3"}.
    """

    grid: OccupancyGrid
    labels: Labels
    regions: tuple[Region, ...]
    doors: tuple[Door, ...]
    vanished: tuple[Vanished, ...] = ()
    former_ids: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        labels = np.array(self.labels, dtype=np.int16, order="C")
        labels.setflags(write=False)
        object.__setattr__(self, "labels", labels)

    def region(self, region_id: str) -> Region:
        """Return the region with this number, following regions that were merged into another.

        Raises:
            MapError: No region has or had this id.
        """
        found = self.find_region(region_id)
        if found is not None:
            return found
        became = [gone.became for gone in self.vanished if gone.id == region_id]
        known = {region.id for region in self.regions}
        if became and len(became[0]) == 1 and became[0][0] in known:
            return self.region(became[0][0])
        names = ", ".join(region.id for region in self.regions) or "none"
        raise MapError(f"This map has no region {region_id}.", hint=f"Its regions are: {names}.")

    def find_region(self, region_id: str) -> Region | None:
        """Return the region with this id, even a former id from before its class changed."""
        now = self.former_ids.get(region_id, region_id)
        return next((each for each in self.regions if each.id in (region_id, now)), None)

    def find_region_at(self, point: Point) -> Region | None:
        """Return the region a point lies in, or None."""
        cell = self.grid.cell_at(point)
        if not self.grid.contains(cell):
            return None
        index = int(self.labels[cell.row, cell.col])
        return next((region for region in self.regions if region.index == index), None)

    def window_of(self, region: Region) -> tuple[slice, slice]:
        """Return the rows and columns that a region lies in."""
        cell = self.grid.cell_at(region.widest)
        reach = max(round(region.length_m / 2 / self.grid.resolution_m), 1)
        while True:
            rows, cols = self.grid.window(cell.row, cell.col, margin=reach)
            inside = self.labels[rows, cols] == region.index
            along, across = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
            window = (
                slice(rows.start + int(along[0]), rows.start + int(along[-1]) + 1),
                slice(cols.start + int(across[0]), cols.start + int(across[-1]) + 1),
            )
            # At a side of the examined part, it may go on beyond.
            is_cut = any(
                (inner.start == outer.start > 0) or (inner.stop == outer.stop < size)
                for inner, outer, size in zip(window, (rows, cols), self.labels.shape, strict=True)
            )
            if not is_cut:
                return window
            reach *= 2

    def doors_of(self, region: Region) -> tuple[Door, ...]:
        """Return the doors that lead out of a region."""
        return tuple(door for door in self.doors if region.id in door.region_ids)

    def find_doubtful_door(self, region: Region) -> Door | None:
        """Return the door that least surely divides a region from a neighbour of some size."""
        least_m2 = (1 + BESIDE_RATIO) * region.floor_area_m2
        areas_m2 = {each.id: each.floor_area_m2 for each in self.regions}
        doubtful = [
            door
            for door in self.doors_of(region)
            if door.certainty < SURE and sum(map(areas_m2.__getitem__, door.region_ids)) > least_m2
        ]
        return min(doubtful, key=lambda door: door.certainty, default=None)

    def doors_between(self, first_id: str, second_id: str) -> tuple[Door, ...]:
        """Return the doors that join two regions."""
        pair = {first_id, second_id}
        return tuple(door for door in self.doors if set(door.region_ids) == pair)
