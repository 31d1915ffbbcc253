"""A mission as a skill: leave for all of it at once, one at a time, with its record."""

import hashlib
import json
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from contextvars import ContextVar

from mapspeak.errors import SkillError
from mapspeak.safety import ApprovalScope, CommandKind, Guard, RunSkill, within_scope
from mapspeak.skill import (
    JsonValue,
    OnProgress,
    SkillApproval,
    SkillCode,
    SkillOutcome,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.arguments import check_arguments
from mapspeak.skills.comparing import plain
from mapspeak.skills.facts import Facts, find_unmet
from mapspeak.skills.guarded import end_within
from mapspeak.skills.missions.record import MissionRecord
from mapspeak.skills.missions.tree import (
    FindSkill,
    MissionBounds,
    MissionCourse,
    MissionPlan,
    check_plan,
)

MOST_TOLD = 160
"""Letters of the steps that a person is asked about; the tree has them all."""
# State of a task, not of the module: True while a part of a mission runs.
_IS_WITHIN: ContextVar[bool] = ContextVar("is_within", default=False)


class MissionDesk:
    """The context that all missions of one server share.

    Args:
        find_skill: Raises `SkillError` for an unknown name.
        list_skills: Names all of them.
        facts: The present facts.
        guard: Decides on each mission; None in tests.
        record: On disk.
        present: Marks a client as present: a mission needs no client while it runs.

    Attributes:
        latest: The course of the latest mission; None before the first.
    """

    def __init__(
        self,
        *,
        find_skill: FindSkill,
        list_skills: Callable[[], list[str]],
        facts: Facts,
        guard: Guard | None,
        record: MissionRecord,
        present: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> None:
        self.find_skill = find_skill
        self.list_skills = list_skills
        self.facts = facts
        self.guard = guard
        self.record = record
        self.present = present
        self.latest: MissionCourse | None = None

    def check(self, plan: MissionPlan) -> MissionBounds:
        """Return the bounds of a mission.

        Raises:
            SkillError: A part of it is unknown, not allowed, or does not fit.
        """
        return check_plan(plan, self.find_skill, self.list_skills())


class MissionSkill:
    """Runs a mission."""

    def __init__(self, plan: MissionPlan, desk: MissionDesk) -> None:
        self.plan = plan
        self._desk = desk

    @property
    def spec(self) -> SkillSpec:
        """Its description."""
        return self.plan.spec

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Run it; within another mission it is a part of that one.

        Raises:
            ApprovalNeededError: A person has to agree to it first, once for all of it.
            SkillError: It has a mistake, or another mission is under way.
            PolicyError: It is not allowed.
        """
        given = check_arguments(self.spec.parameters, arguments, skill=self.spec.name)
        if _IS_WITHIN.get():
            return await self._go(MissionCourse(self.plan, given), on_progress)
        desk = self._desk
        if desk.latest is not None and not desk.latest.is_over:
            raise SkillError(
                f"The mission {desk.latest.plan.spec.name} is under way; there is one at a time.",
                hint="Wait for its end, or cancel it.",
            )
        bounds = desk.check(self.plan)
        desk.latest = course = MissionCourse(self.plan, given)
        try:
            with desk.present():
                return await self._begin(course, bounds, on_progress)
        finally:
            course.is_over = True

    async def _begin(
        self, course: MissionCourse, bounds: MissionBounds, on_progress: OnProgress
    ) -> SkillOutcome:
        desk, given = self._desk, course.given
        scope = self._scope(bounds, given)
        unmet = await find_unmet(self.spec.preconditions, desk.facts)
        if unmet is not None:
            return SkillOutcome(state=SkillState.FAILED, code=SkillCode.PRECONDITION, failed=unmet)
        token = _IS_WITHIN.set(True)
        try:
            with within_scope(scope):
                said = "cut off"
                permit = None
                if desk.guard is not None:
                    command = RunSkill(
                        skill=self.spec.name, arguments=given, needs_word=self._needs_word(bounds)
                    )
                    permit = desk.guard.clear(command, robot_s=desk.facts.now_s)
                desk.record.begin(self.spec.name)
                try:
                    outcome = await end_within(
                        desk.facts, self.spec.timeout_s, lambda: self._go(course, on_progress)
                    )
                    said = SkillState.TIMED_OUT if outcome is None else outcome.state
                finally:
                    desk.record.end(str(said))
                    if desk.guard is not None and permit is not None:
                        desk.guard.note_result(permit, said, robot_s=desk.facts.now_s)
                        desk.guard.end_scope(scope)
        finally:
            _IS_WITHIN.reset(token)
        return outcome or SkillOutcome(
            state=SkillState.TIMED_OUT,
            code=SkillCode.TOO_LATE,
            numbers={"after_s": self.spec.timeout_s},
        )

    async def _go(self, course: MissionCourse, on_progress: OnProgress) -> SkillOutcome:
        # Loads py_trees: a server that runs no mission does without.
        from mapspeak.skills.missions.running import MissionRunner  # noqa: PLC0415

        runner = MissionRunner(
            course,
            find_skill=self._desk.find_skill,
            facts=self._desk.facts,
            on_progress=on_progress,
            on_step=self._desk.record.note,
        )
        return await runner.run()

    def _scope(self, bounds: MissionBounds, given: Mapping[str, JsonValue]) -> ApprovalScope:
        """Return the subject of an approval: this tree with these arguments, and no other one."""
        leaves = [
            " ".join(filter(None, (step.skill, plain(step.main or ""))))
            for step in self.plan.tree.walk()
            if step.skill
        ]
        steps = ", ".join(leaves)
        told = steps if len(steps) <= MOST_TOLD else f"{steps[:MOST_TOLD]}..."
        with_what = "".join(f", {name} {value}" for name, value in given.items())
        exact = json.dumps([repr(self.plan.tree), given], default=str, sort_keys=True)
        digest = hashlib.sha256(exact.encode()).hexdigest()[:8]
        asked = f"; asks for {', '.join(sorted(bounds.asked))}" if bounds.asked else ""
        return ApprovalScope(
            what=f"run the mission {self.spec.name}{with_what} ({told}{asked}; {digest})",
            n_drives=bounds.n_drives,
            duration_s=self.spec.timeout_s,
            n_commands=bounds.n_commands + 1,
        )

    def _needs_word(self, bounds: MissionBounds) -> bool:
        """Return True where any part of it would need a person's word by itself."""
        kinds = frozenset() if self._desk.guard is None else self._desk.guard.policy.approval.kinds
        asks_to_drive = bounds.n_drives > 0 and CommandKind.DRIVE in kinds
        asks_for_more = bounds.n_commands > 0 and bool(kinds - {CommandKind.DRIVE})
        always = self.spec.approval is SkillApproval.ALWAYS
        return always or bool(bounds.asked) or asks_to_drive or asks_for_more
