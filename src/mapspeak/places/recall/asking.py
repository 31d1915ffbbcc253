"""From a request in words to candidates with their evidence, their place and a checked goal."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from heapq import heapify, heappop, heappush
from itertools import islice

from mapspeak.geometry import Point
from mapspeak.memory import Landmark
from mapspeak.memory.search import Answer, Basis, EntryCandidate, EntryKind, Verdict
from mapspeak.places.goalcheck import judge_goal
from mapspeak.places.naming import Place, split_room
from mapspeak.places.recall.answer import (
    Recall,
    RecallCandidate,
    RecallQuery,
    find_doubt,
)
from mapspeak.places.relations.choosing import stand_at
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Remembered, RememberedPlace, RememberedThing


def find_passing(world: WorldModel, query: RecallQuery) -> Iterator[Remembered]:
    """Return the places, then the things, that pass every filter of a request."""
    everything: list[Remembered] = [*world.recollection.places, *world.things]
    return (each for each in everything if _passes(world, each, query))


def kind_of(remembered: Remembered) -> EntryKind:
    """Say whether it is a place or a thing."""
    return EntryKind.PLACE if isinstance(remembered, RememberedPlace) else EntryKind.THING


def point_of(remembered: Remembered) -> Point:
    """Return where it is; of a thing without a position, where it was seen from."""
    if isinstance(remembered, RememberedPlace):
        return remembered.waypoint.pose.point
    return remembered.point


def find_rooms(world: WorldModel, remembered: Remembered) -> tuple[str, ...]:
    """Return the rooms it may be in, by id."""
    if isinstance(remembered, RememberedPlace):
        room_id = world.find_room_id(point_of(remembered))
        return () if room_id is None else (room_id,)
    return world.rooms_before(remembered)


def last_seen(world: WorldModel, remembered: Remembered) -> datetime | None:
    """Return when it was seen last, by the calendar; None where nobody noted it."""
    if isinstance(remembered, RememberedPlace):
        return remembered.waypoint.recorded_at
    times = (view.recorded_at for _, view in list_views(world, remembered))
    return max(filter(None, times), default=None)


def list_views(
    world: WorldModel, remembered: Remembered
) -> Iterator[tuple[RememberedPlace, Landmark]]:
    """Return what was seen of a thing, each with its time and picture, and from where."""
    if isinstance(remembered, RememberedPlace):
        return
    for view in remembered.thing.supporting:
        place = world.recollection.find_place(view.waypoint)
        if place is not None:
            yield place, place.waypoint.dated(view.landmark)


def _passes(world: WorldModel, remembered: Remembered, query: RecallQuery) -> bool:
    if query.kind not in (None, kind_of(remembered)):
        return False
    if query.near is not None and point_of(remembered).distance_to(query.near) > query.near_m:
        return False
    if query.since is not None or query.until is not None:
        seen_at = last_seen(world, remembered)
        if seen_at is None or not _is_between(seen_at, query):
            return False
    return query.room_id is None or query.room_id in find_rooms(world, remembered)


def _is_between(moment: datetime, query: RecallQuery) -> bool:
    is_late = query.since is None or moment >= query.since
    return is_late and (query.until is None or moment < query.until)


def describe_candidate(
    world: WorldModel,
    remembered: Remembered,
    *,
    match: EntryCandidate | None = None,
    near: Point | None = None,
) -> RecallCandidate:
    """Return what is known of a place or thing, and the pose in which a robot would stand for it.

    Args:
        world: The map with the memory.
        remembered: The place or thing.
        match: How it matches a request; None where nothing was asked.
        near: The point that the request is near to.
    """
    if isinstance(remembered, RememberedPlace):
        return _describe_place(world, remembered, match, near)
    return _describe_thing(world, remembered, match, near)


def _describe_place(
    world: WorldModel, remembered: RememberedPlace, match: EntryCandidate | None, near: Point | None
) -> RecallCandidate:
    waypoint = remembered.waypoint
    pose = stand_at(world, Place(remembered.id, remembered))
    check = judge_goal(world.grid, world.distances, pose, opened=world.map.open.distances_from)
    return RecallCandidate(
        id=remembered.id,
        kind=EntryKind.PLACE,
        name=waypoint.name,
        score_ratio=1.0 if match is None else match.score_ratio,
        match=match,
        away_m=None if near is None else point_of(remembered).distance_to(near),
        seen_from=(remembered.id,),
        pictures=() if waypoint.picture is None else (waypoint.picture,),
        position=waypoint.pose.point,
        uncertainty_m=None,
        room_ids=find_rooms(world, remembered),
        pose=pose,
        is_faced=False,
        faced_ratio=0.0,
        check=check,
        last_seen=last_seen(world, remembered),
        trust=world.judge.judge_place(remembered),
    )


def _describe_thing(
    world: WorldModel, remembered: RememberedThing, match: EntryCandidate | None, near: Point | None
) -> RecallCandidate:
    thing = remembered.thing
    pose = stand_at(world, Place(remembered.id, remembered))
    check = judge_goal(world.grid, world.distances, pose, opened=world.map.open.distances_from)
    views = list(list_views(world, remembered))
    pictures = (view.picture for _, view in views)
    return RecallCandidate(
        id=remembered.id,
        kind=EntryKind.THING,
        name=thing.label,
        score_ratio=1.0 if match is None else match.score_ratio,
        match=match,
        away_m=None if near is None else point_of(remembered).distance_to(near),
        seen_from=tuple(dict.fromkeys(place.id for place, _ in views)),
        pictures=tuple(dict.fromkeys(filter(None, pictures))),
        position=thing.position,
        uncertainty_m=thing.uncertainty_m,
        room_ids=find_rooms(world, remembered),
        pose=pose,
        is_faced=world.find_approach(remembered) is not None,
        faced_ratio=world.measure_faced(remembered),
        check=check,
        last_seen=last_seen(world, remembered),
        trust=world.judge.judge_thing(remembered),
    )


LEAST_VIEWS = 3
"""Two views of wrong things meet somewhere now and then; three hardly ever do."""
APART_M = 2.0
"""Of things of one name that stand nearer to each other, views may have been mixed up."""


def find_best_known(
    world: WorldModel, meant: Sequence[Remembered], *, room_id: str | None
) -> RememberedThing | None:
    """Find the one thing that views from three places agree on, with no other of its name near.

    Args:
        world: The map with the memory.
        meant: Of one name.
        room_id: Where it was asked for.

    Returns:
        None where there is none, or several, or where anything else speaks against it.
    """
    things = [each for each in meant if isinstance(each, RememberedThing)]
    if len(things) < len(meant):
        return None
    known = (each for each in things if each.thing.n_agreeing >= LEAST_VIEWS)
    sure = (
        each for each in known if not find_doubt(describe_candidate(world, each), room_id=room_id)
    )
    # To describe one costs much, and with a second one it is settled.
    best, second = next(sure, None), next(sure, None)
    if best is None or second is not None:
        return None
    near = [each for each in things if each.point.distance_to(best.point) < APART_M]
    return best if near == [best] else None


MOST_TIED = 30
"""So many equally likely ones are sorted by their way; of more, the first by their ids."""


def recall(world: WorldModel, query: RecallQuery) -> Recall:
    """Return what is remembered of a request; the same for the same memory, map and pose."""
    query = _with_room(world, query)
    passing = {each.id: each for each in find_passing(world, query)}
    among = frozenset(passing)
    answer = world.recollection.find(query.words, among=among, limit=max(query.n, MOST_TIED))
    is_tied = 1 < answer.n_meant <= MOST_TIED
    best = _find_best(world, answer, passing, room_id=query.room_id) if is_tied else None
    if best is not None:
        answer = replace(answer, verdict=Verdict.FOUND)
    ranked = _rank(world, answer.candidates, passing, best=best, is_tied=is_tied)
    candidates = tuple(
        describe_candidate(
            world,
            passing[each.entry.id],
            match=each,
            near=query.near,
        )
        for each in islice(ranked, query.n)
    )
    doubt = None
    if answer.verdict is Verdict.FOUND:
        doubt = find_doubt(candidates[0], room_id=query.room_id)
    return Recall(
        query=query,
        answer=answer,
        candidates=candidates,
        n_searched=len(among),
        is_empty=not (world.recollection.places or world.things),
        doubt=doubt,
    )


def _find_best(
    world: WorldModel, answer: Answer, passing: Mapping[str, Remembered], *, room_id: str | None
) -> str | None:
    """Return the id of the one that is known best of all that are called so; None where none is."""
    meant = answer.candidates[: answer.n_meant]
    if any(each.basis is not Basis.NAME for each in meant):
        return None
    best = find_best_known(world, [passing[each.entry.id] for each in meant], room_id=room_id)
    return None if best is None else best.id


def _with_room(world: WorldModel, query: RecallQuery) -> RecallQuery:
    """Take the room out of words such as "ladder in R2", so that it is a filter."""
    if query.room_id is not None:
        return query
    words, room_id = split_room(world, query.words)
    return replace(query, words=words, room_id=room_id)


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
        world: The map with the memory.
        found: The candidates.
        passing: What they stand for, by id.
        best: The id of the one that comes first whatever its likeness and way.
        is_tied: Several are called what was asked for.
    """
    n_alike = Counter(map(_likeness, found))
    queue: list[tuple[bool, float, float, int, bool, int]] = []
    for i, each in enumerate(found):
        needs_way = is_tied if each.basis is Basis.NAME else n_alike[_likeness(each)] > 1
        least_m = _find_least_m(world, passing[each.entry.id]) if needs_way else math.inf
        number = int(each.entry.id[1:])
        queue.append((each.entry.id != best, -_likeness(each), least_m, number, needs_way, i))
    heapify(queue)
    while queue:
        is_other, unlikeness, _, number, needs_way, i = heappop(queue)
        if not needs_way:
            yield found[i]
            continue
        way_m = _find_way_m(world, passing[found[i].entry.id])
        heappush(queue, (is_other, unlikeness, way_m, number, False, i))


def _find_least_m(world: WorldModel, remembered: Remembered) -> float:
    if isinstance(remembered, RememberedThing):
        return world.find_least_path_m(remembered)
    return 0.0


def _find_way_m(world: WorldModel, remembered: Remembered) -> float:
    way_m = world.path_m(stand_at(world, Place(remembered.id, remembered)).point)
    return math.inf if way_m is None else way_m


def _likeness(found: EntryCandidate) -> float:
    """Return how alike a candidate is, as far as that tells two of them apart."""
    return round(found.score_ratio, 3)
