"""Where a robot can stand near a place, which of these places suits best, and why."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point
from mapspeak.memory.things.approach import COMFORT_M
from mapspeak.places.naming import Place, Spot
from mapspeak.spatial.grid import FloatArray, IntArray, Mask
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import WorldModel

IN_DOOR_M = 0.5
AT_ONCE = 512
"""Number of lines of sight that are computed together."""
MOST_EXTENT = 256
BODY_M = 1.0
"""Largest distance from what is seen of a thing to its middle."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReachableCells:
    """The cells of a part of the map that the robot can get to; arrays of one length.

    Attributes:
        points: Their centres in metres, shape (n, 2).
        clear_m: From each to the nearest obstacle.
        regions: The index of the region each lies in; 0 in none.
        in_doors: True in the middle of a door, where a robot is in the way.
    """

    points: FloatArray
    paths_m: FloatArray
    clear_m: FloatArray
    regions: IntArray
    in_doors: Mask

    def away_m(self, point: Point) -> FloatArray:
        """Return how far each cell is from a point, as the crow flies."""
        return np.asarray(np.hypot(self.points[:, 0] - point.x, self.points[:, 1] - point.y))

    def along_m(self, origin: Point, heading_rad: float) -> FloatArray:
        """Return how far each cell is from a point in a direction; negative behind it."""
        dx, dy = self.points[:, 0] - origin.x, self.points[:, 1] - origin.y
        return np.asarray(dx * math.cos(heading_rad) + dy * math.sin(heading_rad))

    def at(self, values: FloatArray, point: Point) -> float:
        """Return the value, of one for each cell, at the cell nearest to a point."""
        return float(values[int(np.argmin(self.away_m(point)))])

    def extent_away_m(self, extent: FloatArray) -> FloatArray:
        """Return how far each cell is from the nearest of some points, as the crow flies."""
        away_m = np.full(len(self.points), np.inf)
        for x, y in extent[:: -(-len(extent) // MOST_EXTENT)].tolist():
            np.minimum(away_m, self.away_m(Point(x, y)), out=away_m)
        return away_m

    def is_beside(self, home: Region | None, region: Region | None) -> Mask:
        """Return True for the cells of one region, or else outside another."""
        if home is not None:
            return np.asarray(self.regions == home.index)
        if region is not None:
            return np.asarray(self.regions != region.index)
        return np.ones(len(self.points), dtype=np.bool_)

    def choose(
        self,
        world: WorldModel,
        allowed: Mask,
        costs: FloatArray,
        *,
        in_sight_of: Point | None = None,
    ) -> Point | None:
        """Return the allowed cell of the least cost; None where there is none.

        Roomy ones aside from doors go first, then tight ones, then those in doors.

        Args:
            costs: Of each cell; the first of equal ones wins.
            in_sight_of: What nothing may stand before.
        """
        is_roomy = self.clear_m >= world.radius_m + COMFORT_M
        aside = allowed & ~self.in_doors
        for candidates in map(np.flatnonzero, (aside & is_roomy, aside, allowed)):
            ordered = candidates[np.argsort(costs[candidates], kind="stable")]
            for start in range(0, ordered.size, AT_ONCE):
                some = ordered[start : start + AT_ONCE]
                if in_sight_of is not None:
                    some = some[is_in_sight(world, self.points[some], in_sight_of)]
                if some.size:
                    x, y = self.points[some[0]].tolist()
                    return Point(x, y)
        return None


def find_reachable_cells(world: WorldModel, centre: Point, reach_m: float) -> ReachableCells:
    """Find the reachable cells in the square of `reach_m` to each side of a place."""
    grid = world.grid
    window = grid.window_around(centre, reach_m)
    at_rows, at_cols = np.nonzero(grid.free[window])
    at_rows, at_cols = at_rows + window[0].start, at_cols + window[1].start
    paths_m = world.distances.distances_at(at_rows, at_cols)
    is_reached = np.isfinite(paths_m)
    at_rows, at_cols = at_rows[is_reached], at_cols[is_reached]
    points = grid.points_at(at_rows, at_cols)
    return ReachableCells(
        points=points,
        paths_m=paths_m[is_reached],
        clear_m=world.map.clearance_m[at_rows, at_cols].astype(np.float64),
        regions=world.rooms.labels[at_rows, at_cols].astype(np.intp),
        in_doors=_find_in_doors(world, points, centre, reach_m),
    )


def _find_in_doors(world: WorldModel, points: FloatArray, centre: Point, reach_m: float) -> Mask:
    found = np.zeros(len(points), dtype=np.bool_)
    for door in world.rooms.doors:
        if door.place.distance_to(centre) <= 2 * reach_m:
            away_m = np.hypot(points[:, 0] - door.place.x, points[:, 1] - door.place.y)
            found |= away_m <= min(door.width_m / 2, IN_DOOR_M)
    return found


def is_in_sight(world: WorldModel, points: FloatArray, thing: Point) -> Mask:
    """Return True for the points from which nothing stands before a thing.

    The thing itself may be an obstacle: once a line has met what it ends in, no floor follows, and
    it is not far to its middle.
    """
    grid = world.grid
    if not len(points):
        return np.zeros(0, dtype=np.bool_)
    lines = np.array([thing.x, thing.y]) - points
    far_m = np.hypot(lines[:, 0], lines[:, 1])
    shares = np.linspace(0.0, 1.0, math.ceil(float(far_m.max()) / grid.resolution_m * 2) + 2)
    steps = points[:, None, :] + shares[None, :, None] * lines[:, None, :]
    is_floor = grid.look_up(grid.free, steps, outside=False)
    is_blocked = np.logical_or.accumulate(~is_floor, axis=1)
    is_far = far_m[:, None] * (1.0 - shares) > BODY_M
    return np.asarray(~(is_blocked & (is_floor | is_far)).any(axis=1), dtype=np.bool_)


def stand(point: Point, reason: str, yaw_rad: float | None = None) -> Place:
    """Return a place to stand that fits a relation; without a heading, it is that of the arrival.

    The words of the relation are its name.
    """
    return Place("", Spot(point, yaw_rad), reason)


def refuse(what: str, works: Sequence[str] = (), *, else_hint: str = "") -> GoalError:
    """Return the error for what nothing fits, with what would."""
    if works:
        else_hint = f"Try {join_or(works)}."
    if else_hint:
        return GoalError(what, hint=else_hint)
    return GoalError(what, hint="Name another place.", step=NextStep.MEASURE)


def join_or(words: Sequence[str]) -> str:
    """Return "a, b or c"."""
    return " or ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def tolerance_m(resolution_m: float) -> float:
    """Return how far off an asked distance may be."""
    return max(0.1, 0.75 * resolution_m)
