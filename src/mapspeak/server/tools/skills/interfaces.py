"""Topics, services and actions of a robot as skills."""

from contextlib import suppress
from dataclasses import dataclass
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
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillProgress,
    SkillSpec,
    parameter,
)
from mapspeak.skills.layout import MessageLayout, build_layout
from mapspeak.skills.skillsfile import Called


@dataclass(frozen=True, slots=True)
class Interface:
    """One thing that a robot offers: its full name, and its type as "package/Type"."""

    kind: Called
    name: str
    type: str

    @property
    def command(self) -> Act | Call | Publish | None:
        """What the policy sees of its use; None for one that is only read."""
        name, kind = self.name, self.type
        if self.kind is Called.ACTION:
            return Act(action=name, type=kind, goal={}, true_type=kind)
        if self.kind is Called.SERVICE:
            return Call(service=name, type=kind, arguments={})
        return Publish(topic=name, type=kind, message={}) if self.kind is Called.PUBLISH else None

    @property
    def is_velocity(self) -> bool:
        """True for a topic on which a robot goes on until it is told otherwise."""
        return self.kind is Called.PUBLISH and self.type in VELOCITIES


LOOK_S = 0.2
FOR = "for_s"
LASTS = {
    FOR: parameter(
        "number", unit="s to go on; then the robot stands", minimum=0.1, maximum=20.0, required=True
    )
}
"""The extra argument of a velocity: without an end the robot would go on."""
CODES = {
    ActionState.SUCCEEDED: SkillCode.DONE,
    ActionState.ABORTED: SkillCode.ABORTED,
    ActionState.CANCELLED: SkillCode.STOPPED,
    ActionState.REJECTED: SkillCode.REJECTED,
    ActionState.LOST: SkillCode.LOST,
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
            return SkillOutcome(SkillCode.ABORTED, outputs=outputs, quote=quote)
        return SkillOutcome(outputs=outputs)

    async def act(self, arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
        """Send a goal and follow it; one that is given up is cancelled at its server."""
        n_stops = self.ros.inquiry.connection.started.n_stops
        name, goal = self.interface.name, await self._check(arguments)
        tracked = await self.ros.goals.send(name, goal, described=self.described, n_stops=n_stops)
        try:
            await self._follow(tracked, on_progress)
        except anyio.get_cancelled_exc_class():
            with anyio.CancelScope(shield=True), suppress(MapspeakError):
                await self.ros.goals.cancel(tracked)
            raise
        ended = tracked.goal
        outputs = {} if ended.result is None else self._read(1, ended.result)
        return SkillOutcome(CODES[ended.state], outputs=outputs, quote=ended.reason)

    async def publish(self, arguments: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Publish once; a velocity for a time, then a stand, also where it is given up."""
        name, message = self.interface.name, await self._check(arguments)
        lasts_s = float(arguments[FOR]) if self.interface.is_velocity else None
        await self.ros.publisher.publish(
            PublishRun(topic=name, type=self.described.said, message=message, duration_s=lasts_s)
        )
        return SkillOutcome(SkillCode.SENT)

    async def read(self, _arguments: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Read the topic's latest message; wait for one, where none has come yet."""
        interface, wait_s = self.interface, self.spec.timeout_s
        heard = await self.ros.inquiry.hear(interface.name, interface.type, wait_s=wait_s)
        if not heard.messages:
            return SkillOutcome(SkillCode.NOT_ANSWERED)
        outputs = self._read(0, heard.messages[0])
        return SkillOutcome(outputs=outputs, numbers={"age_s": round(heard.age_s, 1)})

    async def _check(self, arguments: Arguments) -> Message:
        """Return the message that the arguments are; refuse one that does not fit."""
        message = self.described.check(self.sent.build(arguments))
        if self.interface.kind is not Called.SERVICE:
            await check_frames(self.ros.inquiry, message)
        return message

    def _read(self, part: int, message: Message) -> dict[str, JsonValue]:
        """Return an answer, named as arguments would be; nothing where its type cannot be."""
        with suppress(LinkError):
            return build_layout(self.described.book, self.described.parts[part]).read(message)
        return {}

    async def _follow(self, tracked: TrackedGoal, on_progress: OnProgress) -> None:
        n_told = 0
        while not tracked.goal.is_over:
            await self.ros.goals.wait(tracked, wait_s=LOOK_S)
            feedback = tracked.goal.feedback
            if feedback is not None and tracked.goal.n_feedback != n_told:
                n_told = tracked.goal.n_feedback
                on_progress(SkillProgress(values=self._read(2, feedback)))


WAYS = {
    Called.SERVICE: ("srv", "calls", 15.0, _Opened.call),
    Called.ACTION: ("action", "sends a goal to", 600.0, _Opened.act),
    Called.PUBLISH: ("msg", "publishes on", 25.0, _Opened.publish),
    Called.READ: ("msg", "reads", 10.0, _Opened.read),
}
"""How each kind is used: the kind of its type, in words, a usual limit of time, and a method."""


async def open_interface(
    interface: Interface,
    ros: RosAccess,
    *,
    name: str,
    timeout_s: float | None = None,
    reserved: frozenset[str] = frozenset(),
) -> Skill:
    """Return an interface as a skill, whose arguments and time are to be held to its spec.

    LinkError where its type is not or cannot be described. `reserved` are no arguments' names.
    """
    type_kind, does, usual_s, run = WAYS[interface.kind]
    reads = interface.kind is Called.READ
    described = await ros.inquiry.describe(interface.type, kind=type_kind)
    sent = build_layout(described.book, described.parts[0], reserved=reserved)
    spec = SkillSpec(
        name,
        f"{does} {interface.name} ({interface.type})",
        SkillEffect.READS if reads else SkillEffect.MOVES,
        timeout_s=timeout_s or usual_s,
        parameters={} if reads else {**sent.parameters, **(LASTS if interface.is_velocity else {})},
    )
    return Skill(spec, partial(run, _Opened(interface, ros, described, sent, spec)))
