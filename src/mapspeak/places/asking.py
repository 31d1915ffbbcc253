"""From a request in words to what is remembered of it: where, how sure, and where to stand."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from heapq import heapify, heappop, heappush
from itertools import islice

from mapspeak.geometry import Point
from mapspeak.memory import Waypoint
from mapspeak.memory.search.answer import (
    Answer,
    Basis,
    EntryCandidate,
    EntryKind,
    MatchField,
    Verdict,
)
from mapspeak.places.candidate import (
    RecallCandidate,
    RecallDoubt,
    describe_candidate,
    find_doubt,
    find_rooms_of,
    kind_of,
    last_seen,
    point_of,
)
from mapspeak.places.naming import Place, find_elsewhere
from mapspeak.places.things import split_room
from mapspeak.places.ways import stand_at
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


def _leave_out_viewpoints(answer: Answer, passing: Mapping[str, Remembered]) -> Answer:
    """Return an answer in which no place that saw a thing that is meant is its rival."""
    fitting = answer.candidates[: answer.n_meant]
    meant = [passing[each.entry.id] for each in fitting]
    seen_from = {
        name for each in meant if isinstance(each, RememberedThing) for name in each.thing.waypoints
    }
    is_viewpoint = [
        isinstance(each, RememberedPlace) and each.waypoint.name in seen_from for each in meant
    ]
    if not any(is_viewpoint):
        return answer
    things = [each for each, is_left in zip(fitting, is_viewpoint, strict=True) if not is_left]
    n_meant = answer.n_meant - sum(is_viewpoint)
    is_one = n_meant == 1 and answer.verdict is Verdict.SEVERAL
    return replace(
        answer,
        candidates=(*things, *answer.candidates[answer.n_meant :]),
        n_meant=n_meant,
        verdict=Verdict.FOUND if is_one else answer.verdict,
    )


MOST_TIED = 30
"""Up to this number, equally likely candidates are sorted by path; beyond, by id."""


def recall(world: WorldModel, query: RecallQuery) -> Recall:
    """Return what is remembered of a request; the same for the same memory, map and pose."""
    if query.room_id is None:
        words, room_id = split_room(world, query.words)
        query = replace(query, words=words, room_id=room_id)
    passing = _find_passing(world, query)
    answer = _find(world, query, passing)
    if moved := _find_moved(world, query, answer, passing):
        passing = {id_: each for id_, each in passing.items() if id_ not in moved}
        answer = _find(world, query, passing)
    answer = _leave_out_viewpoints(answer, passing)
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


CALLED = (MatchField.NAME, MatchField.LABEL, MatchField.OTHER_NAME)
BESIDE = (MatchField.DESCRIPTION, MatchField.PLACE)


def leave_out_beside(recalled: Recall) -> Recall:
    """Return an answer without what only stands beside a thing that is meant.

    What is meant is surely named, or has words of the request in its own label.
    """
    answer = recalled.answer
    fitting = answer.candidates[: answer.n_meant]
    if not answer.is_sure and not all(each.field in CALLED for each in fitting):
        return recalled
    meant = {each.entry.id for each in fitting}
    kept = tuple(
        each
        for each in recalled.candidates
        if each.id in meant or each.match is None or each.match.field not in BESIDE
    )
    return replace(recalled, candidates=kept)


def _find_passing(world: WorldModel, query: RecallQuery) -> Mapping[str, Remembered]:
    """Return what passes the filters of a query by its id: all that is remembered without any."""
    everything = world.recollection.by_id
    filters = (query.kind, query.near, query.since, query.until, query.room_id)
    if not any(each is not None for each in filters):
        return everything
    return {id_: each for id_, each in everything.items() if _passes(world, each, query)}


def _find(world: WorldModel, query: RecallQuery, passing: Mapping[str, Remembered]) -> Answer:
    among = None if passing is world.recollection.by_id else frozenset(passing)
    limit = max(query.n, MOST_TIED)
    return world.recollection.find(query.words, among=among, limit=limit)


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
    if query.kind not in (None, kind_of(remembered)):
        return False
    if query.near is not None and point_of(remembered).distance_to(query.near) > query.near_m:
        return False
    if query.since is not None or query.until is not None:
        seen_at = last_seen(world, remembered)
        if seen_at is None or (query.since is not None and seen_at < query.since):
            return False
        if query.until is not None and seen_at >= query.until:
            return False
    return query.room_id is None or query.room_id in find_rooms_of(world, remembered)


LEAST_VIEWS = 3
"""Two wrong bearings sometimes intersect by chance; three rarely do."""
APART_M = 2.0
"""Of things of one name that stand nearer to each other, views may have been mixed up."""


def _find_best_known(
    world: WorldModel, answer: Answer, passing: Mapping[str, Remembered], room_id: str | None
) -> str | None:
    """Find the one thing that views from three places agree on, with no other of its name near.

    Another one that nothing speaks against must not be nearer by path either.

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
    if near != [best]:
        return None
    best_m = _measure_way(world, best)
    rivals = (
        each
        for each in things
        if each is not best
        and each.thing.n_agreeing > 1
        and world.find_least_path_m(each) < best_m
        and _measure_way(world, each) < best_m
        and not find_doubt(describe_candidate(world, each), room_id=room_id)
    )
    return None if any(rivals) else best.id


def _measure_way(world: WorldModel, remembered: Remembered) -> float:
    """Return the path to where the robot would stand for it; infinite where no way leads there."""
    way_m = world.path_m(stand_at(world, Place(remembered.id, remembered)).point)
    return math.inf if way_m is None else way_m


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
        far_m = _measure_way(world, remembered)
        heappush(queue, (is_other, unlikeness, far_m, number, False, i))
