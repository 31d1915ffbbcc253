"""Topics, services and actions of a robot as skills, and as tools while it offers them."""

import fnmatch
import logging
import math
import re
from collections.abc import Awaitable, Callable, Collection
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import anyio

from mapspeak.errors import LinkError, MapspeakError, PolicyError
from mapspeak.ros.activity import ActionState
from mapspeak.ros.census import fetch_publishers, fetch_subscribers
from mapspeak.ros.messages.fields import VELOCITIES, Message, bare_type
from mapspeak.safety import Act, Call, GuardedConnection, Publish
from mapspeak.server.tools.ros.goals import RosAccess, TrackedGoal
from mapspeak.server.tools.ros.inquiry import Described, actions_of
from mapspeak.server.tools.ros.publishing import PublishRun, check_frames
from mapspeak.server.tools.ros.services import find_folded
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
    SkillState,
    failed,
    parameter,
    succeeded,
)
from mapspeak.skills.layout import MessageLayout, build_layout
from mapspeak.skills.skillsfile import Called

if TYPE_CHECKING:
    from mapspeak.server.tools.skills.book import SkillBook

logger = logging.getLogger(__name__)


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
        is_read = self.kind is Called.READ
        return None if is_read else Publish(topic=name, type=kind, message={})

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
        return SkillOutcome(*OUTCOMES[ended.state], outputs=outputs, quote=ended.reason)

    async def publish(self, arguments: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Publish once; a velocity for a time, then a stand, also where it is given up."""
        name, message = self.interface.name, await self._check(arguments)
        lasts_s = float(arguments[FOR]) if self.interface.is_velocity else None
        await self.ros.publisher.publish(
            PublishRun(topic=name, type=self.described.said, message=message, duration_s=lasts_s)
        )
        return SkillOutcome(SkillState.SUCCEEDED, SkillCode.SENT)

    async def read(self, _arguments: Arguments, _on_progress: OnProgress) -> SkillOutcome:
        """Read the topic's latest message; wait for one, where none has come yet."""
        interface, wait_s = self.interface, self.spec.timeout_s
        heard = await self.ros.inquiry.hear(interface.name, interface.type, wait_s=wait_s)
        if not heard.messages:
            return failed(SkillCode.NOT_ANSWERED)
        outputs, age_s = self._read(0, heard.messages[0]), round(heard.age_s, 1)
        return replace(succeeded(**outputs), numbers={"age_s": age_s})

    async def _check(self, arguments: Arguments) -> Message:
        """Return the message that the arguments are; refuse one that is denied or does not fit."""
        if (command := self.interface.command) is not None:
            self.ros.inquiry.check_policy(command)
        message = self.described.check(self.sent.build(arguments))
        if self.interface.kind is not Called.SERVICE:
            await check_frames(self.ros.inquiry, message)
        return message

    def _read(self, part: int, message: Message) -> dict[str, JsonValue]:
        """Return an answer, named as arguments would be; nothing where its type cannot be."""
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


MOST_EXPOSED = 100
"""Tools; a model that reads more of them reads nothing else."""
EVERY_S, KEPT_S = 2.0, 20.0
PARTS_OF_ACTION = ("goal", "cancel", "status", "feedback", "result")
MOST_NAME = 60
RESERVED = frozenset({"wait_s", "for_s", "robot"})
"""Names that no argument of a tool may have: they are the tool's own."""
PREFIXES = {Called.PUBLISH: "publish_", Called.READ: "read_"}

_Name = tuple[Called, str]


@dataclass(eq=False)
class Exposure:
    """Keeps the exposed skills of a book in step with the robot's interfaces of some names.

    Attributes:
        patterns: Of full names, as the shell writes them: "/gripper/*".
        tell: Tells clients where tools have changed.
        every_s: Between two looks, in wall time.
        kept_s: For which a type, the ends of a topic, or one that failed, are not tried again.
    """

    ros: RosAccess
    book: "SkillBook"
    patterns: tuple[str, ...]
    _: KW_ONLY
    tell: Callable[[], Awaitable[None]]
    every_s: float = EVERY_S
    kept_s: float = KEPT_S
    _asked_s: float = -math.inf
    _known: dict[_Name, dict[Interface, Skill | None]] = field(default_factory=dict)

    async def keep_looking(self) -> None:
        """Look again and again; a robot out of reach keeps its tools until it is back.

        One that was never there has none yet.
        """
        while True:
            with suppress(MapspeakError):
                if self.ros.inquiry.connection.lost_for_s is not None:
                    self.forget()
                await self.look()
            await anyio.sleep(self.every_s)

    def forget(self) -> None:
        """Ask for everything anew with the next look: the robot may be another one."""
        self._asked_s = -math.inf

    async def look(self) -> None:
        """Expose new interfaces, withdraw those that are gone, and tell clients of any change.

        LinkError where the robot cannot be asked.
        """
        named, now_s = await self._list_named(), anyio.current_time()
        if is_due := now_s >= self._asked_s + self.kept_s:
            self._asked_s = now_s
        self._known = {key: each for key, each in self._known.items() if key in named}
        self._show()
        for key, type_name in named.items():
            if is_due or key not in self._known:
                await self._ask(key, type_name)
        self._show()
        await self.tell()

    def _show(self) -> None:
        opened = (each for known in self._known.values() for each in known.values())
        self.book.exposed = {each.spec.name: each for each in opened if each is not None}

    async def _ask(self, key: _Name, type_name: str) -> None:
        """Open what a name is; at an error all stays."""
        known = self._known.setdefault(key, {})
        with suppress(LinkError):
            found = await self._fetch(*key, type_name)
            for gone in known.keys() - found:
                del known[gone]
            for interface in found:
                known[interface] = known.get(interface) or await self._open(interface, known)

    async def _open(self, interface: Interface, known: Collection[Interface]) -> Skill | None:
        """Return an interface as a skill; None where it cannot be, which is told once."""
        base = f"{PREFIXES.get(interface.kind, '')}{interface.name.strip('/')}"
        name = _name_tool(base, taken=self.book.taken_names)
        try:
            if len(self.book.exposed) >= MOST_EXPOSED:
                said = f"{MOST_EXPOSED} tools are exposed already."
                raise LinkError(said, hint="Name fewer of them.")
            self._check_policy(interface)
            skill = await self.book.open_interface(interface, name=name, reserved=RESERVED)
        except MapspeakError as error:
            if interface not in known:
                logger.warning("%s is not exposed: %s", interface.name, error)
            return None
        self.book.exposed[name] = skill
        return skill

    def _check_policy(self, interface: Interface) -> None:
        """Refuse an interface that the policy denies for its name: a tool would be of no use."""
        connection, command = self.ros.inquiry.connection, interface.command
        if command is None or not isinstance(connection, GuardedConnection):
            return
        if connection.is_name_denied(command):
            raise PolicyError("The policy denies it.", hint="A person can allow it in policy.yaml.")

    async def _list_named(self) -> dict[_Name, str]:
        """Return what the robot offers now of the requested names, with the types of topics."""
        connection = self.ros.inquiry.connection
        graph, offered = await connection.fetch_graph(), await connection.fetch_services()
        actions = actions_of(graph)
        parts = {f"{action}/{part}" for action in actions for part in PARTS_OF_ACTION}
        topics = (each for each in sorted(graph.types) if each not in parts)
        services = (each for each in offered if each in self.patterns or find_folded(each) is None)
        types = {
            **{(Called.ACTION, name): "" for name in actions},
            **{(Called.SERVICE, name): "" for name in services},
            **{(Called.READ, name): graph.types[name] for name in topics},
        }
        return {
            (called, name): kind
            for (called, name), kind in types.items()
            if "/_action/" not in name or (called is Called.SERVICE and name in self.patterns)
            if any(fnmatch.fnmatchcase(name, pattern) for pattern in self.patterns)
        }

    async def _fetch(self, called: Called, name: str, kind: str) -> list[Interface]:
        """Return an action or a service; or what a topic of a type is for, by its ends."""
        inquiry = self.ros.inquiry
        if called is Called.READ:
            ends = {
                Called.READ: await fetch_publishers(inquiry.connection, name),
                Called.PUBLISH: await fetch_subscribers(inquiry.connection, name),
            }
            return [Interface(side, name, bare_type(kind)) for side in ends if ends[side].others]
        is_action, connection = called is Called.ACTION, inquiry.connection
        fetch = inquiry.fetch_action_type if is_action else connection.fetch_service_type
        return [Interface(called, name, bare_type(await fetch(name)))]


def _name_tool(name: str, *, taken: Collection[str]) -> str:
    """Return what a name of ROS is called as a tool, like no other tool."""
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower()[-MOST_NAME:].strip("_")
    base = plain or "skill"
    others = (f"robot_{base}{end}" for end in ("", *(f"_{n}" for n in range(2, 1000))))
    return next(each for each in (base, *others) if each not in taken)
