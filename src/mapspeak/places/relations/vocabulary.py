"""The words that phrases are made of: sides, directions, distances, kinds, ranks and numbers."""

import math
import re
from enum import StrEnum

from mapspeak.places.naming import NUMBER


class Side(StrEnum):
    """A side of a thing, its own if it has a front, else as seen by a viewer."""

    LEFT = "left of"
    RIGHT = "right of"
    FRONT = "in front of"
    BEHIND = "behind"


class Compass(StrEnum):
    """A direction on the map: +y is north."""

    EAST = "east"
    NORTH_EAST = "north-east"
    NORTH = "north"
    NORTH_WEST = "north-west"
    WEST = "west"
    SOUTH_WEST = "south-west"
    SOUTH = "south"
    SOUTH_EAST = "south-east"

    @property
    def heading_rad(self) -> float:
        """The same as a yaw in the map frame."""
        return math.remainder(list(Compass).index(self) * math.tau / 8, math.tau)


UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}
UNIT = r"(?P<unit>m|met(?:er|re)s?|cm|centimet(?:er|re)s?|mm|millimet(?:er|re)s?)"
RANKS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")
COUNTS = ("half", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
DISTANCE = rf"(?P<number>{NUMBER}|half a|an?|{'|'.join(COUNTS[1:])})[\s_-]*{UNIT}"
GAP = r"(?:[\s_]|-(?![\d.]))+"
"""Spaces, underscores and hyphens, but not the sign of a number."""


def pattern(words: str) -> re.Pattern[str]:
    """Return a pattern in which every space stands for spaces, underscores or hyphens."""
    return re.compile(words.replace(" ", GAP), re.IGNORECASE | re.DOTALL)


ARTICLE = pattern(r"(?:the|a|an) (?=\S)")


def plain(words: str) -> str:
    """Return the words without what does not count: an article, brackets or quotes around them."""
    kept = words.strip().rstrip(".!?;").strip()
    while kept:
        inner = _without_brackets(ARTICLE.sub("", kept, count=1) if ARTICLE.match(kept) else kept)
        if inner == kept:
            return kept
        kept = inner
    return kept


def _without_brackets(words: str) -> str:
    is_around = (words[:1], words[-1:]) in {("(", ")"), ("'", "'"), ('"', '"')} and len(words) > 1
    inner = words[1:-1]
    return inner.strip() if is_around and "(" not in inner and ")" not in inner else words


def read_distance(match: re.Match[str]) -> float | None:
    """Return the metres that a match of `DISTANCE` says; None where it says none."""
    number, unit = match["number"], match["unit"]
    if number is None:
        return None
    lowered = re.sub(GAP, " ", number).casefold()
    said = {"a": 1.0, "an": 1.0, "half a": 0.5} | {word: n for n, word in enumerate(COUNTS) if n}
    value = said[lowered] if lowered in said else float(number)
    short = {"c": "cm", "mi": "mm", "mm": "mm"}
    lowered_unit = unit.casefold()
    key = short.get(lowered_unit[:2], short.get(lowered_unit[:1], "m"))
    return value * UNITS_M[key]


def read_compass(words: str | None) -> Compass | None:
    """Return direction that is spelt "north-east", "northeast", "north east" or "north_east"."""
    if words is None:
        return None
    letters = re.sub(GAP, "", words).casefold().removesuffix("ern")
    return next((each for each in Compass if each.replace("-", "") == letters), None)


def read_heading(heading_rad: float) -> Compass:
    """Return the nearest of eight directions of the map."""
    return list(Compass)[round(heading_rad / (math.tau / 8)) % 8]


class Kind(StrEnum):
    """What one can ask for the nearest of."""

    FRONTIER = "frontier"
    DOOR = "door"
    CORRIDOR = "corridor"
    ROOM = "room"
    OPEN_SPACE = "open space"
    REMEMBERED = "remembered place"


class Order(StrEnum):
    """By what one thing of a kind is meant."""

    NEAREST = "nearest"
    FARTHEST = "farthest"
    SMALLEST = "smallest"
    LARGEST = "largest"

    @property
    def is_of_size(self) -> bool:
        """True where the way there does not count."""
        return self in (Order.SMALLEST, Order.LARGEST)


ORDERS = {
    Order.NEAREST: "nearest|closest",
    Order.FARTHEST: "farthest|furthest|most distant",
    Order.SMALLEST: "smallest|narrowest",
    Order.LARGEST: "largest|biggest|widest",
}
ORDER = rf"(?P<order>{'|'.join(ORDERS.values())})"
RANK = rf"(?:(?P<rank>{'|'.join(RANKS)}) )?"
COUNT = rf"(?P<count>[2-9]|1\d|{'|'.join(COUNTS[2:])})"

DOORS = rf"(?P<doors>\d{{1,2}}|{'|'.join(COUNTS[1:])})"


def read_order(word: str) -> Order:
    """Return what a word such as "closest" goes by."""
    spelt = re.sub(GAP, " ", word).casefold()
    return next(order for order, words in ORDERS.items() if spelt in words.split("|"))


def say_order(order: Order, rank: int) -> str:
    """Return "second-nearest" and the like."""
    return str(order) if rank == 1 else f"{RANKS[rank - 1]}-{order}"


def read_count(word: str) -> int:
    """Return the number that "2" or "two" is."""
    return int(word) if word.isdecimal() else COUNTS.index(word.casefold())
