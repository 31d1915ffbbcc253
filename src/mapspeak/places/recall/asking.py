"""From a request in words to what is remembered of it: where, how sure, and where to stand."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from heapq import heapify, heappop, heappush
from itertools import islice

from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, Waypoint
from mapspeak.memory.consistency.findings import WEIGHTS, FindingKind, Trust
from mapspeak.memory.search.answer import Answer, Basis, EntryCandidate, EntryKind, Verdict
from mapspeak.places.goalcheck import GoalCheck, judge_goal
from mapspeak.places.naming import Place, find_elsewhere
from mapspeak.places.relations.choosing import stand_at
from mapspeak.places.standing import find_overlook_of
from mapspeak.places.things import split_room
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import Remembered, RememberedPlace, RememberedThing

NEAR_M = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RecallQuery:
    """What is looked for among what passes every filter that is given.

    Attributes:
        words: What people say: a name, a thing, what it is for, what is the matter.
        near: Not farther than `near_m` from this point, straight.
        since: Last seen at this moment or later.
        until: Last seen before.
    """

    words: str
    near: Point | None = None
    near_m: float = NEAR_M
    room_id: str | None = None
    since: datetime | None = None
    until: datetime | None = None
    kind: EntryKind | None = None
    n: int = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class RecallCandidate:
    """A place or a thing that may be meant.

    Attributes:
        id: "T1" or "W1": a goal for the robot.
        match: How it matches the request; None where nothing was asked.
        away_m: From the point that the request is near to, straight; None where it has none.
        seen_from: Ids of the places that it was seen from; of a place, its own.
        pictures: That it was seen in, by their relative names.
        position: Where it is; None where nobody noted a direction.
        uncertainty_m: The radius around that which holds it with 90 %; None without a position,
            and for a place.
        pose: Where the robot would stand: of a thing, near it and facing it where it can.
        is_faced: True when it would stand near it and face it.
        faced_ratio: The share of where a thing may be that it would face there.
        last_seen: By the calendar; None where nobody noted it.
    """

    id: str
    kind: EntryKind
    name: str
    match: EntryCandidate | None
    away_m: float | None
    seen_from: tuple[str, ...]
    pictures: tuple[str, ...]
    position: Point | None
    uncertainty_m: float | None
    room_ids: tuple[str, ...]
    pose: Pose
    is_faced: bool
    faced_ratio: float
    check: GoalCheck
    last_seen: datetime | None
    trust: Trust


class RecallDoubt(StrEnum):
    """Why what was found may still be wrong."""

    DOUBTFUL_RECORD = "doubtful_record"
    NOT_NOTED = "not_noted"
    CONTRADICTED = "contradicted"
    LONG_AGO = "long_ago"
    FEW_VIEWS = "few_views"
    IMPRECISE = "imprecise"
    OTHER_ROOM = "other_room"
    OUT_OF_SIGHT = "out_of_sight"
    HARDLY_IN_SIGHT = "hardly_in_sight"


@dataclass(frozen=True, slots=True, kw_only=True)
class Recall:
    """What is remembered of a request.

    Attributes:
        query: The request; a room that its words named is a filter.
        candidates: The likeliest first; of equally likely ones the nearest by path. Where nothing
            is remembered they are the nearest in meaning, and probably none is meant.
        n_searched: How many places and things pass the filters.
        elsewhere: Places of other maps that the request names.
        doubt: Why the first candidate may still be wrong; None where nothing speaks for that.
    """

    query: RecallQuery
    answer: Answer
    candidates: tuple[RecallCandidate, ...]
    n_searched: int
    is_empty: bool
    elsewhere: tuple[Waypoint, ...]
    doubt: RecallDoubt | None

    @property
    def verdict(self) -> Verdict:
        """How far the first candidate may be taken for what is meant."""
        return Verdict.LIKELY if self.doubt else self.answer.verdict


MOST_TIED = 30
"""Up to this number, equally likely candidates are sorted by path; beyond, by id."""


def recall(world: WorldModel, query: RecallQuery) -> Recall:
    """Return what is remembered of a request; the same for the same memory, map and pose."""
    if query.room_id is None:
        words, room_id = split_room(world, query.words)
        query = replace(query, words=words, room_id=room_id)
    everything: list[Remembered] = [*world.recollection.places, *world.things]
    passing = {each.id: each for each in everything if _passes(world, each, query)}
    answer = _find(world, query, passing)
    if moved := _find_moved(world, query, answer, passing):
        passing = {id_: each for id_, each in passing.items() if id_ not in moved}
        answer = _find(world, query, passing)
    is_tied = 1 < answer.n_meant <= MOST_TIED
    best = _find_best_known(world, answer, passing, query.room_id) if is_tied else None
    if best is not None:
        answer = replace(answer, verdict=Verdict.FOUND)
    ranked = _rank(world, answer.candidates, passing, best=best, is_tied=is_tied)
    candidates = tuple(
        describe_candidate(world, passing[each.entry.id], match=each, near=query.near)
        for each in islice(ranked, query.n)
    )
    is_found = answer.verdict is Verdict.FOUND
    return Recall(
        query=query,
        answer=answer,
        candidates=candidates,
        n_searched=len(passing),
        elsewhere=find_elsewhere(world.memory, query.words),
        is_empty=not (world.recollection.places or world.things),
        doubt=find_doubt(candidates[0], room_id=query.room_id) if is_found else None,
    )


def _find(world: WorldModel, query: RecallQuery, passing: Mapping[str, Remembered]) -> Answer:
    limit = max(query.n, MOST_TIED)
    return world.recollection.find(query.words, among=frozenset(passing), limit=limit)


def _find_moved(
    world: WorldModel, query: RecallQuery, answer: Answer, passing: Mapping[str, Remembered]
) -> frozenset[str]:
    """Return the ids of what is meant and stands elsewhere by now, under another id that passes."""
    if answer.n_meant > query.n:
        # Of many of a name there are many that each may be, and each costs a judgement.
        return frozenset()
    meant = (passing[each.entry.id] for each in answer.candidates[: answer.n_meant])
    things = (each for each in meant if isinstance(each, RememberedThing))
    now = ((each.id, world.follow(each).id) for each in things)
    return frozenset(old_id for old_id, id_ in now if id_ != old_id and id_ in passing)


def _passes(world: WorldModel, remembered: Remembered, query: RecallQuery) -> bool:
    if query.kind not in (None, _kind_of(remembered)):
        return False
    if query.near is not None and _point_of(remembered).distance_to(query.near) > query.near_m:
        return False
    if query.since is not None or query.until is not None:
        seen_at = last_seen(world, remembered)
        if seen_at is None or (query.since is not None and seen_at < query.since):
            return False
        if query.until is not None and seen_at >= query.until:
            return False
    return query.room_id is None or query.room_id in _find_rooms(world, remembered)


def _kind_of(remembered: Remembered) -> EntryKind:
    return EntryKind.PLACE if isinstance(remembered, RememberedPlace) else EntryKind.THING


def _point_of(remembered: Remembered) -> Point:
    """Return where it is; of a thing without a position, where it was seen from."""
    if isinstance(remembered, RememberedPlace):
        return remembered.waypoint.pose.point
    return remembered.point


def _find_rooms(world: WorldModel, remembered: Remembered) -> tuple[str, ...]:
    """Return the rooms it may be in, by id."""
    if isinstance(remembered, RememberedThing):
        return world.rooms_before(remembered)
    room_id = world.find_room_id(remembered.waypoint.pose.point)
    return () if room_id is None else (room_id,)


def last_seen(world: WorldModel, remembered: Remembered) -> datetime | None:
    """Return when it was last seen, by the calendar; None if not noted."""
    if isinstance(remembered, RememberedPlace):
        return remembered.waypoint.recorded_at
    times = (view.recorded_at for _, view in _list_views(world, remembered))
    return max(filter(None, times), default=None)


def _list_views(world: WorldModel, thing: RememberedThing) -> Iterator[tuple[str, Landmark]]:
    """Return what was seen of a thing, each with its time and picture, and from which place."""
    for view in thing.thing.supporting:
        place = world.recollection.find_place(view.waypoint)
        if place is not None:
            yield place.id, place.waypoint.dated(view.landmark)


def describe_candidate(
    world: WorldModel,
    remembered: Remembered,
    *,
    match: EntryCandidate | None = None,
    near: Point | None = None,
) -> RecallCandidate:
    """Return what is known of a place or thing, and how a robot would stand for it."""
    position: Point | None
    if isinstance(remembered, RememberedPlace):
        waypoint = remembered.waypoint
        name, position, uncertainty_m = waypoint.name, waypoint.pose.point, None
        seen_from, pictures = [remembered.id], [waypoint.picture]
        is_faced, faced_ratio = False, 0.0
        trust = world.judge.judge_place(remembered)
    else:
        thing, views = remembered.thing, list(_list_views(world, remembered))
        name, position, uncertainty_m = thing.label, thing.position, thing.uncertainty_m
        seen_from, pictures = [each for each, _ in views], [view.picture for _, view in views]
        is_looked_for = find_overlook_of(world, remembered) is not None
        is_faced = world.find_approach(remembered) is not None and not is_looked_for
        faced_ratio = world.measure_faced(remembered)
        trust = world.judge.judge_thing(remembered, now=world.now)
    pose = stand_at(world, Place(remembered.id, remembered))
    return RecallCandidate(
        id=remembered.id,
        kind=_kind_of(remembered),
        name=name,
        match=match,
        away_m=None if near is None else _point_of(remembered).distance_to(near),
        seen_from=tuple(dict.fromkeys(seen_from)),
        pictures=tuple(dict.fromkeys(filter(None, pictures))),
        position=position,
        uncertainty_m=uncertainty_m,
        room_ids=_find_rooms(world, remembered),
        pose=pose,
        is_faced=is_faced,
        faced_ratio=faced_ratio,
        check=judge_goal(world.grid, world.distances, pose, opened=world.map.open.distances_from),
        last_seen=last_seen(world, remembered),
        trust=trust,
    )


SURE_RATIO = 0.98
"""A thing that two good views agree on is surer than that, and one view alone is not."""
DOUBTFUL_RATIO = 0.5
LEAST_STAYED_RATIO = WEIGHTS[FindingKind.AGED]
LARGEST_OFF_M = 1.2
"""A thing located less precisely may not be in view from in front of it."""
LEAST_FACED_RATIO = 0.3
"""Least share of where a thing may be that must lie ahead to promise that the robot faces it."""


def find_doubt(first: RecallCandidate, *, room_id: str | None) -> RecallDoubt | None:
    """Return why what was found may still be wrong; None where nothing speaks for that.

    Args:
        first: The only one that is meant.
        room_id: Where it was asked for.
    """
    if first.kind is EntryKind.PLACE:
        return RecallDoubt.DOUBTFUL_RECORD if first.trust.ratio < DOUBTFUL_RATIO else None
    if first.position is None or first.uncertainty_m is None:
        return RecallDoubt.NOT_NOTED
    doubts = {
        RecallDoubt.CONTRADICTED: first.trust.ratio < DOUBTFUL_RATIO,
        RecallDoubt.LONG_AGO: first.trust.stayed_ratio < LEAST_STAYED_RATIO,
        RecallDoubt.FEW_VIEWS: first.trust.ratio < SURE_RATIO * first.trust.stayed_ratio,
        RecallDoubt.IMPRECISE: first.uncertainty_m > LARGEST_OFF_M,
        RecallDoubt.OTHER_ROOM: room_id is not None and set(first.room_ids) != {room_id},
        RecallDoubt.OUT_OF_SIGHT: first.check.is_ok and not first.is_faced,
        RecallDoubt.HARDLY_IN_SIGHT: first.check.is_ok and first.faced_ratio < LEAST_FACED_RATIO,
    }
    return next((doubt for doubt, is_so in doubts.items() if is_so), None)


LEAST_VIEWS = 3
"""Two wrong bearings sometimes intersect by chance; three rarely do."""
APART_M = 2.0
"""Of things of one name that stand nearer to each other, views may have been mixed up."""


def _find_best_known(
    world: WorldModel, answer: Answer, passing: Mapping[str, Remembered], room_id: str | None
) -> str | None:
    """Find the one thing that views from three places agree on, with no other of its name near.

    Returns:
        Its id; None without one, with several, or where anything else speaks against it.
    """
    meant = answer.candidates[: answer.n_meant]
    named = [passing[each.entry.id] for each in meant if each.basis is Basis.NAME]
    things = [each for each in named if isinstance(each, RememberedThing)]
    if len(things) < len(meant):
        return None
    sure = (
        each
        for each in things
        if each.thing.n_agreeing >= LEAST_VIEWS
        and not find_doubt(describe_candidate(world, each), room_id=room_id)
    )
    # To describe one costs much, and with a second one it is settled.
    best, second = next(sure, None), next(sure, None)
    if best is None or second is not None:
        return None
    near = [each for each in things if each.point.distance_to(best.point) < APART_M]
    return best.id if near == [best] else None


def find_speaking_places(
    world: WorldModel, words: str
) -> tuple[tuple[RememberedPlace, ...], Recall]:
    """Return the remembered places that speak of something, the likeliest first, and the answer."""
    answer = recall(world, RecallQuery(words=words))
    if answer.verdict is Verdict.NOT_REMEMBERED:
        return (), answer
    by_id = {place.id: place for place in world.places}
    ids = dict.fromkeys(place_id for each in answer.candidates for place_id in each.seen_from)
    return tuple(by_id[place_id] for place_id in ids), answer


def _rank(
    world: WorldModel,
    found: Sequence[EntryCandidate],
    passing: Mapping[str, Remembered],
    *,
    best: str | None,
    is_tied: bool,
) -> Iterator[EntryCandidate]:
    """Return candidates by likeness, and of several that are as like the nearest by path first.

    The way is worked out of those alone that may come next: of the others it is known that they
    are no nearer.

    Args:
        passing: What they stand for, by id.
        best: The id of the one that comes first whatever its likeness and way.
        is_tied: Several are called what was asked for.
    """
    likeness = [round(each.score_ratio, 3) for each in found]
    n_alike = Counter(likeness)
    queue: list[tuple[bool, float, float, int, bool, int]] = []
    for i, each in enumerate(found):
        needs_way = is_tied if each.basis is Basis.NAME else n_alike[likeness[i]] > 1
        remembered, least_m = passing[each.entry.id], math.inf
        if needs_way:
            least_m = 0.0
            if isinstance(remembered, RememberedThing):
                least_m = world.find_least_path_m(remembered)
        number = int(each.entry.id[1:])
        queue.append((each.entry.id != best, -likeness[i], least_m, number, needs_way, i))
    heapify(queue)
    while queue:
        is_other, unlikeness, _, number, needs_way, i = heappop(queue)
        if not needs_way:
            yield found[i]
            continue
        remembered = passing[found[i].entry.id]
        way_m = world.path_m(stand_at(world, Place(remembered.id, remembered)).point)
        far_m = math.inf if way_m is None else way_m
        heappush(queue, (is_other, unlikeness, far_m, number, False, i))
