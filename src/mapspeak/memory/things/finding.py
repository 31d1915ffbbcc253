"""From remembered places to things: the whole way, and each thing in words and numbers."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.memory.quoting import name_key
from mapspeak.memory.things.joining import (
    Group,
    Posteriors,
    join_sightings,
)
from mapspeak.memory.things.labels import group_names, name_the_same
from mapspeak.memory.things.likelihood import Surroundings, WeighedView, read_waypoints
from mapspeak.memory.things.placing import Placement, measure_agreement, place, trust_range
from mapspeak.memory.things.sight import (
    BODY_M,
    LATTICE_M,
    N_RAYS,
    SightMap,
    bearing_index,
    build_sight_map,
)
from mapspeak.memory.things.thing import NOISE, Category, Thing, View
from mapspeak.memory.waypoint import SemanticMap, Waypoint
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray

PLAIN_SIGHT_M = 5.0
"""Who stands no farther and has nothing between would see a thing."""
SURFACE_M = BODY_M + LATTICE_M / math.sqrt(2)
"""A thing's surface is met at most so far before the middle of a lattice cell that it may be in."""
LIKELY_RATIO = 0.5
ELSEWHERE_RAD = math.radians(30)
"""A view that points so far past a thing says that it is elsewhere."""


@dataclass(slots=True, kw_only=True, eq=False)
class Located:
    """Views of one thing, where it is, and how well each view goes with the others."""

    group: Group
    placement: Placement | None
    agreements: list[float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Things:
    """All things of a memory on a map; compared by identity.

    Attributes:
        things: Those with most views first, then by label and place.
        sight: The map, ready for looking around in it.
        surroundings: What each waypoint, and each of its standpoints, sees.
        pools: The things of all views that bear related names, by these views.
    """

    things: tuple[Thing, ...]
    sight: SightMap
    surroundings: dict[Waypoint, Surroundings]
    pools: dict[tuple[WeighedView, ...], tuple[Thing, ...]]

    def find_sight_ratios(self, waypoint: Waypoint, points: FloatArray) -> FloatArray:
        """Return for each point how likely a waypoint has it in sight: less over furniture."""
        pose, seen = waypoint.pose, self.surroundings[waypoint]
        ways = points - (pose.x, pose.y)
        far_m = np.hypot(*ways.T)
        rays = bearing_index(np.arctan2(ways[:, 1], ways[:, 0]) - self.sight.grid.origin.yaw_rad)
        is_near, is_far = (far_m <= each[rays] + SURFACE_M for each in (seen.near_m, seen.far_m))
        return np.where(is_near, 1.0, np.where(is_far, NOISE.seen_over_ratio, 0.0))

    def seen_from(self, waypoint: Waypoint) -> tuple[Thing, ...]:
        """Return the things with a place that were seen from a waypoint."""
        return tuple(
            thing
            for thing in self.things
            if thing.position is not None and waypoint.name in thing.waypoints
        )

    def open_m(self, waypoint: Waypoint, point: Point) -> float:
        """Return how far one sees towards a point over what one may see over."""
        return float(self.surroundings[waypoint].far_m[self._ray(waypoint.pose, point)])

    def _ray(self, pose: Pose, point: Point) -> int:
        angle = pose.point.bearing_to(point) - self.sight.grid.origin.yaw_rad
        return round(angle * N_RAYS / math.tau) % N_RAYS


def find_things(
    semantic_map: SemanticMap,
    grid: OccupancyGrid,
    *,
    earlier: Things | None = None,
) -> Things:
    """Join what was seen from all places into things, and say where each is.

    Args:
        earlier: What was found before: what depends on no changed waypoint is taken from it where
            the map is the same. The answer is the same without.
    """
    if earlier is None or not _is_of(earlier.sight, grid):
        earlier = None
    sight = earlier.sight if earlier else build_sight_map(grid)
    surroundings = read_waypoints(
        sight, semantic_map.waypoints, earlier.surroundings if earlier else {}
    )
    found = Things(things=(), sight=sight, surroundings=surroundings, pools={})
    known = earlier.pools if earlier else {}
    pools = {
        pool: known.get(pool) or _describe(found, _solve(sight, pool))
        for pool in _divide(surroundings)
    }
    things = (thing for pool in pools.values() for thing in pool)
    return replace(found, things=tuple(sorted(things, key=_rank)), pools=pools)


def _is_of(sight: SightMap, grid: OccupancyGrid) -> bool:
    old = sight.grid
    is_same_frame = old.resolution_m == grid.resolution_m and old.origin == grid.origin
    return old is grid or (is_same_frame and np.array_equal(old.cells, grid.cells))


def _divide(surroundings: dict[Waypoint, Surroundings]) -> list[tuple[WeighedView, ...]]:
    """Return all sightings in pools of related labels, in an order that the file does not set."""
    ordered = sorted(surroundings, key=_order)
    every = [each for waypoint in ordered for each in surroundings[waypoint].sightings]
    pool_of = {
        label: i
        for i, group in enumerate(group_names([s.landmark.label for s in every]))
        for label in group
    }
    pools: dict[int, list[WeighedView]] = {}
    for each in every:
        pools.setdefault(pool_of[each.landmark.label], []).append(each)
    return [tuple(pools[i]) for i in sorted(pools)]


def _order(waypoint: Waypoint) -> tuple[str, str, float, float, float]:
    pose = waypoint.pose
    return name_key(waypoint.name), waypoint.name, pose.x, pose.y, pose.yaw_rad


def _solve(sight: SightMap, pool: Sequence[WeighedView]) -> list[Located]:
    posteriors = Posteriors(sight)
    placed = [each for each in pool if each.likelihood is not None]
    located = []
    for group in join_sightings(posteriors, placed) if placed else []:
        shares = measure_agreement(sight, group)
        placement = _place(posteriors, _agreeing(group, shares))
        located.append(Located(group=group, placement=placement, agreements=list(shares)))
    for view in pool:
        if view.likelihood is None:
            near = _find_nearest(located, view)
            if near is None:
                near = Located(group=[], placement=None, agreements=[])
                located.append(near)
            near.group.append(view)
            # A view without a direction says nothing of the place.
            near.agreements.append(1.0)
    return located


def _place(posteriors: Posteriors, group: Group) -> Placement:
    """Place a thing by all its views, or by the surest of two directions that hardly agree."""
    together = _place_by(posteriors, group)
    if len(group) != 2 or any(each.landmark.range_m is not None for each in group):
        return together
    alone = (_place_by(posteriors, [each]) for each in group)
    return min((together, *alone), key=lambda each: each.uncertainty_m)


def _place_by(posteriors: Posteriors, group: Group) -> Placement:
    seen_from = [each.waypoint.pose.point for each in group]
    posterior, (first, *more) = posteriors.of(group), group
    if first.landmark.range_m is not None and first.likelihood is not None and not more:
        posterior = trust_range(posteriors.sight, first, first.landmark.range_m)
    return place(posteriors.sight, posterior, seen_from)


def _agreeing(group: Group, agreements: Sequence[float]) -> Group:
    """Return the views of a thing that say where it is: two or more that go with each other."""
    kept = [each for each, share in zip(group, agreements, strict=True) if share >= LEAST_AGREEMENT]
    return kept if len(kept) >= 2 else group


def _find_nearest(located: Sequence[Located], view: WeighedView) -> Located | None:
    """Find the nearest thing of the name of a view without a direction."""
    here = view.waypoint.pose.point
    near = [
        (here.distance_to(each.placement.position), i)
        for i, each in enumerate(located)
        if each.placement is not None
        and all(
            other.waypoint is not view.waypoint
            and name_the_same(other.landmark.label, view.landmark.label)
            for other in each.group
        )
    ]
    off_m, i = min(near, default=(math.inf, -1))
    return located[i] if off_m <= PLAIN_SIGHT_M else None


def _describe(found: Things, pool: Sequence[Located]) -> tuple[Thing, ...]:
    alone = [each for each in pool if len(each.group) == 1 and each.placement is not None]
    return tuple(_describe_one(each, _against(found, each, alone)) for each in pool)


def _against(found: Things, located: Located, alone: Sequence[Located]) -> list[WeighedView]:
    """Find lone views of the name, from where the thing is in plain sight, that point past it."""
    if located.placement is None or len(located.group) < 2:
        return []
    position, own = located.placement.position, [each.waypoint for each in located.group]
    at = np.array([[position.x, position.y]])
    return [
        other
        for (other,) in (each.group for each in alone)
        if other.waypoint not in own
        and other.landmark.bearing_rad is not None
        and other.waypoint.pose.point.distance_to(position) <= PLAIN_SIGHT_M
        and _off_rad(other, position) >= ELSEWHERE_RAD
        and name_the_same(other.landmark.label, located.group[0].landmark.label)
        and found.find_sight_ratios(other.waypoint, at)[0] > LIKELY_RATIO
    ]


def _off_rad(sighting: WeighedView, point: Point) -> float:
    pose, bearing_rad = sighting.waypoint.pose, sighting.landmark.bearing_rad or 0.0
    ahead = pose.yaw_rad + bearing_rad
    return abs(math.remainder(pose.point.bearing_to(point) - ahead, math.tau))


def _rank(thing: Thing) -> tuple[int, str, float, float, tuple[str, ...]]:
    at = thing.position or Point(math.inf, math.inf)
    return (-len(thing.supporting), thing.label, at.x, at.y, thing.waypoints)


LEAST_AGREEMENT = 2.0
"""A view that is less than so much likelier than by chance, given the others, places nothing."""

_BEST_ODDS = 1e6
"""However many views agree: they may all be of a map that is wrong."""
_SAME_PLACE_M = 0.3
"""Views from nearer to each other share their mistakes and count once."""


def _describe_one(located: Located, conflicting: Iterable[WeighedView]) -> Thing:
    placement = located.placement
    ordered = sorted(located.group, key=lambda each: name_key(each.waypoint.name))
    labels = _by_votes(each.landmark.label for each in ordered)
    position = placement.position if placement else None
    apart = list(_from_different_places(located))
    times = (each.waypoint.dated(each.landmark).recorded_at for each in ordered)
    seen_at = [each for each in times if each is not None]
    return Thing(
        label=labels[0],
        other_labels=tuple(labels[1:]),
        category=Category(_by_votes(each.category.value for each in ordered)[0]),
        purposes=tuple(_by_votes(filter(None, (each.landmark.purpose for each in ordered)))),
        position=position,
        uncertainty_m=placement.uncertainty_m if placement else None,
        supporting=tuple(_view(each, position) for each in ordered),
        conflicting=tuple(_view(each, position) for each in conflicting),
        confidence_ratio=_confidence(apart),
        n_agreeing=sum(agreement >= LEAST_AGREEMENT for _, agreement in apart),
        whereabouts=placement.whereabouts if placement else None,
        first_seen=min(seen_at, default=None),
        last_seen=max(seen_at, default=None),
    )


def _by_votes(words: Iterable[str]) -> list[str]:
    """Return each once, what was said most often first, then the longer."""
    counts = Counter(words)
    return sorted(counts, key=lambda word: (-counts[word], -len(word), word))


def _view(sighting: WeighedView, position: Point | None) -> View:
    place, has_way = sighting.waypoint.pose.point, sighting.landmark.bearing_rad is not None
    return View(
        waypoint=sighting.waypoint.name,
        landmark=sighting.landmark,
        place=place,
        far_m=place.distance_to(position) if position and has_way else None,
        off_rad=_off_rad(sighting, position) if position and has_way else None,
    )


def _confidence(apart: Iterable[tuple[WeighedView, float]]) -> float:
    """Return how likely it is that not all views are wrong: the odds of each, multiplied.

    The first view may be wrong in any way; a further one must be wrong and agree by chance.
    """
    odds = 1.0
    for i, (each, agreement) in enumerate(apart):
        odds *= (1 - each.wrong_ratio) / each.wrong_ratio * (agreement if i else 1.0)
    odds = min(odds, _BEST_ODDS)
    return odds / (1 + odds)


def _from_different_places(located: Located) -> Iterator[tuple[WeighedView, float]]:
    places = list[Point]()
    for each, agreement in zip(located.group, located.agreements, strict=True):
        here = each.waypoint.pose.point
        if all(here.distance_to(other) >= _SAME_PLACE_M for other in places):
            places.append(here)
            yield each, agreement
