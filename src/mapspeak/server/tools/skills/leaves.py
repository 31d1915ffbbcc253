"""Driving, looking and noting as skills: what missions do with the robot itself."""

from collections.abc import Mapping

from mapspeak.driving.drivereport import DriveReport
from mapspeak.geometry import Pose
from mapspeak.memory.episodes.observation import ObservationKind
from mapspeak.places.views.sights import choose_view, is_there
from mapspeak.robot import GoalState
from mapspeak.server.tools.sightings import look_ahead
from mapspeak.session import Session
from mapspeak.skill import (
    JsonValue,
    OnProgress,
    ParameterKind,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillParameter,
    SkillProgress,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.missions.questions import AskedPicture, QuestionBook

LONGEST_DRIVE_S = 3600.0
WAIT_S = 5.0
PLACE = SkillParameter(
    name="place",
    kind=ParameterKind.TEXT,
    description="an id, a remembered name, a phrase, or x, y",
    most=200,
    is_required=True,
)
DRIVE = SkillSpec(
    name="drive",
    description="Drives to a place",
    effect=SkillEffect.MOVES,
    timeout_s=LONGEST_DRIVE_S,
    parameters=(
        PLACE,
        SkillParameter(name="yaw_deg", kind=ParameterKind.NUMBER, unit="deg on arrival"),
    ),
)
LOOK = SkillSpec(
    name="look",
    description="Takes a picture: of a place from a clear view of it, or of what is ahead",
    effect=SkillEffect.MOVES,
    timeout_s=LONGEST_DRIVE_S,
    parameters=(
        SkillParameter(
            name="place",
            kind=ParameterKind.TEXT,
            description="ahead where left out",
            most=200,
            default="ahead",
        ),
    ),
)
NOTE = SkillSpec(
    name="note",
    description="Notes an observation where the robot is",
    effect=SkillEffect.READS,
    timeout_s=60.0,
    parameters=(SkillParameter(name="text", kind=ParameterKind.TEXT, most=300, is_required=True),),
)
ENDS = {
    GoalState.ARRIVED: (SkillState.SUCCEEDED, SkillCode.DONE),
    GoalState.CANCELLED: (SkillState.CANCELLED, SkillCode.STOPPED),
    GoalState.PREEMPTED: (SkillState.CANCELLED, SkillCode.STOPPED),
    GoalState.REJECTED: (SkillState.FAILED, SkillCode.REJECTED),
    GoalState.TIMED_OUT: (SkillState.FAILED, SkillCode.TOO_LATE),
    GoalState.LOST: (SkillState.FAILED, SkillCode.LOST),
}


class DriveSkill:
    """Drives as the tools do: checked, guarded, one drive at a time."""

    spec = DRIVE

    def __init__(self, session: Session) -> None:
        self._session = session

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Drive there; who is cancelled meanwhile leaves the robot standing.

        Raises:
            MapspeakError: There is no such place, or the robot may not drive there.
        """
        place, yaw_deg = arguments["place"], arguments.get("yaw_deg")
        with self._session.drives.preparing() as ticket:
            goal = await self._session.find_goal(place=place, x=None, y=None, yaw_deg=yaw_deg)
            report = await drive_to(
                self._session, goal.pose, goal.title, ticket=ticket, on_progress=on_progress
            )
        return end_of(report)


class LookSkill:
    """Drives to a clear view and takes a picture."""

    spec = LOOK

    def __init__(self, session: Session, questions: QuestionBook) -> None:
        self._session = session
        self._questions = questions

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Look there, and give the picture's id and what the detector reports in it.

        Raises:
            MapspeakError: There is no such place or no camera, or the robot may not drive there.
        """
        session, place = self._session, arguments["place"]
        if place.casefold() != "ahead":
            with session.drives.preparing() as ticket:
                world = await session.fetch_world_model()
                half_view_rad = session.pictures.half_view_rad
                goal = await session.compute(lambda: choose_view(world, place, half_view_rad))
                here = (await session.robot.fetch_pose()).pose
                if not is_there(here, goal.pose):
                    report = await drive_to(
                        session, goal.pose, goal.title, ticket=ticket, on_progress=on_progress
                    )
                    if report.status.state is not GoalState.ARRIVED:
                        return end_of(report)
        sighting = await look_ahead(session)
        taken, picture = session.pictures.latest, sighting.picture
        picture_id = "" if taken is None else taken.id
        media = picture.media_type.partition("/")[2]
        self._questions.keep(AskedPicture(picture_id, picture.data, media))
        seen = ", ".join(each.label for each in sighting.detections)
        outputs = {"picture": picture_id, "seen": seen}
        return SkillOutcome(state=SkillState.SUCCEEDED, outputs=outputs)


class NoteSkill:
    """Keeps an observation, which `recall_episodes` finds again."""

    spec = NOTE

    def __init__(self, session: Session) -> None:
        self._session = session

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Note it with the time and the pose."""
        del on_progress
        session = self._session
        pose = (await session.robot.fetch_pose()).pose
        room_id = await session.find_room_id(pose.point)

        def keep() -> str:
            return session.episodes.keep(
                ObservationKind.NOTE,
                pose=pose,
                text=arguments["text"],
                stamp_s=session.robot.now_s,
                room_id=room_id,
                name_map=session.memory.name_map,
            ).fault

        fault = await session.compute(keep)
        state = SkillState.FAILED if fault else SkillState.SUCCEEDED
        return SkillOutcome(
            state=state,
            code=SkillCode.LOST if fault else SkillCode.DONE,
            outputs={"text": arguments["text"], "room": room_id or ""},
            quote=fault,
        )


async def drive_to(
    session: Session, goal: Pose, title: str, *, ticket: int, on_progress: OnProgress
) -> DriveReport:
    """Drive to a checked goal and return how that ended.

    Raises:
        MapspeakError: The robot may not drive there, or was stopped meanwhile.
    """
    drive = await session.drives.start(goal, place=title, ticket=ticket)

    async def tell(report: DriveReport) -> None:
        left_m = report.status.distance_left_m
        values = {} if left_m is None else {"left_m": round(left_m, 1)}
        on_progress(SkillProgress(values=values))

    while True:
        report = await session.drives.wait(drive.goal_id, wait_s=WAIT_S, on_progress=tell)
        if report.status.state.is_final:
            return report


def end_of(report: DriveReport) -> SkillOutcome:
    """Return how a drive ended, as a skill's end."""
    status = report.status
    state, code = ENDS.get(status.state, (SkillState.FAILED, SkillCode.ABORTED))
    return SkillOutcome(
        state=state,
        code=code,
        outputs={"place": report.drive.place},
        quote="" if status.cause is None else str(status.cause),
    )
