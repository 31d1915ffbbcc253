"""A skill as everybody runs it: checked, allowed by the guard, noted, and ended in time."""

from collections.abc import Awaitable, Callable, Mapping
from contextlib import nullcontext
from typing import TypeVar

import anyio

from mapspeak.errors import MapspeakError
from mapspeak.safety import Guard, Permit, RunSkill, covered_by
from mapspeak.skill import (
    JsonValue,
    OnProgress,
    Skill,
    SkillApproval,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.arguments import check_arguments
from mapspeak.skills.facts import Facts, Stopwatch, find_unmet

T = TypeVar("T")


class GuardedSkill:
    """Holds a skill to its arguments, its preconditions, the policy and its time.

    Args:
        skill: The skill; no other object may call it.
        facts: The present facts.
        guard: Decides and logs; None in tests.
        is_through_guard: Each command of the skill to the robot passes the guard by itself, so that
            the skill needs a permit of its own only where a person must approve it.
    """

    def __init__(
        self, skill: Skill, *, facts: Facts, guard: Guard | None, is_through_guard: bool = False
    ) -> None:
        self._skill = skill
        self._facts = facts
        self._guard = guard
        self._is_through_guard = is_through_guard

    @property
    def spec(self) -> SkillSpec:
        """Its description."""
        return self._skill.spec

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Do it once, where it may be done.

        Raises:
            MapspeakError: It could not be begun.
        """
        spec = self.spec
        given = check_arguments(spec.parameters, arguments, skill=spec.name)
        unmet = await find_unmet(spec.preconditions, self._facts)
        if unmet is not None:
            return SkillOutcome(state=SkillState.FAILED, code=SkillCode.PRECONDITION, failed=unmet)
        permit = self._clear(given)
        said = "given up"
        try:
            with nullcontext() if permit is None else covered_by(permit.by):
                outcome = await end_within(
                    self._facts, spec.timeout_s, lambda: self._skill.run(given, on_progress)
                )
            said = SkillState.TIMED_OUT if outcome is None else outcome.state
        finally:
            if permit is not None and self._guard is not None:
                self._guard.note_result(permit, said, robot_s=self._facts.now_s)
        return outcome or SkillOutcome(
            state=SkillState.TIMED_OUT,
            code=SkillCode.TOO_LATE,
            numbers={"after_s": spec.timeout_s},
        )

    def _clear(self, given: Mapping[str, JsonValue]) -> Permit | None:
        """Return the guard's permit; None for a skill that only reads, or asks by itself."""
        needs_word = self.spec.approval is SkillApproval.ALWAYS
        is_free = self.spec.effect is SkillEffect.READS or self._is_through_guard
        if self._guard is None or (is_free and not needs_word):
            return None
        command = RunSkill(skill=self.spec.name, arguments=given, needs_word=needs_word)
        return self._guard.clear(command, robot_s=self._facts.now_s)


async def end_within(facts: Facts, limit_s: float, work: Callable[[], Awaitable[T]]) -> T | None:
    """Return the result of some work; None where it was cancelled at the time limit.

    Raises:
        MapspeakError: As the work does.
    """
    result: T | None = None
    failed: MapspeakError | None = None
    stopwatch = Stopwatch(facts)
    async with anyio.create_task_group() as tasks:

        async def watch() -> None:
            await stopwatch.wait(limit_s)
            tasks.cancel_scope.cancel()

        tasks.start_soon(watch)
        try:
            result = await work()
        except MapspeakError as error:
            failed = error
        tasks.cancel_scope.cancel()
    if failed is not None:
        raise failed
    return result
