"""A session as missions see it: the facts of their conditions, and the skills that all have."""

from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial

from mapspeak.driving.drivereport import Drive, DriveReport
from mapspeak.errors import GoalError, LinkError, MapError
from mapspeak.places.relations.choosing import find_place
from mapspeak.robot import GoalState
from mapspeak.safety import current_caller
from mapspeak.server.text.world.drives import say_cause
from mapspeak.server.tools.drive import drive_to_view
from mapspeak.server.tools.memory import keep_note
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.sightings import look_ahead
from mapspeak.session import Session
from mapspeak.skill import (
    Arguments,
    JsonValue,
    OnProgress,
    Schema,
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillProgress,
    SkillSpec,
    SkillState,
    parameter,
)
from mapspeak.skills.guarding import CONDITIONS, end_within, find_unmet, is_as_wanted
from mapspeak.skills.runs import QuestionBook

BATTERY = "sensor_msgs/BatteryState"
HEAR_S = 3.0
WAIT_S = 5.0
CHECK_EVERY_S = 1.0
HOUR_S, DAY_S = 3600.0, 86_400.0
READS, MOVES = SkillEffect.READS, SkillEffect.MOVES
AHEAD = "ahead"
PLACES = ("place", "in_room", "near")
"""The arguments of built-in skills that name a place."""
CODES = {
    GoalState.CANCELLED: SkillCode.STOPPED,
    GoalState.PREEMPTED: SkillCode.STOPPED,
    GoalState.REJECTED: SkillCode.REJECTED,
    GoalState.TIMED_OUT: SkillCode.TOO_LATE,
    GoalState.LOST: SkillCode.LOST,
}


Doing = Callable[["Leaves", Arguments, OnProgress], Awaitable[SkillOutcome]]
LEAVES: list[tuple[SkillSpec, Doing]] = []


def _leaf(effect: SkillEffect, timeout_s: float, **takes: Schema) -> Callable[[Doing], Doing]:
    """Make a method a skill of all missions; its docstring is the description."""

    def keep(do: Doing) -> Doing:
        said = (do.__doc__ or "").partition(".")[0]
        LEAVES.append(
            (SkillSpec(do.__name__, said, effect, timeout_s=timeout_s, parameters=takes), do)
        )
        return do

    return keep


def _text(most: int, description: str = "", **words: JsonValue) -> Schema:
    return parameter("string", maxLength=most, description=description, **words)


def _seconds(least: float, **words: JsonValue) -> Schema:
    return parameter("number", unit="s", minimum=least, maximum=DAY_S, **words)


@dataclass(eq=False)
class Leaves:
    """The facts of one session, and what missions do with the robot itself."""

    session: Session
    ros: RosAccess
    questions: QuestionBook

    def list_skills(self) -> Iterator[Skill]:
        """Yield each as a skill."""
        for spec, do in LEAVES:
            yield Skill(spec, partial(do, self))

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
        value, found = wanted[name], None
        with suppress(GoalError, LinkError, MapError):
            match name:
                case "battery_above" | "battery_below":
                    key, battery = name.removeprefix("battery_"), await self._fetch_battery()
                    found = None if battery is None else is_as_wanted(battery, {key: value})
                case "standing":
                    found = self.session.drives.is_busy is not value
                case "in_room" | "near":
                    found = await self._is_at(name, wanted)
                case "event" if (now := self.read_calendar()) is not None:
                    words, events = value.casefold().split(), self.session.recall_events()
                    told = [f"{each.text} {each.place}" for each in events if each.is_current(now)]
                    found = any(all(word in each.casefold() for word in words) for each in told)
                case "sees" if self.session.robot.description.detector is not None:
                    seen, label = await self.session.robot.fetch_detections(), value.casefold()
                    found = any(label in each.label.casefold() for each in seen)
        return found

    async def _fetch_battery(self) -> float | None:
        """Return how full the battery is: as the robot itself tells, else a topic of its ROS."""
        if self.session.skilled is not None:
            return await self.session.skilled.fetch_battery()
        inquiry = self.ros.inquiry
        topics = (await inquiry.fetch_topics()).types
        if (topic := next((name for name in topics if topics[name] == BATTERY), None)) is None:
            return None
        messages = (await inquiry.hear(topic, BATTERY, wait_s=HEAR_S)).messages
        share = messages[0].get("percentage") if messages else None
        return float(share) if isinstance(share, int | float) and 0.0 <= share <= 1.0 else None

    async def _is_at(self, name: str, wanted: Arguments) -> bool:
        """Return True where the robot is near a place, or in its room."""
        world = await self.session.fetch_world_model()
        here = (await self.session.robot.fetch_pose()).pose.point

        def judge() -> bool:
            there = find_place(world, wanted[name]).point
            if name == "near":
                return bool(here.distance_to(there) <= wanted.get("within_m", 1.0))
            room_id = world.find_room_id(there)
            return room_id is not None and room_id == world.find_room_id(here)

        return await self.session.compute(judge)

    @_leaf(
        MOVES,
        HOUR_S,
        place=_text(200, "an id, a remembered name, a phrase, or x, y", required=True),
        yaw_deg=parameter("number", unit="deg on arrival"),
    )
    async def drive(self, given: Arguments, on_progress: OnProgress) -> SkillOutcome:
        """Drive to a place."""
        session = self.session
        with session.drives.preparing() as ticket:
            goal = await session.find_goal(place=given["place"], yaw_deg=given.get("yaw_deg"))
            drive = await session.drives.start(
                goal.pose, place=goal.name, ticket=ticket, thing=goal.thing
            )
            outcome = await self._follow(drive, on_progress)
        if goal.thing is None or outcome.state is not SkillState.SUCCEEDED:
            return outcome
        here, at = (await session.robot.fetch_pose()).pose.point, goal.thing.thing.position
        away_m = "not noted" if at is None else round(here.distance_to(at), 1)
        return replace(outcome, outputs={**outcome.outputs, "away_m": away_m})

    @_leaf(
        MOVES,
        HOUR_S,
        place=_text(200, "ahead where left out", default=AHEAD),
        camera=_text(60, "another than the front one"),
    )
    async def look(self, given: Arguments, on_progress: OnProgress) -> SkillOutcome:
        """Take a picture: of a place from a clear view of it, or of what is ahead."""
        session, place, camera = self.session, given["place"], given.get("camera")
        if place.casefold() != AHEAD:
            if camera is not None:
                raise GoalError(
                    "Only the front camera is turned to a place.", hint="Leave place or camera out."
                )
            *_, drive = await drive_to_view(session, place)
            if drive is not None:
                outcome = await self._follow(drive, on_progress)
                if outcome.state is not SkillState.SUCCEEDED:
                    return outcome
        sighting = await look_ahead(session, camera)
        taken = session.pictures.latest
        picture_id = "" if taken is None else taken.id
        self.questions.keep(picture_id, sighting.picture)
        seen = ", ".join(each.label for each in sighting.detections)
        return SkillOutcome(outputs={"picture": picture_id, "seen": seen})

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
            return SkillOutcome(outputs={"place": drive.place})
        code, quote = CODES.get(status.state, SkillCode.ABORTED), say_cause(status.cause)
        return SkillOutcome(code, outputs={"place": drive.place}, quote=quote)

    @_leaf(READS, 60.0, text=_text(300, required=True))
    async def note(self, given: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Note an observation where the robot is."""
        session, text = self.session, given["text"]
        pose = (await session.robot.fetch_pose()).pose
        room_id = await session.find_room_id(pose.point)
        keep = partial(keep_note, session, text, pose=pose, room_id=room_id, stamp_s=self.now_s)
        if fault := await session.compute(keep):
            return SkillOutcome(SkillCode.LOST, quote=fault)
        return SkillOutcome(outputs={"text": text, "room": room_id or ""})

    @_leaf(READS, 60.0, **CONDITIONS)
    async def check(self, given: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Succeed where all that is given holds now."""
        unmet = await find_unmet(given, self)
        return SkillOutcome(SkillCode.NOT_ACHIEVED if unmet else SkillCode.DONE)

    @_leaf(READS, DAY_S, **CONDITIONS, within_s=_seconds(1, default=600.0))
    async def wait_for(self, given: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Wait until all that is given holds."""
        until_s = self.now_s + given["within_s"]
        while await find_unmet(given, self):
            if self.now_s >= until_s:
                return SkillOutcome(SkillCode.NOT_ACHIEVED)
            await self.sleep(CHECK_EVERY_S)
        return SkillOutcome()

    @_leaf(READS, DAY_S + 60, duration_s=_seconds(0, required=True))
    async def wait(self, given: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Wait."""
        await self.sleep(given["duration_s"])
        return SkillOutcome()

    @_leaf(
        READS,
        DAY_S,
        question=_text(300, required=True),
        answers=parameter(
            "array", description="any where left out", minItems=2, maxItems=10, items=_text(80)
        ),
        otherwise=_text(300, "without an answer; else the step fails"),
        within_s=_seconds(1, default=300.0),
        picture=_text(40, "its id; the latest if left out"),
    )
    async def ask(self, given: Arguments, on_progress: OnProgress) -> SkillOutcome:
        """Ask the model or the person who runs the mission, and wait for the answer."""
        question = self.questions.put(given, client=current_caller().session)
        on_progress(SkillProgress())
        try:
            await end_within(self, given["within_s"], question.is_answered.wait)
        finally:
            self.questions.waiting.pop(question.id, None)
            on_progress(SkillProgress())
        if question.answer is not None:
            return SkillOutcome(outputs={"answer": question.answer, "by": "answered"})
        if "otherwise" in given:
            return SkillOutcome(outputs={"answer": given["otherwise"], "by": "otherwise"})
        return SkillOutcome(SkillCode.NOT_ANSWERED)


BUILT_IN = frozenset(spec.name for spec, _ in LEAVES)
