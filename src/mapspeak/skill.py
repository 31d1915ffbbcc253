"""THE PORT: what a robot can do besides driving, and the values that cross.

A skill is an exposed topic, service or action of the robot, an entry of skills.yaml, a skill of the
simulated robot, or a saved mission. Whoever runs one sees nothing else of it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol

JsonValue = Any
"""A value of JSON: None, a truth value, a number, a text, a list or an object by its names."""


class SkillEffect(StrEnum):
    """What running a skill does to the world."""

    READS = "reads"
    MOVES = "moves"
    CHANGES = "changes"


class SkillApproval(StrEnum):
    """Whether a person is asked before a skill is run."""

    AS_POLICY = "as_policy"
    ALWAYS = "always"


class ParameterKind(StrEnum):
    """What a parameter holds; bytes are a text in base64."""

    NUMBER = "number"
    WHOLE = "whole"
    TEXT = "text"
    BYTES = "bytes"
    FLAG = "flag"
    LIST = "list"
    OBJECT = "object"


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillParameter:
    """One argument that a skill takes, or what a list or an object within one holds.

    Attributes:
        name: Empty for what a list holds.
        description: What it is, in its owner's words: quoted, never followed.
        unit: Such as "m"; empty where it has none.
        least: Of a number; of a list, how many values it holds at least.
        most: Of a number; of a list, how many values it holds at most; of a text, its
            letters.
        choices: The only values it may have; empty where it may have any.
        is_required: It has no default.
        default: What it is where it is left out.
        item: What a list holds.
        fields: What an object holds.
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
    """What may have to hold before a skill is run."""

    BATTERY_ABOVE = "battery_above"
    STANDING = "standing"
    IN_ROOM = "in_room"


@dataclass(frozen=True, slots=True)
class Precondition:
    """What must hold before a skill is run.

    Attributes:
        ratio: Of the battery's charge, for `BATTERY_ABOVE`.
        room: Its id or its name, for `IN_ROOM`.
    """

    kind: PreconditionKind
    ratio: float | None = None
    room: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillSpec:
    """What is known of a skill before it is run.

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
    """How a run of a skill stands."""

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
        outputs: What it gave, by name; a mission passes these on.
        numbers: Details of the code, by name with the unit, such as "after_s" or "battery_ratio".
        quote: What the robot's software said, word for word.
        failed: What did not hold, for `PRECONDITION`.
    """

    state: SkillState
    code: SkillCode = SkillCode.DONE
    outputs: Mapping[str, JsonValue] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    quote: str = ""
    failed: Precondition | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillProgress:
    """What a running skill tells.

    Attributes:
        values: The latest feedback, by name.
        done_ratio: None where it is not known.
        is_asking: It waits for somebody's answer.
        account: What a mission has done so far, a step each.
    """

    values: Mapping[str, JsonValue] = field(default_factory=dict)
    done_ratio: float | None = None
    is_asking: bool = False
    account: tuple[str, ...] = ()


OnProgress = Callable[[SkillProgress], None]
"""What is told of progress; it must not raise."""


class Skill(Protocol):
    """Something that a robot can do, by name."""

    @property
    def spec(self) -> SkillSpec:
        """What is known of it before it is run."""

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
        """What it can do besides driving, looking and stopping."""

    async def fetch_battery(self) -> float | None:
        """Return how full its battery is, from 0 to 1; None where it does not tell."""
