"""Finds remembered places by the words that people use for them.

Words are compared as they are, then by their stem, and only a word that the map does not know at
all is taken for a misspelt one. Meaning is not compared: "something to put out a fire" finds an
extinguisher only where the record says so.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from mapspeak.semantic.retrieval.evidence import MatchEvidence, MatchField, MatchKind
from mapspeak.semantic.retrieval.wordindex import WordIndex
from mapspeak.semantic.waypoint import SemanticMap, Waypoint, name_key

__all__ = ["MIN_SCORE_RATIO", "WaypointMatch", "find_waypoints"]

MIN_SCORE_RATIO = 0.25
"""Below, too little of the phrase was found to speak of a match."""

_ACCEPTED = (MatchKind.SAME, MatchKind.FORM, MatchKind.MISSPELT)


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointMatch:
    """A remembered place that a phrase may mean.

    Attributes:
        waypoint: The place.
        score_ratio: How much of the phrase was found, rare words counting more; 1 for its name.
        evidence: At most one finding for each word of the phrase.
    """

    waypoint: Waypoint
    score_ratio: float
    evidence: tuple[MatchEvidence, ...]


def find_waypoints(
    semantic_map: SemanticMap, query: str, *, limit: int = 5
) -> tuple[WaypointMatch, ...]:
    """Finds the places that a phrase may mean, the likeliest first; none where nothing fits."""
    places = semantic_map.waypoints
    index = WordIndex([list(_texts_of(place)) for place in places], accepted=_ACCEPTED)
    asked = index.ask(query)
    scores = index.score_ratios(asked).tolist()
    is_named = [name_key(place.name) == name_key(query) for place in places]
    scores = [1.0 if named else score for named, score in zip(is_named, scores, strict=True)]
    likely = [number for number, score in enumerate(scores) if score >= MIN_SCORE_RATIO]
    best = sorted(likely, key=lambda number: -scores[number])[:limit]
    return tuple(
        WaypointMatch(
            waypoint=places[number],
            score_ratio=scores[number],
            evidence=_its_name(places[number])
            if is_named[number]
            else index.explain(asked, number),
        )
        for number in best
    )


def _its_name(place: Waypoint) -> tuple[MatchEvidence, ...]:
    name = place.name
    return (
        MatchEvidence(
            query_word=name,
            found_word=name,
            field=MatchField.NAME,
            text=name,
            kind=MatchKind.SAME,
        ),
    )


def _texts_of(place: Waypoint) -> Iterator[tuple[MatchField, str]]:
    yield MatchField.NAME, place.name
    for landmark in place.landmarks:
        yield MatchField.LABEL, landmark.label
        yield MatchField.PURPOSE, landmark.purpose or ""
        yield MatchField.NOTE, landmark.note or ""
    for feature in place.geometric_features:
        yield MatchField.FEATURE, feature
    yield MatchField.DESCRIPTION, place.description
