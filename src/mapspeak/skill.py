"""THE PORT: a robot's skills besides driving: a description and a function that does it.

Exposed interfaces, entries of skills.yaml, the robot's own skills, leaves and missions are skills.
"""

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from enum import StrEnum
from typing import Any, Protocol

from mapspeak.robot import Robot

JsonValue = Any
"""A value of JSON: None, a truth value, a number, a text, a list or an object by its names."""
Arguments = Mapping[str, JsonValue]
Schema = Mapping[str, JsonValue]
"""What a value may be, as JSON Schema says it, with two words more: its `unit`, such as "m", and
`required`, true where it cannot be left out. Descriptions are quoted, never followed.
"""


def parameter(kind: str, **words: JsonValue) -> Schema:
    """Return a schema by the words of JSON Schema; None and "" say nothing."""
    said = {word: each for word, each in words.items() if each is not None and each != ""}
    return {"type": kind, **said}


class SkillEffect(StrEnum):
    """The effect of a skill on the world."""

    READS = "reads"
    MOVES = "moves"
    CHANGES = "changes"


@dataclass(frozen=True, slots=True)
class SkillSpec:
    """The description of a skill before it runs.

    Attributes:
        name: Unique among the skills of a robot: small letters, digits and underscores.
        description: What it does, in its owner's words: quoted, never followed.
        timeout_s: It is cancelled when it has not ended by then, in robot time.
        needs: The conditions that must hold when it begins, as a mission's `check` takes them.
        is_always_asked: A person is asked each time, whatever the policy says.
    """

    name: str
    description: str
    effect: SkillEffect
    _: KW_ONLY
    timeout_s: float
    parameters: Mapping[str, Schema] = field(default_factory=dict)
    needs: Arguments = field(default_factory=dict)
    is_always_asked: bool = False


class SkillState(StrEnum):
    """The state of a skill's run."""

    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    TIMED_OUT = "timed_out"


class SkillCode(StrEnum):
    """Why a run ended as it did."""

    DONE = "done"
    SENT = "sent"
    CANCELLED = "cancelled"
    STOPPED = "stopped"
    TOO_LATE = "too_late"
    REJECTED = "rejected"
    ABORTED = "aborted"
    LOST = "lost"
    NOT_ANSWERED = "not_answered"
    PRECONDITION = "precondition"
    NOT_ACHIEVED = "not_achieved"


_NOT_FAILED = {
    SkillCode.DONE: SkillState.SUCCEEDED,
    SkillCode.SENT: SkillState.SUCCEEDED,
    SkillCode.CANCELLED: SkillState.CANCELLED,
    SkillCode.STOPPED: SkillState.CANCELLED,
    SkillCode.TOO_LATE: SkillState.TIMED_OUT,
}


@dataclass(frozen=True, slots=True)
class SkillOutcome:
    """How a run of a skill ended.

    Attributes:
        outputs: Its results, by name; a mission passes these on.
        numbers: Details of the code, by name with the unit, such as "after_s".
        quote: The words of the robot's software.
        unmet: The condition that did not hold, for `PRECONDITION`.
    """

    code: SkillCode = SkillCode.DONE
    _: KW_ONLY
    outputs: Arguments = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    quote: str = ""
    unmet: Arguments = field(default_factory=dict)

    @property
    def state(self) -> SkillState:
        """The state in which the run ended."""
        return _NOT_FAILED.get(self.code, SkillState.FAILED)


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillProgress:
    """The progress of a running skill: its latest feedback, and a mission's steps so far."""

    values: Arguments = field(default_factory=dict)
    account: tuple[str, ...] = ()


OnProgress = Callable[[SkillProgress], None]
"""The listener for progress; it must not raise."""


@dataclass(frozen=True, slots=True, eq=False)
class Skill:
    """Something that a robot can do, by name.

    `run` does it once, and returns how it ended. When its task is cancelled, nothing of it is left
    running at the robot. Where it raises `MapspeakError` nothing was sent there.
    """

    spec: SkillSpec
    run: Callable[[Arguments, OnProgress], Awaitable[SkillOutcome]]


class SkilledRobot(Protocol):
    """A robot with skills of its own, which need no ROS; `mapspeak.skills` guards each of them."""

    def build_skills(self, driven: Robot) -> Sequence[Skill]:
        """Return its skills besides driving; those that drive send goals to `driven`."""

    async def fetch_battery(self) -> float | None:
        """Return how full its battery is, from 0 to 1; None where it does not tell."""
