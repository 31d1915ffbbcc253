"""The tools that move the robot, and those that stop it."""

from typing import Annotated

from mcp.server.mcpserver import Context
from pydantic import Field

from mapspeak.errors import LinkError
from mapspeak.server.reports.robot import DriveAnswer
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import say_pose, say_pose_doubt
from mapspeak.server.tools.asking import (
    AT_MOST_LONGEST_WAIT,
    LONGEST_WAIT_S,
    client_of,
    tell_progress,
)
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session

Place = Annotated[
    str | None,
    Field(
        description="an id (R3, C1, D1, F2, W5, T1), a remembered name or thing, or a phrase: "
        "left of W3, between D1 and D2, corner of R2"
    ),
]
Metres = Annotated[float | None, Field(description="metres, map frame", allow_inf_nan=False)]
Degrees = Annotated[
    float | None,
    Field(
        description="heading on arrival, counter-clockwise from +x; also with place",
        allow_inf_nan=False,
    ),
]
Wait = Annotated[
    float,
    Field(description="seconds", ge=0, le=LONGEST_WAIT_S),
    AT_MOST_LONGEST_WAIT,
]
GoalId = Annotated[str | None, Field(description="such as G1; else the latest")]


class DriveTools:
    """Sending the robot somewhere, waiting, cancelling, stopping."""

    def __init__(self, session: Session) -> None:
        self._session = session

    @tool(
        "Drive to a place",
        ToolEffect.MOVES,
        has_report=True,
        is_entry=True,
        leads="Use {wait_for_goal} to wait on.",
    )
    async def navigate_to(
        self,
        context: Context,
        place: Place = None,
        x: Metres = None,
        y: Metres = None,
        yaw_deg: Degrees = None,
        wait_s: Wait = 20.0,
    ) -> DriveAnswer:
        """Drive the robot to a place: an id, a remembered name, or x and y.

        Use it to go anywhere. The goal is checked first; a refused goal comes with one that works.
        Answers `arrived` or, after wait_s, a goal_id. A newer goal replaces the older.
        """
        drives = self._session.drives
        with drives.preparing() as ticket:
            goal = await self._session.find_goal(place=place, x=x, y=y, yaw_deg=yaw_deg)
            drive = await drives.start(
                goal.pose, place=goal.title, ticket=ticket, client=client_of(context)
            )
        return await self._wait(context, drive.goal_id, wait_s)

    @tool(
        "Wait for a drive",
        ToolEffect.READS,
        has_report=True,
        leads="Use it after {navigate_to}.",
    )
    async def wait_for_goal(
        self, context: Context, goal_id: GoalId = None, wait_s: Wait = 20.0
    ) -> DriveAnswer:
        """Wait for a drive's end, at most wait_s; say how it stands.

        With wait_s=0 it only asks.
        """
        return await self._wait(context, goal_id, wait_s)

    @tool("Cancel a drive", ToolEffect.STOPS, leads="Use {stop_robot} when anything is urgent.")
    async def cancel_goal(self, goal_id: GoalId = None) -> str:
        """End one drive; the robot comes to a stand."""
        report = await self._session.drives.cancel(goal_id)
        lines = [
            f"{report.drive.goal_id} to {report.drive.place}: {report.status.state}.",
            f"The robot is at {say_pose(report.pose)}.",
            say_pose_doubt(report.pose_doubt, report.pose_age_s, report.silence),
        ]
        if not report.status.state.is_final:
            lines.append(lead("NOT CANCELLED: navigation goes on with it. Call {stop_robot}."))
        return " ".join(filter(None, lines))

    @tool("Stop the robot", ToolEffect.STOPS, is_entry=True)
    async def stop_robot(self) -> str:
        """Stop the robot at once and end every drive.

        Use it whenever going on could do harm; it works during any other call.
        """
        ended = self._session.drives.under_way
        try:
            await self._session.drives.stop()
        except LinkError as error:
            raise LinkError(
                f"NOT STOPPED: {error.message}",
                hint=f"The robot may still move: press its own stop button. {error.hint}",
            ) from error
        told = "" if ended is None else f" {ended.goal_id} was ended."
        return f"The robot was told to stop, and to give up every goal, whoever sent it.{told}"

    async def _wait(self, context: Context, goal_id: str | None, wait_s: float) -> DriveAnswer:
        report = await self._session.drives.wait(
            goal_id, wait_s=wait_s, on_progress=tell_progress(context)
        )
        is_over = report.status.state.is_final and self._session.drives.under_way is None
        foreign = await self._session.robot.fetch_foreign_goals() if is_over else ()
        return DriveAnswer.of(report, foreign_goals=foreign)
