"""From remembered places to things: the whole way, and each thing in words and numbers."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from operator import itemgetter

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.memory.quoting import name_key
from mapspeak.memory.things.joining import Group, Posteriors, divide_views, join_sightings
from mapspeak.memory.things.labels import group_names, name_the_same
from mapspeak.memory.things.likelihood import Seen, Surroundings, WeighedView, read_waypoints
from mapspeak.memory.things.placing import (
    Placement,
    find_confidence_ratio,
    measure_agreement,
    place,
    speaks_of,
    trust_range,
    views_from_apart,
)
from mapspeak.memory.things.sight import (
    N_RAYS,
    SURFACE_M,
    SightMap,
    are_opposite,
    bearing_index,
    build_sight_map,
    find_farthest_beside,
)
from mapspeak.memory.things.thing import NOISE, Category, Thing, View
from mapspeak.memory.waypoint import SemanticMap, Waypoint
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray

PLAIN_SIGHT_M = 5.0
"""Who stands no farther and has nothing between would see a thing."""
LIKELY_RATIO = 0.5
ELSEWHERE_RAD = math.radians(30)
"""A view that points so far past a thing says that it is elsewhere."""
IN_PICTURE_RAD = math.radians(40)
"""What is no farther off the heading would be in the picture."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Located:
    """Views of one thing, where it is, and how well each view goes with the others."""

    group: tuple[WeighedView, ...]
    placement: Placement | None
    agreements: tuple[float, ...]


Rank = tuple[int, str, float, float, tuple[str, ...]]
Solved = dict[tuple[WeighedView, ...], tuple[Located, ...]]
Evidence = tuple[Located | None, tuple[WeighedView, ...], tuple[WeighedView, ...]]
"""What a thing is made of: placed views of it, those without a direction, those against it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pool:
    """The things of all views that bear related names; compared by identity.

    Attributes:
        solved: What was joined, by the views that may be joined with each other.
        things: By what they are made of.
        ranked: The same, each with its rank among all things.
    """

    solved: Solved
    things: dict[Evidence, Thing]
    ranked: tuple[tuple[Rank, Thing], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Things:
    """All things of a memory on a map; compared by identity.

    Attributes:
        things: Those with most views first, then by label and place.
        sight: The map, ready for looking around in it.
        seen: By the name of each waypoint.
        of_label: The sightings of each label.
        pools: By the related names that their views bear.
        n_joined: How many views were joined anew to find them.
    """

    things: tuple[Thing, ...]
    sight: SightMap
    seen: Seen
    of_label: dict[str, frozenset[WeighedView]]
    pools: dict[frozenset[str], Pool]
    n_joined: int = 0

    def find_sight_ratios(
        self, looks: Sequence[Waypoint], points: FloatArray, *, seen_from: FloatArray
    ) -> FloatArray:
        """Return how likely each waypoint (row) has each point in sight: less over furniture.

        Args:
            points: Where a thing may be, shape (n, 2), metres.
            seen_from: Where it was seen from, shape (m, 2), metres: it is on that side of a wall.
        """
        seen = [self._surroundings(each) for each in looks]
        here = np.array([(each.pose.x, each.pose.y) for each in seen]).reshape(-1, 1, 2)
        ways = (points - here).transpose(0, 2, 1)
        far_m = np.hypot(ways[:, 0], ways[:, 1])
        ahead = np.arctan2(ways[:, 1], ways[:, 0])
        rays = bearing_index(ahead - self.sight.grid.origin.yaw_rad)
        # A thing is wider than a ray, so that its edge shows where a corner hides its middle.
        met_m = np.array([(each.near_m, each.far_m) for each in seen]).reshape(-1, 2, N_RAYS)
        beside_m = np.take_along_axis(find_farthest_beside(met_m), rays[:, None], axis=2)
        is_near, is_far = (far_m[:, None] <= beside_m + SURFACE_M).transpose(1, 0, 2)
        is_behind = (far_m > beside_m[:, 1]) & are_opposite(
            here - points, seen_from - points[:, None]
        )
        in_sight = np.where(is_near, 1.0, np.where(is_far, NOISE.seen_over_ratio, 0.0))
        return np.where(is_behind, 0.0, in_sight)

    def open_m(self, waypoint: Waypoint, point: Point) -> float:
        """Return how far one sees towards a point over what one may see over."""
        seen = self._surroundings(waypoint)
        return float(seen.far_m[self._ray(waypoint.pose, point)])

    def _surroundings(self, stand: Waypoint) -> Surroundings:
        return next(each for each in self.seen[stand.name] if each.pose == stand.pose)

    def is_over_furniture(self, waypoint: Waypoint, point: Point) -> bool:
        """Return True when one sees towards a point over something that stands on the way."""
        seen, ray = self._surroundings(waypoint), self._ray(waypoint.pose, point)
        near_m, grid = float(seen.near_m[ray]), self.sight.grid
        if near_m >= seen.far_m[ray]:
            return False
        here, met_m = waypoint.pose.point, near_m + grid.resolution_m / 2
        way = Pose(here.x, here.y, here.bearing_to(point))
        cell = grid.cell_at(way.transform(Point(met_m, 0.0)))
        return grid.contains(cell) and bool(grid.occupied[cell.row, cell.col])

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
    seen = read_waypoints(sight, semantic_map.waypoints, earlier.seen if earlier else {})
    of_label, changed = _divide(seen, earlier)
    found = Things(things=(), sight=sight, seen=seen, of_label=of_label, pools={})
    groups, known = group_names(list(of_label)), earlier.pools if earlier else {}
    same = {names for names in groups if names in known and changed.isdisjoint(names)}
    left = [pool for names, pool in known.items() if names not in same]
    before = Pool(
        solved={views: each for pool in left for views, each in pool.solved.items()},
        things={made_of: thing for pool in left for made_of, thing in pool.things.items()},
    )
    pools = {
        names: known[names] if names in same else _solve(found, names, before) for names in groups
    }
    parts = chain.from_iterable(pools[names].solved for names in groups if names not in same)
    n_joined = sum(len(part) for part in parts if part not in before.solved)
    ranked = sorted(chain.from_iterable(p.ranked for p in pools.values()), key=itemgetter(0))
    things = tuple(thing for _, thing in ranked)
    return replace(found, things=things, pools=pools, n_joined=n_joined)


def _is_of(sight: SightMap, grid: OccupancyGrid) -> bool:
    old = sight.grid
    is_same_frame = old.resolution_m == grid.resolution_m and old.origin == grid.origin
    return old is grid or (is_same_frame and np.array_equal(old.cells, grid.cells))


def _divide(
    seen: Seen, earlier: Things | None
) -> tuple[dict[str, frozenset[WeighedView]], set[str]]:
    """Return the sightings of each label, and the labels whose sightings are others than before."""
    known = {} if earlier is None else earlier.seen
    gone = _by_label(stands for name, stands in known.items() if seen.get(name) is not stands)
    new = _by_label(stands for name, stands in seen.items() if known.get(name) is not stands)
    before = {} if earlier is None else earlier.of_label
    of_label, changed = dict(before), set[str]()
    for label in gone.keys() | new.keys():
        left = before.get(label, frozenset()) - gone.get(label, set()) | new.get(label, set())
        if left != before.get(label):
            changed.add(label)
            of_label[label] = left
    return {label: views for label, views in of_label.items() if views}, changed


def _by_label(seen: Iterable[Sequence[Surroundings]]) -> dict[str, set[WeighedView]]:
    found: defaultdict[str, set[WeighedView]] = defaultdict(set)
    for stand in chain.from_iterable(seen):
        for each in stand.sightings:
            found[each.landmark.label].add(each)
    return found


def _order(view: WeighedView) -> tuple[str, str, float, float, float, int]:
    """Return where a view stands in an order that the file does not set."""
    waypoint, pose = view.waypoint, view.waypoint.pose
    return name_key(waypoint.name), waypoint.name, pose.x, pose.y, pose.yaw_rad, view.number


def _solve(found: Things, names: frozenset[str], before: Pool) -> Pool:
    """Join views of related names; what is known of those that may be joined is taken as it is."""
    views = sorted(chain.from_iterable(found.of_label[name] for name in names), key=_order)
    solved = {
        part: before.solved.get(part) or _join(found.sight, part)
        for part in divide_views(found.sight, [v for v in views if v.likelihood is not None])
    }
    located = [each for joined in solved.values() for each in joined]
    added: defaultdict[Located | None, list[WeighedView]] = defaultdict(list)
    for view in views:
        if view.likelihood is None:
            added[_find_nearest(located, added, view)].append(view)
    against = _find_against(found, located, added)
    made_of: list[Evidence] = [(None, (view,), ()) for view in added.get(None, ())]
    made_of += (
        (each, tuple(added.get(each, ())), past)
        for each, past in zip(located, against, strict=True)
    )
    things = {each: before.things.get(each) or _describe(each) for each in made_of}
    ranked = sorted(((_rank(each), each) for each in things.values()), key=itemgetter(0))
    return Pool(solved=solved, things=things, ranked=tuple(ranked))


def _join(sight: SightMap, views: Sequence[WeighedView]) -> tuple[Located, ...]:
    posteriors, located = Posteriors(sight), []
    for group in join_sightings(posteriors, views):
        shares = measure_agreement(sight, group)
        placement = _place(posteriors, _agreeing(group, shares))
        located.append(Located(group=tuple(group), placement=placement, agreements=shares))
    return tuple(located)


def _place(posteriors: Posteriors, group: Group) -> Placement:
    """Place a thing by all its views, or by the surer of two directions that hardly agree.

    That one stands for both only where the other speaks of the place as well.
    """
    together = _place_by(posteriors, group)
    if len(group) != 2 or any(each.landmark.range_m is not None for each in group):
        return together
    alone = [(_place_by(posteriors, [one]), other) for one, other in (group, group[::-1])]
    borne_out = (at for at, other in alone if speaks_of(posteriors.sight, other, at.position))
    return min((together, *borne_out), key=lambda each: each.uncertainty_m)


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


def _find_nearest(
    located: Sequence[Located],
    added: Mapping[Located | None, Sequence[WeighedView]],
    view: WeighedView,
) -> Located | None:
    """Find the nearest thing of the name of a view without a direction."""
    here = view.waypoint.pose.point
    near = [
        (here.distance_to(each.placement.position), i)
        for i, each in enumerate(located)
        if each.placement is not None
        and here.distance_to(each.placement.position) <= PLAIN_SIGHT_M
        and all(
            other.waypoint is not view.waypoint
            and name_the_same(other.landmark.label, view.landmark.label)
            for other in (*each.group, *added.get(each, ()))
        )
    ]
    return located[min(near)[1]] if near else None


def _find_against(
    found: Things, located: Sequence[Located], added: Mapping[Located | None, Sequence[WeighedView]]
) -> Iterator[tuple[WeighedView, ...]]:
    """Return for each thing the lone views of its name that point past it.

    Those are meant whose picture would show it in plain sight; a thing of one view has none.
    """
    is_lone = [len(each.group) + len(added.get(each, ())) == 1 for each in located]
    alone = [
        each.group[0]
        for each, is_one in zip(located, is_lone, strict=True)
        if is_one and each.group[0].landmark.bearing_rad is not None
    ]
    places = np.array([(v.waypoint.pose.x, v.waypoint.pose.y) for v in alone]).reshape(-1, 2)
    for each, is_one in zip(located, is_lone, strict=True):
        if each.placement is None or is_one:
            yield ()
            continue
        at = each.placement.position
        near = np.flatnonzero(np.hypot(*(places - (at.x, at.y)).T) <= PLAIN_SIGHT_M).tolist()
        yield tuple(alone[i] for i in near if _points_past(found, alone[i], each.group, at))


def _points_past(
    found: Things, view: WeighedView, group: Sequence[WeighedView], position: Point
) -> bool:
    at, bearing_rad = np.array([[position.x, position.y]]), view.landmark.bearing_rad or 0.0
    places = np.array([(each.waypoint.pose.x, each.waypoint.pose.y) for each in group])
    return (
        all(view.waypoint is not each.waypoint for each in group)
        and _off_rad(view.waypoint.pose, bearing_rad, position) >= ELSEWHERE_RAD
        and _off_rad(view.waypoint.pose, 0.0, position) <= IN_PICTURE_RAD
        and name_the_same(view.landmark.label, group[0].landmark.label)
        and found.find_sight_ratios([view.waypoint], at, seen_from=places).item() > LIKELY_RATIO
    )


def _off_rad(pose: Pose, bearing_rad: float, point: Point) -> float:
    ahead = pose.yaw_rad + bearing_rad
    return abs(math.remainder(pose.point.bearing_to(point) - ahead, math.tau))


def _rank(thing: Thing) -> Rank:
    at = thing.position or Point(math.inf, math.inf)
    return (-len(thing.supporting), thing.label, at.x, at.y, thing.waypoints)


LEAST_AGREEMENT = 2.0
"""A view that is less than so much likelier than by chance, given the others, places nothing."""


def _describe(made_of: Evidence) -> Thing:
    located, unplaced, conflicting = made_of
    placement = located.placement if located else None
    views = (*located.group, *unplaced) if located else unplaced
    # A view without a direction says nothing of the place.
    shares = (*(located.agreements if located else ()), *(1.0 for _ in unplaced))
    ordered = sorted(views, key=lambda each: name_key(each.waypoint.name))
    labels = _by_votes(each.landmark.label for each in ordered)
    position = placement.position if placement else None
    apart = list(views_from_apart(zip(views, shares, strict=True)))
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
        confidence_ratio=find_confidence_ratio(apart),
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
    pose, bearing_rad = sighting.waypoint.pose, sighting.landmark.bearing_rad
    place, has_way = pose.point, bearing_rad is not None
    return View(
        waypoint=sighting.waypoint.name,
        landmark=sighting.landmark,
        place=place,
        far_m=place.distance_to(position) if position and has_way else None,
        off_rad=_off_rad(pose, bearing_rad or 0.0, position) if position and has_way else None,
        recorded_point=sighting.landmark.recorded_point_from(pose),
    )
