"""The world model: rooms, doors, frontiers and remembered places of the map, under ids."""

from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from typing import TypeVar
from weakref import WeakKeyDictionary

import cv2
import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMap, TakenPicture
from mapspeak.memory.consistency.checking import MemoryCheck
from mapspeak.memory.things.approach import (
    BEST_OFF_M,
    SPREAD_M,
    Stands,
    find_fronts,
    find_least_path_m,
    find_stands,
    measure_faced,
)
from mapspeak.robot import PoseDoubt
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import (
    NOTHING_TRIED,
    FrontierReport,
    Tried,
    find_frontiers,
    match_frontiers,
    rerank_frontiers,
)
from mapspeak.spatial.paths import DistanceField, Path
from mapspeak.spatial.rooms import Door, RoomMap
from mapspeak.worldmodel.recollection import Recollection, Recollector
from mapspeak.worldmodel.remembered import Judge, RememberedPlace, RememberedThing, number_places
from mapspeak.worldmodel.reported import list_reported
from mapspeak.worldmodel.revision import MapRevision

AROUND_M = 0.5
"""Distance beyond posts and robot radius within which both sides of a door are examined."""


def find_crossing(rooms: RoomMap, distances: DistanceField, door: Door) -> Point | None:
    """Find the place in a door where the robot passes from one side to the other, or None.

    That the middle of a door can be reached is not enough: the robot may stand before it.
    """
    reach_m = door.width_m / 2 + distances.radius_m + AROUND_M
    window = rooms.grid.window_around(door.place, reach_m)
    labels, top, left = rooms.labels[window], window[0].start, window[1].start
    rows = np.arange(top, top + labels.shape[0])[:, np.newaxis]
    cols = np.arange(left, left + labels.shape[1])
    is_reached = np.isfinite(distances.distances_at(rows, cols))
    n_parts, parts = cv2.connectedComponents(is_reached.astype(np.uint8), connectivity=8)
    is_joining = np.arange(n_parts) > 0
    for region_id in door.region_ids:
        inside = is_reached & (labels == rooms.region(region_id).index)
        is_joining &= np.bincount(parts[inside], minlength=n_parts) > 0
    crossing = is_joining[parts]
    if not crossing.any():
        return None
    at_rows, at_cols = np.nonzero(crossing)
    points = rooms.grid.points_at(at_rows + top, at_cols + left)
    off_m = np.hypot(points[:, 0] - door.place.x, points[:, 1] - door.place.y)
    x, y = points[int(np.argmin(off_m))].tolist()
    return Point(x, y)


STEP_M = 0.2
HIDDEN_M2, HIDDEN_RATIO = 8.0, 0.15
"""A frontier that promises so much may lead to another room, or all of them, of the known floor.

What promises less mostly shows corners of rooms that are known. Chosen while the 14 shipped worlds
were explored (`benchmarks/growing_rooms.py`).
"""

Key = TypeVar("Key")
Found = TypeVar("Found")
ThingMap = WeakKeyDictionary[RememberedThing, Found]


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """What was found for all places from which a robot can get to the same floor of one map.

    Attributes:
        start: One of these places.
        crossings: Where it passes each door, by the door's id; None where it does not.
        standing: Where it would stand in each region, by the region's id.
        out_of_reach: The same for regions it cannot get to.
        frontiers: By the places from which it has looked already.
        stands: Where it may stand before a remembered thing, by how far off and what else is near.
        overlooks: From where it would look for one that is not known well enough.
        faced: The share of where a thing may be that it would face there, by the pose.
        fronts: The last floor before a thing, for each who saw it.
        rooms: The rooms before a thing, by id.
        judges: What may be trusted, for a state of the memory.
    """

    start: Point
    crossings: dict[str, Point | None] = field(default_factory=dict)
    standing: dict[str, Point | None] = field(default_factory=dict)
    out_of_reach: dict[str, Point] = field(default_factory=dict)
    frontiers: dict[Tried, FrontierReport] = field(default_factory=dict)
    stands: ThingMap[dict[tuple[float, bytes], Stands]] = field(default_factory=WeakKeyDictionary)
    overlooks: ThingMap[Pose | None] = field(default_factory=WeakKeyDictionary)
    faced: ThingMap[dict[Pose, float]] = field(default_factory=WeakKeyDictionary)
    fronts: ThingMap[list[Point]] = field(default_factory=WeakKeyDictionary)
    rooms: ThingMap[tuple[str, ...]] = field(default_factory=WeakKeyDictionary)
    judges: WeakKeyDictionary[Recollection, Judge] = field(default_factory=WeakKeyDictionary)


def revise(grid: OccupancyGrid, previous: "WorldModel | None", *, radius_m: float) -> MapRevision:
    """Return the state of a map with nothing closed on it: the one before, while it holds."""
    before = None if previous is None else previous.map
    if before is not None and before.is_of(grid):
        return before
    return MapRevision(grid, radius_m=radius_m, previous=before, leaves_pockets=True)


class WorldModel:
    """A state of the map with everything that has an id; parts are computed when first asked for.

    Args:
        tried: What the robot's drives to frontiers have shown.
        previous: The one before, whose ids are kept and whose parts are used where they hold.
        revision: The state of the map, if it is already built.
        recollector: Keeps what is made of the memory; that of `previous` where None.
        pose_doubt: Why the robot may be elsewhere; None for a fresh pose on the map.
        is_radius_assumed: The robot's radius is unknown.
        now: By the calendar of the records; None where that is not known.
        pictures: Those that can be referred to, the oldest first.

    Attributes:
        warnings: What a reader of the memory should know.
        start: Where the robot was in the first state of this map.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        robot: Pose,
        memory: SemanticMap,
        *,
        radius_m: float,
        tried: Tried = NOTHING_TRIED,
        previous: "WorldModel | None" = None,
        revision: MapRevision | None = None,
        recollector: Recollector | None = None,
        pose_doubt: PoseDoubt | None = None,
        is_radius_assumed: bool = False,
        now: datetime | None = None,
        pictures: Sequence[TakenPicture] = (),
    ) -> None:
        self.map: MapRevision = revision or revise(grid, previous, radius_m=radius_m)
        self.robot = robot
        self.pose_doubt = pose_doubt
        self.is_radius_assumed = is_radius_assumed
        self.now = now
        self.pictures = tuple(pictures)
        self.memory: SemanticMap = memory
        # Before the first record, and while the memory cannot be read, a map has no id.
        map_ids = {None, memory.map_id, None if previous is None else previous.memory.map_id}
        self.start: Pose = previous.start if previous and len(map_ids) <= 2 else robot
        self.places: tuple[RememberedPlace, ...] = (
            previous.places
            if previous is not None and previous.memory.waypoints == memory.waypoints
            else number_places(memory.waypoints, () if previous is None else previous.places)
        )
        self.warnings = memory.warnings
        self.recollector: Recollector = recollector or (
            Recollector() if previous is None else previous.recollector
        )
        self._tried = tried
        self._previous_frontiers = None if previous is None else previous.latest_frontiers
        has_only_moved = previous is not None and previous.map is self.map
        self._earlier_reach = previous.latest_reach if previous and has_only_moved else None

    @property
    def grid(self) -> OccupancyGrid:
        """The map."""
        return self.map.grid

    @property
    def radius_m(self) -> float:
        """Of the robot."""
        return self.map.radius_m

    @property
    def rooms(self) -> RoomMap:
        """Rooms, corridors, open spaces and doors."""
        return self.map.rooms

    @property
    def distances(self) -> DistanceField:
        """Path distances from the robot."""
        return self.map.distances_from(self.robot.point)

    @cached_property
    def reach(self) -> Reach:
        """What depends on where the robot can get to, and not on where it is."""
        earlier = self._earlier_reach
        if earlier is not None and self.distances.is_reachable(earlier.start):
            return earlier
        return Reach(self.robot.point)

    @cached_property
    def frontiers(self) -> FrontierReport:
        """Where the known meets the unknown, best first; poses stay while the map does."""
        known = self.reach.frontiers.get(self._tried)
        moved = None if known is None else rerank_frontiers(known, self.distances)
        if moved is not None:
            return moved
        found = find_frontiers(
            self.grid,
            self.robot.point,
            radius_m=self.radius_m,
            distances=self.distances,
            tried=self._tried,
        )
        earlier = self._previous_frontiers
        named = found if earlier is None else match_frontiers(earlier, found)
        self.reach.frontiers[self._tried] = named
        return named

    @property
    def latest_frontiers(self) -> FrontierReport | None:
        """The frontiers found last; finds none anew."""
        found: FrontierReport | None = self.__dict__.get("frontiers", self._previous_frontiers)
        return found

    @property
    def latest_reach(self) -> Reach | None:
        """The reach of this world model, or of one before it on the same map."""
        found: Reach | None = self.__dict__.get("reach", self._earlier_reach)
        return found

    def path_m(self, point: Point) -> float | None:
        """Return the metres the robot has to drive to a point; None where it cannot get to."""
        return self.distances.distance_to(point)

    def find_room_id(self, point: Point) -> str | None:
        """Return the id of the room or corridor a point lies in."""
        region = self.rooms.find_region_at(point)
        return None if region is None else region.id

    def find_crossing(self, door: Door) -> Point | None:
        """Find where the robot passes a door; None where it does not get through."""
        return _keep(
            self.reach.crossings,
            door.id,
            lambda: find_crossing(self.rooms, self.distances, door),
        )

    @cached_property
    def recollection(self) -> Recollection:
        """What is remembered, joined with the map: things, and the index to find them."""
        return self.recollector.recollect(self.memory, self.grid)

    @property
    def things(self) -> tuple[RememberedThing, ...]:
        """Remembered things, in the order of their ids."""
        return self.recollection.things

    def join_reported(self, labels: Iterable[str]) -> tuple[RememberedThing, ...]:
        """Return the things of some labels that the robot's detector reported in pictures."""
        found, joiner = self.recollection.found, self.recollector.reports
        return joiner.join(labels, self.pictures, self.grid, sight_of=found)

    def find_reported(self, words: str) -> tuple[RememberedThing, ...]:
        """Return the things called so that the robot's detector alone reported, in pictures."""
        labels = list_reported(self.pictures)
        return self.join_reported(self.recollector.reports.index.find_called(words, labels))

    @property
    def judge(self) -> Judge:
        """Says how far what is remembered may be trusted, and what is odd about it."""
        return _keep(self.reach.judges, self.recollection, self._judge)

    def _judge(self) -> Judge:
        # What is closed for now says nothing against a record of what lies behind it.
        distances = self.map.open.distances_from(self.robot.point)
        unseen = self.recollection.unseen
        return Judge(MemoryCheck(self.memory, unseen, distances=distances, rooms=self.rooms))

    def follow(self, remembered: RememberedThing) -> RememberedThing:
        """Return a thing as it is by now: one that was moved under the id of its new place."""
        moved = self.recollection.unseen.find_moved(remembered.thing)
        if moved is None:
            return remembered
        return next(each for each in self.things if each.thing is moved)

    def find_approach(
        self, remembered: RememberedThing, *, off_m: float = BEST_OFF_M
    ) -> Pose | None:
        """Find where the robot stands to face a thing from about so far; None where it cannot."""
        thing = remembered.thing
        if (position := thing.position) is None:
            return None
        others = self.recollection.find_around(position, off_m + SPREAD_M)
        stands = _keep(
            self.reach.stands.setdefault(remembered, {}),
            (off_m, others.tobytes()),
            lambda: find_stands(
                self.recollection.found.sight,
                self.distances,
                position,
                _seen_from(remembered),
                fronts=self.find_fronts(remembered),
                whereabouts=thing.whereabouts,
                others=others,
                off_m=off_m,
            ),
        )
        return stands.choose(self.distances)

    def find_least_path_m(self, remembered: RememberedThing) -> float:
        """Return metres than which no way to look at a thing is shorter."""
        seen_from = _seen_from(remembered)
        return find_least_path_m(self.grid, self.distances, remembered.point, seen_from)

    def measure_faced(self, remembered: RememberedThing) -> float:
        """Return the share of where a thing may be that the robot would face before it."""
        pose, whereabouts = self.find_approach(remembered), remembered.thing.whereabouts
        if pose is None or whereabouts is None:
            return 0.0
        sight, seen_from = self.recollection.found.sight, _seen_from(remembered)
        return _keep(
            self.reach.faced.setdefault(remembered, {}),
            pose,
            lambda: measure_faced(sight, pose, seen_from, whereabouts),
        )

    def rooms_before(self, remembered: RememberedThing) -> tuple[str, ...]:
        """Return the rooms a thing may be in, by id: those on the side that it was seen from."""
        fronts, seen_from = self.find_fronts(remembered), _seen_from(remembered)
        return _keep(
            self.reach.rooms,
            remembered,
            lambda: tuple(
                dict.fromkeys(filter(None, map(self._find_room_on_line, fronts, seen_from)))
            ),
        )

    def find_fronts(self, remembered: RememberedThing) -> list[Point]:
        """Return the last floor before a thing for each who saw it, or where these stood."""
        seen_from, position = _seen_from(remembered), remembered.thing.position
        if position is None:
            return seen_from
        sight = self.recollection.found.sight
        lines = [(place, position) for place in seen_from]
        return _keep(self.reach.fronts, remembered, lambda: find_fronts(sight, lines))

    def _find_room_on_line(self, end: Point, start: Point) -> str | None:
        """Return the room of the last floor on a line: what hangs on a wall is in none itself."""
        points = Path.through((end, start)).sampled(STEP_M)
        return next(filter(None, map(self.find_room_id, points)), None)

    @cached_property
    def growth_m2(self) -> Mapping[str, float]:
        """How much more floor the frontiers of a region promise, if it borders on the unknown."""
        growth_m2: dict[str, float] = {}
        for refused in self.frontiers.refused:
            growth_m2.setdefault(self.find_room_id(refused.anchor) or "", 0.0)
        for frontier in self.frontiers.frontiers:
            for room_id in {self.find_room_id(at) for at in (frontier.pose.point, frontier.anchor)}:
                growth_m2[room_id or ""] = growth_m2.get(room_id or "", 0.0) + frontier.gain_m2
        growth_m2.pop("", None)
        return growth_m2

    @property
    def may_hide_rooms(self) -> bool:
        """True while frontiers promise as much floor as another room has."""
        gains_m2 = [frontier.gain_m2 for frontier in self.frontiers.frontiers]
        known_m2 = sum(region.floor_area_m2 for region in self.rooms.regions)
        return max(gains_m2, default=0.0) >= HIDDEN_M2 or sum(gains_m2) > HIDDEN_RATIO * known_m2


def _keep(known: MutableMapping[Key, Found], key: Key, find: Callable[[], Found]) -> Found:
    """Return what is known under a key; find it where nothing is."""
    if key not in known:
        known[key] = find()
    return known[key]


def _seen_from(remembered: RememberedThing) -> list[Point]:
    return [view.place for view in remembered.thing.supporting]
