"""Why drives end, for tests."""

from mapspeak.robot import Cause, CauseCode, GoalStatus


def navigation_said(quote: str) -> Cause | None:
    """Return the cause that navigation tells; None where it tells nothing."""
    return Cause(code=CauseCode.NAVIGATION_SAID, quote=quote) if quote else None


CRATE = navigation_said("A crate stands in the way.")


def code_of(status: GoalStatus) -> CauseCode | None:
    """Return why a drive ended."""
    return None if status.cause is None else status.cause.code


def quote_of(status: GoalStatus) -> str:
    """Return what the robot's software said of the end of a drive."""
    return "" if status.cause is None else status.cause.quote
