"""Looks that should have shown a thing and did not, and things that stand elsewhere since."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from datetime import datetime
from functools import cached_property
from itertools import count, islice, repeat, zip_longest

import numpy as np

from mapspeak.geometry import Point, wrap_angle
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding, judge_trust
from mapspeak.memory.merging import NEAR_M, SAME_BEARING_RAD, find_cone, find_named
from mapspeak.memory.things.finding import Things
from mapspeak.memory.things.labels import group_names, name_the_same
from mapspeak.memory.things.thing import Thing
from mapspeak.memory.waypoint import Landmark, SemanticMap, Waypoint
from mapspeak.spatial.grid import FloatArray, IntArray, Mask

LEAST_SHOWN_RATIO = 0.25
"""A look that shows a thing less likely says nothing of it."""
MOVED_RATIO = 0.5
"""A thing that later looks leave less likely may be the one of its name that is seen elsewhere."""


class UnseenThings:
    """Finds things that looks should have shown, and those that may have been moved.

    Each thing is looked into once, when it is first asked for.

    Args:
        earlier: Those of before: what depends on no changed look or thing is taken from them. The
            answer is the same without.

    Attributes:
        found: All things.
        placed: Those with a position, in the order of all.
        at: Where these are, shape (n, 2), metres.
        numbers: Of these, by their identity.
        looks: The waypoints by name.
        known: What looks say against each thing that was looked into, by its identity.
    """

    def __init__(
        self, places: SemanticMap, found: Things, *, earlier: "UnseenThings | None" = None
    ) -> None:
        self._waypoints = places.waypoints
        self.looks = {each.name: each for each in places.waypoints}
        self.found = found
        self.placed = [thing for thing in found.things if thing.position is not None]
        self.numbers = dict(zip(map(id, self.placed), count(), strict=False))
        known = {} if earlier is None else earlier.numbers
        # The number of each among the earlier ones; -1 for a new one.
        came_from = np.fromiter(map(known.get, self.numbers, repeat(-1)), np.intp)
        self.at = self._place(earlier, came_from)
        self._looks_at = np.full((len(self._waypoints), 5), np.nan)
        before = () if earlier is None else earlier._waypoints  # noqa: SLF001 - of this class
        if earlier is not None:
            self._looks_at[: len(before)] = earlier._looks_at[: len(self._waypoints)]  # noqa: SLF001
        others = list[Waypoint]()
        for i, (look, then) in enumerate(zip_longest(self._waypoints, before)):
            if look is not then:
                others += filter(None, (look, then))
                if look is not None:
                    pose = look.pose
                    self._looks_at[i] = pose.x, pose.y, pose.yaw_rad, np.nan, np.nan
        self.known: dict[int, tuple[MemoryFinding, ...]] = {}
        if earlier is not None and earlier.known:
            self._take_over(earlier, came_from, others)

    def _place(self, earlier: "UnseenThings | None", came_from: IntArray) -> FloatArray:
        """Return where the things are; what is known of the very same ones is taken over."""
        at = np.empty((len(self.placed), 2))
        if earlier is not None:
            at[came_from >= 0] = earlier.at[came_from[came_from >= 0]]
        for number in np.flatnonzero(came_from < 0).tolist():
            position = self.placed[number].position
            assert position is not None  # noqa: S101 - those without one are not placed
            at[number] = position.x, position.y
        return at

    def _take_over(
        self, earlier: "UnseenThings", came_from: IntArray, others: Iterable[Waypoint]
    ) -> None:
        """Take over what depends on none of the other looks, nor on a changed thing."""
        new = [self.placed[number] for number in np.flatnonzero(came_from < 0).tolist()]
        is_gone = np.ones(len(earlier.placed), dtype=np.bool_)
        is_gone[came_from[came_from >= 0]] = False
        changed = [earlier.placed[number] for number in np.flatnonzero(is_gone).tolist()] + new
        names = {name for thing in changed for name in thing.waypoints}
        before = {name: earlier.seen_from.get(name, ()) for name in names}
        seen_from = {
            name: [each for each in things if id(each) in self.numbers]
            for name, things in before.items()
        }
        for thing in new:
            for name in thing.waypoints:
                seen_from[name].append(thing)
        for things in seen_from.values():
            things.sort(key=lambda each: self.numbers[id(each)])
        self.seen_from = earlier.seen_from | seen_from
        looks, looked = self.looks, earlier.looks
        names.update(each.name for each in others if looks.get(each.name) != looked.get(each.name))
        is_stale = np.zeros(len(self.placed), dtype=np.bool_)
        for look in filter(None, (each.get(name) for each in (looks, looked) for name in names)):
            is_stale[find_near(self.at, (look.pose.x, look.pose.y), NEAR_M)] = True
        for known, findings in earlier.known.items():
            number = self.numbers.get(known)
            if number is not None and not is_stale[number]:
                self.known[known] = findings

    def find(self, thing: Thing) -> Iterator[MemoryFinding]:
        """Return the findings about one placed thing: what looks miss, then whether it moved."""
        yield from self._unseen(thing)
        yield from self._moved(thing)

    def find_moved(self, old: Thing) -> Thing | None:
        """Return what one that is gone is by now: the only thing of its name that is new since."""
        if id(old) not in self.numbers or not self._is_gone(old):
            return None
        others = self._find_partners(old)
        is_it = len(others) == 1 and len(self._find_partners(others[0])) == 1
        return others[0] if is_it else None

    @cached_property
    def seen_from(self) -> dict[str, list[Thing]]:
        """The placed things that were seen from each waypoint, by its name."""
        seen_from: defaultdict[str, list[Thing]] = defaultdict(list)
        for thing in self.placed:
            for name in thing.waypoints:
                seen_from[name].append(thing)
        return seen_from

    @cached_property
    def _alike(self) -> dict[str, list[Thing]]:
        """By each label, the things that may be what is called so, and more of their kind."""
        by_label: defaultdict[str, list[Thing]] = defaultdict(list)
        for thing in self.placed:
            by_label[thing.label].append(thing)
        alike = dict[str, list[Thing]]()
        for group in group_names(list(by_label)):
            things = [thing for label in sorted(group) for thing in by_label[label]]
            alike |= dict.fromkeys(group, things)
        return alike

    def _unseen(self, thing: Thing) -> tuple[MemoryFinding, ...]:
        if id(thing) not in self.known:
            self.known[id(thing)] = (*self._missed(thing), *self._not_shown(thing))
        return self.known[id(thing)]

    def _missed(self, thing: Thing) -> Iterator[MemoryFinding]:
        """Return the places it was once seen from, whose later looks did not name it."""
        for view in thing.supporting:
            if not view.landmark.n_missed:
                continue
            look = self.looks.get(view.waypoint)
            if look is not None and _is_later(look, thing.last_seen):
                yield MemoryFinding(
                    kind=FindingKind.NOT_SEEN,
                    waypoints=(view.waypoint,),
                    things=(thing,),
                    far_m=view.far_m,
                    n_since=view.landmark.n_missed,
                )

    def _not_shown(self, thing: Thing) -> Iterator[MemoryFinding]:
        """Return the looks that show a thing within the cone of what they name, and not by name."""
        point = Point(*self.at[self.numbers[id(thing)]].tolist())
        looks, shown = self._measure_shown(thing)
        for i in np.flatnonzero(shown >= LEAST_SHOWN_RATIO).tolist():
            look = looks[i]
            bearing_rad = wrap_angle(look.pose.point.bearing_to(point) - look.pose.yaw_rad)
            if not self._is_told(thing, look, bearing_rad):
                yield MemoryFinding(
                    kind=FindingKind.NOT_SEEN,
                    waypoints=(look.name,),
                    things=(thing,),
                    far_m=look.pose.point.distance_to(point),
                    n_since=int(_is_later(look, thing.last_seen)),
                    shown_ratio=float(shown[i]),
                )

    def _measure_shown(self, thing: Thing) -> tuple[list[Waypoint], FloatArray]:
        """Return looks, and how likely each shows a thing: over all that it may be, in sight."""
        near = find_near(self._looks_at, self.at[self.numbers[id(thing)]], NEAR_M)
        for i in near[np.isnan(self._looks_at[near, 3])].tolist():
            self._looks_at[i, 3:] = find_cone(self._waypoints[i]) or (np.inf, -np.inf)
        spots = np.empty((0, 2)) if thing.whereabouts is None else thing.whereabouts
        is_ahead = _are_ahead(self._looks_at[near], spots)
        n_spots = max(len(spots), 1)
        enough = np.flatnonzero(is_ahead.sum(axis=1) >= LEAST_SHOWN_RATIO * n_spots)
        looks = [self._waypoints[i] for i in near[enough].tolist()]
        seen_from = np.array([(each.place.x, each.place.y) for each in thing.supporting])
        in_sight = self.found.find_sight_ratios(looks, spots, seen_from=seen_from)
        return looks, np.where(is_ahead[enough], in_sight, 0.0).sum(axis=1) / n_spots

    def _is_told(self, thing: Thing, waypoint: Waypoint, bearing_rad: float) -> bool:
        """Return True when a waypoint names what may be a thing, or named it from another spot.

        Args:
            bearing_rad: From the waypoint's heading to the thing.
        """
        owners = {
            view.landmark: owner
            for owner in self.seen_from.get(waypoint.name, ())
            for view in owner.supporting
            if view.waypoint == waypoint.name
        }
        named = find_named(waypoint)
        return any(_may_be(thing, each, bearing_rad, owners.get(each)) for each in named) or any(
            view.waypoint == waypoint.name for view in thing.supporting
        )

    def _is_gone(self, thing: Thing) -> bool:
        against = self._unseen(thing)
        return (
            any(each.n_since for each in against)
            and judge_trust(thing, against).ratio < MOVED_RATIO
        )

    def _moved(self, thing: Thing) -> Iterator[MemoryFinding]:
        """Return a thing that is gone and the only one of its name that is new since."""
        others = self._find_partners(thing)
        if len(others) == 1 and len(self._find_partners(others[0])) == 1:
            old, new = (thing, *others) if self._is_gone(thing) else (*others, thing)
            yield MemoryFinding(
                kind=FindingKind.MOVED, waypoints=new.waypoints[:1], things=(old, new)
            )

    def _find_partners(self, thing: Thing) -> list[Thing]:
        """Return those that it may have been moved from or to: two at most, for that is enough."""
        is_gone = self._is_gone(thing)
        partners = (
            other
            for other in self._alike[thing.label]
            if (_is_newer(other, thing) if is_gone else _is_newer(thing, other))
            and name_the_same(thing.label, other.label)
            and self._is_gone(other) is not is_gone
        )
        return list(islice(partners, 2))


def find_near(
    places: FloatArray, point: FloatArray | tuple[float, float], reach_m: float
) -> IntArray:
    """Return which of many places, whose first columns are x and y, are near a point."""
    east, north = places[:, 0] - point[0], places[:, 1] - point[1]
    return np.flatnonzero(east * east + north * north <= reach_m * reach_m)


def _is_later(look: Waypoint, last_seen: datetime | None) -> bool:
    if look.recorded_at is None or last_seen is None:
        return False
    return look.recorded_at > last_seen


def _may_be(thing: Thing, landmark: Landmark, bearing_rad: float, owner: Thing | None) -> bool:
    """Return True for a landmark that may be a thing, and is not of another one seen elsewhere."""
    is_ahead = (
        landmark.bearing_rad is None
        or abs(wrap_angle(landmark.bearing_rad - bearing_rad)) <= SAME_BEARING_RAD
    )
    is_others = owner is not None and owner is not thing and len(owner.waypoints) > 1
    return is_ahead and not is_others and name_the_same(landmark.label, thing.label)


def _are_ahead(looks: FloatArray, points: FloatArray) -> Mask:
    """Return True for each look (row) and point (column) that is near and in the look's cone."""
    x, y, yaws, least, most = looks.T[..., None]
    east, north = points[:, 0] - x, points[:, 1] - y
    off_rad = np.remainder(np.arctan2(north, east) - yaws + np.pi, 2 * np.pi) - np.pi
    is_near = np.hypot(east, north) <= NEAR_M
    return np.asarray((least <= off_rad) & (off_rad <= most) & is_near)


def _is_newer(new: Thing, old: Thing) -> bool:
    if new.first_seen is None or old.last_seen is None:
        return False
    return new.first_seen > old.last_seen
