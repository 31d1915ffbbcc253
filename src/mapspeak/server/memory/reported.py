"""What nobody has written down, yet the robot's own detector has reported: from its episodes."""

from datetime import datetime

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.places.recall import Recall, RecallQuery
from mapspeak.semantic import find_objection
from mapspeak.semantic.episodes import EpisodeQuery, EpisodeStore, Observation, ObservationKind
from mapspeak.semantic.quoting import quote_name
from mapspeak.semantic.retrieval import EntryKind, Verdict, calls_by_name
from mapspeak.server.memory.moments import say_age
from mapspeak.server.wording import say_count, say_pose

MOST_READ = 200
APART_M = 1.0
"""Pictures from nearer to each other are from one place."""


def say_reported(
    store: EpisodeStore, answer: Recall, query: RecallQuery, *, map_id: str | None, now: datetime
) -> str:
    """Gives what the detector reported of a thing that no record is called by; empty for nothing.

    A report is less than a record: nobody has checked it, and where the thing is was not noted.

    Args:
        store: What was observed.
        answer: What is remembered.
        query: What was asked.
        map_id: The map that the robot is on; None takes all poses for its.
        now: The operator's time.
    """
    is_open = answer.verdict in (Verdict.NOT_REMEMBERED, Verdict.AMBIGUOUS)
    is_called_so = any(calls_by_name(query.words, [each.name]) for each in answer.candidates)
    if not is_open or is_called_so or query.kind is EntryKind.PLACE:
        return ""
    seen = [
        (label, each)
        for each in _find_pictures(store, query, map_id)
        if (label := _find_label(each, query.words)) is not None
    ]
    if not seen:
        return ""
    label, last = max(seen, key=lambda pair: pair[1].recorded_at)
    n_places = _count_places([each.pose.point for _, each in seen])
    return (
        f"Not written down, but seen: the robot's detector reported {quote_name(label)} in "
        f"{say_count(len(seen), 'picture')} from {say_count(n_places, 'place')}, last "
        f"{say_age(last.recorded_at, now)} from {say_pose(last.pose)} ({last.id}). Nobody has "
        "checked that; recall_episodes shows them."
    )


def _find_pictures(
    store: EpisodeStore, query: RecallQuery, map_id: str | None
) -> tuple[Observation, ...]:
    wanted = EpisodeQuery(
        words=query.words,
        near=query.near,
        radius_m=None if query.near is None else query.near_m,
        room_id=query.room_id,
        since=query.since,
        until=query.until,
        kind=ObservationKind.PICTURE,
        map_id=map_id,
        limit=MOST_READ,
    )
    try:
        return tuple(match.observation for match in store.find(wanted).matches)
    except SemanticMapError:
        # What cannot be read costs no answer about what is remembered.
        return ()


def _find_label(seen: Observation, words: str) -> str | None:
    called = (label for label in seen.labels if calls_by_name(words, [label]))
    return next((label for label in called if find_objection(label) is None), None)


def _count_places(points: list[Point]) -> int:
    places: list[Point] = []
    for point in points:
        if all(point.distance_to(each) > APART_M for each in places):
            places.append(point)
    return len(places)
