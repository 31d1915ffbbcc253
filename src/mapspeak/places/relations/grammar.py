"""From words to a relation: a small grammar, one pattern for each kind of phrase."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.places.naming import NUMBER


class Side(StrEnum):
    """A side of a thing, its own where it has a front, else as somebody sees it."""

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Towards:
    """A place in some direction from a thing.

    Attributes:
        direction: One of its sides, or of the map.
        seen_from: From where its sides are meant; None for its own front, or the robot.
    """

    direction: Side | Compass
    of: str
    away_m: float | None = None
    seen_from: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Away:
    """A place so far from a thing, in any direction."""

    of: str
    away_m: float


@dataclass(frozen=True, slots=True)
class NextTo:
    """A place beside a thing."""

    of: str


@dataclass(frozen=True, slots=True)
class Facing:
    """A place from which a thing is seen, looking at it."""

    of: str


@dataclass(frozen=True, slots=True)
class Turned:
    """A place, and what to look at there."""

    place: str
    to: str


@dataclass(frozen=True, slots=True)
class Between:
    """A place half way between two things.

    Attributes:
        ways: In which the words can be divided into two, the likeliest first.
    """

    ways: tuple[tuple[str, str], ...]
    of: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Corner:
    """A corner of a room.

    Attributes:
        of: The room; None for that of the thing beside it, or of the robot.
        compass: Where in the room; None for the nearest one.
        near: The thing that it is next to.
    """

    of: str | None = None
    compass: Compass | None = None
    near: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class WallSide:
    """A place at a wall of a room.

    Attributes:
        is_along: Heading along it, not looking at it.
    """

    of: str
    compass: Compass | None = None
    is_along: bool = False


@dataclass(frozen=True, slots=True)
class Middle:
    """The middle of something."""

    of: str


@dataclass(frozen=True, slots=True)
class Nearest:
    """The nearest thing of a kind, from the robot or from a place."""

    kind: Kind
    to: str | None = None


Relation = (
    Towards | Away | NextTo | Facing | Turned | Between | Corner | WallSide | Middle | Nearest
)

LONGEST = 300
"""Longer words are a text and no phrase."""
THE = r"(?:the )?"
BESIDE = r"(?:(?:to|on|at) )?(?:the )?"
AT = r"(?:(?:to|at|in|on|into) )?(?:the )?"
COMPASS = r"(?P<compass>(?:north|south)(?:[\s_-]*(?:east|west))?(?:ern)?|(?:east|west)(?:ern)?)"
BY = r"(?:next to|beside|near(?:est)?(?: to)?|close(?:st)?(?: to)?|by)"
OPEN = rf"(?:{GAP}|\s*(?=\())"

SIDES = {
    Side.LEFT: rf"{BESIDE}left(?: hand)?(?: side)? of",
    Side.RIGHT: rf"{BESIDE}right(?: hand)?(?: side)? of",
    Side.FRONT: rf"(?:in {THE}front of|ahead of)",
    Side.BEHIND: r"(?:behind|in back of|at the back of)",
}
AWAY = rf"(?:(?:at )?{DISTANCE} )?"
ROBOT_SEES = r"(?:as the robot sees it|(?:as seen )?from the robot'?s? (?:point of )?view)"
SEEN = rf"(?:,?{GAP}(?:(?P<robot>{ROBOT_SEES})|(?:as )?seen from (?P<seen_from>.+)))?"
KINDS = {
    Kind.FRONTIER: "frontier|unexplored (?:area|place|part|space|region)|unknown(?: area)?",
    Kind.DOOR: "door|doorway",
    Kind.CORRIDOR: "corridor|hallway",
    Kind.ROOM: "room",
    Kind.OPEN_SPACE: "open space",
    Kind.REMEMBERED: "remembered place|waypoint",
}

Read = Callable[[re.Match[str]], Relation | None]


def parse_relation(words: str) -> Relation | None:
    """Return the relation that words begin with; None where they are none."""
    if len(words) > LONGEST:
        return None
    wanted = plain(words)
    for form, read in FORMS:
        match = form.fullmatch(wanted)
        relation = None if match is None else read(match)
        if relation is not None:
            return relation
    return None


def _read_side(side: Side) -> Read:
    def read(match: re.Match[str]) -> Relation:
        seen_from = "robot" if match["robot"] else match["seen_from"]
        return Towards(
            direction=side, of=match["of"], away_m=read_distance(match), seen_from=seen_from
        )

    return read


def _read_compass(match: re.Match[str]) -> Relation | None:
    compass = read_compass(match["compass"])
    if compass is None:
        return None
    return Towards(direction=compass, of=match["of"], away_m=read_distance(match))


def _read_away(match: re.Match[str]) -> Relation | None:
    away_m = read_distance(match)
    return None if away_m is None else Away(of=match["of"], away_m=away_m)


def _read_between(match: re.Match[str]) -> Relation:
    of = plain(match["of"])
    parted = [
        part for by in (r"\s+and\s+", r"\s*,\s*and\s+", r"\s*[,;]\s*") for part in _split(by, of)
    ]
    return Between(tuple(dict.fromkeys(parted)), of)


def _split(by: str, words: str) -> list[tuple[str, str]]:
    cuts = re.finditer(by, words, re.IGNORECASE)
    return [
        (words[: cut.start()], words[cut.end() :])
        for cut in cuts
        if words[: cut.start()].strip() and words[cut.end() :].strip()
    ]


def _read_wall(match: re.Match[str]) -> Relation:
    is_along = match["along"].casefold() == "along" if match["along"] else False
    return WallSide(of=match["of"], compass=read_compass(match["compass"]), is_along=is_along)


def _read_nearest(kind: Kind) -> Read:
    return lambda match: Nearest(kind, match["to"])


FORMS: tuple[tuple[re.Pattern[str], Read], ...] = (
    (
        pattern(r"(?P<place>.+),? (?:facing|looking at) (?P<to>.+)"),
        lambda m: Turned(m["place"].rstrip(","), m["to"]),
    ),
    *(
        (pattern(rf"{AWAY}{words}{OPEN}(?P<of>.+?){SEEN}"), _read_side(side))
        for side, words in SIDES.items()
    ),
    (pattern(rf"{AWAY}{BESIDE}{COMPASS} of{OPEN}(?P<of>.+)"), _read_compass),
    (pattern(rf"(?:at )?{DISTANCE} (?:away )?from{OPEN}(?P<of>.+)"), _read_away),
    (pattern(rf"(?:in )?between{OPEN}(?P<of>.+)"), _read_between),
    (
        pattern(
            rf"{AT}(?:nearest |closest )?(?:{COMPASS} )?corner(?: (?:of|in) (?P<of>.+?))?"
            rf"(?: {BY} (?P<near>.+))?"
        ),
        lambda m: Corner(of=m["of"], compass=read_compass(m["compass"]), near=m["near"]),
    ),
    (
        pattern(
            rf"(?:(?P<along>along|at|by|next to|beside|near|facing) )?{THE}"
            rf"(?:nearest |closest )?(?:{COMPASS} )?wall (?:of|in) (?P<of>.+)"
        ),
        _read_wall,
    ),
    (pattern(rf"{AT}(?:middle|cent(?:er|re)) of{OPEN}(?P<of>.+)"), lambda m: Middle(m["of"])),
    *(
        (
            pattern(rf"{AT}(?:nearest|closest) (?:{words})(?: (?:to|from) (?P<to>.+))?"),
            _read_nearest(kind),
        )
        for kind, words in KINDS.items()
    ),
    (
        pattern(rf"(?:next to|beside|near(?: to)?|close to|by){OPEN}(?P<of>.+)"),
        lambda m: NextTo(m["of"]),
    ),
    (pattern(rf"(?:facing|looking at){OPEN}(?P<of>.+)"), lambda m: Facing(m["of"])),
)
"""Tried in this order; the first that fits is meant."""
