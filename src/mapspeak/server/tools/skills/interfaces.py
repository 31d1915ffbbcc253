"""A topic, a service or an action of the robot as a skill, by the same door as the ROS tools."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from functools import partial

import anyio

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.ros.activity import ActionState
from mapspeak.ros.messages.fields import VELOCITIES, Message
from mapspeak.safety import Act, Call, Publish
from mapspeak.server.tools.ros.goals import RosAccess, TrackedGoal
from mapspeak.server.tools.ros.inquiry import Described
from mapspeak.server.tools.ros.publishing import PublishRun, check_frames
from mapspeak.skill import (
    Arguments,
    JsonValue,
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
from mapspeak.skills.arguments import check_arguments
from mapspeak.skills.layout import MessageLayout, build_layout
from mapspeak.skills.skillsfile import Called


@dataclass(frozen=True, slots=True)
class Interface:
    """One thing that a robot offers.

    Attributes:
        name: In full, such as "/gripper/move".
        type: As "package/Type".
    """

    kind: Called
    name: str
    type: str

    @property
    def command(self) -> Act | Call | Publish | None:
        """What the policy sees of its use; None for one that is only read."""
        match self.kind:
            case Called.ACTION:
                return Act(action=self.name, type=self.type, goal={}, true_type=self.type)
            case Called.SERVICE:
                return Call(service=self.name, type=self.type, arguments={})
            case Called.PUBLISH:
                return Publish(topic=self.name, type=self.type, message={})
            case _:
                return None

    @property
    def is_velocity(self) -> bool:
        """True for a topic on which a robot goes on until it is told otherwise."""
        return self.kind is Called.PUBLISH and self.type in VELOCITIES


LOOK_S = 0.2
DURATION = SkillParameter(
    "for_s",
    ParameterKind.NUMBER,
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


@dataclass(frozen=True, slots=True)
class _Opened:
    """An interface with its type and what it takes, ready to be used."""

    interface: Interface
    ros: RosAccess
    described: Described
    sent: MessageLayout
    spec: SkillSpec

    async def call(self, arguments: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Call the service; an answer that reports its own failure is a failure."""
        answer = await self.ros.inquiry.connection.call_service(
            self.interface.name,
            await self._check(arguments),
            type_name=self.described.said,
            timeout_s=self.spec.timeout_s,
        )
        outputs = self._read(1, answer)
        if answer.get("success", True) is False:
            quote = str(answer.get("message", ""))
            return replace(failed(SkillCode.ABORTED, quote), outputs=outputs)
        return succeeded(**outputs)

    async def act(self, arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
        """Send a goal and follow it; one that is given up or late is cancelled at its server."""
        n_stops = self.ros.inquiry.connection.started.n_stops
        name, goal = self.interface.name, await self._check(arguments)
        tracked = await self.ros.goals.send(name, goal, described=self.described, n_stops=n_stops)
        try:
            with anyio.move_on_after(self.spec.timeout_s):
                await self._follow(tracked, on_progress)
        except anyio.get_cancelled_exc_class():
            with anyio.CancelScope(shield=True):
                await self._end(tracked)
            raise
        ended = tracked.goal
        if not ended.is_over:
            quote, numbers = await self._end(tracked), {"after_s": self.spec.timeout_s}
            return SkillOutcome(
                SkillState.TIMED_OUT, SkillCode.TOO_LATE, numbers=numbers, quote=quote
            )
        outputs = {} if ended.result is None else self._read(1, ended.result)
        return SkillOutcome(*OUTCOMES[ended.state], outputs=outputs, quote=ended.reason)

    async def publish(self, arguments: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Publish once; a velocity for a time, then a stand, also where it is given up."""
        name, message = self.interface.name, await self._check(arguments)
        lasts_s = float(arguments[DURATION.name]) if self.interface.is_velocity else None
        await self.ros.publisher.publish(
            PublishRun(topic=name, type=self.described.said, message=message, duration_s=lasts_s)
        )
        return SkillOutcome(SkillState.SUCCEEDED, SkillCode.SENT)

    async def read(self, arguments: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Read the topic's latest message; wait for one, where none has come yet."""
        check_arguments((), arguments, skill=self.spec.name)
        heard = await self.ros.inquiry.hear(
            self.interface.name, self.interface.type, wait_s=self.spec.timeout_s
        )
        if not heard.messages:
            return failed(SkillCode.NOT_ANSWERED)
        outputs, age_s = self._read(0, heard.messages[0]), round(heard.age_s, 1)
        return replace(succeeded(**outputs), numbers={"age_s": age_s})

    async def _check(self, arguments: Arguments) -> Message:
        """Return the message that the arguments are; refuse one that is denied or does not fit."""
        if (command := self.interface.command) is not None:
            self.ros.inquiry.check_policy(command)
        given = check_arguments(self.spec.parameters, arguments, skill=self.spec.name)
        given.pop(DURATION.name, None)
        message = self.described.check(self.sent.build(given))
        if self.interface.kind is not Called.SERVICE:
            await check_frames(self.ros.inquiry, message)
        return message

    def _read(self, part: int, message: Message) -> dict[str, JsonValue]:
        """Return an answer, named as arguments would be."""
        try:
            return build_layout(self.described.book, self.described.parts[part]).read(message)
        except LinkError:
            return {}

    async def _follow(self, tracked: TrackedGoal, on_progress: OnProgress) -> None:
        n_told = 0
        while not tracked.goal.is_over:
            await self.ros.goals.wait(tracked, wait_s=LOOK_S)
            feedback = tracked.goal.feedback
            if feedback is not None and tracked.goal.n_feedback != n_told:
                n_told = tracked.goal.n_feedback
                on_progress(SkillProgress(values=self._read(2, feedback)))

    async def _end(self, tracked: TrackedGoal) -> str:
        """Cancel a goal, and return its server's objection."""
        try:
            await self.ros.goals.cancel(tracked)
        except MapspeakError as error:
            return error.message
        return ""


@dataclass(frozen=True, slots=True)
class _Way:
    """How interfaces of a kind are used."""

    type_kind: str
    does: str
    timeout_s: float
    run: Callable[[_Opened, Arguments, OnProgress], Awaitable[SkillOutcome]]


WAYS = {
    Called.SERVICE: _Way("srv", "calls", 15.0, _Opened.call),
    Called.ACTION: _Way("action", "sends a goal to", 600.0, _Opened.act),
    Called.PUBLISH: _Way("msg", "publishes on", 25.0, _Opened.publish),
    Called.READ: _Way("msg", "reads", 10.0, _Opened.read),
}


async def open_interface(
    interface: Interface,
    ros: RosAccess,
    *,
    name: str,
    timeout_s: float | None = None,
    reserved: frozenset[str] = frozenset(),
) -> Skill:
    """Return an interface as a skill.

    Args:
        name: Of the skill.
        timeout_s: The limit of a call; a usual one where left out.
        reserved: Names that no argument may have.

    Raises:
        LinkError: Its type is not described, or cannot be.
    """
    way, reads = WAYS[interface.kind], interface.kind is Called.READ
    described = await ros.inquiry.describe(interface.type, kind=way.type_kind)
    sent = build_layout(described.book, described.parts[0], reserved=reserved)
    parameters = () if reads else sent.parameters
    spec = SkillSpec(
        name,
        f"{way.does} {interface.name} ({interface.type})",
        SkillEffect.READS if reads else SkillEffect.MOVES,
        timeout_s=timeout_s or way.timeout_s,
        parameters=(*parameters, DURATION) if interface.is_velocity else parameters,
    )
    return Skill(spec, partial(way.run, _Opened(interface, ros, described, sent, spec)))
