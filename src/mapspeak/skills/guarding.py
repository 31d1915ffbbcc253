"""A skill as every caller runs it: under its conditions, allowed by the guard, ended in time."""

import math
from collections.abc import Awaitable, Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import datetime, time
from functools import partial
from typing import Protocol, TypeVar

import anyio

from mapspeak.errors import SkillError, plain_errors
from mapspeak.safety import Guard, RunSkill, covered_by
from mapspeak.skill import (
    Arguments,
    JsonValue,
    OnProgress,
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillSpec,
    parameter,
)
from mapspeak.skills.arguments import check_arguments, plain

_SHARE = parameter("number", unit="0 to 1", minimum=0, maximum=1)
OF_FACTS = {
    "battery_above": _SHARE,
    "battery_below": _SHARE,
    "standing": parameter("boolean", description="no drive is under way"),
    "in_room": parameter("string", description="an id or a name", maxLength=200),
    "near": parameter("string", description="a place", maxLength=200),
    "within_m": parameter("number", description="of near", default=1.0),
    "event": parameter("string", description="words of an event that lasts now", maxLength=200),
    "sees": parameter("string", description="a thing that the detector reports now", maxLength=200),
    "time_from": parameter("string", description="such as 22:00", maxLength=5),
    "time_until": parameter("string", description="such as 06:00", maxLength=5),
    "not": parameter("boolean", description="the opposite", default=False),
}
COMPARING = {
    "value": parameter("string", description="a result, such as {door.answer}", maxLength=1000),
    "is": parameter("string", description="the wanted value", maxLength=1000),
    "above": parameter("number", description="of the value"),
    "below": parameter("number", description="of the value"),
}
CONDITIONS = {**OF_FACTS, **COMPARING}
MODIFIERS = frozenset({"not", "within_m", "within_s"})
LOOKS_S = (0.05, 0.25)
"""The shortest and longest wall time between two looks at the robot's clock."""
FASTEST = 20
"""A robot's clock may run so many times as fast as the wall's, and no limit is kept late."""
STILL_S = 1.0
"""Wall time after which a clock that shows the same stands still."""
T = TypeVar("T")


class Facts(Protocol):
    """The present facts, as far as the robot and its memory know; None is what is not known."""

    @property
    def now_s(self) -> float:
        """Robot time."""

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""

    def read_calendar(self) -> datetime | None:
        """Return the operator's time; None where that is not known."""

    async def holds(self, name: str, wanted: Arguments) -> bool | None:
        """Return True where a condition of `OF_FACTS` holds now, other than those of the time."""


async def find_unmet(wanted: Arguments, facts: Facts) -> dict[str, JsonValue]:
    """Return the first condition that does not hold, by its name; empty where all hold.

    What is not known does not hold, and neither does its opposite. SkillError where nothing is
    wanted, or a time of day cannot be read.
    """
    named = {name: each for name, each in wanted.items() if name not in MODIFIERS}
    if not named:
        raise SkillError(
            "A condition needs something that is to hold.",
            hint=f"Give one of: {', '.join(CONDITIONS)}.",
        )
    is_opposite = wanted.get("not", False)
    for name, value in named.items():
        if name.startswith("time_"):
            holds = _is_time(wanted, facts.read_calendar())
        elif name not in COMPARING:
            holds = await facts.holds(name, wanted)
        elif "value" in wanted:
            holds = is_as_wanted(wanted["value"], wanted)
        else:
            raise SkillError("is, above and below need a value.", hint="Write value: '{name}'.")
        if is_opposite and holds is False:
            return {}
        if not is_opposite and not holds:
            return {name: value}
    return {"not": named} if is_opposite else {}


def is_as_wanted(value: JsonValue, wanted: Mapping[str, JsonValue]) -> bool:
    """Return True where a value is what `is` says in any notation, and above and below numbers."""
    equal, above, below = (wanted.get(key) for key in ("is", "above", "below"))
    if equal is not None and plain(value).casefold() != plain(equal).casefold():
        return False
    if above is None and below is None:
        return True
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        return False
    return (above is None or number > above) and (below is None or number < below)


def _is_time(wanted: Arguments, now: datetime | None) -> bool | None:
    if now is None:
        return None
    begins, ends = (_read_time(wanted.get(key, "00:00")) for key in ("time_from", "time_until"))
    at = now.time()
    return begins <= at < ends if begins < ends else at >= begins or at < ends


def _read_time(said: str) -> time:
    try:
        return time.fromisoformat(said.replace("24:00", "00:00").zfill(5))
    except ValueError as error:
        raise SkillError(f"{said!r} is no time of day.", hint="Write it as 22:00.") from error


@dataclass(frozen=True, slots=True)
class SkillGate:
    """Holds skills to their arguments, their conditions, the policy and their time."""

    facts: Facts
    guard: Guard | None

    def hold(self, skill: Skill, *, is_through_guard: bool = False) -> Skill:
        """Return a skill that is run through this gate alone; no other object may run it.

        Where each of its commands to the robot `is_through_guard` by itself, it needs a permit of
        its own only if a person must approve it.
        """
        spec = skill.spec
        reads = spec.effect is SkillEffect.READS
        is_free = (reads or is_through_guard) and not spec.is_always_asked

        async def run(arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
            given = check_arguments(spec.parameters, arguments, skill=spec.name)
            command = RunSkill(skill=spec.name, arguments=given, needs_word=spec.is_always_asked)
            work = partial(skill.run, given, on_progress)
            return await self.run_once(spec, work, command=None if is_free else command)

        return Skill(spec, run)

    async def run_once(
        self,
        spec: SkillSpec,
        work: Callable[[], Awaitable[SkillOutcome]],
        *,
        command: RunSkill | None,
        is_covering: bool = True,
    ) -> SkillOutcome:
        """Do the work of a skill where its conditions hold, for as long as it may take.

        Args:
            command: The guard decides on it; None for a skill that only reads, or asks by itself.
            is_covering: A person's word for the command covers what the work commands.
        """
        facts, guard, limit_s = self.facts, self.guard, spec.timeout_s
        if spec.needs and (unmet := await find_unmet(spec.needs, facts)):
            return SkillOutcome(SkillCode.PRECONDITION, unmet=unmet)
        late = SkillOutcome(SkillCode.TOO_LATE, numbers={"after_s": limit_s})
        if guard is None or command is None:
            return await end_within(facts, limit_s, work) or late
        permit, said = guard.clear(command, robot_s=facts.now_s), "given up"
        try:
            with covered_by(permit.by) if is_covering else nullcontext():
                outcome = await end_within(facts, limit_s, work) or late
            said = outcome.state
            return outcome
        finally:
            guard.note_result(permit, said, robot_s=facts.now_s)


async def end_within(facts: Facts, limit_s: float, work: Callable[[], Awaitable[T]]) -> T | None:
    """Return the result of some work; None where it was cancelled at the time limit."""
    result: T | None = None
    with plain_errors():
        async with anyio.create_task_group() as tasks:

            async def watch() -> None:
                await wait(facts, limit_s)
                tasks.cancel_scope.cancel()

            tasks.start_soon(watch)
            result = await work()
            tasks.cancel_scope.cancel()
    return result


async def wait(facts: Facts, duration_s: float) -> None:
    """Return when robot time has passed, or wall time where the robot's clock stands still.

    It does not advance the time of a robot whose clock only moves while it sleeps.
    """
    seen_s, passed_s = facts.now_s, 0.0
    moved_s = anyio.current_time()
    while passed_s < duration_s:
        left_s = (duration_s - passed_s) / FASTEST
        await anyio.sleep(min(max(left_s, LOOKS_S[0]), LOOKS_S[1]))
        now_s, wall_s = facts.now_s, anyio.current_time()
        if now_s != seen_s:
            # A simulation that is begun anew sets its clock back.
            passed_s += max(now_s - seen_s, 0.0)
            seen_s, moved_s = now_s, wall_s
        elif wall_s - moved_s > STILL_S:
            passed_s += wall_s - moved_s
            moved_s = wall_s
