"""A topic, a service or an action of the robot as a skill, by the same door as the ROS tools."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import anyio

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.ros.activity import ActionState
from mapspeak.ros.definitions.checking import check_message
from mapspeak.ros.messages.fields import Message
from mapspeak.safety import Act, Call, Publish, zero_velocity_of
from mapspeak.server.tools.ros.commands import VELOCITIES, PublishRequest
from mapspeak.server.tools.ros.goals import RosAccess, TrackedGoal
from mapspeak.server.tools.ros.inquiry import Described
from mapspeak.server.tools.ros.measuring import check_frames
from mapspeak.server.tools.ros.reading import hear
from mapspeak.server.tools.ros.views import BULKY
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
from mapspeak.skills.arguments import check_arguments
from mapspeak.skills.layout import build_layout


class InterfaceKind(StrEnum):
    """The kinds of a robot's interfaces that can be skills."""

    SERVICE = "service"
    ACTION = "action"
    PUBLISH = "publish"
    READ = "read"


@dataclass(frozen=True, slots=True)
class Interface:
    """One thing that a robot offers.

    Attributes:
        name: In full, such as "/gripper/move".
        type: As "package/Type".
    """

    kind: InterfaceKind
    name: str
    type: str


TIMEOUTS_S = {
    InterfaceKind.SERVICE: 15.0,
    InterfaceKind.ACTION: 600.0,
    InterfaceKind.PUBLISH: 25.0,
    InterfaceKind.READ: 10.0,
}
DOES = {
    InterfaceKind.SERVICE: "calls",
    InterfaceKind.ACTION: "sends a goal to",
    InterfaceKind.PUBLISH: "publishes on",
    InterfaceKind.READ: "reads",
}
LOOK_S = 0.2
RATE_HZ = 10.0
DURATION = SkillParameter(
    name="for_s",
    kind=ParameterKind.NUMBER,
    unit="s to go on; then the robot stands",
    least=0.1,
    most=20.0,
    is_required=True,
)
"""The extra argument of a velocity: without an end the robot would go on."""
OUTCOMES = {
    ActionState.SUCCEEDED: (SkillState.SUCCEEDED, SkillCode.DONE),
    ActionState.ABORTED: (SkillState.FAILED, SkillCode.ABORTED),
    ActionState.CANCELLED: (SkillState.CANCELLED, SkillCode.STOPPED),
    ActionState.REJECTED: (SkillState.FAILED, SkillCode.REJECTED),
    ActionState.LOST: (SkillState.FAILED, SkillCode.LOST),
}


class InterfaceSkill(ABC):
    """The common part of all skills of one interface.

    Args:
        interface: What it calls.
        ros: The way to it.
        described: Its type.
        name: Of the skill.
        reserved: Names that no argument may have.
    """

    def __init__(
        self,
        interface: Interface,
        ros: RosAccess,
        described: Described,
        *,
        name: str,
        reserved: frozenset[str],
    ) -> None:
        self.interface = interface
        self.ros = ros
        self.described = described
        reads = interface.kind is InterfaceKind.READ
        self.sent = build_layout(described.book, described.parts[0], reserved=reserved)
        parameters = () if reads else self.sent.parameters
        if self.is_velocity:
            parameters = (*parameters, DURATION)
        self._spec = SkillSpec(
            name=name,
            description=f"{DOES[interface.kind]} {interface.name} ({interface.type})",
            effect=SkillEffect.READS if reads else SkillEffect.MOVES,
            timeout_s=TIMEOUTS_S[interface.kind],
            parameters=parameters,
        )

    @property
    def spec(self) -> SkillSpec:
        """Its description."""
        return self._spec

    @property
    def is_velocity(self) -> bool:
        """True for a topic on which a robot goes on until it is told otherwise."""
        is_published = self.interface.kind is InterfaceKind.PUBLISH
        return is_published and self.interface.type in VELOCITIES

    @abstractmethod
    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Do it once, and return how it ended."""

    async def check(self, arguments: Mapping[str, JsonValue]) -> Message:
        """Return the message that the arguments are, as its type wants it.

        Raises:
            LinkError: It does not fit, or names an unknown frame.
            SkillError: An argument is unknown, or has a wrong value.
        """
        given = check_arguments(self.spec.parameters, arguments, skill=self.spec.name)
        given.pop(DURATION.name, None)
        book, part = self.described.book, self.described.parts[0]
        message = check_message(book, part, self.sent.build(given))
        if self.interface.kind in (InterfaceKind.ACTION, InterfaceKind.PUBLISH):
            await check_frames(self.ros.inquiry, message)
        return message

    def read(self, part: int, message: Message) -> dict[str, JsonValue]:
        """Return the answer, named as arguments would be."""
        try:
            return build_layout(self.described.book, self.described.parts[part]).read(message)
        except LinkError:
            return {}


class ServiceSkill(InterfaceSkill):
    """Calls a service."""

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Call it; an answer that reports its own failure is a failure."""
        del on_progress
        name = self.interface.name
        said = await self.ros.inquiry.said(self.interface.type, kind="srv")
        self.ros.commands.check_name(Call(service=name, type=said, arguments={}))
        request = await self.check(arguments)
        answer = await self.ros.inquiry.connection.call_service(
            name, request, type_name=said, timeout_s=self.spec.timeout_s
        )
        outputs = self.read(1, answer)
        if answer.get("success", True) is False:
            return SkillOutcome(
                state=SkillState.FAILED,
                code=SkillCode.ABORTED,
                outputs=outputs,
                quote=str(answer.get("message", "")),
            )
        return SkillOutcome(state=SkillState.SUCCEEDED, outputs=outputs)


class ActionSkill(InterfaceSkill):
    """Sends a goal to an action and follows it to its end."""

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Send it; a goal that is given up or takes too long is cancelled at its server."""
        n_stops = self.ros.inquiry.connection.started.n_stops
        name = self.interface.name
        self.ros.commands.check_name(Act(action=name, type=self.interface.type, goal={}))
        goal = await self.check(arguments)
        tracked = await self.ros.goals.send(
            name, goal, type_name=self.interface.type, n_stops=n_stops
        )
        try:
            with anyio.move_on_after(self.spec.timeout_s):
                await self._follow(tracked, on_progress)
        except anyio.get_cancelled_exc_class():
            with anyio.CancelScope(shield=True):
                await self._end(tracked)
            raise
        if not tracked.goal.is_over:
            quote = await self._end(tracked)
            return SkillOutcome(
                state=SkillState.TIMED_OUT,
                code=SkillCode.TOO_LATE,
                numbers={"after_s": self.spec.timeout_s},
                quote=quote,
            )
        return self._outcome(tracked)

    async def _follow(self, tracked: TrackedGoal, on_progress: OnProgress) -> None:
        n_told = 0
        while not tracked.goal.is_over:
            await self.ros.goals.wait(tracked, wait_s=LOOK_S)
            feedback = tracked.goal.feedback
            if feedback is not None and tracked.goal.n_feedback != n_told:
                n_told = tracked.goal.n_feedback
                on_progress(SkillProgress(values=self.read(2, feedback)))

    async def _end(self, tracked: TrackedGoal) -> str:
        """Cancel a goal, and return its server's objection."""
        try:
            await self.ros.goals.cancel(tracked)
        except MapspeakError as error:
            return error.message
        return ""

    def _outcome(self, tracked: TrackedGoal) -> SkillOutcome:
        goal = tracked.goal
        state, code = OUTCOMES[goal.state]
        result = goal.result
        return SkillOutcome(
            state=state,
            code=code,
            outputs={} if result is None else self.read(1, result),
            quote=goal.reason,
        )


class PublishSkill(InterfaceSkill):
    """Publishes on a topic: a velocity for a time, anything else once."""

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Publish it; a velocity ends with a stand, also where it is given up."""
        del on_progress
        name, kind = self.interface.name, self.interface.type
        self.ros.commands.check_name(Publish(topic=name, type=kind, message={}))
        message = await self.check(arguments)
        is_moving = self.is_velocity and zero_velocity_of(message) != message
        request = PublishRequest(
            topic=name,
            type=await self.ros.inquiry.said(kind),
            message=message,
            is_moving=is_moving,
            duration_s=float(arguments[DURATION.name]) if self.is_velocity else None,
            rate_hz=RATE_HZ,
        )
        await self.ros.publisher.publish(request)
        return SkillOutcome(state=SkillState.SUCCEEDED)


class ReadSkill(InterfaceSkill):
    """Reads the latest message of a topic."""

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Wait for a message, where none has come yet."""
        del on_progress
        check_arguments((), arguments, skill=self.spec.name)
        heard = await hear(
            self.ros.inquiry.connection,
            self.interface.name,
            type_name=await self.ros.inquiry.said(self.interface.type),
            is_bulky=self.interface.type in BULKY,
            n=1,
            wait_s=self.spec.timeout_s,
            duration_s=0.0,
        )
        if not heard.messages:
            return SkillOutcome(state=SkillState.FAILED, code=SkillCode.NOT_ANSWERED)
        return SkillOutcome(
            state=SkillState.SUCCEEDED,
            outputs=self.read(0, heard.messages[0]),
            numbers={"age_s": round(heard.age_s, 1)},
        )


SKILLS: Mapping[InterfaceKind, type[InterfaceSkill]] = {
    InterfaceKind.SERVICE: ServiceSkill,
    InterfaceKind.ACTION: ActionSkill,
    InterfaceKind.PUBLISH: PublishSkill,
    InterfaceKind.READ: ReadSkill,
}
KINDS = {
    InterfaceKind.SERVICE: "srv",
    InterfaceKind.ACTION: "action",
    InterfaceKind.PUBLISH: "msg",
    InterfaceKind.READ: "msg",
}


async def open_interface(
    interface: Interface, ros: RosAccess, *, name: str, reserved: frozenset[str] = frozenset()
) -> InterfaceSkill:
    """Return the skill that an interface is.

    Raises:
        LinkError: Its type is not described, or cannot be.
    """
    said = await ros.inquiry.said(interface.type, kind=KINDS[interface.kind])
    described = await ros.inquiry.describe(said)
    return SKILLS[interface.kind](interface, ros, described, name=name, reserved=reserved)
