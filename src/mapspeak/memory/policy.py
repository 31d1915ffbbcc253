"""The paper's semantic filtering policy: what a memory of places leaves out, and its wording.

The paper describes its policy without quoting it: what is kept is stable, recognisable and useful
for navigation. `LEFT_OUT` is the one home of the sentences: the prompt shows them all, and a
refusal repeats the one that was broken. The word lists are English and general; a text in another
language passes, which costs at most a superfluous record.

A label is judged by its head, the word that says what the thing is: "fuse box" and "letter box" are
equipment and a "cardboard box" is not, a "personnel lift" is a lift, and a "person beside the lift"
is a person. Text in quotes or after "sign:" is read off the thing and not judged; text addressed to
a robot must be in quotes.
"""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib import resources
from typing import Any

from ruamel.yaml import YAML


class Concern(StrEnum):
    """Kinds of content that the policy leaves out."""

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


_STRAIGHT = str.maketrans("\u2018\u2019\u201a\u201b\u201c\u201d\u201e\u201f", "''''" + 4 * '"')
_WORD = re.compile(r"[^\W\d_]+(?:'[^\W\d_]+)?|\?")
_QUOTED = re.compile(r"\"[^\"]*\"|«[^»]*»|(?<!\w)'[^']*'(?!\w)")
_ASIDE = re.compile(r"\([^()]*\)|\[[^\[\]]*\]")
_SENTENCE_END = re.compile(r"[.!?]+(?=\s|$)|\n")


@cache
def _knowledge() -> Mapping[str, Any]:
    """Read the list of words once; it never changes."""
    text = resources.files(__package__).joinpath("data/words.yaml").read_text(encoding="utf-8")
    knowledge: Mapping[str, Any] = YAML(typ="safe", pure=True).load(text)
    return knowledge


@cache
def half_lives() -> Mapping[int, frozenset[str]]:
    """Return by hours the nouns of things of which half stand elsewhere after so long."""
    return {
        int(hours): frozenset(words.split()) for hours, words in _knowledge()["half_lives"].items()
    }


@cache
def words_of(entry: str) -> frozenset[str]:
    """Return the words under one entry of `data/words.yaml`, or the phrases of a list."""
    known = _knowledge()[entry]
    return frozenset(known.split() if isinstance(known, str) else known)


@dataclass(frozen=True, slots=True)
class _Patterns:
    """Patterns to search texts for; a carrier is a thing that bears words."""

    told: re.Pattern[str]
    carrier: re.Pattern[str]
    after_carrier: re.Pattern[str]
    names_a_carrier: re.Pattern[str]
    doubt: re.Pattern[str]
    order: re.Pattern[str]
    use: re.Pattern[str]
    addressed: re.Pattern[str]


@cache
def _patterns() -> _Patterns:
    known = _knowledge()
    carrier = rf"\b(?:{'|'.join(known['carriers'].split())})s?\b"
    parts = known["order_parts"]
    use, *orders = (
        re.sub("<([a-z]+)>", lambda part: parts[part[1]], each)
        for each in (known["use"], *known["orders"])
    )
    return _Patterns(
        told=re.compile(rf"\b(?:{'|'.join(known['told_by'].split())})\b.*"),
        carrier=re.compile(carrier),
        after_carrier=re.compile(rf"({carrier})\W*[:|].*"),
        names_a_carrier=re.compile(
            rf"(?!.*\b(?:the|an?|this|that|your|all|any)\b)[^.!:;|]*{carrier}\W*"
        ),
        doubt=re.compile("|".join(rf"\b(?:{words})\b" for words in known["doubts"]) + r"|\?"),
        order=re.compile("|".join(orders)),
        use=re.compile(use),
        addressed=re.compile(known["addressed"]),
    )


def find_concern(label: str) -> Concern | None:
    """Return why a landmark of that label, or a feature in those words, stays out; None if allowed.

    A label names a thing in a few words.
    """
    text = _plain(label)
    if _patterns().doubt.search(_own_words(text)):
        return Concern.GUESSES
    if gives_orders(label):
        return Concern.ORDERS
    words = _words_about(text)
    return Concern.PASSING_VEHICLES if _is_underway(words) else _judge_head(_head(words))


def find_head(label: str) -> tuple[str, ...]:
    """Return the words of a label, in small letters, up to the one that says what the thing is.

    "Red sofa by the window" gives "red sofa"; "sign: toilet" gives "sign".
    """
    return tuple(_head(_words_about(_plain(label))))


def gives_orders(text: str) -> bool:
    """Return True for a text that tells its reader what to do and names no thing."""
    plain = _QUOTED.sub(" ", _plain(text)).strip()
    patterns = _patterns()
    if patterns.addressed.search(plain):
        return True
    order = patterns.order.search(plain)
    if order is None or patterns.names_a_carrier.fullmatch(plain):
        return False
    return not patterns.carrier.search(plain[: order.start()])


def tells_what_to_do(text: str) -> bool:
    """Return True if any sentence of a text gives orders."""
    unquoted = _QUOTED.sub(" ", text.translate(_STRAIGHT))
    return any(gives_orders(part) for part in _SENTENCE_END.split(unquoted))


PASSING = (Concern.PEOPLE, Concern.ANIMALS)
_THERE = re.compile(r"\s*there (?:is|are) ", re.IGNORECASE)


def find_passing(text: str) -> Concern | None:
    """Return why a description tells of nothing that stays; None where one sentence does."""
    parts = (_THERE.sub("", part) for part in _SENTENCE_END.split(text) if part.strip())
    concerns = [find_concern(part) for part in parts]
    return next((each for each in concerns if set(concerns) <= {*PASSING}), None)


def is_purpose(text: str) -> bool:
    """Return True unless a purpose gives orders; what a thing is for may read like one."""
    use = _patterns().use.match(_plain(text))
    return not tells_what_to_do(text if use is None else _plain(text)[use.end() :])


def _plain(text: str) -> str:
    """Return a text in small letters, with one kind of quotes and of space."""
    folded = unicodedata.normalize("NFKC", text).casefold().translate(_STRAIGHT)
    return " ".join(folded.split())


def _own_words(text: str) -> str:
    """Return the observer's words without those read off the thing."""
    patterns = _patterns()
    return patterns.after_carrier.sub(r"\1", patterns.told.sub(" ", _QUOTED.sub(" ", text)))


def _words_about(text: str) -> list[str]:
    return _WORD.findall(_ASIDE.sub(" ", _own_words(text)))


def _head(words: Sequence[str]) -> Sequence[str]:
    """Return the words up to the one that says what the thing is.

    "two men by the door" gives "two men"; "a stack of boxes on a shelf" gives "boxes".
    """
    end = next((i for i in range(1, len(words)) if _ends_head(words, i)), len(words))
    head = [word for word in words[:end] if word != "?"]
    is_counted = words[end : end + 1] == ["of"] and head and head[-1] in words_of("counted_by")
    return _head(words[end + 1 :]) if is_counted else head


def _ends_head(words: Sequence[str], index: int) -> bool:
    """Return True if a new thing or an action begins: at "waiting" in "man waiting"."""
    word = words[index]
    if word in words_of("ends_of_heads"):
        return True
    follower = words[index + 1] if index + 1 < len(words) else None
    if word.endswith("ing") and follower in words_of("determiners"):
        return True
    may_follow = words_of("determiners") | words_of("follows_a_deed") | {None}
    return word in words_of("stances") and follower in may_follow


def _judge_head(head: Sequence[str]) -> Concern | None:
    *before, noun = head or [""]
    is_bare = words_of("descriptive").issuperset(before)
    if noun in words_of("phantoms"):
        return Concern.REFLECTIONS
    if noun in words_of("moved_by_hand") and (is_bare or "loose" in before):
        return Concern.LOOSE_THINGS
    if noun in words_of("vague") and is_bare:
        return Concern.GUESSES
    is_lifeless = not words_of("lifeless").isdisjoint(before)
    return None if is_lifeless else _judge_life(noun, before, is_bare=is_bare)


def _judge_life(noun: str, before: Sequence[str], *, is_bare: bool) -> Concern | None:
    jobs: Mapping[str, str] = _knowledge()["perhaps_people"]
    is_role = noun in jobs and (is_bare or before[-1] in jobs[noun].split())
    if noun in words_of("people") or is_role:
        return Concern.PEOPLE
    is_alive = noun in words_of("animals") or (noun in words_of("perhaps_alive") and is_bare)
    return Concern.ANIMALS if is_alive else None


def _is_underway(words: Sequence[str]) -> bool:
    """Return True for a vehicle on its way: "passing truck", "a forklift driving by"."""
    head = _head(words)
    if not head or head[-1] not in words_of("vehicles"):
        return False
    behind = words[len(head) : len(head) + 1]
    is_moving = not words_of("underway").isdisjoint((*head[:-1], *behind))
    return is_moving or "in motion" in " ".join(words)
