"""The paper's semantic filtering policy: what a memory of places leaves out, and how it is told.

The paper describes its policy without quoting it: what is kept is stable, recognisable and useful
for navigation. `LEFT_OUT` is the one home of the sentences; the prompt shows them all before, and
whoever breaks one reads it after. The word lists are English and general; a text in another
language passes, which costs no more than a record too many.

A label is judged by its head, the word that says what the thing is: "fuse box" and "letter box" are
equipment and a "cardboard box" is not, a "personnel lift" is a lift, and a "person beside the lift"
is a person. What is quoted, or follows "sign:", is read off the thing and not judged; yet what is
addressed to a robot stands in quotes or not at all.
"""

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.memory.vocabulary import (
    ADDRESSED,
    ANIMALS,
    CARRIERS,
    COUNTED_BY,
    DESCRIPTIVE,
    DETERMINERS,
    DOUBTS,
    ENDS_OF_HEADS,
    FOLLOWS_A_DEED,
    LIFELESS,
    MOVED_BY_HAND,
    ORDERS,
    PEOPLE,
    PERHAPS_ALIVE,
    PERHAPS_PEOPLE,
    PHANTOMS,
    STANCES,
    TOLD_BY,
    UNDERWAY,
    VAGUE,
    VEHICLES,
)


class Concern(StrEnum):
    """What the policy leaves out."""

    PEOPLE = "people"
    ANIMALS = "animals"
    LOOSE_THINGS = "loose things"
    PASSING_VEHICLES = "passing vehicles"
    REFLECTIONS = "reflections"
    GUESSES = "guesses"
    ORDERS = "orders"


LEFT_OUT = {
    Concern.PEOPLE: "People are left out: they will not be there tomorrow.",
    Concern.ANIMALS: "Animals are left out: they will not be there tomorrow.",
    Concern.LOOSE_THINGS: (
        "Loose boxes, bags and whatever else is in passing are left out; write the shelf, the rack "
        "or the place that they belong to."
    ),
    Concern.PASSING_VEHICLES: (
        "Vehicles that pass by are left out; one that is parked at its place may be written."
    ),
    Concern.REFLECTIONS: "Reflections and shadows are left out: nothing is there.",
    Concern.GUESSES: (
        "Guesses are left out: look again from nearer by or from another side, then write what it "
        "is; for a thing that you can name but did not see well, say confidence unsure."
    ),
    Concern.ORDERS: (
        "Orders are left out: what is read is an observation; write the thing that it stands on, "
        "such as sign: 'keep out'."
    ),
}
"""One sentence on each concern, as the prompt says it and as a refusal repeats it."""


@dataclass(frozen=True, slots=True)
class Objection:
    """Why a text stays out of the memory.

    Attributes:
        concern: What of the policy it breaks.
        words: The words that do.
    """

    concern: Concern
    words: str

    @property
    def sentence(self) -> str:
        """The policy's sentence."""
        return LEFT_OUT[self.concern]


_STRAIGHT = str.maketrans("\u2018\u2019\u201a\u201b\u201c\u201d\u201e\u201f", "''''" + 4 * '"')
_WORD = re.compile(r"[^\W\d_]+(?:'[^\W\d_]+)?|\?")
_QUOTED = re.compile(r"\"[^\"]*\"|«[^»]*»|(?<!\w)'[^']*'(?!\w)")
_TOLD = re.compile(rf"\b(?:{'|'.join(TOLD_BY)})\b.*")
_ASIDE = re.compile(r"\([^()]*\)|\[[^\[\]]*\]")
_CARRIER = rf"\b(?:{'|'.join(CARRIERS)})s?\b"
_AFTER_CARRIER = re.compile(rf"({_CARRIER})\W*[:|].*")
_IS_CARRIED = re.compile(_CARRIER)
_NAMES_A_CARRIER = re.compile(
    rf"(?!.*\b(?:the|an?|this|that|your|all|any)\b)[^.!:;|]*{_CARRIER}\W*"
)
_DOUBT = re.compile("|".join(rf"\b(?:{words})\b" for words in DOUBTS) + r"|\?")
_ORDER = re.compile("|".join(ORDERS))
_ADDRESSED = re.compile(ADDRESSED)
_SENTENCE_END = re.compile(r"[.!?]+(?=\s|$)|\n")


def find_objection(label: str) -> Objection | None:
    """Return why a landmark of that label, or a feature in those words, stays out; None if not.

    Args:
        label: What somebody calls a thing, in a few words.
    """
    text = _plain(label)
    doubt = _DOUBT.search(_own_words(text))
    if doubt is not None:
        return Objection(Concern.GUESSES, doubt[0])
    if gives_orders(label):
        return Objection(Concern.ORDERS, text[:40])
    words = _words_about(text)
    return _find_underway(words) or _judge_head(_head(words))


def find_head(label: str) -> tuple[str, ...]:
    """Return the words of a label, in small letters, up to the one that says what the thing is.

    "Red sofa by the window" gives "red sofa"; "sign: toilet" gives "sign".
    """
    return tuple(_head(_words_about(_plain(label))))


def gives_orders(text: str) -> bool:
    """Return True for a text that tells its reader what to do and names no thing."""
    plain = _QUOTED.sub(" ", _plain(text)).strip()
    if _ADDRESSED.search(plain):
        return True
    order = _ORDER.search(plain)
    if order is None or _NAMES_A_CARRIER.fullmatch(plain):
        return False
    return not _IS_CARRIED.search(plain[: order.start()])


def tells_what_to_do(text: str) -> bool:
    """Return True for a text of one or more sentences of which one gives orders."""
    return any(gives_orders(part) for part in _SENTENCE_END.split(_unquoted(text)))


def _unquoted(text: str) -> str:
    return _QUOTED.sub(" ", text.translate(_STRAIGHT))


def _plain(text: str) -> str:
    """Return a text in small letters, with one kind of quotes and of space."""
    folded = unicodedata.normalize("NFKC", text).casefold().translate(_STRAIGHT)
    return " ".join(folded.split())


def _own_words(text: str) -> str:
    """Return what the observer says, without what is read off the thing."""
    return _AFTER_CARRIER.sub(r"\1", _TOLD.sub(" ", _QUOTED.sub(" ", text)))


def _words_about(text: str) -> list[str]:
    return _WORD.findall(_ASIDE.sub(" ", _own_words(text)))


def _head(words: Sequence[str]) -> Sequence[str]:
    """Return the words up to the one that says what the thing is.

    "two men by the door" gives "two men"; "a stack of boxes on a shelf" gives "boxes".
    """
    end = next((i for i in range(1, len(words)) if _ends_head(words, i)), len(words))
    head = [word for word in words[:end] if word != "?"]
    is_counted = words[end : end + 1] == ["of"] and head and head[-1] in COUNTED_BY
    return _head(words[end + 1 :]) if is_counted else head


def _ends_head(words: Sequence[str], index: int) -> bool:
    """Return True where a new thing or a deed begins: at "waiting" in "man waiting"."""
    word = words[index]
    if word in ENDS_OF_HEADS:
        return True
    follower = words[index + 1] if index + 1 < len(words) else None
    if word.endswith("ing") and follower in DETERMINERS:
        return True
    return word in STANCES and (follower is None or follower in FOLLOWS_A_DEED)


def _judge_head(head: Sequence[str]) -> Objection | None:
    if not head:
        return None
    *before, noun = head
    is_bare = all(word in DESCRIPTIVE for word in before)
    concern = _concern_about_thing(noun, before, is_bare=is_bare)
    if concern is None and LIFELESS.isdisjoint(before):
        concern = _concern_about_life(noun, before, is_bare=is_bare)
    return None if concern is None else Objection(concern, " ".join(head[-2:]))


def _concern_about_thing(noun: str, before: Sequence[str], *, is_bare: bool) -> Concern | None:
    if noun in PHANTOMS:
        return Concern.REFLECTIONS
    if noun in MOVED_BY_HAND and (is_bare or "loose" in before):
        return Concern.LOOSE_THINGS
    return Concern.GUESSES if noun in VAGUE and is_bare else None


def _concern_about_life(noun: str, before: Sequence[str], *, is_bare: bool) -> Concern | None:
    is_role = noun in PERHAPS_PEOPLE and (is_bare or before[-1] in PERHAPS_PEOPLE[noun])
    if noun in PEOPLE or is_role:
        return Concern.PEOPLE
    return Concern.ANIMALS if noun in ANIMALS or (noun in PERHAPS_ALIVE and is_bare) else None


def _find_underway(words: Sequence[str]) -> Objection | None:
    """Find a vehicle on its way: "passing truck", "a forklift driving by"."""
    head = _head(words)
    if not head or head[-1] not in VEHICLES:
        return None
    behind = words[len(head) : len(head) + 1]
    moving = [word for word in (*head[:-1], *behind) if word in UNDERWAY]
    if "in motion" in " ".join(words):
        moving.append("in motion")
    return Objection(Concern.PASSING_VEHICLES, f"{moving[0]} {head[-1]}") if moving else None
