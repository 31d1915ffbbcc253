"""The demo's scores from the simulator's truth: the world file and the state log, never words."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mapspeak.evaluation.scores import BESIDE_M, Site
from mapspeak.geometry import Pose
from mapspeak.simulator import StateRecord, World
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.coverage import Coverage, measure_coverage
from mapspeak.spatial.rooms import RoomClass

__all__ = ["FireToolScore", "RoomScore", "Scorer"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomScore:
    """Whether the robot stands in the smallest room.

    Attributes:
        is_success: It does.
        chosen_room: The name of the room it stands in; None when in none.
        chosen_room_area_m2: Its free floor.
        smallest_room_area_m2: The free floor of the smallest one; None in a world without rooms.
        final_pose: Where it truly stands.
    """

    is_success: bool
    chosen_room: str | None
    chosen_room_area_m2: float | None
    smallest_room_area_m2: float | None
    final_pose: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class FireToolScore:
    """Whether the robot was led to a fire extinguisher.

    Attributes:
        is_success: One is in sight and near.
        nearest: The name of the nearest one in sight; None when none is.
        distance_m: To that one, else to the nearest of all; None in a world without any.
    """

    is_success: bool
    nearest: str | None
    distance_m: float | None


class Scorer:
    """Knows one world's truth."""

    def __init__(self, world: World) -> None:
        self._site = Site(world)

    def score_map(self, grid: OccupancyGrid) -> Coverage:
        """Compares a robot's map with what a perfect robot could have mapped."""
        return measure_coverage(grid, self._site.floor.visible)

    def score_smallest_room(self, pose: Pose) -> RoomScore:
        """Scores the paper's Task 2 from where the robot truly stands."""
        rooms = [each for each in self._site.floor.rooms if each.room.room_class is RoomClass.ROOM]
        smallest = min(rooms, key=lambda room: room.free_area_m2, default=None)
        here = self._site.room_at(pose.point)
        return RoomScore(
            is_success=here is not None and here is smallest,
            chosen_room=None if here is None else here.room.name,
            chosen_room_area_m2=None if here is None else here.free_area_m2,
            smallest_room_area_m2=None if smallest is None else smallest.free_area_m2,
            final_pose=pose,
        )

    def score_fire_tool(self, pose: Pose) -> FireToolScore:
        """Scores the paper's Task 3 from where the robot truly stands."""
        site, here = self._site, pose.point
        tools = site.things("fire_extinguisher")
        if not tools:
            return FireToolScore(is_success=False, nearest=None, distance_m=None)
        in_sight = [tool for tool in tools if site.is_in_sight(here, tool)]
        nearest = min(in_sight or tools, key=lambda tool: here.distance_to(site.place_of(tool)))
        distance_m = here.distance_to(site.place_of(nearest))
        return FireToolScore(
            is_success=bool(in_sight) and distance_m <= BESIDE_M,
            nearest=nearest.name if in_sight else None,
            distance_m=distance_m,
        )


def slam_rmse_m(records: Sequence[StateRecord]) -> float:
    """Gives the root mean square error of the robot's own pose over a run."""
    if not records:
        return math.nan
    return math.sqrt(sum(record.slam_error_m**2 for record in records) / len(records))
