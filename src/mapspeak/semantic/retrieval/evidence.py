"""Why something was found: which words of a request stand where in a record."""

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["FIELD_WEIGHTS", "KIND_WEIGHTS", "MatchEvidence", "MatchField", "MatchKind"]


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
    """How a word of the phrase and a word of the record are the same.

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


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchEvidence:
    """One word of the phrase, and where the record says it.

    Attributes:
        query_word: As it stands in the phrase.
        found_word: As it stands in the record.
        field: Which part of the record.
        text: The name, label, purpose, feature, note or description it stands in.
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
        return FIELD_WEIGHTS[self.field] * KIND_WEIGHTS[self.kind]
