"""Times as people and models write them, read by the operator's clock."""

import re
from datetime import datetime, time, timedelta
from types import MappingProxyType

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import read_local, show_local

AHEAD = "2026-11-20T09:30, 09:30, tomorrow 8:00, today, tonight, in 2h, now"
PAST = "2026-11-20, 2026-11-20T09:30, 09:30, 2h ago, last 10 min, yesterday, this morning, Monday"
"""What schemas and hints say that can be written; all of it is read."""

_SPAN = re.compile(
    r"(?P<ahead>in\s+)?(?P<back>(?:the\s+)?(?:last|past)\s+)?(?P<n>\d{1,6}(?:\.\d+)?|an?|)\s*"
    r"(?P<unit>s(?:ec(?:ond)?s?)?|m(?:in(?:ute)?s?)?|h(?:(?:ou)?rs?)?|d(?:ays?)?|w(?:eeks?)?)"
    r"(?P<past>\s+ago)?",
    re.IGNORECASE,
)
_CLOCK = re.compile(
    r"(?:at\s+)?(?P<hour>\d{1,2})(?:[:.](?P<minute>\d\d))?\s*(?P<half>[ap]\.?m\.?)?", re.IGNORECASE
)
_UNITS = {"s": "seconds", "m": "minutes", "h": "hours", "d": "days", "w": "weeks"}
_DAYS = {"day before yesterday": -2, "yesterday": -1, "today": 0, "tomorrow": 1}
_WEEKDAYS = ("monday", "tuesday", "wednesday", "thursday", "friday", "saturday", "sunday")
_DAY = re.compile(
    rf"(?:on\s+)?(?:(?P<which>last|next|this)\s+)?(?P<day>{'|'.join((*_DAYS, *_WEEKDAYS))})"
    r"(?:\s+(?P<rest>.+))?"
)
_PART_ALONE = re.compile(r"(?P<which>this|in the)\s+(?P<part>morning|noon|afternoon|evening|night)")
_NIGHTS = {"tonight": "today night", "last night": "yesterday night"}
_PARTS = MappingProxyType(
    {
        "morning": (5, 12),
        "noon": (12, 13),
        "afternoon": (12, 18),
        "evening": (18, 23),
        "night": (22, 30),
    }
)
"""Hours from and to which a part of a day lasts."""
_HALF_DAY_H = 12
_DAY_LONG, _WEEK_LONG = timedelta(days=1), timedelta(days=7)

Period = tuple[datetime, datetime | None]
"""The first moment, and the first one after; None for a single moment."""


def read_moment(text: str | None, now: datetime | None) -> datetime | None:
    """Return the moment to come that is meant, in the zone of `now` where none is said.

    A span without a direction is counted from now on, and a time of day that is over is tomorrow's.

    Args:
        text: As `AHEAD` or `PAST` say, or "2h" without a direction; of a period such as
            "yesterday", its beginning. None for no moment.
        now: The operator's time, or another moment to count from; None where it is not known.

    Raises:
        SemanticMapError: It is no moment, or counted from a clock that is not known.
    """
    period = _read_period(text, now, is_ahead=True)
    return None if period is None else period[0]


def read_past(
    since: str | None, until: str | None, now: datetime | None
) -> tuple[datetime | None, datetime | None]:
    """Return from when to when, as two texts say it.

    "Yesterday" or "this morning" alone is the whole of it; as `until` it is its end. A time of day
    that is still to come is yesterday's.

    Raises:
        SemanticMapError: As `read_moment`.
    """
    begin, end = _read_period(since, now), _read_period(until, now)
    first, last = (begin and begin[0]), end and (end[1] or end[0])
    if first is None or now is None:
        return first, last
    if first > now and _is_clock(since):
        first -= _DAY_LONG
    if last is None:
        return first, (begin and begin[1])
    if last > now and _is_clock(until) and last - _DAY_LONG > first:
        last -= _DAY_LONG
    return first, last


def _is_clock(text: str | None) -> bool:
    return text is not None and _CLOCK.fullmatch(text.strip()) is not None


def read_coming(
    begins: str | None, ends: str | None, now: datetime
) -> tuple[datetime | None, datetime | None]:
    """Return from when to when, of what is to come; of 22:00 to 06:00 the second is the next day.

    Of a period that has begun, such as "today", the second is its end.

    Raises:
        SemanticMapError: As `read_moment`.
    """
    start = read_moment(begins, now)
    after = start if start is not None and _is_clock(ends) else now
    period = _read_period(ends, after, is_ahead=True)
    if period is None:
        return start, None
    has_begun = period[0] <= max(now, start or now)
    return start, (period[1] if has_begun and period[1] is not None else period[0])


def _read_period(
    text: str | None, now: datetime | None, *, is_ahead: bool = False
) -> Period | None:
    if text is None:
        return None
    if now is None:
        raise SemanticMapError(
            "The time by the calendar is not known here.", hint="Leave times out."
        )
    words = " ".join(text.split())
    try:
        span = _read_span(words.casefold(), now, is_ahead)
        if span is not None:
            return span
        shown = show_local(now, now)
        for read in (_read_day, _read_clock):
            period = read(words.casefold(), shown, is_ahead)
            if period is not None:
                begin, end = period
                return read_local(begin, now), None if end is None else read_local(end, now)
        moment = datetime.fromisoformat(words)
    except (ValueError, OverflowError) as error:
        raise SemanticMapError(
            f"{text[:40]!r} is no time.",
            hint=f"Write it as one of {AHEAD if is_ahead else PAST}.",
        ) from error
    begin = moment if moment.tzinfo else read_local(moment, now)
    is_day = len(words) <= len("2026-11-20")
    return begin, begin + _DAY_LONG if is_day else None


def _read_span(words: str, now: datetime, is_ahead: bool) -> Period | None:  # noqa: FBT001 - read alike
    """Read "2h ago", "in 2h", "last 10 min"."""
    if words == "now":
        return now, None
    said = _SPAN.fullmatch(words)
    if said is None or (not said["n"] and not said["back"]):
        return None
    if said["ahead"] and (said["past"] or said["back"]):
        raise ValueError(words)
    number = float(said["n"]) if said["n"][:1].isdigit() else 1.0
    span = timedelta(**{_UNITS[said["unit"][0]]: number})
    is_later = said["ahead"] or (is_ahead and not said["past"] and not said["back"])
    return (now + span if is_later else now - span), None


def _read_day(words: str, now: datetime, is_ahead: bool) -> Period | None:  # noqa: FBT001 - read alike
    """Read "yesterday", "this morning", "last night", "Monday 9:30", "tomorrow evening"."""
    part = _PART_ALONE.fullmatch(words)
    said = _DAY.fullmatch(f"today {part['part']}" if part else _NIGHTS.get(words, words))
    if said is None:
        return None
    midnight = now.replace(hour=0, minute=0, second=0, microsecond=0)
    away = _days_away(said["day"], said["which"], midnight.weekday(), is_ahead=is_ahead)
    day, rest = midnight + timedelta(days=away), said["rest"]
    if rest is None:
        return day, day + _DAY_LONG
    if rest in _PARTS:
        begin, end = (day + timedelta(hours=hour) for hour in _PARTS[rest])
        # At noon "in the morning" is tomorrow's, where "this morning" is not.
        is_next = is_ahead and end <= now and part is not None and part["which"] == "in the"
        return (begin + _DAY_LONG, end + _DAY_LONG) if is_next else (begin, end)
    clock = _find_clock(rest)
    if clock is None:
        return None
    moment = datetime.combine(day, clock)
    if said["day"] in _WEEKDAYS and not said["which"]:
        if is_ahead and moment <= now:
            moment += _WEEK_LONG
        elif not is_ahead and moment > now:
            moment -= _WEEK_LONG
    return moment, None


def _days_away(day: str, which: str | None, weekday: int, *, is_ahead: bool) -> int:
    """Return how many days a named one is from today; of "Monday" the last or the next one."""
    if day in _DAYS:
        return _DAYS[day]
    away = (_WEEKDAYS.index(day) - weekday) % 7
    if which == "next":
        return away or 7
    if which == "last":
        return away - 7
    return away if is_ahead or not away else away - 7


def _read_clock(words: str, now: datetime, is_ahead: bool) -> Period | None:  # noqa: FBT001 - read alike
    """Read "9:30", "3 pm", "noon", "midnight"."""
    clock = _find_clock(words)
    if clock is None:
        return None
    moment = datetime.combine(now, clock)
    return (moment + _DAY_LONG if is_ahead and moment <= now else moment), None


def _find_clock(words: str) -> time | None:
    named = {"noon": time(12), "midnight": time(0)}
    if words in named:
        return named[words]
    said = _CLOCK.fullmatch(words)
    if said is None or not (said["minute"] or said["half"]):
        return None
    hour = int(said["hour"])
    if said["half"]:
        if not 1 <= hour <= _HALF_DAY_H:
            raise ValueError(words)
        hour = hour % _HALF_DAY_H + (_HALF_DAY_H if said["half"][0] == "p" else 0)
    return time(hour, int(said["minute"] or 0))
