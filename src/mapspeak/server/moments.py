"""Moments as models write them: a date, a date with a time, a time of today, or an age."""

import re
from datetime import datetime, timedelta

from mapspeak.errors import SemanticMapError

__all__ = ["read_moment", "say_age"]

AGE = re.compile(r"(?P<n>\d{1,6}(?:\.\d+)?)\s*(?P<unit>[mhd])")
CLOCK = re.compile(r"(?P<hour>\d{1,2}):(?P<minute>\d\d)")
UNITS = {"m": "minutes", "h": "hours", "d": "days"}


def read_moment(
    text: str | None, now: datetime | None, *, is_ahead: bool = False
) -> datetime | None:
    """Gives the moment that is meant, in the zone of `now` where none is said.

    Args:
        text: Such as "2026-11-20", "2026-11-20T09:30", "09:30" or "2h"; None for no moment.
        now: The operator's time; None where it is not known.
        is_ahead: True where an age is counted from now on, and a time that is over is tomorrow's.

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
            hint="Write 2026-11-20, 2026-11-20T09:30, 09:30, or 90m, 2h, 3d.",
        ) from error
    return moment if moment.tzinfo else moment.replace(tzinfo=now.tzinfo)


def _read(text: str, now: datetime, *, is_ahead: bool) -> datetime:
    if age := AGE.fullmatch(text):
        span = timedelta(**{UNITS[age["unit"]]: float(age["n"])})
        return now + span if is_ahead else now - span
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
