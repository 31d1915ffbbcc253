"""Who calls a tool, and how they hear of a drive while they wait."""

from typing import Any

from mcp.server.mcpserver import Context
from pydantic import BeforeValidator

from mapspeak.driving.drive import OnProgress
from mapspeak.driving.drivereport import DriveReport

LONGEST_WAIT_S = 25.0
"""Clients give up on a call that takes much longer."""


def _shorten_wait(wait_s: Any) -> Any:  # noqa: ANN401 - what is no number is refused later
    is_number = isinstance(wait_s, int | float) and not isinstance(wait_s, bool)
    return min(wait_s, LONGEST_WAIT_S) if is_number else wait_s


AT_MOST_LONGEST_WAIT = BeforeValidator(_shorten_wait)
"""Who would wait longer is answered sooner, and can call again."""


def client_of(context: Context) -> str:
    """Gives the HTTP session that calls; empty on stdio and for clients without one."""
    return (context.headers or {}).get("mcp-session-id", "")


def tell_progress(context: Context) -> OnProgress:
    """Gives what tells the caller how a drive stands."""

    async def tell(report: DriveReport) -> None:
        left_m = report.status.distance_left_m
        left = "" if left_m is None else f", {left_m:.1f} m left"
        await context.report_progress(
            report.elapsed_s, message=f"{report.drive.goal_id} {report.status.state}{left}"
        )

    return tell
