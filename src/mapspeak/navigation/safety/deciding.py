"""Whether a command may go to the robot: one pure function over values."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from mapspeak.navigation.goals import GoalVerdict
from mapspeak.navigation.safety.commands import (
    Act,
    Call,
    Command,
    Drive,
    Publish,
    SetParameter,
    say_command,
)
from mapspeak.navigation.safety.hold import say_hold
from mapspeak.navigation.safety.policy import Policy

__all__ = [
    "Allowed",
    "Decision",
    "NeedsApproval",
    "Refused",
    "Situation",
    "decide",
    "find_speeds",
    "is_name_denied",
]

MOST_NESTED = 8
"""No message of speeds is nested deeper; what is, is refused unread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Allowed:
    """The command may go to the robot.

    Attributes:
        by: The person's word that covers it; empty where none was needed.
    """

    by: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """The command must not go to the robot.

    Attributes:
        rule: The rule's key in policy.yaml, or what else is against it.
        reason: What is wrong, with the number and the unit.
        hint: What could be done instead.
    """

    rule: str
    reason: str
    hint: str

    @property
    def is_of_the_goal(self) -> bool:
        """True when another goal may be allowed now, and False when no command would be."""
        return self.rule.startswith("goals")


@dataclass(frozen=True, slots=True, kw_only=True)
class NeedsApproval:
    """A person has to agree first.

    Attributes:
        question: What to ask.
    """

    question: str


Decision = Allowed | Refused | NeedsApproval


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What a decision depends on besides the command and the policy.

    Attributes:
        held_by: Why the robot is held; None where it is not.
        n_in_last_minute: Commands of this kind that were allowed in the last minute.
        is_approved: A person has agreed to this command.
        objection: Why a published velocity must not be, by where it would take the robot.
    """

    held_by: str | None = None
    n_in_last_minute: int = 0
    is_approved: bool = False
    objection: str | None = None


def decide(command: Command, *, policy: Policy, situation: Situation) -> Decision:
    """Decides on a command."""
    refusals = (
        _against_everything(policy, situation),
        _against_name(command, policy),
        _against_goal(command, policy),
        _against_speed(command, policy),
        _against_way(situation),
        _against_rate(command, policy, situation),
    )
    refused = next((each for each in refusals if each is not None), None)
    if refused is not None:
        return refused
    if command.kind in policy.approval.kinds and not situation.is_approved:
        return NeedsApproval(question=f"May the robot {say_command(command)}?")
    return Allowed()


def _against_everything(policy: Policy, situation: Situation) -> Refused | None:
    if policy.is_read_only:
        return Refused(
            rule="read_only",
            reason="The policy is read-only: nothing may move or change.",
            hint="Look, measure and remember what you see; a person can change policy.yaml.",
        )
    if situation.held_by is not None:
        return Refused(
            rule="hold",
            reason=f"The robot is held: {say_hold(situation.held_by)}.",
            hint="Tell the person at the robot; only `mapspeak release` lets it drive again.",
        )
    return None


def is_name_denied(command: Command, policy: Policy) -> bool:
    """True when the policy forbids a command for its name, whatever it says."""
    return _against_name(command, policy) is not None


def _against_name(command: Command, policy: Policy) -> Refused | None:
    name = _name_of(command)
    patterns = policy.patterns.get(command.kind)
    denial = None if name is None or patterns is None else patterns.find_denial(name)
    if denial is None:
        return None
    return Refused(
        rule=f"{command.kind}.names",
        reason=f"The robot may not {say_command(command)}: {denial}.",
        hint="To drive use navigate_to, to stop stop_robot; a person can change policy.yaml.",
    )


def _name_of(command: Command) -> str | None:
    match command:
        case Publish(topic=name) | Call(service=name) | Act(action=name):
            return name
        case SetParameter():
            return command.full_name
        case Drive():
            return None


def _against_goal(command: Command, policy: Policy) -> Refused | None:
    if not isinstance(command, Drive):
        return None
    check = command.check
    always = (GoalVerdict.NOT_FINITE, GoalVerdict.CLOSED)
    if not check.is_ok and (policy.needs_known_way or check.verdict in always):
        return Refused(rule="goals", reason=check.sentence, hint=_what_instead(command))
    if check.path_m is not None and check.path_m > policy.farthest_m:
        return Refused(
            rule="goals.farthest_m",
            reason=f"The goal is {check.path_m:.1f} m away, the policy allows "
            f"{policy.farthest_m:.1f} m.",
            hint="Choose a nearer goal, and go on from there.",
        )
    return None


def _what_instead(drive: Drive) -> str:
    near = drive.check.nearest
    if near is None:
        return "No place near it works either; call look_at_map and choose another one."
    return f"The nearest pose that works is x={near.x:.2f}, y={near.y:.2f}."


def _against_speed(command: Command, policy: Policy) -> Refused | None:
    if not isinstance(command, Publish):
        return None
    limits = {
        "linear": ("A linear speed", policy.speeds.linear_mps, "m/s"),
        "angular": ("An angular speed", policy.speeds.angular_radps, "rad/s"),
        "speed": ("A speed", policy.speeds.linear_mps, "m/s"),
    }
    for part, speed in find_speeds(command.message):
        name, most, unit = limits[part]
        # Written so that what is no number is refused too.
        if not speed <= most:
            return Refused(
                rule=f"speed.{part}",
                reason=f"{name} of {speed:g} {unit} is above the limit, {most:g} {unit}.",
                hint=f"Publish at most {most:g} {unit}.",
            )
    return None


def find_speeds(value: object, depth: int = 0) -> Iterator[tuple[str, float]]:
    """Finds speeds anywhere in a message: of Twist, TwistStamped, and drives with a speed."""
    if depth > MOST_NESTED:
        yield "linear", math.nan
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            if key in ("linear", "angular") and isinstance(inner, Mapping):
                yield key, _length_of(inner)
            elif key == "speed":
                yield key, abs(_number(inner))
            else:
                yield from find_speeds(inner, depth + 1)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            yield from find_speeds(inner, depth + 1)


def _length_of(vector: Mapping[str, Any]) -> float:
    return math.sqrt(sum(_number(part) ** 2 for part in vector.values()))


def _number(value: object) -> float:
    """Gives a finite number as it is, and what is none as NaN."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    try:
        return float(value) if is_number else math.nan  # type: ignore[arg-type]
    except OverflowError:
        return math.inf


def _against_way(situation: Situation) -> Refused | None:
    if situation.objection is None:
        return None
    return Refused(
        rule="keep_out",
        reason=situation.objection,
        hint="Publish a velocity that leads away, or use navigate_to, which leads round.",
    )


def _against_rate(command: Command, policy: Policy, situation: Situation) -> Refused | None:
    most = policy.rates.get(command.kind)
    if most is None or situation.n_in_last_minute < most:
        return None
    return Refused(
        rule=f"rates.{command.kind}",
        reason=f"{situation.n_in_last_minute} commands of the kind {command.kind} were given in "
        f"the last minute, the policy allows {most}.",
        hint="Wait, or do more with each command.",
    )
