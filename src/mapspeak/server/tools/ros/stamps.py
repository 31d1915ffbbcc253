"""How old a message is by its own stamp, and whether that is more than its rate explains."""

from collections.abc import Mapping

from mapspeak.errors import LinkError
from mapspeak.ros.messages import Message, read_stamp

LATE_PERIODS = 3.0
LEAST_LATE_S = 0.5
"""A way over a network takes some time, and so does an answer."""
OLD_S = 2.0
"""A message whose rate is not known may be so old without a word."""


def stamp_of(message: Message) -> float | None:
    """Gives a message's own time in seconds of robot time; None where it has none."""
    header = message.get("header")
    holder = header if isinstance(header, Mapping) else message
    stamp = holder.get("stamp")
    if not isinstance(stamp, Mapping):
        return None
    try:
        return read_stamp(stamp)
    except LinkError:
        return None


def say_stamp(
    message: Message, *, now_s: float, age_s: float = 0.0, period_s: float | None = None
) -> str:
    """Says a message's stamp and how far it is off; empty where it has none.

    Args:
        message: Of any type.
        now_s: Robot time.
        age_s: Since the message came.
        period_s: Between two messages of its topic; None where that is not known.
    """
    stamp_s = stamp_of(message)
    if stamp_s is None:
        return ""
    if stamp_s == 0.0:
        return "stamp 0: not set"
    lag_s = now_s - stamp_s
    return f"stamp {stamp_s:.3f} s, {say_lag(lag_s)}{_judge(lag_s - age_s, period_s)}"


def say_lag(lag_s: float) -> str:
    """Says how far a stamp is from robot time."""
    where = "behind" if lag_s >= 0.0 else "ahead of"
    return f"{abs(lag_s):.2f} s {where} robot time"


def _judge(old_s: float, period_s: float | None) -> str:
    """Says that a message was too old, or too new, when it came."""
    if old_s < -LEAST_LATE_S:
        return f" - AHEAD: {-old_s:.1f} s in the future when it came"
    if period_s is None:
        return (
            f" - it was {old_s:.1f} s old when it came: kept for latecomers, or late"
            if old_s > OLD_S
            else ""
        )
    if old_s <= max(LATE_PERIODS * period_s, LEAST_LATE_S):
        return ""
    return f" - LATE: {old_s:.1f} s old when it came, though one comes every {period_s:.3g} s"
