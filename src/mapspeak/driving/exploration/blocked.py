"""What drives have shown: places that could not be reached, and when to try another time."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from mapspeak.driving.drivereport import FAILED, FRONTIER, Drive
from mapspeak.geometry import Point, Pose
from mapspeak.robot import Cause, GoalState
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import ProvedGap, Tried, find_proved_gap
from mapspeak.spatial.grid import FloatArray, IntArray
from mapspeak.spatial.paths import clearance_m
from mapspeak.worldmodel.revision import MapRevision

SAME_GAP_M = 0.5
MOST_GAPS = 30


def has_room_at(grid: OccupancyGrid, point: Point, *, radius_m: float) -> bool:
    """Return True where a robot of that radius can stand on known floor."""
    cell = grid.cell_at(point)
    if not grid.is_free(cell):
        return False
    rows, cols = grid.window_around(point, radius_m + grid.resolution_m)
    near_m = clearance_m(grid.crop(rows, cols))
    return bool(near_m[cell.row - rows.start, cell.col - cols.start] >= radius_m)


SAME_PLACE_M = 0.5
"""A place this near to one that was blocked is blocked as well."""
AROUND_M = 1.5
EVERY_M = 0.1
CHANGED_RATIO = 0.1
"""The path counts as changed when this share of the floor around it looks different."""
MOST_TRIES = 2
MOST_KEPT = 50


@dataclass(frozen=True, slots=True, kw_only=True)
class TripEnd:
    """Why a trip ended before its target."""

    goal_id: str | None = None
    goal_state: GoalState | None = None
    cause: Cause | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BlockedPlace:
    """A place that could not be reached.

    Attributes:
        id: What it was called when the robot was sent there.
    """

    id: str
    pose: Pose
    end: TripEnd
    n_tries: int
    _points: FloatArray = field(repr=False)
    _kinds: IntArray = field(repr=False)

    def has_changed(self, grid: OccupancyGrid) -> bool:
        """Return True when the map now shows something else there, or where the robot got stuck."""
        is_other = _kinds_at(grid, self._points) != self._kinds
        return bool((is_other.mean(axis=1) > CHANGED_RATIO).any())


class BlockedPlaces:
    """All places that could not be reached so far."""

    def __init__(self) -> None:
        self._places: list[BlockedPlace] = []

    def __iter__(self) -> Iterator[BlockedPlace]:
        return iter(self._places)

    def remember(
        self, place_id: str, pose: Pose, *, stuck: Point, end: TripEnd, grid: OccupancyGrid
    ) -> None:
        """Note that a place could not be reached.

        Args:
            stuck: Where it gave up.
        """
        earlier = self._find(pose.point)
        self.forget(pose.point)
        points = np.stack([_points_around(pose.point), _points_around(stuck)])
        place = BlockedPlace(
            id=place_id,
            pose=pose,
            end=end,
            n_tries=1 if earlier is None else earlier.n_tries + 1,
            _points=points,
            _kinds=_kinds_at(grid, points),
        )
        self._places.append(place)
        del self._places[:-MOST_KEPT]

    def forget(self, point: Point) -> None:
        """Strike out what is known of a place: the robot has been there after all."""
        self._places = [each for each in self._places if not _is_near(each, point)]

    def is_closed(self, point: Point, grid: OccupancyGrid) -> bool:
        """Return True for a place that was blocked and looks as it did then."""
        place = self._find(point)
        return place is not None and not place.has_changed(grid)

    def worth_another_try(self, grid: OccupancyGrid) -> list[BlockedPlace]:
        """Return those that look different now; each of the others once more, in the end."""
        changed = [each for each in self._places if each.has_changed(grid)]
        return changed or [each for each in self._places if each.n_tries < MOST_TRIES]

    def _find(self, point: Point) -> BlockedPlace | None:
        near = [each for each in self._places if _is_near(each, point)]
        return min(near, key=lambda each: each.pose.point.distance_to(point), default=None)


def _is_near(place: BlockedPlace, point: Point) -> bool:
    return place.pose.point.distance_to(point) <= SAME_PLACE_M


def _points_around(centre: Point) -> FloatArray:
    steps = np.arange(-AROUND_M, AROUND_M + EVERY_M / 2, EVERY_M)
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    is_round = np.hypot(*offsets.T) <= AROUND_M
    return np.asarray(np.array([centre.x, centre.y]) + offsets[is_round])


def _kinds_at(grid: OccupancyGrid, points: FloatArray) -> IntArray:
    """Return what the map shows at points: 1 free, 0 occupied, -1 unknown."""
    free = grid.look_up(grid.free, points, outside=False).astype(np.intp)
    return free - grid.look_up(grid.unknown, points, outside=True)


class FrontierTries:
    """Learns from drives, on the map as it is after them."""

    def __init__(self) -> None:
        self._looked_from: list[Point] = []
        self._blocked = BlockedPlaces()
        self._gaps: list[ProvedGap] = []

    def learn(self, ended: Iterable[Drive], revision: MapRevision, robot: Pose) -> None:
        """Take in drives that have ended, each once.

        Args:
            robot: Where the robot is, for a drive of which it is not known where it gave up.
        """
        for drive in ended:
            if drive.final is None:
                continue
            if drive.final.state is GoalState.ARRIVED:
                self._blocked.forget(drive.goal.point)
                if FRONTIER.fullmatch(drive.place):
                    self._looked_from.append(drive.goal.point)
            elif drive.final.state in FAILED:
                self._learn_failure(drive, revision, drive.ended_at or robot.point)

    def find_tried(self, revision: MapRevision) -> Tried:
        """Return what counts on a map: what has changed there is worth another try."""
        places = [each.pose.point for each in self._blocked]
        grid = revision.grid
        return Tried(
            looked_from=tuple(self._looked_from),
            failed_at=tuple(at for at in places if self._blocked.is_closed(at, grid)),
            gaps=tuple(self._gaps),
        )

    def _learn_failure(self, drive: Drive, revision: MapRevision, stuck: Point) -> None:
        state = None if drive.final is None else drive.final.state
        end = TripEnd(goal_id=drive.goal_id, goal_state=state)
        self._blocked.remember(drive.place, drive.goal, stuck=stuck, end=end, grid=revision.grid)
        if state is not GoalState.BLOCKED:
            return
        gap = find_proved_gap(revision.distances_from(stuck), drive.goal.point)
        if gap is not None:
            others = [each for each in self._gaps if not _is_same(each, gap)]
            self._gaps = [*others, gap][-MOST_GAPS:]


def _is_same(one: ProvedGap, other: ProvedGap) -> bool:
    return one.point.distance_to(other.point) <= SAME_GAP_M
