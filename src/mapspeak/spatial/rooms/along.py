"""Walk along a corridor: its doors in order, and the side of each."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.spatial.grid import FloatArray, OccupancyGrid
from mapspeak.spatial.paths import DistanceField, distances_from, known_clearance_m
from mapspeak.spatial.paths.lattice import measure_away
from mapspeak.spatial.rooms.room_map import Door, Region, RoomMap

AHEAD_RAD = math.radians(50)
"""A door within this of the walking direction is ahead, not beside."""
CELL_M = 0.25
"""Fine enough to walk by: a person's corridor is several such cells wide."""
END_RATIO = 0.42
"""Ends keep this share of the corridor's width from walls; half would be the middle."""
STEP_M = 0.05
SLICE_M = 0.6
"""Length of the slices of a corridor; the middle of each is a point of the walk."""
TANGENT_M = 3.0
"""Length of walk over which the walking direction is taken."""
WALL_M = 0.5
"""Thickest wall between a walk and a door beside it."""


class DoorSide(StrEnum):
    """Position of a door relative to the walk."""

    LEFT = "left"
    RIGHT = "right"
    AHEAD = "at the end"
    BEHIND = "at the start"
    ELSEWHERE = "elsewhere in it"


@dataclass(frozen=True, slots=True, kw_only=True)
class PassedDoor:
    """A door of a corridor.

    Attributes:
        along_m: From the start of the walk, along it, to the point nearest to the door.
        side: Its side; elsewhere if the walk does not pass it, because the corridor branches or
            leads all around.
    """

    door_id: str
    region_id: str
    along_m: float
    side: DoorSide


@dataclass(frozen=True, slots=True, kw_only=True)
class CorridorWalk:
    """A walk from one end of a region to the other.

    Attributes:
        start: One end; of the two the one with the smaller x + y, so that it stays the same.
        stops: The doors in the order in which they come.
    """

    start: Point
    end: Point
    middle: Point
    heading_rad: float
    end_heading_rad: float
    length_m: float
    stops: tuple[PassedDoor, ...]


def walk_along(rooms: RoomMap, region: Region) -> CorridorWalk | None:
    """Walk a region from end to end, past all its doors; None where it has no length.

    The ends are the two places farthest from each other by path, and the walk leads through the
    middles of cells equally far from its start, near the shortest way to its end. So it stays on
    the floor of a corridor that branches, or leads all around.
    """
    floor = _floor_of(rooms, region)
    reached = _distances_from_end(floor, region)
    if reached is None:
        return None
    line = _straighten_ends(_find_middle_line(*reached), most_off_m=region.width_m / 2)
    doors = [door for door in rooms.doors if region.id in door.region_ids]
    stops = [_stop_at(line, region, door) for door in doors]
    return CorridorWalk(
        start=line.point_at(0.0),
        end=line.point_at(line.length_m),
        middle=line.point_at(line.length_m / 2),
        heading_rad=line.heading_at(0.0),
        end_heading_rad=line.heading_at(line.length_m),
        length_m=line.length_m,
        stops=tuple(sorted(stops, key=lambda stop: (stop.along_m, stop.door_id))),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Line:
    """Points of a way, shape (n, 2), and how far along it each is, in metres."""

    points: FloatArray
    along_m: FloatArray

    @property
    def length_m(self) -> float:
        return float(self.along_m[-1])

    def point_at(self, along_m: float) -> Point:
        x, y = (float(np.interp(along_m, self.along_m, self.points[:, axis])) for axis in (0, 1))
        return Point(x, y)

    def heading_at(self, along_m: float) -> float:
        half_m = TANGENT_M / 2
        middle_m = min(max(along_m, half_m), max(self.length_m - half_m, self.length_m / 2))
        return self.point_at(middle_m - half_m).bearing_to(self.point_at(middle_m + half_m))

    def nearest_to(self, point: Point) -> float:
        along_m = np.arange(0.0, self.length_m + STEP_M, STEP_M)
        xs, ys = (np.interp(along_m, self.along_m, self.points[:, axis]) for axis in (0, 1))
        return float(along_m[int(np.argmin(np.hypot(xs - point.x, ys - point.y)))])


def _floor_of(rooms: RoomMap, region: Region) -> OccupancyGrid:
    """Return the region's floor with its furniture alone, in cells to walk by."""
    window = rooms.window_of(region)
    here = rooms.grid.crop(*window)
    n = max(round(CELL_M / here.resolution_m), 1)
    is_floor = rooms.labels[window][n // 2 :: n, n // 2 :: n] == region.index
    return OccupancyGrid(
        cells=np.where(is_floor, 0, 100).astype(np.int8),
        resolution_m=n * here.resolution_m,
        origin=here.origin,
    )


def _distances_from_end(
    floor: OccupancyGrid, region: Region
) -> tuple[FloatArray, FloatArray] | None:
    """Return points of the floor, shape (n, 2), and how far each is from one end of it."""
    clear_m = known_clearance_m(floor)
    enough_m = min(END_RATIO * region.width_m, float(clear_m.max(initial=0.0)))
    candidates = floor.points_at(*np.nonzero(floor.free & (clear_m >= enough_m)))
    from_middle = distances_from(floor, region.widest, radius_m=0.0)
    one = _farthest(from_middle, candidates)
    if one is None:
        return None
    distances = from_middle.from_elsewhere(one)
    other = _farthest(distances, candidates) or one
    way = distances.way_to(other) or (one,)
    is_way = np.zeros(floor.cells.shape, dtype=np.bool_)
    is_way[floor.cells_at(np.array([[point.x, point.y] for point in way]))] = True
    is_near = measure_away(is_way) * floor.resolution_m <= region.width_m
    rows, cols = np.nonzero(floor.free & is_near)
    away_m = distances.distances_at(rows, cols)
    is_reached = np.isfinite(away_m)
    points, away_m = floor.points_at(rows[is_reached], cols[is_reached]), away_m[is_reached]
    if float(away_m.max()) < 2 * SLICE_M:
        return None
    is_start = (one.x + one.y, one.x) <= (other.x + other.y, other.x)
    if is_start:
        return points, away_m
    whole_m = distances.distance_to(other) or 0.0
    return points, np.maximum(whole_m - away_m, 0.0)


def _farthest(distances: DistanceField, candidates: FloatArray) -> Point | None:
    away_m = distances.distances_at(*distances.lattice.grid.cells_at(candidates))
    if not np.isfinite(away_m).any():
        return None
    x, y = candidates[int(np.argmax(np.where(np.isfinite(away_m), away_m, -1.0)))].tolist()
    return Point(x, y)


def _find_middle_line(points: FloatArray, away_m: FloatArray) -> _Line:
    """Return the middle of each slice of equally far points."""
    n = max(round(float(away_m.max()) / SLICE_M), 2)
    number = np.minimum((away_m / away_m.max() * n).astype(np.intp), n - 1)
    sizes = np.bincount(number, minlength=n)
    means = [
        np.bincount(number, weights=values, minlength=n)[sizes > 0] / sizes[sizes > 0]
        for values in (points[:, 0], points[:, 1], away_m)
    ]
    return _stretch(np.stack(means[:2], axis=1), means[2] - means[2][0])


def _stretch(points: FloatArray, along_m: FloatArray) -> _Line:
    """Return the line: means of slices shorten a way, and none is shorter than straight."""
    straight_m = math.hypot(*(points[-1] - points[0]))
    stretch = max(1.0, straight_m / max(float(along_m[-1]), SLICE_M))
    return _Line(points, along_m * stretch)


def _straighten_ends(line: _Line, *, most_off_m: float) -> _Line:
    """Return the line with both ends on the straight way that leads up to them.

    What is as far from an end lies on an arc around it, often more of it on one side: there the
    middles of slices lead askew past doors. Ends farther off that way lie in a bend, and stay.
    """
    cut_m = min(TANGENT_M / 2, line.length_m / 4)
    reach_m = min(TANGENT_M, line.length_m - 2 * cut_m)
    is_inner = np.abs(line.along_m - line.length_m / 2) <= line.length_m / 2 - cut_m
    known = [(line.points[is_inner], line.along_m[is_inner])]
    for sign, is_end in ((1, line.along_m < cut_m), (-1, line.along_m > line.length_m - cut_m)):
        from_m = cut_m if sign > 0 else line.length_m - cut_m
        corner = line.point_at(from_m)
        inward = Pose(
            corner.x, corner.y, corner.bearing_to(line.point_at(from_m + sign * reach_m))
        ).inverse()
        ahead_m, aside_m = np.array(
            [
                (at.x, at.y)
                for at in (inward.transform(Point(*xy)) for xy in line.points[is_end].tolist())
            ]
        ).T
        if np.abs(aside_m).max() > most_off_m:
            known.append((line.points[is_end], line.along_m[is_end]))
            continue
        out_m = float(ahead_m.min())
        end = inward.inverse().transform(Point(out_m, 0.0))
        ends = np.array([[corner.x, corner.y], [end.x, end.y]])
        known.append((ends, np.array([from_m, from_m + sign * out_m])))
    points, along_m = (np.concatenate(each) for each in zip(*known, strict=True))
    order = np.argsort(along_m, kind="stable")
    return _stretch(points[order], along_m[order] - along_m.min())


def _stop_at(line: _Line, region: Region, door: Door) -> PassedDoor:
    along_m = line.nearest_to(door.place)
    to_door_rad = line.point_at(along_m).bearing_to(door.place)
    turn_rad = wrap_angle(to_door_rad - line.heading_at(along_m))
    is_beside = line.point_at(along_m).distance_to(door.place) <= region.width_m + WALL_M
    one, other = door.region_ids
    return PassedDoor(
        door_id=door.id,
        region_id=other if one == region.id else one,
        along_m=along_m,
        side=_side_of(turn_rad, along_m, line.length_m - along_m)
        if is_beside
        else DoorSide.ELSEWHERE,
    )


def _side_of(turn_rad: float, from_start_m: float, from_end_m: float) -> DoorSide:
    if from_end_m <= TANGENT_M / 2 and abs(turn_rad) <= AHEAD_RAD:
        return DoorSide.AHEAD
    if from_start_m <= TANGENT_M / 2 and abs(turn_rad) >= math.pi - AHEAD_RAD:
        return DoorSide.BEHIND
    return DoorSide.LEFT if turn_rad > 0 else DoorSide.RIGHT
