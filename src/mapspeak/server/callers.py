"""Who calls a tool, and how they hear of a drive while they wait."""

from mcp.server.mcpserver import Context

from mapspeak.navigation.drive import DriveReport, OnProgress

__all__ = ["client_of", "tell_progress"]


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
