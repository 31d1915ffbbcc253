"""One map as everybody speaks of it: rooms, doors, frontiers and remembered places under their ids.

An atlas is made from a map, a pose and the memory. Ids come from the atlas before it, so that R3
stays R3 while the map grows.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.semantic import SemanticMap, Waypoint
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import FrontierReport, find_frontiers, match_frontiers
from mapspeak.spatial.paths import DistanceField, clearance_m, distances_from
from mapspeak.spatial.paths.clearance import Clearance
from mapspeak.spatial.rooms import Region, RoomMap, find_rooms

__all__ = ["Atlas", "RememberedPlace", "number_places"]


COMFORT_M = 0.15
"""How much more than its radius a robot should have around it where it is sent to stand."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RememberedPlace:
    """A waypoint of the semantic map under its id.

    Attributes:
        id: "W1" for the first in the file.
        waypoint: The record.
    """

    id: str
    waypoint: Waypoint


class Atlas:
    """A map revision with everything that has an id; each part is computed when first asked for.

    Args:
        grid: The map.
        robot: Where the robot is.
        memory: What is remembered.
        radius_m: Of the robot.
        looked_from: Places of former frontiers that the robot has been to.
        previous: The atlas before, whose ids are kept and whose parts are used where they hold.

    Attributes:
        grid: The map.
        robot: Where the robot is.
        radius_m: Of the robot.
        places: Remembered places.
        warnings: What a reader of the memory should know.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        robot: Pose,
        memory: SemanticMap,
        *,
        radius_m: float,
        looked_from: Sequence[Point] = (),
        previous: "Atlas | None" = None,
    ) -> None:
        self.grid = grid
        self.robot = robot
        self.radius_m = radius_m
        self.places = number_places(memory.waypoints)
        self.warnings = memory.warnings
        self._looked_from = tuple(looked_from)
        self._earlier_rooms = None if previous is None else previous.latest_rooms
        self._earlier_frontiers = None if previous is None else previous.latest_frontiers
        self._earlier_distances = None if previous is None else previous.latest_distances

    @cached_property
    def rooms(self) -> RoomMap:
        """Rooms, corridors, open spaces and doors."""
        earlier = self._earlier_rooms
        if earlier is not None and earlier.grid is self.grid:
            return earlier
        return find_rooms(self.grid, previous=earlier)

    @cached_property
    def distances(self) -> DistanceField:
        """Path distances from the robot."""
        earlier = self._earlier_distances
        if earlier is not None and earlier.lattice.grid is self.grid:
            moved_m = earlier.start.distance_to(self.robot.point)
            if moved_m < self.grid.resolution_m / 2:
                return earlier
        return distances_from(self.grid, self.robot.point, radius_m=self.radius_m)

    @cached_property
    def frontiers(self) -> FrontierReport:
        """Where the known meets the unknown, best first."""
        found = find_frontiers(
            self.grid,
            self.robot.point,
            radius_m=self.radius_m,
            distances=self.distances,
            looked_from=self._looked_from,
        )
        earlier = self._earlier_frontiers
        return found if earlier is None else match_frontiers(earlier, found)

    @cached_property
    def _clearance_m(self) -> Clearance:
        return clearance_m(self.grid)

    @property
    def latest_rooms(self) -> RoomMap | None:
        """The rooms found last, on this map or an earlier one; finds none anew."""
        found: RoomMap | None = self.__dict__.get("rooms", self._earlier_rooms)
        return found

    @property
    def latest_frontiers(self) -> FrontierReport | None:
        """The frontiers found last; finds none anew."""
        found: FrontierReport | None = self.__dict__.get("frontiers", self._earlier_frontiers)
        return found

    @property
    def latest_distances(self) -> DistanceField | None:
        """The distances found last; finds none anew."""
        found: DistanceField | None = self.__dict__.get("distances", self._earlier_distances)
        return found

    def path_m(self, point: Point) -> float | None:
        """Gives the metres the robot has to drive to a point; None where it cannot get to."""
        return self.distances.distance_to(point)

    def find_room_id(self, point: Point) -> str | None:
        """Gives the id of the room or corridor a point lies in."""
        region = self.rooms.find_region_at(point)
        return None if region is None else region.id

    def is_growing(self, region: Region) -> bool:
        """True when a frontier leads out of the region: its area is not final."""
        return any(
            self.find_room_id(frontier.pose.point) == region.id
            for frontier in self.frontiers.frontiers
        )

    def find_standing_point(self, region: Region) -> Point | None:
        """Gives a reachable point of a region, as far from walls as can be, or None."""
        comfortable_m = self.radius_m + COMFORT_M
        cell = self.grid.cell_at(region.widest)
        is_roomy = self._clearance_m[cell.row, cell.col] >= comfortable_m
        if is_roomy and self.distances.is_reachable(region.widest):
            return region.widest
        rows, cols = np.nonzero(self.rooms.labels == region.index)
        distances_m = self.distances.distances_at(rows, cols)
        clear_m = self._clearance_m[rows, cols]
        reachable = np.flatnonzero(np.isfinite(distances_m))
        if not reachable.size:
            return None
        enough_m = min(comfortable_m, float(clear_m[reachable].max()))
        reachable = reachable[clear_m[reachable] >= enough_m]
        points = self.grid.points_at(rows[reachable], cols[reachable])
        away_m = np.hypot(points[:, 0] - region.widest.x, points[:, 1] - region.widest.y)
        best = points[int(np.argmin(away_m))]
        return Point(float(best[0]), float(best[1]))

    def arrival_pose(self, point: Point) -> Pose:
        """Gives the pose at a point in which the robot ends when it drives there straight on."""
        path = self.distances.path_to(point)
        if path is None or len(path.points) < 2 or path.length_m == 0.0:
            return Pose(point.x, point.y, self.robot.yaw_rad)
        before = next(
            (p for p in reversed(path.points[:-1]) if p.distance_to(point) > 0.05), path.points[0]
        )
        yaw_rad = before.bearing_to(point) if before != point else self.robot.yaw_rad
        return Pose(point.x, point.y, yaw_rad)


def number_places(waypoints: Sequence[Waypoint]) -> tuple[RememberedPlace, ...]:
    """Gives remembered places their ids, in the order of the file."""
    return tuple(
        RememberedPlace(id=f"W{number}", waypoint=waypoint)
        for number, waypoint in enumerate(waypoints, start=1)
    )
