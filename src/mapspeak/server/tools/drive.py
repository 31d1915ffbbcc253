"""The tools that move the robot, and those that stop it."""

import math
from contextlib import AbstractContextManager, nullcontext
from typing import Annotated

from mcp.server.mcpserver import Context, Image
from pydantic import Field

from mapspeak.driving.drivereport import Drive, DriveReport
from mapspeak.driving.exploration.camera import aim, end_for_picture, scope_of
from mapspeak.driving.exploration.trips import TURN, spread_headings, turn_to
from mapspeak.errors import GoalError, LinkError
from mapspeak.places.relations.choosing import CheckedGoal, GoalPurpose
from mapspeak.places.relations.viewpoints import choose_view, is_there
from mapspeak.robot import CameraPicture, GoalState
from mapspeak.safety import ApprovalScope, current_caller, within_scope
from mapspeak.server.reports.robot import DriveAnswer
from mapspeak.server.text.offered import lead, say_error
from mapspeak.server.text.wording import say_pose, say_pose_doubt
from mapspeak.server.text.world.descriptions import describe_view
from mapspeak.server.text.world.drives import not_stopped, say_cause
from mapspeak.server.tools.caller import (
    AT_MOST_LONGEST_WAIT,
    LONGEST_WAIT_S,
    tell_progress,
)
from mapspeak.server.tools.places import OnePlace
from mapspeak.server.tools.sightings import Camera, look_ahead
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session
from mapspeak.worldmodel.model import WorldModel

Place = Annotated[
    str | None,
    Field(
        description="an id (R3, C1, D1, F2, W5, T1), a remembered name or thing, or a phrase: "
        "left of W3, between the two nearest doors, smallest room, R2 looking back through its door"
    ),
]
Metres = Annotated[float | None, Field(description="metres, map frame", allow_inf_nan=False)]
Degrees = Annotated[
    float | None,
    Field(
        description="on arrival, counter-clockwise from +x",
        allow_inf_nan=False,
    ),
]
Wait = Annotated[
    float,
    Field(description="seconds", ge=0, le=LONGEST_WAIT_S),
    AT_MOST_LONGEST_WAIT,
]
LEAST_TURN_S = 0.5
LEAST_WAY_M = 0.1
"""From a shorter way nobody can tell a pace."""
MOST_PICTURES = 12
LOOK_AROUND = "a look around,"
OVERLAP_RATIO = 1.1
"""A thing at the edge of one picture is whole in the next."""
TurnBy = Annotated[
    float | None,
    Field(description="left positive", ge=-180, le=180, allow_inf_nan=False),
]
TurnTo = Annotated[
    float | None,
    Field(description="heading, counter-clockwise from +x", allow_inf_nan=False),
]
NPictures = Annotated[
    int | None,
    Field(
        description="else as many as leave no gap",
        ge=2,
        le=MOST_PICTURES,
        strict=True,
    ),
]
AsNear = Annotated[
    bool, Field(description="where it does not work, drive to the nearest that does")
]
GoalId = Annotated[str | None, Field(description="e.g. G1; else the latest")]


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
        *,
        as_near: AsNear = False,
    ) -> DriveAnswer:
        """Drive the robot to a place: an id, a remembered name, or x and y.

        A goal that does not work is refused with one that does.
        Answers `arrived` or, after wait_s, a goal_id. A newer goal replaces the older.
        """
        drives = self._session.drives
        with drives.preparing() as ticket:
            goal = await self._session.find_goal(
                place=place, x=x, y=y, yaw_deg=yaw_deg, as_near=as_near
            )
            goal = await aim(self._session, goal)
            with _scope_of(goal.name, goal.purpose):
                drive = await drives.start(
                    goal.pose,
                    place=goal.name,
                    ticket=ticket,
                    purpose=goal.purpose,
                    thing=goal.thing,
                )
        answer = await self._wait(context, drive.goal_id, wait_s)
        # How the words were read is said once; what asks for the drive later gets its short name.
        return answer.model_copy(update={"place": goal.title})

    @tool(
        "Wait for a drive",
        ToolEffect.READS,
        has_report=True,
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
        """Stop the robot at once and end every drive; it works during any other call."""
        ended = self._session.drives.under_way
        try:
            await self._session.drives.stop()
        except LinkError as error:
            raise not_stopped(error) from error
        told = "" if ended is None else f" {ended.goal_id} was ended."
        return f"The robot was told to stop, and to give up every goal, whoever sent it.{told}"

    async def _wait(self, context: Context, goal_id: str | None, wait_s: float) -> DriveAnswer:
        robot, on_progress = self._session.robot, tell_progress(context)
        until_s = robot.now_s + wait_s
        report = await self._session.drives.wait(goal_id, wait_s=wait_s, on_progress=on_progress)
        if goal_id is None or goal_id.strip().upper() != report.drive.goal_id:
            report = report.as_asked
        drive = report.drive
        if wait_s > 0 and drive.caller.owner == current_caller().owner:
            left_s = max(until_s - robot.now_s, 0.0)
            with _scope_of(drive.place, drive.purpose):
                report = await end_for_picture(
                    self._session, report, wait_s=left_s, on_progress=on_progress
                )
        is_over = report.status.state.is_final and self._session.drives.under_way is None
        foreign = await self._session.robot.fetch_foreign_goals() if is_over else ()
        return DriveAnswer.of(report, foreign_goals=foreign)


class ViewTools:
    """Turning in place, and looking: at a place from where it is best seen, and all around."""

    def __init__(self, session: Session) -> None:
        self._session = session

    @tool("Look at a place", ToolEffect.MOVES)
    async def look_at(
        self, context: Context, place: OnePlace, wait_s: Wait = 20.0
    ) -> list[str | Image]:
        """Drive to a clear view of a room, door, thing or point, and take a picture there.

        Use it to check a place: it says how much is in view, and what should be where.
        """
        session = self._session
        begun_s = session.robot.now_s
        world, goal, drive = await drive_to_view(session, place)
        if drive is not None:
            report = await session.drives.wait(
                drive.goal_id, wait_s=wait_s, on_progress=tell_progress(context)
            )
            if report.status.state is not GoalState.ARRIVED:
                way_m = world.path_m(goal.pose.point) or 0.0
                waited_s = session.robot.now_s - begun_s
                return [_say_no_view(report, way_m=way_m, waited_s=waited_s)]
        sighting = await look_ahead(session)
        world = await session.fetch_world_model()
        text = await session.compute(lambda: describe_view(world, goal.place, sighting.picture))
        return [f"{sighting.text}\n{text}", sighting.image]

    @tool(
        "Turn in place",
        ToolEffect.MOVES,
        has_report=True,
        leads="{look_around} takes pictures to all sides.",
    )
    async def turn(
        self, context: Context, by_deg: TurnBy = None, to_yaw_deg: TurnTo = None
    ) -> DriveAnswer:
        """Turn the robot where it stands, by an angle or to a heading."""
        if (by_deg is None) == (to_yaw_deg is None):
            raise GoalError(
                "A turn is either by an angle or to a heading.",
                hint="Give by_deg (left positive), or to_yaw_deg.",
            )
        ended = await self._end_drive()
        yaw_rad = math.radians(to_yaw_deg or 0.0)
        if by_deg is not None:
            here = (await self._session.robot.fetch_pose()).pose
            yaw_rad = here.yaw_rad + math.radians(by_deg)
        answer = DriveAnswer.of(await self._turn(context, yaw_rad, LONGEST_WAIT_S))
        reason = " ".join(filter(None, (*ended, answer.reason)))
        return answer.model_copy(update={"reason": reason})

    @tool("Look all around", ToolEffect.MOVES)
    async def look_around(
        self, context: Context, n_pictures: NPictures = None, camera: Camera = None
    ) -> list[str | Image]:
        """Turn the robot where it stands and take pictures at several headings.

        Use it to see a whole room.
        """
        robot = self._session.robot
        deadline_s = robot.now_s + LONGEST_WAIT_S
        ended = await self._end_drive()
        first = await look_ahead(self._session, camera)
        here = (await robot.fetch_pose()).pose
        n_pictures = n_pictures or _count_all_around(first.picture)
        what = f"turn in place for {n_pictures} pictures"
        scope = ApprovalScope(what=what, n_drives=n_pictures - 1, duration_s=LONGEST_WAIT_S)
        shown: list[str | Image] = ["\n".join((*ended, first.text)), first.image]
        for yaw_rad in spread_headings(here.yaw_rad, n_pictures)[1:]:
            left_s = deadline_s - robot.now_s
            if left_s < LEAST_TURN_S:
                return [*shown, _say_rest(yaw_rad, "the time for one call is over")]
            with within_scope(scope):
                report = await self._turn(context, yaw_rad, left_s, LOOK_AROUND)
            if report.status.state is not GoalState.ARRIVED:
                await self._session.drives.cancel(report.drive.goal_id)
                why = say_cause(report.status.cause) or f"the turn is {report.status.state}"
                return [*shown, _say_rest(yaw_rad, why)]
            try:
                sighting = await look_ahead(self._session, camera)
            except LinkError as error:
                return [*shown, _say_rest(yaw_rad, say_error(error))]
            shown += [sighting.text, sighting.image]
        return shown

    async def _end_drive(self) -> list[str]:
        """End the client's own drive under way, so that the robot stands; say which it was."""
        drives = self._session.drives
        drive = drives.under_way
        if drive is None or drive.caller.owner != current_caller().owner:
            return []
        report = await drives.report(drive.goal_id)
        if report.status.state.is_final:
            return []
        report = (await drives.cancel(drive.goal_id)).as_asked
        left_m = report.pose.point.distance_to(report.drive.goal.point)
        told = f"{report.drive.goal_id} to {report.drive.place} was ended first"
        return [f"{told}, {left_m:.1f} m before it got there."]

    async def _turn(
        self, context: Context, yaw_rad: float, wait_s: float, what: str = TURN
    ) -> DriveReport:
        return await turn_to(
            self._session,
            yaw_rad,
            wait_s=wait_s,
            on_progress=tell_progress(context),
            what=what,
        )


async def drive_to_view(
    session: Session, place: str
) -> tuple[WorldModel, CheckedGoal, Drive | None]:
    """Send the robot to a clear view of a place; without a drive where it is there already."""
    with session.drives.preparing() as ticket:
        world, half_view_rad = await session.fetch_world_model(), session.pictures.half_view_rad
        goal = await session.compute(lambda: choose_view(world, place, half_view_rad))
        if is_there(world.robot, goal.pose):
            return world, goal, None
        title = f"a view of {goal.name}"
        return world, goal, await session.drives.start(goal.pose, place=title, ticket=ticket)


def _scope_of(place: str, purpose: GoalPurpose) -> AbstractContextManager[None]:
    """Let one word of a person do for a drive and the turn at its end."""
    return within_scope(scope_of(place)) if purpose.is_for_picture else nullcontext()


def _say_no_view(report: DriveReport, *, way_m: float, waited_s: float) -> str:
    """Say how a drive to a view stands.

    Args:
        way_m: How far it was when the call began, so long ago.
    """
    answer = DriveAnswer.of(report)
    told = f"No picture yet: {answer.goal_id} to {answer.place} is {answer.state}"
    left_m = answer.distance_left_m
    if left_m is not None and not report.status.state.is_final:
        told += f", {left_m:.1f} m left"
        if way_m - left_m > LEAST_WAY_M:
            told += f", about {math.ceil(waited_s * left_m / (way_m - left_m))} s at its pace"
    told += "."
    on = answer.next_step if report.status.state.is_final else "Call look_at again to wait on."
    return " ".join(filter(None, [told, answer.reason, on]))


def _count_all_around(picture: CameraPicture) -> int:
    """Return how many pictures overlap all around; four where the camera's width is not known."""
    if picture.horizontal_fov_rad is None:
        return 4
    return min(
        max(math.ceil(OVERLAP_RATIO * math.tau / picture.horizontal_fov_rad), 2), MOST_PICTURES
    )


def _say_rest(yaw_rad: float, why: str) -> str:
    to_go_on = lead("Call {turn} or {look_around} to go on.")
    said = f"No picture at {math.degrees(yaw_rad):.0f} deg and beyond: {why.removesuffix('.')}."
    return f"{said} {to_go_on}".rstrip()
