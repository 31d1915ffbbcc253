"""A session as missions see it: the facts of their conditions, and the skills that all have."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial

from mapspeak.driving.drivereport import Drive, DriveReport
from mapspeak.errors import GoalError, LinkError, MapError
from mapspeak.geometry import Point
from mapspeak.memory.episodes.observation import ObservationKind
from mapspeak.places.naming import find_named
from mapspeak.places.relations.choosing import find_place
from mapspeak.places.relations.viewpoints import choose_view, is_there
from mapspeak.robot import GoalState
from mapspeak.safety import current_caller
from mapspeak.server.text.world.drives import say_cause
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.sightings import look_ahead
from mapspeak.session import Session
from mapspeak.skill import (
    Arguments,
    OnProgress,
    ParameterKind,
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillParameter,
    SkillProgress,
    SkillSpec,
    SkillState,
    failed,
    succeeded,
)
from mapspeak.skills.guarding import CONDITIONS, Facts, end_within, find_unmet, is_as_wanted
from mapspeak.skills.runs import QuestionBook

BATTERY = "sensor_msgs/BatteryState"
HEAR_S = 3.0
KEPT_S = 2.0
WAIT_S = 5.0
CHECK_EVERY_S = 1.0
HOUR_S, DAY_S = 3600.0, 86_400.0
NUMBER, TEXT, LIST = ParameterKind.NUMBER, ParameterKind.TEXT, ParameterKind.LIST
READS, MOVES = SkillEffect.READS, SkillEffect.MOVES
WHERE = "an id, a remembered name, a phrase, or x, y"
AHEAD = "ahead"
PLACES = ("place", "in_room", "near")
"""The arguments of built-in skills that name a place."""
ANSWER = SkillParameter("", TEXT, most=80)
ENDS = {
    GoalState.CANCELLED: (SkillState.CANCELLED, SkillCode.STOPPED),
    GoalState.PREEMPTED: (SkillState.CANCELLED, SkillCode.STOPPED),
    GoalState.REJECTED: (SkillState.FAILED, SkillCode.REJECTED),
    GoalState.TIMED_OUT: (SkillState.FAILED, SkillCode.TOO_LATE),
    GoalState.LOST: (SkillState.FAILED, SkillCode.LOST),
}


@dataclass(eq=False)
class SessionFacts:
    """The facts of one session; its ROS system may publish a battery."""

    session: Session
    ros: RosAccess
    _battery: tuple[float | None, float] | None = None

    @property
    def now_s(self) -> float:
        """Robot time."""
        return self.session.robot.now_s

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""
        await self.session.robot.sleep(duration_s)

    def read_calendar(self) -> datetime | None:
        """Return the operator's time; None where that is not known."""
        return self.session.find_wall_time()

    async def holds(self, name: str, wanted: Arguments) -> bool | None:
        """Return True where a condition on the robot or its memory holds now."""
        value = wanted[name]
        found: bool | None
        match name:
            case "battery_above" | "battery_below":
                key, battery = name.removeprefix("battery_"), await self._fetch_battery()
                found = None if battery is None else is_as_wanted(battery, {key: value})
            case "standing":
                found = self.session.drives.is_busy is not value
            case "in_room":
                found = await self._is_in(value)
            case "near":
                found = await self._is_near(value, wanted.get("within_m", 1.0))
            case "event":
                found = self._has_event(value)
            case _:
                found = await self._sees(value)
        return found

    async def _fetch_battery(self) -> float | None:
        """Return how full the battery is: as the robot itself tells, else a topic of its ROS."""
        if self.session.skilled is not None:
            return await self.session.skilled.fetch_battery()
        if self.session.ros is None:
            return None
        # A simulation that is begun anew sets its clock back.
        if self._battery is None or not 0.0 <= self.now_s - self._battery[1] <= KEPT_S:
            self._battery = (await self._hear_battery(), self.now_s)
        return self._battery[0]

    async def _hear_battery(self) -> float | None:
        inquiry = self.ros.inquiry
        try:
            topics = (await inquiry.fetch_topics()).types
            topic = next((name for name, kind in topics.items() if kind == BATTERY), None)
            if topic is None:
                return None
            heard = await inquiry.hear(topic, BATTERY, wait_s=HEAR_S)
        except LinkError:
            return None
        share = heard.messages[0].get("percentage") if heard.messages else None
        is_told = isinstance(share, int | float) and 0.0 <= share <= 1.0
        return float(share) if is_told and share is not None else None

    async def _is_in(self, room: str) -> bool | None:
        here = await self._here()
        try:
            world = await self.session.fetch_world_model()
        except (LinkError, MapError):
            return None
        found = await self.session.compute(lambda: world.find_room_id(here))
        if found == room.strip().upper():
            return True
        place = find_named(world, room)
        if place is None:
            return None
        return found is not None and world.find_room_id(place.point) == found

    async def _is_near(self, place: str, within_m: float) -> bool | None:
        """Return True where the robot is so near to a place, in a straight line."""
        try:
            world = await self.session.fetch_world_model()
            point = await self.session.compute(lambda: find_place(world, place).point)
        except (GoalError, LinkError, MapError):
            return None
        return (await self._here()).distance_to(point) <= within_m

    def _has_event(self, words: str) -> bool | None:
        """Return True while an event lasts in whose words these stand."""
        now, wanted = self.read_calendar(), words.casefold().split()
        if now is None:
            return None
        said = (
            f"{each.text} {each.place}".casefold()
            for each in self.session.recall_events()
            if each.is_current(now)
        )
        return any(all(word in each for word in wanted) for each in said)

    async def _sees(self, label: str) -> bool | None:
        if self.session.robot.description.detector is None:
            return None
        wanted = label.casefold()
        found = await self.session.robot.fetch_detections()
        return any(wanted in each.label.casefold() for each in found)

    async def _here(self) -> Point:
        return (await self.session.robot.fetch_pose()).pose.point


def _spec(
    name: str, description: str, effect: SkillEffect, timeout_s: float, *parameters: SkillParameter
) -> SkillSpec:
    return SkillSpec(name, description, effect, timeout_s=timeout_s, parameters=parameters)


def _within(default_s: float) -> SkillParameter:
    return SkillParameter("within_s", NUMBER, unit="s", least=1, most=DAY_S, default=default_s)


DRIVE = _spec(
    "drive",
    "Drives to a place",
    MOVES,
    HOUR_S,
    SkillParameter("place", TEXT, description=WHERE, most=200, is_required=True),
    SkillParameter("yaw_deg", NUMBER, unit="deg on arrival"),
)
LOOK = _spec(
    "look",
    "Takes a picture: of a place from a clear view of it, or of what is ahead",
    MOVES,
    HOUR_S,
    SkillParameter("place", TEXT, description="ahead where left out", most=200, default=AHEAD),
    SkillParameter("camera", TEXT, description="another than the front one", most=60),
)
NOTE = _spec(
    "note",
    "Notes an observation where the robot is",
    READS,
    60.0,
    SkillParameter("text", TEXT, most=300, is_required=True),
)
CHECK = _spec("check", "Succeeds where all that is given holds now", READS, 60.0, *CONDITIONS)
WAIT_FOR = _spec(
    "wait_for", "Waits until all that is given holds", READS, DAY_S, *CONDITIONS, _within(600.0)
)
WAIT = _spec(
    "wait",
    "Waits",
    READS,
    DAY_S + 60,
    SkillParameter("duration_s", NUMBER, unit="s", least=0, most=DAY_S, is_required=True),
)
ASK = _spec(
    "ask",
    "Asks the model or the person who runs the mission, and waits for the answer",
    READS,
    DAY_S,
    SkillParameter("question", TEXT, most=300, is_required=True),
    SkillParameter(
        "answers", LIST, description="any where left out", least=2, most=10, item=ANSWER
    ),
    SkillParameter(
        "otherwise", TEXT, description="without an answer; else the step fails", most=300
    ),
    _within(300.0),
    SkillParameter("picture", TEXT, description="its id; the latest if left out", most=40),
)


BUILT_IN = frozenset(each.name for each in (DRIVE, LOOK, NOTE, CHECK, WAIT_FOR, WAIT, ASK))


@dataclass(frozen=True, slots=True)
class Leaves:
    """Does what missions do with the robot itself."""

    session: Session
    facts: Facts
    questions: QuestionBook

    def list_skills(self) -> Iterator[Skill]:
        """Yield each as a skill."""
        yield Skill(DRIVE, self._drive)
        yield Skill(LOOK, self._look)
        yield Skill(NOTE, self._note)
        yield Skill(CHECK, self._check)
        yield Skill(WAIT_FOR, self._wait_for)
        yield Skill(WAIT, self._wait)
        yield Skill(ASK, self._ask)

    async def _drive(self, given: Arguments, on_progress: OnProgress) -> SkillOutcome:
        """Drive as the tools do: checked, guarded, one drive at a time."""
        session = self.session
        with session.drives.preparing() as ticket:
            goal = await session.find_goal(place=given["place"], yaw_deg=given.get("yaw_deg"))
            drive = await session.drives.start(
                goal.pose, place=goal.title, ticket=ticket, thing=goal.thing
            )
            outcome = await self._follow(drive, on_progress)
        if goal.thing is None or outcome.state is not SkillState.SUCCEEDED:
            return outcome
        here, at = (await session.robot.fetch_pose()).pose.point, goal.thing.thing.position
        away_m = "not noted" if at is None else round(here.distance_to(at), 1)
        return replace(outcome, outputs={**outcome.outputs, "away_m": away_m})

    async def _look(self, given: Arguments, on_progress: OnProgress) -> SkillOutcome:
        """Drive to a clear view, and give the picture's id and what the detector reports in it."""
        session, place, camera = self.session, given["place"], given.get("camera")
        if place.casefold() != AHEAD:
            if camera is not None:
                raise GoalError(
                    "Only the front camera is turned to a place.", hint="Leave place or camera out."
                )
            with session.drives.preparing() as ticket:
                world = await session.fetch_world_model()
                half_view_rad = session.pictures.half_view_rad
                goal = await session.compute(lambda: choose_view(world, place, half_view_rad))
                here = (await session.robot.fetch_pose()).pose
                if not is_there(here, goal.pose):
                    drive = await session.drives.start(goal.pose, place=goal.title, ticket=ticket)
                    outcome = await self._follow(drive, on_progress)
                    if outcome.state is not SkillState.SUCCEEDED:
                        return outcome
        sighting = await look_ahead(session, camera)
        taken = session.pictures.latest
        picture_id = "" if taken is None else taken.id
        self.questions.keep(picture_id, sighting.picture)
        seen = ", ".join(each.label for each in sighting.detections)
        return succeeded(picture=picture_id, seen=seen)

    async def _follow(self, drive: Drive, on_progress: OnProgress) -> SkillOutcome:
        """Wait for the end of a drive; cancelled meanwhile, the robot is left standing."""

        async def tell(report: DriveReport) -> None:
            left_m = report.status.distance_left_m
            values = {} if left_m is None else {"left_m": round(left_m, 1)}
            on_progress(SkillProgress(values=values))

        while True:
            report = await self.session.drives.wait(drive.goal_id, wait_s=WAIT_S, on_progress=tell)
            if (status := report.status).state.is_final:
                break
        if status.state is GoalState.ARRIVED:
            return succeeded(place=drive.place)
        state, code = ENDS.get(status.state, (SkillState.FAILED, SkillCode.ABORTED))
        outputs, quote = {"place": drive.place}, say_cause(status.cause)
        return SkillOutcome(state, code, outputs=outputs, quote=quote)

    async def _note(self, given: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Keep an observation with the time and the pose; `recall_episodes` finds it again."""
        session, text = self.session, given["text"]
        pose = (await session.robot.fetch_pose()).pose
        room_id = await session.find_room_id(pose.point)

        keep = partial(
            session.episodes.keep,
            ObservationKind.NOTE,
            pose=pose,
            text=text,
            stamp_s=session.robot.now_s,
            room_id=room_id,
            name_map=session.memory.name_map,
        )
        fault = (await session.compute(keep)).fault
        return failed(SkillCode.LOST, fault) if fault else succeeded(text=text, room=room_id or "")

    async def _check(self, given: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        return failed() if await find_unmet(given, self.facts) else succeeded()

    async def _wait_for(self, given: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        until_s = self.facts.now_s + given["within_s"]
        while await find_unmet(given, self.facts):
            if self.facts.now_s >= until_s:
                return failed()
            await self.facts.sleep(CHECK_EVERY_S)
        return succeeded()

    async def _wait(self, given: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        await self.facts.sleep(given["duration_s"])
        return succeeded()

    async def _ask(self, given: Arguments, on_progress: OnProgress) -> SkillOutcome:
        """Ask, and fall back on the default where no answer comes in time."""
        question = self.questions.put(
            given["question"],
            tuple(given.get("answers", ())),
            picture=given.get("picture"),
            client=current_caller().session,
            within_s=given["within_s"],
            otherwise=given.get("otherwise"),
        )
        on_progress(SkillProgress())
        try:
            await end_within(self.facts, given["within_s"], question.is_answered.wait)
        finally:
            self.questions.take_back(question)
            on_progress(SkillProgress())
        if question.answer is not None:
            return succeeded(answer=question.answer, by="answered")
        if "otherwise" in given:
            return succeeded(answer=given["otherwise"], by="otherwise")
        return failed(SkillCode.NOT_ANSWERED)
