"""One state of the map with all that does not depend on where the robot is."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.paths import DistanceField, Path, clearance_m, distances_from
from mapspeak.spatial.paths.lattice import Clearance
from mapspeak.spatial.paths.wavefront import Costs
from mapspeak.spatial.rooms import CorridorWalk, Region, RoomMap, find_rooms, walk_along
from mapspeak.worldmodel.keepout import ClosedArea, close_floor, mask_areas

if TYPE_CHECKING:
    from mapspeak.spatial.picture import PictureRegion, RegionLayer

STEP_M = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Hindrance:
    """A part of the floor that is better not driven over where there is another way.

    Attributes:
        extra_m: A path across it costs at least this much more.
        factor: A metre in it costs at least this many metres.
    """

    area: ClosedArea
    extra_m: float
    factor: float

    @property
    def weight(self) -> float:
        """What a metre in it counts as: across a door's sill as much as across a room."""
        corners = np.array([[each.x, each.y] for each in self.area.outline], dtype=np.float32)
        _, sides, _ = cv2.minAreaRect(corners)
        return max(self.factor, 1 + self.extra_m / max(min(sides), STEP_M))

    def is_crossed_by(self, path: Path) -> bool:
        """Return True when a way leads over it."""
        return any(self.area.contains(point) for point in path.sampled(STEP_M))


MOST_FIELDS = 6
"""The number of distance fields kept; on a map of 16 Mcells each takes 16 MB."""


class MapRevision:
    """A map and what is found on it; each part is computed when first asked for.

    Args:
        previous: The state before, whose rooms give theirs their ids.
        areas: What is closed of the floor: no way leads over it.
        hindrances: What ways lead round where that is not too far.
        leaves_pockets: A robot that a gap too narrow by a cell shuts in gets out of it.

    Attributes:
        drawn: The rooms as they were drawn last.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        radius_m: float,
        previous: "MapRevision | None" = None,
        areas: Sequence[ClosedArea] = (),
        hindrances: Sequence[Hindrance] = (),
        leaves_pockets: bool = False,
    ) -> None:
        self.grid = grid
        self.radius_m = radius_m
        self.areas = tuple(areas)
        self.hindrances = tuple(hindrances)
        self._leaves_pockets = leaves_pockets
        self._open: MapRevision | None = None
        self._earlier_rooms = None if previous is None else previous.latest_rooms
        self._fields: dict[Cell, DistanceField] = {}
        self._walks: dict[str, CorridorWalk | None] = {}
        self.drawn: dict[tuple[PictureRegion, ...], RegionLayer] = {}

    def is_of(self, grid: OccupancyGrid) -> bool:
        """Return True when a map shows the same as this one."""
        return self.grid is grid or (
            self.grid.resolution_m == grid.resolution_m
            and self.grid.origin == grid.origin
            and np.array_equal(self.grid.cells, grid.cells)
        )

    def with_areas(
        self, areas: Sequence[ClosedArea], hindrances: Sequence[Hindrance] = ()
    ) -> "MapRevision":
        """Return the same map with other areas closed or hindered; its rooms are the same ones."""
        other = MapRevision(
            self.grid,
            radius_m=self.radius_m,
            previous=self,
            areas=areas,
            hindrances=hindrances,
            leaves_pockets=self._leaves_pockets,
        )
        other._open = self.open
        if "rooms" in self.__dict__:
            other.__dict__["rooms"] = self.rooms
        return other

    @property
    def open(self) -> "MapRevision":
        """The same map with nothing closed, as a robot sees it that knows of no areas."""
        if not (self.areas or self.hindrances):
            return self
        if self._open is None:
            radius_m, leaves_pockets = self.radius_m, self._leaves_pockets
            self._open = MapRevision(
                self.grid, radius_m=radius_m, previous=self, leaves_pockets=leaves_pockets
            )
        return self._open

    @cached_property
    def floor(self) -> OccupancyGrid:
        """The map without the floor that is closed."""
        return close_floor(self.grid, self.areas)

    @cached_property
    def rooms(self) -> RoomMap:
        """Rooms, corridors, open spaces and doors."""
        return find_rooms(self.grid, previous=self._earlier_rooms)

    @cached_property
    def clearance_m(self) -> Clearance:
        """Metres from each cell to the nearest obstacle or closed area, the shape of the grid."""
        known = next(iter(self._fields.values()), None)
        return clearance_m(self.floor) if known is None else known.lattice.fine_clearance_m

    @property
    def latest_rooms(self) -> RoomMap | None:
        """The rooms found last, on this map or an earlier one; finds none anew."""
        found: RoomMap | None = self.__dict__.get("rooms", self._earlier_rooms)
        return found

    def walk_along(self, region: Region) -> CorridorWalk | None:
        """Return the walk along one of the regions, past its doors; None where it has none."""
        if not region.door_ids:
            return None
        if region.id not in self._walks:
            self._walks[region.id] = walk_along(self.rooms, region)
        return self._walks[region.id]

    @cached_property
    def weights(self) -> Costs | None:
        """What a metre counts in each cell of the map; None where it is one everywhere."""
        if not self.hindrances:
            return None
        weights = np.ones(self.grid.cells.shape, dtype=np.float32)
        for hindrance in self.hindrances:
            inside = mask_areas(self.grid, [hindrance.area])
            weights[inside] = np.maximum(weights[inside], np.float32(hindrance.weight))
        return weights

    def find_path(self, start: Point, goal: Point) -> Path | None:
        """Find the way to take from one place to another, round hindrances where that pays."""
        return self.find_path_over(self.distances_from(start), goal)

    def find_path_over(self, distances: DistanceField, goal: Point) -> Path | None:
        """Find the way to take from where distances were measured."""
        if self.weights is None:
            return distances.path_to(goal)
        return distances.cheapest_path_to(goal, self.weights)

    def distances_from(self, point: Point) -> DistanceField:
        """Return the path distances from a place to every other."""
        cell = self.grid.cell_at(point)
        field = self._fields.get(cell)
        if field is None:
            known = next(iter(self._fields.values()), None)
            if known is not None:
                field = known.from_elsewhere(point)
            else:
                radius_m, leaves_pockets = self.radius_m, self._leaves_pockets
                field = distances_from(
                    self.floor, point, radius_m=radius_m, leaves_pockets=leaves_pockets
                )
            # A new dictionary each time: several threads may ask at once.
            kept = list(self._fields.items())[1 - MOST_FIELDS :]
            self._fields = {**dict(kept), cell: field}
        return field
