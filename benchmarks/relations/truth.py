"""What is true of a place: geometry written down without the code that is measured."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix  # type: ignore[import-untyped]  # it ships no types
from scipy.sparse.csgraph import dijkstra  # type: ignore[import-untyped]  # likewise

from benchmarks.relations.sites import Site, TrueDoor, TrueRoom
from mapspeak.geometry import Point

__all__ = ["Fit", "Fitting", "Places", "Truth", "angle_off", "away", "bearing"]

Places = NDArray[np.float64]
Angles = NDArray[np.float64]
Fitting = NDArray[np.bool_]


class Fit(Protocol):
    """Says which points, shape (n, 2), fit: with a margin where it is strict, else just so."""

    def __call__(self, points: Places, *, strict: bool) -> Fitting:
        """Return one truth value for each point."""
        ...


def angle_off(one: Places | float, other: float) -> Places:
    """Return how far an angle is from another, without sign."""
    return np.abs(np.remainder(np.asarray(one) - other + math.pi, math.tau) - math.pi)


def bearing(origin: Point, points: Places) -> Places:
    """Return the directions from a point to others."""
    return np.arctan2(points[:, 1] - origin.y, points[:, 0] - origin.x)


def away(origin: Point, points: Places) -> Places:
    """Return the distances from a point to others."""
    return np.hypot(points[:, 0] - origin.x, points[:, 1] - origin.y)


@dataclass(frozen=True)
class Truth:
    """What can be known of a site from its drawing, and from its cells one by one."""

    site: Site

    @cached_property
    def clear_m(self) -> Places:
        """From each cell to the nearest obstacle."""
        grid = self.site.grid
        away_px = cv2.distanceTransform((~grid.occupied).astype(np.uint8), cv2.DIST_L2, 5)
        return np.asarray(away_px * grid.resolution_m)

    @cached_property
    def standable(self) -> Fitting:
        """True for the cells where the robot fits and gets to."""
        grid = self.site.grid
        fits = (grid.free & (self.clear_m >= self.site.radius_m)).astype(np.uint8)
        _, parts = cv2.connectedComponents(fits, connectivity=4)
        cell = grid.cell_at(self.site.robot.point)
        return np.asarray((parts == parts[cell.row, cell.col]) & (fits > 0))

    @cached_property
    def places(self) -> Places:
        """The centres of these cells."""
        return self.site.grid.points_at(*np.nonzero(self.standable))

    def is_standable(self, point: Point) -> bool:
        """Return True where the robot fits and gets to."""
        cell = self.site.grid.cell_at(point)
        return self.site.grid.contains(cell) and bool(self.standable[cell.row, cell.col])

    def paths_m(self, start: Point) -> Places:
        """Return the way to each of the places, over eight neighbours, round corners."""
        number = np.full(self.standable.shape, -1, dtype=np.intp)
        number[self.standable] = np.arange(len(self.places))
        ends, costs = [], []
        n_rows, n_cols = self.standable.shape
        for d_row, d_col in ((0, 1), (1, 0), (1, 1), (1, -1)):
            one = number[: n_rows - d_row, max(-d_col, 0) : n_cols - max(d_col, 0)]
            other = number[d_row:, max(d_col, 0) : n_cols + min(d_col, 0)]
            is_both = (one >= 0) & (other >= 0)
            if d_row and d_col:  # no corner of a wall is cut
                level, upright = number[: n_rows - 1], number[1:]
                right, left = slice(1, None), slice(None, n_cols - 1)
                ahead, above = (right, left) if d_col > 0 else (left, right)
                is_both &= (level[:, ahead] >= 0) & (upright[:, above] >= 0)
            ends.append(np.stack([one[is_both], other[is_both]]))
            costs.append(np.full(int(is_both.sum()), math.hypot(d_row, d_col)))
        rows, cols = np.concatenate(ends, axis=1)
        n = len(self.places)
        graph = coo_matrix((np.concatenate(costs), (rows, cols)), shape=(n, n)).tocsr()
        first = int(np.argmin(away(start, self.places)))
        found = dijkstra(graph, directed=False, indices=first)
        return np.asarray(found * self.site.grid.resolution_m)

    @cached_property
    def from_robot_m(self) -> Places:
        """The way from the robot to each of the places."""
        return self.paths_m(self.site.robot.point)

    def way_m(self, ways_m: Places, point: Point) -> float:
        """Return the way to the place nearest to a point."""
        return float(ways_m[int(np.argmin(away(point, self.places)))])

    def sees(self, points: Places, thing: Point) -> Fitting:
        """Return True where all cells between are floor, but for those the thing stands in."""
        grid, n_steps = self.site.grid, 160
        solid = grid.cells != 0 if grid.cells.max() in (0, 100) else ~grid.free
        blocked = np.zeros(len(points), dtype=bool)
        is_open_after = np.zeros(len(points), dtype=bool)
        for share in np.linspace(0, 1, n_steps):
            x = points[:, 0] + share * (thing.x - points[:, 0])
            y = points[:, 1] + share * (thing.y - points[:, 1])
            rows, cols = grid.cells_at(np.stack([x, y], axis=1))
            rows, cols = rows.clip(0, grid.n_rows - 1), cols.clip(0, grid.n_cols - 1)
            is_solid = solid[rows, cols]
            is_open_after |= blocked & ~is_solid
            blocked |= is_solid
        return ~is_open_after

    def in_room(self, room: TrueRoom | None, points: Places) -> Fitting:
        """Return True inside a room's outline."""
        if room is None:
            return np.ones(len(points), dtype=bool)
        inside = np.ones(len(points), dtype=bool)
        for one, other in zip(room.corners, room.corners[1:] + room.corners[:1], strict=True):
            cross = (other.x - one.x) * (points[:, 1] - one.y) - (other.y - one.y) * (
                points[:, 0] - one.x
            )
            inside &= cross >= -0.05 * one.distance_to(other)
        return inside

    def room_at(self, point: Point) -> TrueRoom | None:
        """Return the room that a point lies in."""
        at = np.array([[point.x, point.y]])
        return next((room for room in self.site.rooms if self.in_room(room, at)[0]), None)

    def towards(self, thing: Point, heading_rad: float, away_m: float | None = None) -> Fit:
        """Return what lies in a direction from a point, in its room, with a free view of it."""
        room = self.room_at(thing)

        def fits(points: Places, *, strict: bool) -> Fitting:
            off = angle_off(bearing(thing, points), heading_rad) <= math.radians(
                30 if strict else 45
            )
            return (
                off
                & self.at_distance(thing, away_m)(points, strict=strict)
                & self.near(thing, room, points)
            )

        return fits

    def near(self, thing: Point, room: TrueRoom | None, points: Places) -> Fitting:
        """Return True in the same room and in sight of a point."""
        return self.in_room(room, points) & self.sees(points, thing)

    def at_distance(self, thing: Point, away_m: float | None) -> Fit:
        """Return what is as far from a point as was asked for, or not far where nothing was."""
        cell_m = self.site.grid.resolution_m

        def fits(points: Places, *, strict: bool) -> Fitting:
            found_m = away(thing, points)
            if away_m is not None:
                return np.abs(found_m - away_m) <= (cell_m if strict else max(0.15, 1.6 * cell_m))
            low, high = (0.6, 1.4) if strict else (0.25, 2.6)
            return np.asarray((found_m >= low) & (found_m <= high))

        return fits

    def beside_door(self, door: TrueDoor, side: str, viewer: Point) -> Fit:
        """Return what is left, right, in front or behind of a door as somebody sees it."""
        normal_rad = door.normal_rad
        if math.cos(door.place.bearing_to(viewer) - normal_rad) < 0:
            normal_rad += math.pi
        half_m, cell_m = door.width_m / 2, self.site.grid.resolution_m
        room = self.room_at(viewer)

        def fits(points: Places, *, strict: bool) -> Fitting:
            dx, dy = points[:, 0] - door.place.x, points[:, 1] - door.place.y
            out_m = dx * math.cos(normal_rad) + dy * math.sin(normal_rad)
            right_m = -dx * math.sin(normal_rad) + dy * math.cos(normal_rad)
            if side in ("in front of", "behind"):
                out_m = out_m if side == "in front of" else -out_m
                low, high = (0.8, 1.2) if strict else (0.3, 2.7)
                aside = np.abs(right_m) <= (0.1 if strict else half_m + 0.9 * out_m)
                return (out_m >= low) & (out_m <= high) & aside
            post_m = (right_m if side == "right of" else -right_m) - half_m
            low, high = (0.5, 0.9) if strict else (-cell_m, 2.6)
            is_beside = (post_m >= low) & (post_m <= high)
            steep = np.tan(math.radians(30 if strict else 47)) * (post_m + cell_m)
            is_before = (out_m > 0) & (out_m <= steep + 0.1)
            return np.asarray(is_beside & is_before & self.in_room(room, points))

        return fits

    def out_of_the_way(self, door: TrueDoor, viewer: Point) -> Fit:
        """Return what is beside a door, on the side of a viewer, and not before its opening."""
        room = self.room_at(viewer)

        def fits(points: Places, *, strict: bool) -> Fitting:
            out_m, aside_m = _around(door, viewer, points)
            gap_m = np.hypot(np.maximum(aside_m - door.width_m / 2, 0.0), out_m)
            is_near = gap_m <= (0.8 if strict else 1.7)
            is_aside = aside_m >= door.width_m / 2 + (0.1 if strict else -0.1)
            return np.asarray(is_near & is_aside & (out_m > 0.1) & self.in_room(room, points))

        return fits

    def before_door(self, door: TrueDoor, viewer: Point, away_m: float) -> Fit:
        """Return what is so far from a door, on the side of a viewer."""
        cell_m = self.site.grid.resolution_m

        def fits(points: Places, *, strict: bool) -> Fitting:
            out_m, aside_m = _around(door, viewer, points)
            gap_m = np.hypot(np.maximum(aside_m - door.width_m / 2, 0.0), out_m)
            is_there = np.abs(gap_m - away_m) <= (0.1 * cell_m if strict else max(0.25, cell_m))
            seen_from = np.asarray(aside_m <= 0.1) if strict else np.ones(len(points), dtype=bool)
            return np.asarray(is_there & (out_m > 0) & seen_from)

        return fits


def _around(door: TrueDoor, viewer: Point, points: Places) -> tuple[Places, Places]:
    """Return how far points are before a door, on a viewer's side, and how far beside it."""
    normal_rad = door.normal_rad
    if math.cos(door.place.bearing_to(viewer) - normal_rad) < 0:
        normal_rad += math.pi
    dx, dy = points[:, 0] - door.place.x, points[:, 1] - door.place.y
    out_m = dx * math.cos(normal_rad) + dy * math.sin(normal_rad)
    return out_m, np.abs(-dx * math.sin(normal_rad) + dy * math.cos(normal_rad))
