"""Events: a place, a time and an effect, beside the words that a person said."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import datetime, timedelta, tzinfo
from enum import StrEnum

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose
from mapspeak.memory.frames import FrameId
from mapspeak.memory.policy import tells_what_to_do
from mapspeak.memory.quoting import clean_line, name_key, quote

_WAYS = re.compile(
    r"^ *(?:please )?(?:avoid|keep|stay|slow|(?:do not|don't) (?:enter|use|cross|pass|block))\b",
    re.IGNORECASE | re.MULTILINE,
)
"""Phrases about closed or slow ways: an event may say these."""
_QUOTE_SIGN = re.compile(
    "[\"«»\u2039\u203a\u201a-\u201f]|(?<!\\w)['\u2018\u2019]|['\u2018\u2019](?!\\w)"
)
_NUMBER = r"-?\d+(?:\.\d+)?"
_OWN_PLACE = re.compile(rf"(?:{_NUMBER} m around )?(?:[RCODFPT]\d+|{_NUMBER}, ?{_NUMBER})")
"""A place given by an id or in metres needs no quotes."""


def gives_orders(text: str) -> bool:
    """Return True if the words of an event tell the reader what to do, even in quotes."""
    # An order may be inside one pair of quotes, or continue behind them.
    return any(tells_what_to_do(_WAYS.sub("", _QUOTE_SIGN.sub(by, text))) for by in (" ", "\n"))


def tell_place(place: str) -> str:
    """Return the place: an id or a point unquoted, other words quoted."""
    if _OWN_PLACE.fullmatch(place):
        return place
    return "its place gives orders and is left out" if gives_orders(place) else quote(place)


Outline = tuple[Point, ...]
"""Corners in order; the last is joined to the first."""

ID_RULE = "at most 16 letters, digits, - and _"
"""Rule for event ids, which are shown without quotes."""
ROBOT = "the robot"
SHUT = "the robot could not get through"
OPEN_AGAIN = f"{SHUT}, and came through later"
"""All that the robot notes by itself, and under which name."""
_N_WORKDAYS = 5
_ID = re.compile(r"[A-Za-z0-9_-]{1,16}")
_PLACE_ID = re.compile(r"\b[RCOD]\d+\b")


class Effect(StrEnum):
    """Effect of an event on paths.

    Closed: no path leads through. Slow and avoid: paths around it are preferred, for avoid even
    long ones. None: it is only a note.
    """

    CLOSED = "closed"
    SLOW = "slow"
    AVOID = "avoid"
    NONE = "none"


class Every(StrEnum):
    """Recurrence of an event, at the first time's hours by the operator's clock on the wall."""

    ONCE = "once"
    DAY = "day"
    WORKDAY = "workday"
    WEEK = "week"


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """A temporary condition of a place.

    Attributes:
        place: In words or ids at the time of writing: "corridor C1".
        outlines: Of the place at the time of writing, in the map frame; unlike ids, they never
            change.
        until: The first moment after the end; None if unknown. For a recurring event, both
            times are those of the first occurrence.
        frame: The frame of the memory that its place is in; None for its own.

    Raises:
        SemanticMapError: It has no words, an invalid id, no place though it needs one, or it
            ends before it begins.
    """

    text: str
    place: str = ""
    effect: Effect = Effect.NONE
    id: str = ""
    at: Point | None = None
    outlines: tuple[Outline, ...] = ()
    begins: datetime | None = None
    until: datetime | None = None
    every: Every = Every.ONCE
    source: str = ""
    recorded_at: datetime | None = None
    frame: FrameId = None

    def __post_init__(self) -> None:
        for key in ("id", "text", "place", "source"):
            object.__setattr__(self, key, clean_line(getattr(self, key)))
        _require(not self.id or is_event_id(self.id), "An event's id is none", f"Give {ID_RULE}.")
        _require(self.text, "An event has no text", "Say what is the matter.")
        _require(
            self.effect is Effect.NONE or self.place or self.outlines,
            f"The event {self.told_text} is {self.effect}, but at no place",
            "Name the place, such as C1 or D2.",
        )
        _require(
            self.begins is None or self.until is None or self.begins < self.until,
            f"The event {self.told_text} ends before it begins",
            "Correct its times.",
        )
        _require(
            self.every is Every.ONCE or self._fits_between(),
            f"The event {self.told_text} comes again every {self.every}, but has no beginning and "
            "end with less than that between them",
            "Say from when to when, such as 08:00 and 10:00.",
        )

    def _fits_between(self) -> bool:
        if self.begins is None or self.until is None:
            return False
        return self.until - self.begins <= timedelta(days=7 if self.every is Every.WEEK else 1)

    def find_time(self, now: datetime) -> tuple[datetime | None, datetime | None]:
        """Return its present occurrence, else the next one, as begin and end."""
        if self.every is Every.ONCE or self.begins is None or self.until is None:
            return self.begins, self.until
        first = show_local(self.begins, now)
        length = show_local(self.until, now) - first
        day = max(show_local(now, now) - length, first).date()
        while True:
            begins = datetime.combine(day, first.time())
            is_day = (
                self.every is Every.DAY
                or (self.every is Every.WORKDAY and begins.weekday() < _N_WORKDAYS)
                or (self.every is Every.WEEK and begins.weekday() == first.weekday())
            )
            ends = read_local(begins + length, now)
            if is_day and now < ends:
                return read_local(begins, now), ends
            day += timedelta(days=1)

    def is_over(self, now: datetime) -> bool:
        """Return True if it will not occur again."""
        return self.every is Every.ONCE and self.until is not None and self.until <= now

    @property
    def is_of_robot(self) -> bool:
        """True for the robot's notes on its own drives; others under its name use other words."""
        is_in_its_words = self.text in (SHUT, OPEN_AGAIN) and self.effect is Effect.AVOID
        return self.source == ROBOT and is_in_its_words

    @property
    def is_note_of_place(self) -> bool:
        """True for what is so at a place for good and changes no way."""
        has_time = self.begins is not None or self.until is not None
        return self.effect is Effect.NONE and bool(self.place) and not has_time

    def is_current(self, now: datetime) -> bool:
        """Return True while it lasts; `now` has a zone."""
        begins, until = self.find_time(now)
        return (begins is None or begins <= now) and (until is None or now < until)

    def moved(self, motion: Pose, into: FrameId = None) -> "Event":
        """Return it in another frame, by the transform from the present one to that."""
        return replace(
            self,
            frame=into,
            at=None if self.at is None else motion.transform(self.at),
            outlines=tuple(tuple(map(motion.transform, outline)) for outline in self.outlines),
        )

    @property
    def told_text(self) -> str:
        """The words for a reader: quoted, or left out if they give orders."""
        is_order = gives_orders(self.text)
        return "(its text gives orders and is left out)" if is_order else quote(self.text)

    @property
    def told_title(self) -> str:
        """The event in a few words: `E1 "painters at work"`."""
        told = self.told_text
        mark = ":" if self.id and not told.startswith('"') else ""
        return f"{self.id}{mark} {told}".lstrip()

    def sentence(self, now: datetime) -> str:
        """Return the event for a reader, with times as `now` counts them; its words are quoted."""
        where = f" ({tell_place(self.place)})" if self._names_more_than_text() else ""
        parts = [f"{self.told_title}{where}"]
        if self.effect is not Effect.NONE:
            parts.append(_EFFECTS[self.effect])
        begins, until = self.find_time(now)
        if begins is not None and begins > now:
            parts.append(f"from {_say_time(begins, now)}")
        if until is not None:
            parts.append(f"until {_say_time(until, now)}")
        if self.every is not Every.ONCE:
            parts.append(f"again every {self.every}")
        return f"{', '.join(parts)}{self._say_source()}."

    def _say_source(self) -> str:
        if not self.source:
            return ""
        if is_name_of_robot(self.source) and not self.is_of_robot:
            return "; said by somebody in the robot's name"
        if gives_orders(self.source):
            return "; said by a source left out, for it gives orders"
        return f"; said by {quote(self.source)}"

    def _names_more_than_text(self) -> bool:
        is_told = self.told_text.startswith('"') and self.place in self.text
        return bool(self.place) and not is_told


_NAMES_OF_ROBOT = (ROBOT, "robot")


def is_name_of_robot(source: str) -> bool:
    """Return True for the name under which the robot makes notes, in any spelling."""
    return name_key(source) in _NAMES_OF_ROBOT


_EFFECTS = {
    Effect.CLOSED: "closed to the robot",
    Effect.SLOW: "slow, ways around it are preferred",
    Effect.AVOID: "to be avoided where there is another way",
}


def current_events(events: Iterable[Event], now: datetime) -> tuple[Event, ...]:
    """Return the events that are active at a moment, in the order of the file."""
    return tuple(event for event in events if event.is_current(now))


def is_event_id(text: str) -> bool:
    """Return True for a valid event id: "E3", "wet-floor_2"."""
    return _ID.fullmatch(text) is not None


def find_place_ids(words: str) -> tuple[str, ...]:
    """Return the ids of rooms, corridors and doors that words name: "corridor C1" has C1."""
    return tuple(dict.fromkeys(_PLACE_ID.findall(words.upper())))


def show_local(moment: datetime, now: datetime) -> datetime:
    """Return what the operator's clock on the wall shows at a moment, in summer or winter time."""
    return moment.astimezone(_find_zone(now)).replace(tzinfo=None)


def read_local(shown: datetime, now: datetime) -> datetime:
    """Return the moment at which the operator's clock on the wall shows this."""
    zone = _find_zone(now)
    return shown.astimezone() if zone is None else shown.replace(tzinfo=zone)


def _find_zone(now: datetime) -> tzinfo | None:
    """Return the zone of `now`; None for this machine's, which knows of summer time.

    The operator's time has the offset of today alone.
    """
    return None if now.utcoffset() == now.astimezone().utcoffset() else now.tzinfo


def _say_time(time: datetime, now: datetime) -> str:
    local = show_local(time, now)
    return f"{local:%H:%M}" if local.date() == now.date() else f"{local:%Y-%m-%d %H:%M}"


def _require(is_right: object, what: str, hint: str) -> None:
    if not is_right:
        raise SemanticMapError(f"{what}.", hint=hint)
