"""Check records against the map, their rooms and each other."""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import chain, compress, product

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory.consistency.filing import FARTHEST_M, check_rooms, file_of, find_misfiled
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding
from mapspeak.memory.consistency.unseen import UnseenThings, find_near
from mapspeak.memory.things.approach import find_fronts
from mapspeak.memory.things.finding import Things
from mapspeak.memory.things.labels import name_the_same
from mapspeak.memory.things.sight import BODY_M, OWN_M, SightMap
from mapspeak.memory.things.thing import NOISE, Thing
from mapspeak.memory.waypoint import Landmark, SemanticMap, Waypoint
from mapspeak.spatial import FREE_MAX, UNKNOWN, OccupancyGrid
from mapspeak.spatial.paths import DistanceField
from mapspeak.spatial.rooms import Region, RoomMap


def check_pose(
    grid: OccupancyGrid, waypoint: Waypoint, distances: DistanceField | None, map_id: str | None
) -> Iterator[MemoryFinding]:
    """Return findings about the position of a waypoint."""
    of, point = (waypoint.name,), waypoint.pose.point
    if waypoint.map_id is not None and map_id is not None and waypoint.map_id != map_id:
        ids = (waypoint.map_id, map_id)
        yield MemoryFinding(kind=FindingKind.OTHER_MAP, waypoints=of, ids=ids)
    ground = _ground_at(grid, point)
    if ground is not None:
        yield MemoryFinding(kind=ground, waypoints=of, at=point)
    elif distances is not None and not distances.is_reachable(point):
        radius_m = distances.radius_m
        yield MemoryFinding(kind=FindingKind.UNREACHABLE, waypoints=of, at=point, radius_m=radius_m)


def _ground_at(grid: OccupancyGrid, point: Point) -> FindingKind | None:
    if max(abs(point.x), abs(point.y)) > FARTHEST_M:
        return FindingKind.OFF_MAP
    cell = grid.cell_at(point)
    if not grid.contains(cell):
        return FindingKind.OFF_MAP
    occupancy = int(grid.cells[cell.row, cell.col])
    if occupancy > FREE_MAX:
        return FindingKind.IN_OBSTACLE
    return FindingKind.IN_UNKNOWN if occupancy == UNKNOWN else None


N_SIGMAS = 2.0


def check_rays(found: Things, waypoint: Waypoint) -> Iterator[MemoryFinding]:
    """Return landmarks of a waypoint that lie behind a wall or in unseen space."""
    for stand in waypoint.standpoints:
        for landmark in stand.landmarks:
            kind_at = None if landmark.bearing_rad is None else _check(found, stand, landmark)
            if kind_at is not None:
                kind, open_m = kind_at
                yield MemoryFinding(
                    kind=kind,
                    waypoints=(waypoint.name,),
                    label=landmark.label,
                    told_m=landmark.range_m,
                    open_m=open_m,
                )


def _check(found: Things, stand: Waypoint, landmark: Landmark) -> tuple[FindingKind, float] | None:
    """Return a finding about a landmark's line of sight and its free length; None if it is fine."""
    way = stand.pose.yaw_rad + (landmark.bearing_rad or 0.0)
    open_m = _open_m(found, stand, way)
    if open_m <= OWN_M:
        return None  # A waypoint in an obstacle is another finding.
    if _ends_in_unknown(found, stand, way, open_m):
        is_beyond = landmark.range_m is None or landmark.range_m > open_m
        return (FindingKind.THROUGH_UNKNOWN, open_m) if is_beyond else None
    if landmark.range_m is None:
        return None
    spread_m = NOISE.range_m + NOISE.range_ratio * landmark.range_m
    # The farthest view within the noise of the direction.
    sigma_rad = NOISE.bearing_rad_of(landmark)
    turns = (-sigma_rad, 0.0, sigma_rad)
    widest_m = max(_open_m(found, stand, way + turn_rad) for turn_rad in turns)
    is_behind = landmark.range_m > widest_m + BODY_M + N_SIGMAS * spread_m
    return (FindingKind.BEHIND_WALL, open_m) if is_behind else None


def _open_m(found: Things, stand: Waypoint, way: float) -> float:
    return found.open_m(stand, _along(stand.pose, way))


def _along(pose: Pose, way: float) -> Point:
    return Point(pose.x + math.cos(way), pose.y + math.sin(way))


def _ends_in_unknown(found: Things, waypoint: Waypoint, way: float, open_m: float) -> bool:
    grid = found.sight.grid
    if open_m >= NOISE.reach_m:
        return False
    if found.is_over_furniture(waypoint, _along(waypoint.pose, way)):
        return False  # What is unknown there is the furniture itself, which may be the thing.
    pose = waypoint.pose
    end = grid.cell_at(Point(pose.x + open_m * math.cos(way), pose.y + open_m * math.sin(way)))
    if not grid.contains(end):
        return True
    around = grid.cells[max(end.row - 1, 0) : end.row + 2, max(end.col - 1, 0) : end.col + 2]
    # A ray that grazes a wall may end in the unknown behind it.
    return int(grid.cells[end.row, end.col]) == UNKNOWN and not (around > FREE_MAX).any()


TWIN_M = 0.3
TWIN_RAD = math.radians(15)
ONE_PLACE_M = 0.5


def check_duplicates(waypoints: Sequence[Waypoint]) -> Iterator[MemoryFinding]:
    """Return pairs of waypoints with nearly the same pose and landmarks."""
    at = np.array([(each.pose.x, each.pose.y) for each in waypoints]).reshape(-1, 2)
    for i, waypoint in enumerate(waypoints):
        for j in find_near(at[:i], at[i], TWIN_M).tolist():
            other = waypoints[j]
            turn_rad = abs(wrap_angle(waypoint.pose.yaw_rad - other.pose.yaw_rad))
            named = _labels(waypoint)
            if turn_rad <= TWIN_RAD and named and named == _labels(other):
                yield MemoryFinding(
                    kind=FindingKind.DUPLICATE,
                    waypoints=(other.name, waypoint.name),
                    far_m=other.pose.point.distance_to(waypoint.pose.point),
                )


def _labels(waypoint: Waypoint) -> list[str]:
    return sorted(each.label.casefold() for each in waypoint.landmarks)


class MemoryCheck:
    """What speaks against what is remembered: worked out for what is asked for, and kept.

    Args:
        distances: From the robot, to check that places can be reached; None skips that check.
    """

    def __init__(
        self,
        places: SemanticMap,
        unseen: UnseenThings,
        *,
        distances: DistanceField | None = None,
        rooms: RoomMap | None = None,
    ) -> None:
        self._places = places
        self._unseen = unseen
        self._distances = distances
        self._rooms = rooms
        # By identity: to compare things as values is slow.
        self._against: dict[int, list[MemoryFinding]] = {}

    @cached_property
    def findings(self) -> tuple[MemoryFinding, ...]:
        """All findings: in the order of the places, then of things the weightiest first."""
        waypoints, placed = self._places.waypoints, self._unseen.placed
        of_things = [
            each
            for thing in placed
            for each in self._find_against(thing)
            if each.things[0] is thing
        ]
        of_things.sort(key=lambda each: each.weight)
        of_places = chain.from_iterable(map(self._check_place, waypoints))
        return (*of_places, *check_duplicates(waypoints), *of_things)

    def find_of_place(self, waypoint: Waypoint) -> tuple[MemoryFinding, ...]:
        """Return what speaks against a record itself, in the order of all findings."""
        return tuple(each for each in self._check_place(waypoint) if not each.things)

    def find_of_thing(self, thing: Thing) -> tuple[MemoryFinding, ...]:
        """Return what speaks against a thing and its records, in the order of all findings."""
        seen_from = sorted(self._numbers[name] for name in thing.waypoints)
        of_places = (
            finding
            for number in seen_from
            for finding in self._check_place(self._places.waypoints[number])
            if not finding.things or any(each is thing for each in finding.things)
        )
        return (*of_places, *self._find_against(thing))

    def _find_against(self, thing: Thing) -> Sequence[MemoryFinding]:
        number = self._unseen.numbers.get(id(thing))
        if number is None:
            return ()
        if id(thing) not in self._against:
            self._against[id(thing)] = [
                *self._two_labels(number),
                *_points_past(thing),
                *self._unseen.find(thing),
            ]
        return self._against[id(thing)]

    def _check_place(self, waypoint: Waypoint) -> Iterator[MemoryFinding]:
        found = self._unseen.found
        of_pose = list(check_pose(found.sight.grid, waypoint, self._distances, self._places.map_id))
        yield from of_pose
        if of_pose and of_pose[-1].kind is FindingKind.OFF_MAP:
            return
        yield from check_rays(found, waypoint)
        if self._rooms is not None:
            filing = file_of(self._rooms, waypoint)
            seen = self._unseen.seen_from.get(waypoint.name, ())
            # All records are compared only where this one may be misfiled.
            misfiled = self._misfiled if filing and filing[0].id != filing[1].id else {}
            yield from check_rooms(self._rooms, waypoint, seen, misfiled)

    def _two_labels(self, number: int) -> Iterator[MemoryFinding]:
        """Return which things are in the place of one and called otherwise."""
        placed, at = self._unseen.placed, self._unseen.at
        near = find_near(at, at[number], ONE_PLACE_M).tolist()
        pairs = [(placed[min(each, number)], placed[max(each, number)]) for each in near]
        pairs = [
            (one, two)
            for one, two in pairs
            if set(one.waypoints).isdisjoint(two.waypoints)
            and not name_the_same(two.label, one.label)
        ]
        for one, two in _find_sharing_a_side(self._unseen.found, self._rooms, pairs):
            yield MemoryFinding(
                kind=FindingKind.TWO_LABELS,
                waypoints=(*one.waypoints, *two.waypoints),
                things=(one, two),
            )

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {each.name: number for number, each in enumerate(self._places.waypoints)}

    @cached_property
    def _misfiled(self) -> Mapping[str, tuple[Region, Region]]:
        return find_misfiled(self._rooms, self._places.waypoints) if self._rooms else {}


def _find_sharing_a_side(
    found: Things, rooms: RoomMap | None, pairs: Sequence[tuple[Thing, Thing]]
) -> Iterator[tuple[Thing, Thing]]:
    """Return the pairs before both of which the floor is in one room, with no wall between."""
    things = {id(each): each for each in chain.from_iterable(pairs)}
    seen = [(key, view.place) for key, each in things.items() for view in each.supporting]
    lines = [(place, things[key].position or place) for key, place in seen]
    fronts: defaultdict[int, list[Point]] = defaultdict(list)
    for (key, _), front in zip(seen, find_fronts(found.sight, lines), strict=True):
        fronts[key].append(front)
    between = [
        (i, *ends)
        for i, (one, two) in enumerate(pairs)
        for ends in product(fronts[id(one)], fronts[id(two)])
    ]
    is_open = _are_open([ends for _, *ends in between], found.sight)
    is_shared = {
        i
        for i, start, end in compress(between, is_open)
        if not _are_in_two_rooms(rooms, start, end)
    }
    return (pair for i, pair in enumerate(pairs) if i in is_shared)


def _are_open(lines: Sequence[Sequence[Point]], sight: SightMap) -> Sequence[bool]:
    """Return for each line True where nothing that one cannot see over is on it."""
    ends = np.array([(start.x, start.y, end.x, end.y) for start, end in lines]).reshape(-1, 4)
    away = ends[:, 2:] - ends[:, :2]
    away_m = np.hypot(away[:, 0], away[:, 1])
    angles = np.arctan2(away[:, 1], away[:, 0]) - sight.grid.origin.yaw_rad
    starts = sight.grid.fractional_cells_at(ends[:, :2])
    open_m = sight.cast(sight.wall_off, starts, angles, begin_m=0.0, reach_m=away_m)
    is_open: list[bool] = (open_m >= away_m - sight.grid.resolution_m).tolist()
    return is_open


def _are_in_two_rooms(rooms: RoomMap | None, start: Point, end: Point) -> bool:
    if rooms is None:
        return False
    one, two = map(rooms.find_region_at, (start, end))
    return one is not None and two is not None and one.id != two.id


def _points_past(thing: Thing) -> Iterator[MemoryFinding]:
    for view in thing.conflicting:
        yield MemoryFinding(
            kind=FindingKind.POINTS_PAST,
            waypoints=(view.waypoint,),
            label=view.landmark.label,
            things=(thing,),
            view=view,
        )


def check_memory(
    places: SemanticMap,
    found: Things,
    *,
    distances: DistanceField | None = None,
    rooms: RoomMap | None = None,
) -> tuple[MemoryFinding, ...]:
    """Return all findings about a memory, as `MemoryCheck` has them."""
    unseen = UnseenThings(places, found)
    return MemoryCheck(places, unseen, distances=distances, rooms=rooms).findings
