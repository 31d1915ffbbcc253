"""Moments as models write them: a date, a date with a time, a time of today, or a span from now."""

import re
from datetime import datetime, timedelta

from mapspeak.errors import SemanticMapError

AHEAD = "2026-11-20T09:30, 09:30, in 2h, now"
PAST = "2026-11-20, 2026-11-20T09:30, 09:30, 2h ago"
"""What schemas and hints say that can be written; `read_moment` reads all of it."""
SPAN = re.compile(
    r"(?P<ahead>in\s+)?(?P<n>\d{1,6}(?:\.\d+)?)\s*"
    r"(?P<unit>s(?:ec(?:ond)?s?)?|m(?:in(?:ute)?s?)?|h(?:ours?)?|d(?:ays?)?)(?P<past>\s+ago)?",
    re.IGNORECASE,
)
CLOCK = re.compile(r"(?P<hour>\d{1,2}):(?P<minute>\d\d)")
UNITS = {"s": "seconds", "m": "minutes", "h": "hours", "d": "days"}


def read_moment(
    text: str | None, now: datetime | None, *, is_ahead: bool = False
) -> datetime | None:
    """Gives the moment that is meant, in the zone of `now` where none is said.

    Args:
        text: As `AHEAD` or `PAST` say, or "2h" without a direction; None for no moment.
        now: The operator's time; None where it is not known.
        is_ahead: True where a span without a direction is counted from now on, and a time of day
            that is over is tomorrow's.

    Raises:
        SemanticMapError: It is no moment, or counted from a clock that is not known.
    """
    if text is None:
        return None
    if now is None:
        raise SemanticMapError(
            "The time by the calendar is not known here.", hint="Leave times out."
        )
    try:
        moment = _read(text.strip(), now, is_ahead=is_ahead)
    except (ValueError, OverflowError) as error:
        raise SemanticMapError(
            f"{text[:40]!r} is no time.",
            hint=f"Write it as one of {AHEAD if is_ahead else PAST}.",
        ) from error
    return moment if moment.tzinfo else moment.replace(tzinfo=now.tzinfo)


def _read(text: str, now: datetime, *, is_ahead: bool) -> datetime:
    if text.casefold() == "now":
        return now
    if said := SPAN.fullmatch(text):
        if said["ahead"] and said["past"]:
            raise ValueError(text)
        span = timedelta(**{UNITS[said["unit"][0].lower()]: float(said["n"])})
        is_later = bool(said["ahead"]) or (is_ahead and not said["past"])
        return now + span if is_later else now - span
    if clock := CLOCK.fullmatch(text):
        moment = now.replace(
            hour=int(clock["hour"]), minute=int(clock["minute"]), second=0, microsecond=0
        )
        return moment + timedelta(days=1) if is_ahead and moment <= now else moment
    return datetime.fromisoformat(text)


def say_age(moment: datetime, now: datetime) -> str:
    """Gives how long ago something was: "3 h ago"."""
    age_s = (now - moment).total_seconds()
    for unit, length_s in (("d", 86_400), ("h", 3600), ("min", 60)):
        if age_s >= 2 * length_s:
            return f"{age_s / length_s:.0f} {unit} ago"
    return f"{max(age_s, 0):.0f} s ago"
