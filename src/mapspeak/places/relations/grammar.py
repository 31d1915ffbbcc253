"""From words to a relation: a small grammar, one pattern for each kind of phrase."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from mapspeak.places.relations.vocabulary import (
    COUNT,
    DISTANCE,
    DOORS,
    GAP,
    ORDER,
    ORDERS,
    RANK,
    RANKS,
    Compass,
    Kind,
    Order,
    Side,
    pattern,
    plain,
    read_compass,
    read_count,
    read_distance,
    read_order,
)


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
    """A place at a given distance from a thing, in any direction."""

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
    """A place, and what to look at there; None for the door that leads back out of it."""

    place: str
    to: str | None


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


@dataclass(frozen=True, slots=True, kw_only=True)
class End:
    """An end of a corridor.

    Attributes:
        compass: On which side; None for the farther one by path from the robot, or the nearer.
    """

    of: str
    compass: Compass | None = None
    is_near: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Superlative:
    """The nearest thing of a kind or a name, the second-smallest, and so on.

    Attributes:
        kind: None for remembered things.
        label: What these are called; else empty.
        rank: 1 for the first in that order.
        to: From where ways are measured; None for the robot.
    """

    kind: Kind | None = None
    label: str = ""
    order: Order = Order.NEAREST
    rank: int = 1
    to: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Several:
    """All things of a kind or a name, or the first of an order.

    Attributes:
        kind: None for remembered things.
        label: What these are called; else empty.
        count: How many; None for all.
        at: The room they are of, or from where ways are measured; None for all and the robot.
        n_doors: Regions with so many doors; None for any.
    """

    kind: Kind | None = None
    label: str = ""
    order: Order = Order.NEAREST
    count: int | None = None
    at: str | None = None
    n_doors: int | None = None


Standing = Towards | Away | NextTo | Facing | Turned | Between | Corner | WallSide | Middle | End
"""What means where to stand."""
Relation = Standing | Superlative | Several

VERB = re.compile(r"\s*(?:go|drive|move|come|stand)\s+(?:to\s+)?(?=\S)", re.IGNORECASE)
"""What a person says before a place; it changes nothing."""
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
    """Return the relation that words express; None for other words."""
    if len(words) > LONGEST:
        return None
    wanted = plain(VERB.sub("", words, count=1))
    for form, read in _forms():
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


def _read_superlative(kind: Kind | None) -> Read:
    def read(match: re.Match[str]) -> Relation:
        return Superlative(
            kind=kind,
            label=match.groupdict().get("label", ""),
            order=read_order(match["order"]),
            rank=1 + RANKS.index(match["rank"].casefold()) if match["rank"] else 1,
            to=match["to"],
        )

    return read


def _read_some(kind: Kind | None) -> Read:
    def read(match: re.Match[str]) -> Relation:
        return Several(
            kind=kind,
            label=match.groupdict().get("label", ""),
            order=read_order(match["order"]),
            count=read_count(match["count"]),
            at=match["at"],
        )

    return read


def _read_with_doors(kind: Kind) -> Read:
    return lambda match: Several(kind=kind, n_doors=read_count(match["doors"]))


def _read_all(kind: Kind) -> Read:
    return lambda match: Several(kind=kind, at=match["at"])


WAY_ORDER = rf"(?P<order>{ORDERS[Order.NEAREST]}|{ORDERS[Order.FARTHEST]})"
ALL = r"(?:all|every|each)(?: of)?(?: the)?"
TOWARDS = r"(?:at|through|to|towards)"
LOOKING = rf"(?:facing|looking (?:back )?{TOWARDS})"
ITS_DOOR = r"(?:its (?:own )?|the )(?:door|doorway)"
FORMS: tuple[tuple[str, Read], ...] = (
    (
        (
            rf"(?P<place>.+?),? (?:(?:facing|look(?:ing)?) back(?: {TOWARDS} {ITS_DOOR})?"
            rf"|{LOOKING} its (?:own )?(?:door|doorway))"
        ),
        lambda m: Turned(m["place"].rstrip(","), None),
    ),
    (
        rf"(?P<place>.+),? {LOOKING} (?P<to>.+)",
        lambda m: Turned(m["place"].rstrip(","), m["to"]),
    ),
    *(
        (rf"{AWAY}{words}{OPEN}(?P<of>.+?){SEEN}", _read_side(side))
        for side, words in SIDES.items()
    ),
    (rf"{AWAY}{BESIDE}{COMPASS} of{OPEN}(?P<of>.+)", _read_compass),
    (rf"(?:at )?{DISTANCE} (?:away )?from{OPEN}(?P<of>.+)", _read_away),
    (rf"(?:in )?between{OPEN}(?P<of>.+)", _read_between),
    (
        (
            rf"{AT}(?:nearest |closest )?(?:{COMPASS} )?corner(?: (?:of|in) (?P<of>.+?))?"
            rf"(?: {BY} (?P<near>.+))?"
        ),
        lambda m: Corner(of=m["of"], compass=read_compass(m["compass"]), near=m["near"]),
    ),
    (
        (
            rf"(?:(?P<along>along|at|by|next to|beside|near|facing) )?{THE}"
            rf"(?:nearest |closest )?(?:{COMPASS} )?wall (?:of|in) (?P<of>.+)"
        ),
        _read_wall,
    ),
    (rf"{AT}(?:middle|cent(?:er|re)) of{OPEN}(?P<of>.+)", lambda m: Middle(m["of"])),
    (
        (
            rf"{AT}(?:(?:(?P<near>near(?:er|est)?)|far(?:ther)?|other|{COMPASS}) )?"
            rf"end of{OPEN}(?P<of>.+)"
        ),
        lambda m: End(of=m["of"], compass=read_compass(m["compass"]), is_near=bool(m["near"])),
    ),
    *(
        (
            rf"{AT}{RANK}{ORDER} (?:{words})(?: (?:to|from) (?P<to>.+))?",
            _read_superlative(kind),
        )
        for kind, words in KINDS.items()
    ),
    *(
        (
            rf"{THE}{COUNT} {ORDER} (?:{words})s?(?: (?:to|from) (?P<at>.+))?",
            _read_some(kind),
        )
        for kind, words in KINDS.items()
    ),
    *(
        (rf"(?:{ALL} )?(?:{words})s? with {DOORS} doors?", _read_with_doors(kind))
        for kind, words in KINDS.items()
        if kind in (Kind.ROOM, Kind.CORRIDOR, Kind.OPEN_SPACE)
    ),
    *(
        (
            rf"(?:{ALL} (?:{words})s?|{THE}(?:{words})s)(?: (?:of|in|into) (?P<at>.+))?",
            _read_all(kind),
        )
        for kind, words in KINDS.items()
    ),
    (
        rf"{THE}{COUNT} {WAY_ORDER} (?P<label>.+?)(?: (?:to|from) (?P<at>.+))?",
        _read_some(None),
    ),
    (
        rf"{ALL} (?:(?:remembered|known) )?(?P<label>.+)",
        lambda m: Several(label=m["label"]),
    ),
    (
        rf"(?:next to|beside|near(?: to)?|close to|by){OPEN}(?P<of>.+)",
        lambda m: NextTo(m["of"]),
    ),
    (rf"(?:facing|looking at){OPEN}(?P<of>.+)", lambda m: Facing(m["of"])),
    (
        rf"{AT}{RANK}{WAY_ORDER} (?P<label>.+?)(?: (?:to|from) (?P<to>.+))?",
        _read_superlative(None),
    ),
)
"""Tried in this order; the first that fits is meant."""


@cache
def _forms() -> tuple[tuple[re.Pattern[str], Read], ...]:
    """Return the forms as patterns: to make them all takes as long as to load a package."""
    return tuple((pattern(form), read) for form, read in FORMS)
