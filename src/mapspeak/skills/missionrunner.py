"""Missions run: approved once, one at a time, with their record; their leaves are tasks."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import anyio

from mapspeak.errors import MapspeakError, SkillError
from mapspeak.safety import RunSkill, calling, current_caller, within_scope
from mapspeak.skill import (
    Arguments,
    JsonValue,
    OnProgress,
    Skill,
    SkillCode,
    SkillOutcome,
    SkillProgress,
    SkillState,
    failed,
    succeeded,
)
from mapspeak.skills.arguments import check_arguments
from mapspeak.skills.bounds import FindSkill, MissionBounds, MissionCheck, needs_word, scope_of
from mapspeak.skills.guarding import SkillGate
from mapspeak.skills.missionrecord import MissionRecord
from mapspeak.skills.skillsfile import OwnersEntry
from mapspeak.skills.steps import Mission, Step, fill_in

MOST_TOLD = 40
"""Steps of the account that are told; the record on disk has all."""
MOST_LINE = 300


@dataclass(eq=False)
class MissionRunner:
    """Runs one mission once.

    Attributes:
        desk: Finds the skill of a leaf when that begins: it may have gone meanwhile.
        mission: With a tree that was checked before.
        parts: The missions within it, as they were when it was approved.
        states: Of the leaves that have begun, by their numbers.
    """

    desk: "MissionDesk"
    mission: Mission
    given: Arguments
    parts: Mapping[str, Mission]
    on_progress: OnProgress
    states: dict[int, SkillState] = field(default_factory=dict)
    is_over: bool = False
    _account: list[str] = field(default_factory=list)
    _scope: anyio.CancelScope = field(default_factory=anyio.CancelScope)
    _cut_off: SkillOutcome | None = None
    _last: SkillOutcome = field(default_factory=failed)

    def __post_init__(self) -> None:
        self._facts = self.desk.gate.facts
        self._values: dict[str, JsonValue] = dict(self.given)

    async def run(self) -> SkillOutcome:
        """Run it to its end; cancelling this call cancels its running steps, too."""
        # Loads py_trees: a server that runs no mission does without.
        from mapspeak.skills.behaviours import StepTree  # noqa: PLC0415

        tree = StepTree(self.mission.tree, self._do_leaf, self._facts, self.note)
        is_done = False
        with self._scope:
            is_done = await tree.run()
        if self._cut_off is not None:
            return self._cut_off
        given = (step.output for step in self.mission.tree.walk())
        outputs = {name: self._values[name] for name in given if name in self._values}
        if is_done:
            return succeeded(**outputs)
        last = self._last
        return SkillOutcome(SkillState.FAILED, last.code, outputs=outputs, quote=last.quote)

    async def _do_leaf(self, step: Step) -> bool:
        self.states[step.number] = SkillState.RUNNING
        try:
            skill = self.desk.find_part(step.skill, self.parts)
            given = fill_in(step.name_arguments(skill.spec), self._values)
            self._tell(now=f"{step.number} {step.skill}")
            outcome = await skill.run(given, partial(self._take_progress, step))
        except anyio.get_cancelled_exc_class():
            self.states[step.number] = SkillState.CANCELLED
            self.note(f"{step.number} {step.skill}: cut off")
            raise
        except MapspeakError as error:
            outcome = failed(SkillCode.REJECTED, error.message)
        self.states[step.number] = outcome.state
        if step.output:
            self._values[step.output] = {**outcome.outputs, "ended": str(outcome.state)}
        self.note(_say_end(step, outcome))
        if outcome.state is SkillState.SUCCEEDED:
            return True
        self._last = outcome
        if outcome.state is SkillState.CANCELLED:
            # A person, another client or the robot's own software has taken over.
            self._cut_off = outcome
            self._scope.cancel()
        return False

    def note(self, said: str) -> None:
        """Tell and keep what was done, with the time by the operator's clock, else the robot's."""
        at = self._facts.read_calendar()
        time = f"{self._facts.now_s:.0f} s" if at is None else f"{at:%H:%M:%S}"
        self._account.append(f"{time} {said}")
        self.desk.record.note(said)
        self._tell(now="")

    def _take_progress(self, step: Step, progress: SkillProgress) -> None:
        inner = progress.account
        now = f"{step.number} {step.skill}" + (f" [{inner[-1]}]" if inner else "")
        self._tell(now=now, values=progress.values)

    def _tell(self, *, now: str, values: Mapping[str, JsonValue] | None = None) -> None:
        told = tuple(self._account[-MOST_TOLD:]) + ((f"now: {now}",) if now else ())
        self.on_progress(SkillProgress(values=values or {}, account=told))


def _say_end(step: Step, outcome: SkillOutcome) -> str:
    said = f"{step.number} {step.skill}: {outcome.state}"
    if outcome.code is not SkillCode.DONE:
        said += f" ({outcome.code})"
    told = (f"{name}={str(each)[:60]}" for name, each in outcome.outputs.items() if each != "")
    said = f"{said} {', '.join(told)}".rstrip()
    if outcome.quote:
        said += f' "{outcome.quote[:120]}"'
    return said[:MOST_LINE]


@dataclass(eq=False)
class MissionDesk:
    """Checks and runs the missions of one server.

    Attributes:
        find_skill: Raises `SkillError` for a name that it does not know.
        present: Marks a client as present: a mission needs no client while it runs.
        begins: Called as a mission begins.
    """

    find_skill: FindSkill
    gate: SkillGate
    record: MissionRecord
    present: Callable[[], AbstractContextManager[None]] = nullcontext
    begins: Callable[[], None] = lambda: None
    latest: MissionRunner | None = None

    def check(self, mission: Mission) -> MissionBounds:
        """Return what a mission can do at most.

        Raises:
            SkillError: A part of it is unknown, not allowed, or does not fit.
        """
        return MissionCheck(self.find_skill).find_bounds(mission)

    def open(self, entry: OwnersEntry, path: Path | None = None) -> Mission:
        """Return the mission that is written in an entry, or saved in a file.

        Raises:
            SkillError: Its tree has a mistake.
        """

        async def run(arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
            return await self._run(mission, arguments, on_progress)

        mission = Mission(entry.spec, run, entry.tree, tuple(entry.remember), path)
        return mission

    async def _run(
        self, mission: Mission, arguments: Arguments, on_progress: OnProgress
    ) -> SkillOutcome:
        """Run a mission, for which a person is asked once, unless another one is under way."""
        spec = mission.spec
        given = check_arguments(spec.parameters, arguments, skill=spec.name)
        if self.latest is not None and not self.latest.is_over:
            raise SkillError(
                "Another mission is under way; there is one at a time.",
                hint="Wait for its end, or cancel it.",
            )
        bounds = self.check(mission)
        scope, guard = scope_of(mission, given, bounds), self.gate.guard
        kinds = frozenset() if guard is None else guard.policy.approval.kinds
        self.latest = runner = MissionRunner(self, mission, given, bounds.parts, on_progress)
        self.begins()
        try:
            acting = replace(current_caller(), mission=spec.name)
            with self.present(), within_scope(scope), calling(acting):
                return await self.gate.run_once(
                    spec,
                    partial(self._run_recorded, runner),
                    command=RunSkill(
                        skill=spec.name,
                        arguments=given,
                        needs_word=needs_word(spec, bounds, kinds),
                    ),
                    is_covering=False,
                )
        finally:
            runner.is_over = True
            if guard is not None:
                guard.end_scope(scope)

    async def _run_recorded(self, runner: MissionRunner) -> SkillOutcome:
        said = "cut off"
        self.record.begin(runner.mission.spec.name)
        try:
            outcome = await runner.run()
            said = str(outcome.state)
        finally:
            self.record.note(said, event="ended")
        return outcome

    def find_part(self, name: str, parts: Mapping[str, Mission]) -> Skill:
        """Return the skill of a leaf; a mission is approved and recorded with the one around it.

        Args:
            parts: The missions within, as they were when that one was approved.

        Raises:
            SkillError: There is none of that name now.
        """
        if (part := parts.get(name)) is None:
            return self.find_skill(name)
        spec = part.spec

        async def run(arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
            given = check_arguments(spec.parameters, arguments, skill=name)
            runner = MissionRunner(self, part, given, parts, on_progress)
            return await self.gate.run_once(spec, runner.run, command=None)

        return Skill(spec, run)
