"""Whether a command may go to the robot: one pure function over values."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from mapspeak.errors import GoalError, NextStep, PolicyError
from mapspeak.hold import say_hold
from mapspeak.installation import shell_command
from mapspeak.places.goalcheck import GoalCheck, GoalVerdict, say_check, say_instead
from mapspeak.ros.messages.fields import bare_type
from mapspeak.safety.commands import (
    Act,
    Call,
    Command,
    DriveCommand,
    Publish,
    RunSkill,
    SetParameter,
    say_command,
    say_whole,
)
from mapspeak.safety.policy import RATE_KEYS, Policy

MOST_NESTED = 8
"""Messages of speeds are not nested deeper; deeper ones are refused unread."""


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
        error: What the sender of the command is told.
    """

    rule: str
    error: GoalError | PolicyError


@dataclass(frozen=True, slots=True, kw_only=True)
class NeedsApproval:
    """A person has to agree first."""

    question: str


Decision = Allowed | Refused | NeedsApproval


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What a decision depends on besides the command and the policy.

    Attributes:
        held_by: Why the robot is held; None where it is not.
        n_in_last_minute: Commands of this kind that were allowed in the last minute.
        is_approved: A person has agreed to this command, or to the skill that gives it.
        objection: What is against a velocity or the goal of an action by where it leads.
    """

    held_by: str | None = None
    n_in_last_minute: int = 0
    is_approved: bool = False
    objection: Refused | None = None


def refuse(message: str, *, rule: str, hint: str, step: NextStep | None = None) -> Refused:
    """Return a refusal; of a goal where another one may be allowed."""
    kind = GoalError if rule.startswith("goals") else PolicyError
    return Refused(rule=rule, error=kind(message, hint=hint, step=step))


def decide(command: Command, *, policy: Policy, situation: Situation) -> Decision:
    """Decide on a command."""
    refusals = (
        _against_everything(policy, situation),
        _against_name(command, policy, is_approved=situation.is_approved),
        judge_check(command.check, policy) if isinstance(command, DriveCommand) else None,
        _against_speed(command, policy),
        situation.objection,
        _against_rate(command, policy, situation),
    )
    refused = next((each for each in refusals if each is not None), None)
    if refused is not None:
        return refused
    needs_word = isinstance(command, RunSkill) and command.needs_word
    if (needs_word or command.kind in policy.approval.kinds) and not situation.is_approved:
        return NeedsApproval(question=f"May the robot {say_whole(command)}?")
    return Allowed()


def _against_everything(policy: Policy, situation: Situation) -> Refused | None:
    if policy.is_read_only:
        return refuse(
            "The policy is read-only: nothing may move or change.",
            rule="read_only",
            hint="Look, measure and remember what you see; a person can change policy.yaml.",
        )
    if situation.held_by is not None:
        return refuse(
            f"The robot is held: {say_hold(situation.held_by)}.",
            rule="hold",
            hint=f"Tell the person at the robot: `{shell_command('release')}` lets it drive again.",
        )
    return None


def is_name_denied(command: Command, policy: Policy) -> bool:
    """Return True when the policy forbids a command for its name, whatever it says."""
    return _against_name(command, policy) is not None


def _against_name(command: Command, policy: Policy, *, is_approved: bool = False) -> Refused | None:
    patterns = policy.patterns.get(command.kind)
    if isinstance(command, DriveCommand) or patterns is None:
        return None
    name = _name_of(command)
    denial = patterns.find_denial(name, _types_of(command))
    if denial is None or (is_approved and denial.key == "usual_denials"):
        return None
    key, said = f"{command.kind}.{denial.key}", ", ".join(denial.patterns) or "nothing"
    how = f"change {key}"
    if denial.key == "usual_denials":
        opened = json.dumps([*patterns.allow, name], ensure_ascii=False)
        how = f"open this one name: `{command.kind}: {{allow: {opened}}}`"
    return refuse(
        f"The policy denies this: {say_command(command)} ({key}: {said}).",
        rule=key,
        hint=f"In the file given to mapspeak with --policy a person can {how}.",
        step=NextStep.USE_OTHER_TOOLS,
    )


def _name_of(command: Publish | Call | Act | SetParameter | RunSkill) -> str:
    match command:
        case Publish(topic=name) | Call(service=name) | Act(action=name) | RunSkill(skill=name):
            return name
        case SetParameter():
            return command.full_name


def _types_of(command: Publish | Call | Act | SetParameter | RunSkill) -> tuple[str, ...]:
    """Return the types that a command is known by, as they were written and as "package/Type"."""
    types: tuple[str, ...] = ()
    match command:
        case Act():
            types = (command.type, command.true_type)
        case Publish() | Call():
            types = (command.type,)
        case SetParameter() | RunSkill():
            pass
    return tuple({form for each in types if each for form in (each, bare_type(each))})


def judge_check(check: GoalCheck, policy: Policy) -> Refused | None:
    """Return what is against a goal by what the map says of it; None when nothing is."""
    always = (GoalVerdict.NOT_FINITE, GoalVerdict.CLOSED)
    if not check.is_ok and (policy.needs_known_way or check.verdict in always):
        hint, step = say_instead(check)
        # Not every command drives by goals of ours: only the lack of one says what to do next.
        needed = step if check.nearest is None else None
        return refuse(say_check(check), rule="goals", hint=hint, step=needed)
    if check.path_m is not None and check.path_m > policy.farthest_m:
        return refuse(
            f"The goal is {check.path_m:.1f} m away, the policy allows {policy.farthest_m:.1f} m.",
            rule="goals.farthest_m",
            hint="Choose a nearer goal, and go on from there.",
        )
    return None


def _against_speed(command: Command, policy: Policy) -> Refused | None:
    if not isinstance(command, Publish):
        return None
    limits = {
        "linear": ("A linear speed", "linear_mps", "m/s"),
        "angular": ("An angular speed", "angular_radps", "rad/s"),
        "speed": ("A speed", "linear_mps", "m/s"),
    }
    for part, speed in find_speeds(command.message):
        name, key, unit = limits[part]
        most: float = getattr(policy.speeds, key)
        # Written so that NaN is refused too.
        if not speed <= most:
            return refuse(
                f"{name} of {speed:g} {unit} is above the limit, {most:g} {unit}.",
                rule=f"speed.{key}",
                hint=f"Publish at most {most:g} {unit}; a person can change speed.{key} in "
                "policy.yaml.",
            )
    return None


def find_speeds(value: object, depth: int = 0) -> Iterator[tuple[str, float]]:
    """Find speeds anywhere in a message: of Twist, TwistStamped, and drive with a speed."""
    if depth > MOST_NESTED:
        yield "linear", math.nan
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            if key in ("linear", "angular") and isinstance(inner, Mapping):
                yield key, _length_of(inner)
            elif key == "speed":
                yield key, abs(read_number(inner))
            else:
                yield from find_speeds(inner, depth + 1)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            yield from find_speeds(inner, depth + 1)


def _length_of(vector: Mapping[str, Any]) -> float:
    return math.hypot(*map(read_number, vector.values()))


def read_number(value: object) -> float:
    """Return a finite number as it is, and anything else as NaN."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    try:
        return float(value) if is_number else math.nan  # type: ignore[arg-type]
    except OverflowError:
        return math.inf


def _against_rate(command: Command, policy: Policy, situation: Situation) -> Refused | None:
    most = policy.rates.get(command.kind)
    if most is None or situation.n_in_last_minute < most:
        return None
    key = f"rates.{RATE_KEYS[command.kind]}"
    return refuse(
        f"{situation.n_in_last_minute} commands of the kind {command.kind} were given in "
        f"the last minute, the policy allows {most}.",
        rule=key,
        hint=f"Wait, or do more with each command; a person can change {key} in policy.yaml.",
    )
