"""Search results: candidates, why they were found, and how far to trust the first."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.memory.quoting import name_key
from mapspeak.memory.waypoint import Landmark, SemanticMap, Waypoint


class MatchField(StrEnum):
    """Where in a record a word was found, or where in what is commonly known of such a thing."""

    NAME = "name"
    LABEL = "label"
    CATEGORY = "category"
    PURPOSE = "purpose"
    FEATURE = "feature"
    NOTE = "note"
    DESCRIPTION = "description"
    PLACE = "place"
    OTHER_NAME = "other name"
    USE = "usual use"


class MatchKind(StrEnum):
    """Kind of match between a word of the phrase and a word of the record.

    A part is "dish" in "dishwasher": a word at one end of a longer one.
    """

    SAME = "same"
    FORM = "form"
    MISSPELT = "misspelt"
    PART = "part"


FIELD_WEIGHTS = {
    MatchField.NAME: 1.0,
    MatchField.LABEL: 0.9,
    MatchField.CATEGORY: 0.8,
    MatchField.PURPOSE: 0.8,
    MatchField.FEATURE: 0.7,
    MatchField.NOTE: 0.6,
    MatchField.DESCRIPTION: 0.6,
    MatchField.PLACE: 0.4,
    MatchField.OTHER_NAME: 0.7,
    MatchField.USE: 0.4,
}
KIND_WEIGHTS = {
    MatchKind.SAME: 1.0,
    MatchKind.FORM: 0.95,
    MatchKind.MISSPELT: 0.75,
    MatchKind.PART: 0.6,
}
WHOLE_WORD_WEIGHTS = KIND_WEIGHTS | {MatchKind.PART: 0.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchEvidence:
    """One word of the phrase, and where the record says it."""

    query_word: str
    found_word: str
    field: MatchField
    text: str
    kind: MatchKind

    @property
    def weight(self) -> float:
        """Weight of this match, up to 1."""
        return FIELD_WEIGHTS[self.field] * KIND_WEIGHTS[self.kind]


class EntryKind(StrEnum):
    """Kind of entry."""

    PLACE = "place"
    THING = "thing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A place or a thing, with its texts.

    Attributes:
        id: The owner's unique key for it.
        place: For a thing, the name of the place where it is.
        surroundings: Description of that place.
    """

    id: str
    kind: EntryKind
    name: str
    category: str | None = None
    purpose: str | None = None
    note: str | None = None
    description: str = ""
    features: tuple[str, ...] = ()
    place: str | None = None
    surroundings: tuple[str, ...] = ()
    other_names: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All its names, its own first."""
        return (self.name, *self.other_names)

    @property
    def texts(self) -> tuple[tuple[MatchField, str], ...]:
        """All its texts, its name first; each with its part of the record."""
        return tuple((field, text) for field, text in self._fields() if text)

    def _fields(self) -> Iterator[tuple[MatchField, str | None]]:
        called = MatchField.NAME if self.kind is EntryKind.PLACE else MatchField.LABEL
        yield from ((called, name) for name in self.names)
        yield MatchField.CATEGORY, self.category
        yield MatchField.PURPOSE, self.purpose
        yield MatchField.NOTE, self.note
        yield MatchField.DESCRIPTION, self.description
        yield from ((MatchField.FEATURE, feature) for feature in self.features)
        yield MatchField.PLACE, self.place
        yield from ((MatchField.PLACE, text) for text in self.surroundings)


def list_entries(semantic_map: SemanticMap) -> tuple[Entry, ...]:
    """Return each place followed by the landmarks seen from it.

    The id of a place is the key of its name; that of a landmark has both keys and, if a label
    occurs several times there, its number among those.
    """
    return tuple(entry for place in semantic_map.waypoints for entry in _entries_of(place))


def _entries_of(place: Waypoint) -> Iterator[Entry]:
    yield Entry(
        id=name_key(place.name),
        kind=EntryKind.PLACE,
        name=place.name,
        description=place.description,
        features=place.geometric_features,
    )
    n_before: Counter[str] = Counter()
    for landmark in place.landmarks:
        key = name_key(landmark.label)
        n_before[key] += 1
        number = f" / {n_before[key]}" if n_before[key] > 1 else ""
        yield _thing(landmark, place, id_=f"{name_key(place.name)} / {key}{number}")


def _thing(landmark: Landmark, place: Waypoint, *, id_: str) -> Entry:
    return Entry(
        id=id_,
        kind=EntryKind.THING,
        name=landmark.label,
        category="safety equipment" if landmark in place.safety_landmarks else None,
        purpose=landmark.purpose,
        note=landmark.note,
        place=place.name,
        surroundings=(place.description, *place.geometric_features),
    )


class Verdict(StrEnum):
    """Trust in an answer.

    Found: it is the one meant. Likely: one fits, but its record is not sure; a search of words
    alone never returns that, the search of things, which knows their views, does. Several: each of
    these is what was asked for. Unsure: some are like it, and perhaps none is meant.
    """

    FOUND = "found"
    LIKELY = "likely"
    SEVERAL = "several"
    UNSURE = "unsure"
    NOT_REMEMBERED = "not_remembered"


class Basis(StrEnum):
    """Basis of a match: the name, the meaning, or the words of a candidate."""

    NAME = "name"
    MEANING = "meaning"
    WORDS = "words"


@dataclass(frozen=True, slots=True, kw_only=True)
class Chance:
    """How likely something is by similarities: a logistic regression (Platt, 1999).

    Attributes:
        likeness: Weight of the similarity of the request to the first candidate.
        lead: Weight of its lead over the first one with another name.
        missing: Weight of the lead of a kind that is not remembered over the first candidate.
    """

    constant: float
    likeness: float
    lead: float = 0.0
    missing: float

    def ratio(self, likeness: float, lead: float, missing: float, *, n_words: int = 1) -> float:
        """Return the probability; a missing kind that is much less like counts for nothing more.

        Args:
            n_words: How many words each tell so much: what agrees in four says more than in one.
        """
        terms = self.likeness * likeness + self.lead * lead + self.missing * max(missing, -1.0)
        return 1.0 / (1.0 + math.exp(-(self.constant + n_words * terms)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Thresholds:
    """What similarities mean; each way of comparing has its own scale.

    Attributes:
        least_ratio: Similarity from which a text is about a phrase.
        same_ratio: Scores no further apart count as equal.
        right: How likely the first candidate is what is meant.
        there: How likely what is meant is remembered at all.
    """

    least_ratio: float
    same_ratio: float
    right: Chance
    there: Chance


SURE_RATIO = 0.93
"""The first candidate is said to be the one meant where it is so likely."""
REMEMBERED_RATIO = 0.65
"""A request is said not to be remembered where it is less likely."""
WORD_THRESHOLDS = Thresholds(
    least_ratio=0.05,
    same_ratio=0.02,
    right=Chance(constant=-1.12, likeness=0.67, lead=3.05, missing=-1.88),
    there=Chance(constant=0.46, likeness=2.01, missing=-3.01),
)
MINILM_THRESHOLDS = Thresholds(
    least_ratio=0.25,
    same_ratio=0.05,
    right=Chance(constant=-1.3, likeness=3.11, lead=4.84, missing=-7.26),
    there=Chance(constant=0.48, likeness=2.98, missing=-10.07),
)
"""Fitted to the requests for tuning; benchmarks/requests/README.md says how."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EntryCandidate:
    """Something that a request may mean.

    Attributes:
        score_ratio: Similarity to the request; 1 for its exact name.
        field: The part of the record most similar to the request.
        evidence: The words of the request that the record contains.
        said_ratio: Share of the request that the record contains word for word; rare words and
            names count more, parts of words nothing.
    """

    entry: Entry
    score_ratio: float
    basis: Basis
    field: MatchField
    text: str
    evidence: tuple[MatchEvidence, ...]
    said_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Answer to a request.

    Attributes:
        understood: The request with misspelt words corrected.
        verdict: Trust in the first candidate. If nothing is remembered, the candidates are only
            the most similar things, and probably not meant.
        n_meant: Number of remembered entries that fit as well as the first.
        is_sure: The name of the first is the one meant, though several may share it.
        limits: Limitations of the search, in words; None without any.
        missing: A kind that is not remembered and more similar to the request than anything
            remembered, where the request calls it by name or a model compares meanings; else None.
    """

    query: str
    understood: str
    verdict: Verdict
    candidates: tuple[EntryCandidate, ...]
    n_meant: int
    is_sure: bool
    limits: str | None = None
    missing: str | None = None

    def find_speaking(self, *, least_said_ratio: float) -> tuple[EntryCandidate, ...]:
        """Return the candidates that are surely meant, or contain enough of the request."""
        n_sure = self.n_meant if self.is_sure else 0
        return tuple(
            each
            for number, each in enumerate(self.candidates)
            if number < n_sure or each.said_ratio >= least_said_ratio
        )
