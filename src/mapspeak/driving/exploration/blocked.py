"""Places that the robot was sent to and could not get to, and when another try makes sense."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.robot import Cause, GoalState
from mapspeak.spatial import UNKNOWN, OccupancyGrid
from mapspeak.spatial.paths import clearance_m


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
"""The way is another one when so much of the floor around looks different."""
MOST_TRIES = 2
MOST_KEPT = 50


@dataclass(frozen=True, slots=True, eq=False)
class _Patch:
    """What the map showed around a place, at points of the world.

    Attributes:
        points: In metres, shape (n, 2).
        kinds: 0 free, 1 occupied, -1 unknown, shape (n,).
    """

    points: NDArray[np.float64] = field(repr=False)
    kinds: NDArray[np.int8] = field(repr=False)

    def changed_ratio(self, grid: OccupancyGrid) -> float:
        """Return the share of the points that the map shows as something else now."""
        return float((_kinds_at(grid, self.points) != self.kinds).mean())


@dataclass(frozen=True, slots=True, kw_only=True)
class TripEnd:
    """Why a trip ended before its target.

    Attributes:
        goal_id: Its drive; None where the robot was not sent at all.
        goal_state: How the drive ended; None likewise.
        cause: Why; None where nobody said.
    """

    goal_id: str | None = None
    goal_state: GoalState | None = None
    cause: Cause | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BlockedPlace:
    """A place that could not be reached.

    Attributes:
        id: What it was called when the robot was sent there.
        pose: Where the robot was to stand.
        end: Why it did not get there.
        n_tries: How often it was sent there.
    """

    id: str
    pose: Pose
    end: TripEnd
    n_tries: int = 1
    _patches: tuple[_Patch, ...] = field(default=(), repr=False)

    def has_changed(self, grid: OccupancyGrid) -> bool:
        """Return True when the map now shows something else there, or where the robot got stuck."""
        return any(patch.changed_ratio(grid) > CHANGED_RATIO for patch in self._patches)


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
            place_id: Of the place.
            pose: Where the robot was to stand.
            stuck: Where it gave up.
            end: Why.
            grid: The map of that moment.
        """
        earlier = self._find(pose.point)
        self.forget(pose.point)
        patches = (_patch_around(grid, pose.point), _patch_around(grid, stuck))
        n_tries = 1 if earlier is None else earlier.n_tries + 1
        self._places.append(
            BlockedPlace(id=place_id, pose=pose, end=end, n_tries=n_tries, _patches=patches)
        )
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


def _patch_around(grid: OccupancyGrid, centre: Point) -> _Patch:
    steps = np.arange(-AROUND_M, AROUND_M + EVERY_M / 2, EVERY_M)
    off_x, off_y = (each.ravel() for each in np.meshgrid(steps, steps))
    is_round = np.hypot(off_x, off_y) <= AROUND_M
    points = np.stack([centre.x + off_x[is_round], centre.y + off_y[is_round]], axis=1)
    return _Patch(points, _kinds_at(grid, points))


def _kinds_at(grid: OccupancyGrid, points: NDArray[np.float64]) -> NDArray[np.int8]:
    rows, cols = grid.cells_at(points)
    is_inside = grid.contains_cells(rows, cols)
    kinds = np.full(len(points), UNKNOWN, dtype=np.int8)
    rows, cols = rows[is_inside], cols[is_inside]
    kinds[is_inside] = np.where(
        grid.free[rows, cols], 0, np.where(grid.unknown[rows, cols], UNKNOWN, 1)
    )
    return kinds
