"""From a request in words to candidates with their evidence, their place and a checked goal."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from heapq import heapify, heappop, heappush
from itertools import islice

from mapspeak.places.choosing import stand_at
from mapspeak.places.naming import Place, say_spot
from mapspeak.places.recall.answer import Recall, RecallQuery
from mapspeak.places.recall.candidates import describe_candidate
from mapspeak.places.recall.filters import find_passing, point_of
from mapspeak.places.recall.preferring import find_best_known
from mapspeak.places.recall.wording import find_doubt, say_advice, say_evidence
from mapspeak.places.thingnames import split_room
from mapspeak.semantic.retrieval import Answer, Basis, Candidate, Verdict
from mapspeak.worldmodel.model import Atlas
from mapspeak.worldmodel.recollection import (
    Remembered,
    RememberedPlace,
    RememberedThing,
)

__all__ = ["find_speaking_places", "recall"]

MOST_TIED = 30
"""So many equally likely ones are sorted by their way; of more, the first by their ids."""


def recall(atlas: Atlas, query: RecallQuery) -> Recall:
    """Gives what is remembered of a request; the same for the same memory, map and pose."""
    query = _with_room(atlas, query)
    passing = {each.id: each for each in find_passing(atlas, query)}
    among = frozenset(passing)
    answer = atlas.recollection.find(query.words, among=among, limit=max(query.n, MOST_TIED))
    is_tied = 1 < answer.n_meant <= MOST_TIED
    best = _find_best(atlas, answer, passing, room_id=query.room_id) if is_tied else None
    if best is not None:
        answer = replace(answer, verdict=Verdict.FOUND)
    ranked = _rank(atlas, answer.candidates, passing, best=best, is_tied=is_tied)
    candidates = tuple(
        describe_candidate(
            atlas,
            passing[each.entry.id],
            score_ratio=each.score_ratio,
            evidence="; ".join(_say_why(query, each, passing[each.entry.id])),
        )
        for each in islice(ranked, query.n)
    )
    doubt = ""
    if answer.verdict is Verdict.FOUND:
        doubt = find_doubt(candidates[0], room_id=query.room_id)
    return Recall(
        verdict=Verdict.LIKELY if doubt else answer.verdict,
        advice=say_advice(
            answer,
            candidates,
            n_searched=len(among),
            is_empty=not (atlas.recollection.places or atlas.things),
            doubt=doubt,
        ),
        candidates=candidates,
        n_meant=answer.n_meant,
        n_searched=len(among),
        understood=answer.understood,
        limits=answer.limits,
    )


def _find_best(
    atlas: Atlas, answer: Answer, passing: Mapping[str, Remembered], *, room_id: str | None
) -> str | None:
    """Gives the id of the one that is known best of all that are called so; None where none is."""
    meant = answer.candidates[: answer.n_meant]
    if any(each.basis is not Basis.NAME for each in meant):
        return None
    best = find_best_known(atlas, [passing[each.entry.id] for each in meant], room_id=room_id)
    return None if best is None else best.id


def _say_why(query: RecallQuery, found: Candidate, remembered: Remembered) -> Iterator[str]:
    yield say_evidence(found)
    if query.near is not None:
        yield f"{point_of(remembered).distance_to(query.near):.1f} m from {say_spot(query.near)}"


def _with_room(atlas: Atlas, query: RecallQuery) -> RecallQuery:
    """Takes the room out of words such as "ladder in R2", so that it is a filter."""
    if query.room_id is not None:
        return query
    words, room_id = split_room(atlas, query.words)
    return replace(query, words=words, room_id=room_id)


def find_speaking_places(atlas: Atlas, words: str) -> tuple[tuple[RememberedPlace, ...], Recall]:
    """Gives the remembered places that speak of something, the likeliest first, and the answer."""
    answer = recall(atlas, RecallQuery(words=words))
    if answer.verdict is Verdict.NOT_REMEMBERED:
        return (), answer
    by_id = {place.id: place for place in atlas.places}
    ids = dict.fromkeys(place_id for each in answer.candidates for place_id in each.seen_from)
    return tuple(by_id[place_id] for place_id in ids), answer


def _rank(
    atlas: Atlas,
    found: Sequence[Candidate],
    passing: Mapping[str, Remembered],
    *,
    best: str | None,
    is_tied: bool,
) -> Iterator[Candidate]:
    """Gives candidates by likeness, and of several that are as like the nearest by path first.

    The way is worked out of those alone that may come next: of the others it is known that they
    are no nearer.

    Args:
        atlas: The map with the memory.
        found: The candidates.
        passing: What they stand for, by id.
        best: The id of the one that comes first whatever its likeness and way.
        is_tied: Several are called what was asked for.
    """
    n_alike = Counter(map(_likeness, found))
    queue: list[tuple[bool, float, float, int, bool, int]] = []
    for i, each in enumerate(found):
        needs_way = is_tied if each.basis is Basis.NAME else n_alike[_likeness(each)] > 1
        least_m = _find_least_m(atlas, passing[each.entry.id]) if needs_way else math.inf
        number = int(each.entry.id[1:])
        queue.append((each.entry.id != best, -_likeness(each), least_m, number, needs_way, i))
    heapify(queue)
    while queue:
        is_other, unlikeness, _, number, needs_way, i = heappop(queue)
        if not needs_way:
            yield found[i]
            continue
        way_m = _find_way_m(atlas, passing[found[i].entry.id])
        heappush(queue, (is_other, unlikeness, way_m, number, False, i))


def _find_least_m(atlas: Atlas, remembered: Remembered) -> float:
    if isinstance(remembered, RememberedThing):
        return atlas.find_least_path_m(remembered)
    return 0.0


def _find_way_m(atlas: Atlas, remembered: Remembered) -> float:
    way_m = atlas.path_m(stand_at(atlas, Place(remembered.id, remembered)).point)
    return math.inf if way_m is None else way_m


def _likeness(found: Candidate) -> float:
    """Gives how alike a candidate is, as far as that tells two of them apart."""
    return round(found.score_ratio, 3)
