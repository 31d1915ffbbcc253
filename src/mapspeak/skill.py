"""THE PORT: a robot's skills besides driving, and their values.

A skill is an exposed topic, service or action of the robot, an entry of skills.yaml, a skill of the
simulated robot, or a saved mission. The caller sees only this port.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol

JsonValue = Any
"""A value of JSON: None, a truth value, a number, a text, a list or an object by its names."""


class SkillEffect(StrEnum):
    """The effect of a skill on the world."""

    READS = "reads"
    MOVES = "moves"
    CHANGES = "changes"


class SkillApproval(StrEnum):
    """The need for a person's consent before a skill runs."""

    AS_POLICY = "as_policy"
    ALWAYS = "always"


class ParameterKind(StrEnum):
    """The type of a parameter's value; bytes are a text in base64."""

    NUMBER = "number"
    WHOLE = "whole"
    TEXT = "text"
    BYTES = "bytes"
    FLAG = "flag"
    LIST = "list"
    OBJECT = "object"


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillParameter:
    """One parameter of a skill, or an element of a list or an object within one.

    Attributes:
        name: Empty for an element of a list.
        description: What it is, in its owner's words: quoted, never followed.
        unit: Such as "m"; empty where it has none.
        least: The least number; of a list, the least count of values.
        most: The largest number; of a list, the most values; of a text, the most letters.
        choices: The only values it may have; empty where it may have any.
        is_required: It has no default.
        default: Its value where it is left out.
        item: The element of a list.
        fields: The fields of an object.
    """

    name: str
    kind: ParameterKind
    description: str = ""
    unit: str = ""
    least: float | None = None
    most: float | None = None
    choices: tuple[JsonValue, ...] = ()
    is_required: bool = False
    default: JsonValue = None
    item: "SkillParameter | None" = None
    fields: tuple["SkillParameter", ...] = ()


class PreconditionKind(StrEnum):
    """The conditions that may have to hold before a skill runs."""

    BATTERY_ABOVE = "battery_above"
    STANDING = "standing"
    IN_ROOM = "in_room"


@dataclass(frozen=True, slots=True)
class Precondition:
    """A condition that must hold before a skill runs.

    Attributes:
        ratio: Of the battery's charge, for `BATTERY_ABOVE`.
        room: Its id or its name, for `IN_ROOM`.
    """

    kind: PreconditionKind
    ratio: float | None = None
    room: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillSpec:
    """The description of a skill before it runs.

    Attributes:
        name: Unique among the skills of a robot: small letters, digits and underscores.
        description: What it does, in its owner's words: quoted, never followed.
        timeout_s: It is cancelled when it has not ended by then, in robot time.
        preconditions: All of them must hold when it begins.
    """

    name: str
    description: str
    effect: SkillEffect
    timeout_s: float
    parameters: tuple[SkillParameter, ...] = ()
    preconditions: tuple[Precondition, ...] = ()
    approval: SkillApproval = SkillApproval.AS_POLICY


class SkillState(StrEnum):
    """The state of a skill's run."""

    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    TIMED_OUT = "timed_out"

    @property
    def is_final(self) -> bool:
        """True when nothing more will happen."""
        return self is not SkillState.RUNNING


class SkillCode(StrEnum):
    """Why a run ended as it did."""

    DONE = "done"
    CANCELLED = "cancelled"
    STOPPED = "stopped"
    TOO_LATE = "too_late"
    REJECTED = "rejected"
    ABORTED = "aborted"
    LOST = "lost"
    NOT_OFFERED = "not_offered"
    NOT_ANSWERED = "not_answered"
    PRECONDITION = "precondition"
    NOT_ACHIEVED = "not_achieved"


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillOutcome:
    """How a run of a skill ended.

    Attributes:
        outputs: Its results, by name; a mission passes these on.
        numbers: Details of the code, by name with the unit, such as "after_s" or "battery_ratio".
        quote: The words of the robot's software.
        failed: The condition that did not hold, for `PRECONDITION`.
    """

    state: SkillState
    code: SkillCode = SkillCode.DONE
    outputs: Mapping[str, JsonValue] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    quote: str = ""
    failed: Precondition | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillProgress:
    """The progress of a running skill.

    Attributes:
        values: The latest feedback, by name.
        done_ratio: None where it is not known.
        is_asking: It waits for an answer.
        account: The steps that a mission has done so far.
    """

    values: Mapping[str, JsonValue] = field(default_factory=dict)
    done_ratio: float | None = None
    is_asking: bool = False
    account: tuple[str, ...] = ()


OnProgress = Callable[[SkillProgress], None]
"""The listener for progress; it must not raise."""


class Skill(Protocol):
    """Something that a robot can do, by name."""

    @property
    def spec(self) -> SkillSpec:
        """Its description before it runs."""

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Do it once, and return how it ended.

        Everything it started is ended when the task is cancelled or the timeout passes:
        nothing of it is left running at the robot.

        Raises:
            MapspeakError: It cannot be begun: wrong arguments, a denied or a missing interface, an
                approval that is needed. Nothing was sent to the robot then.
        """


class SkilledRobot(Protocol):
    """A robot with skills of its own, which need no ROS; `mapspeak.skills` guards each of them."""

    @property
    def skills(self) -> Sequence[Skill]:
        """Its skills besides driving, looking and stopping."""

    async def fetch_battery(self) -> float | None:
        """Return how full its battery is, from 0 to 1; None where it does not tell."""
