"""Finds remembered places by the words that people use for them.

Words are compared as they are, then by their stem, and only a word that the map does not know at
all is taken for a misspelt one. Meaning is not compared: "something to put out a fire" finds an
extinguisher only where the record says so.
"""

import difflib
import math
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.semantic.waypoint import SemanticMap, Waypoint, name_key

MIN_SCORE_RATIO = 0.25
"""Below, too little of the phrase was found to speak of a match."""

_MIN_MISSPELT_LETTERS = 4
_MIN_LIKENESS_RATIO = 0.8

_FILLERS = """
    a an and any are at by can closest could drive find for from get go goto here i in is it its me
    move my navigate near nearest of on or place please robot some take that the there this to was
    we what where which with you your
""".split()  # noqa: SIM905 - fifty words in quotes would hide what they are


class MatchField(StrEnum):
    """Where in a record a word was found."""

    NAME = "name"
    LABEL = "label"
    PURPOSE = "purpose"
    FEATURE = "feature"
    DESCRIPTION = "description"


class MatchKind(StrEnum):
    """How a word of the phrase and a word of the record are the same."""

    SAME = "same"
    FORM = "form"
    MISSPELT = "misspelt"


_FIELD_WEIGHTS = {
    MatchField.NAME: 1.0,
    MatchField.LABEL: 0.9,
    MatchField.PURPOSE: 0.8,
    MatchField.FEATURE: 0.7,
    MatchField.DESCRIPTION: 0.6,
}
_KIND_WEIGHTS = {MatchKind.SAME: 1.0, MatchKind.FORM: 0.95, MatchKind.MISSPELT: 0.75}


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchEvidence:
    """One word of the phrase, and where the record says it.

    Attributes:
        query_word: As it stands in the phrase.
        found_word: As it stands in the record.
        field: Which part of the record.
        text: The name, label, purpose, feature or description it stands in.
        kind: How the two words are the same.
    """

    query_word: str
    found_word: str
    field: MatchField
    text: str
    kind: MatchKind

    @property
    def weight(self) -> float:
        """How much this finding says, up to 1."""
        return _FIELD_WEIGHTS[self.field] * _KIND_WEIGHTS[self.kind]


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


@dataclass(frozen=True, slots=True)
class _Word:
    """A word of a record, as it stands there and as it is compared."""

    shown: str
    compared: str
    field: MatchField
    text: str


@dataclass(frozen=True, slots=True)
class _Asked:
    """A word of the phrase.

    Attributes:
        shown: As it stands there.
        spellings: The words of the map that count as this one.
        weight: The rarer in the map, the more.
    """

    shown: str
    spellings: dict[str, MatchKind]
    weight: float


def find_waypoints(
    semantic_map: SemanticMap, query: str, *, limit: int = 5
) -> tuple[WaypointMatch, ...]:
    """Finds the places that a phrase may mean, the likeliest first; none where nothing fits."""
    records = [(place, list(_words_of(place))) for place in semantic_map.waypoints]
    asked = list(_asked_words(query, [words for _, words in records]))
    matches = [_match(place, words, asked, name_key(query)) for place, words in records]
    likely = [match for match in matches if match.score_ratio >= MIN_SCORE_RATIO]
    return tuple(sorted(likely, key=lambda match: -match.score_ratio)[:limit])


def _match(
    place: Waypoint, words: list[_Word], asked: list[_Asked], query_key: str
) -> WaypointMatch:
    if name_key(place.name) == query_key:
        name = MatchEvidence(
            query_word=place.name,
            found_word=place.name,
            field=MatchField.NAME,
            text=place.name,
            kind=MatchKind.SAME,
        )
        return WaypointMatch(waypoint=place, score_ratio=1.0, evidence=(name,))
    findings = [_finding(word, words) for word in asked]
    found = sum(
        word.weight * finding.weight
        for word, finding in zip(asked, findings, strict=True)
        if finding
    )
    score_ratio = found / max(sum(word.weight for word in asked), 1e-9)
    evidence = tuple(finding for finding in findings if finding)
    return WaypointMatch(waypoint=place, score_ratio=score_ratio, evidence=evidence)


def _finding(asked: _Asked, words: list[_Word]) -> MatchEvidence | None:
    """Gives the weightiest place in a record that says a word."""
    findings = (
        MatchEvidence(
            query_word=asked.shown,
            found_word=word.shown,
            field=word.field,
            text=word.text,
            kind=asked.spellings[word.compared],
        )
        for word in words
        if word.compared in asked.spellings
    )
    return max(findings, key=lambda finding: finding.weight, default=None)


def _asked_words(query: str, records: list[list[_Word]]) -> Iterator[_Asked]:
    n_records_with = Counter(
        compared for words in records for compared in {word.compared for word in words}
    )
    for shown, compared in _words(query):
        if compared not in _FILLERS:
            spellings = _spellings(compared, n_records_with)
            n_with = sum(n_records_with[spelling] for spelling in spellings)
            yield _Asked(shown, spellings, math.log1p(len(records) / max(n_with, 1)))


def _spellings(word: str, vocabulary: Iterable[str]) -> dict[str, MatchKind]:
    """Gives the words of the map that count as this one; likeness only where nothing else is."""
    stem = _stem(word)
    found = {other: MatchKind.FORM for other in vocabulary if _stem(other) == stem}
    if word in found:
        found[word] = MatchKind.SAME
    if found or len(word) < _MIN_MISSPELT_LETTERS:
        return found
    near = difflib.get_close_matches(word, vocabulary, n=3, cutoff=_MIN_LIKENESS_RATIO)
    return dict.fromkeys(near, MatchKind.MISSPELT)


def _words_of(place: Waypoint) -> Iterator[_Word]:
    for field, text in _texts_of(place):
        for shown, compared in _words(text):
            yield _Word(shown, compared, field, text)


def _texts_of(place: Waypoint) -> Iterator[tuple[MatchField, str]]:
    yield MatchField.NAME, place.name
    for landmark in place.landmarks:
        yield MatchField.LABEL, landmark.label
        yield MatchField.PURPOSE, landmark.purpose or ""
        yield MatchField.DESCRIPTION, landmark.note or ""
    for feature in place.geometric_features:
        yield MatchField.FEATURE, feature
    yield MatchField.DESCRIPTION, place.description


def _words(text: str) -> Iterator[tuple[str, str]]:
    """Gives each word as it stands and as it is compared: small letters without accents."""
    for shown in re.findall(r"\w+", text):
        letters = unicodedata.normalize("NFKD", shown.casefold())
        yield shown, "".join(c for c in letters if not unicodedata.combining(c))


def _stem(word: str) -> str:
    """Cuts an English ending off: plural, -ing, -ed, -er, a last e."""
    if len(word) > 4 and word.endswith("ies"):
        word = word[:-3] + "y"
    elif len(word) > 4 and word.endswith(("ses", "xes", "zes", "ches", "shes")):
        word = word[:-2]
    elif len(word) > 3 and word.endswith("s") and not word.endswith("ss"):
        word = word[:-1]
    for ending, n_left in (("ing", 3), ("ed", 3), ("er", 5)):
        if word.endswith(ending) and len(word) - len(ending) >= n_left:
            word = word.removesuffix(ending)
            return word[:-1] if word[-1] == word[-2] and word[-1] not in "ls" else word
    return word.removesuffix("e") if len(word) > 3 else word
