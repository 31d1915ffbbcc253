"""A skill as every caller runs it: checked, allowed by the guard, noted, and ended in time."""

from collections.abc import Awaitable, Callable
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import anyio

from mapspeak.errors import MapspeakError
from mapspeak.safety import Guard, RunSkill, covered_by
from mapspeak.skill import (
    Arguments,
    OnProgress,
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.arguments import check_arguments
from mapspeak.skills.conditions import Facts, find_unmet

LOOK_S = 0.05
"""Wall time between two looks at the robot's clock."""
STILL_S = 1.0
"""Wall time after which a clock that shows the same stands still."""
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class SkillGate:
    """Holds skills to their arguments, their conditions, the policy and their time.

    Attributes:
        guard: Decides and logs; None in tests.
    """

    facts: Facts
    guard: Guard | None

    def hold(self, skill: Skill, *, is_through_guard: bool = False) -> Skill:
        """Return a skill that is run through this gate alone.

        Args:
            skill: The skill; no other object may run it.
            is_through_guard: Each command of the skill to the robot passes the guard by itself, so
                that the skill needs a permit of its own only where a person must approve it.
        """
        spec = skill.spec
        is_free = spec.effect is SkillEffect.READS or is_through_guard

        async def run(arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
            given = check_arguments(spec.parameters, arguments, skill=spec.name)
            needs_word = spec.is_always_asked
            command = RunSkill(skill=spec.name, arguments=given, needs_word=needs_word)
            return await self.run_once(
                spec,
                partial(skill.run, given, on_progress),
                command=None if is_free and not needs_word else command,
            )

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

        Raises:
            MapspeakError: It is not allowed, or the work could not begin.
        """
        facts, guard = self.facts, self.guard
        if spec.needs and (unmet := await find_unmet(spec.needs, facts)):
            return SkillOutcome(SkillState.FAILED, SkillCode.PRECONDITION, unmet=unmet)
        if guard is None or command is None:
            return await _end_in_time(spec, work, facts)
        permit, said = guard.clear(command, robot_s=facts.now_s), "given up"
        try:
            with covered_by(permit.by) if is_covering else nullcontext():
                outcome = await _end_in_time(spec, work, facts)
            said = outcome.state
            return outcome
        finally:
            guard.note_result(permit, said, robot_s=facts.now_s)


async def _end_in_time(
    spec: SkillSpec, work: Callable[[], Awaitable[SkillOutcome]], facts: Facts
) -> SkillOutcome:
    return await end_within(facts, spec.timeout_s, work) or SkillOutcome(
        SkillState.TIMED_OUT, SkillCode.TOO_LATE, numbers={"after_s": spec.timeout_s}
    )


async def end_within(facts: Facts, limit_s: float, work: Callable[[], Awaitable[T]]) -> T | None:
    """Return the result of some work; None where it was cancelled at the time limit.

    Raises:
        MapspeakError: As the work does.
    """
    result: T | None = None
    failure: MapspeakError | None = None
    async with anyio.create_task_group() as tasks:

        async def watch() -> None:
            await wait(facts, limit_s)
            tasks.cancel_scope.cancel()

        tasks.start_soon(watch)
        try:
            result = await work()
        except MapspeakError as error:
            failure = error
        tasks.cancel_scope.cancel()
    if failure is not None:
        raise failure
    return result


async def wait(facts: Facts, duration_s: float) -> None:
    """Return when robot time has passed, or wall time where the robot's clock stands still.

    It does not advance the time of a robot whose clock only moves while it sleeps.
    """
    seen_s, passed_s = facts.now_s, 0.0
    moved_s = anyio.current_time()
    while passed_s < duration_s:
        await anyio.sleep(LOOK_S)
        now_s, wall_s = facts.now_s, anyio.current_time()
        if now_s != seen_s:
            # A simulation that is begun anew sets its clock back.
            passed_s += max(now_s - seen_s, 0.0)
            seen_s, moved_s = now_s, wall_s
        elif wall_s - moved_s > STILL_S:
            passed_s += wall_s - moved_s
            moved_s = wall_s
