"""Missions as skills: checked whole, approved once, one at a time, with their record."""

import hashlib
import json
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from mapspeak.errors import SkillError
from mapspeak.safety import (
    ApprovalScope,
    CommandKind,
    RunSkill,
    calling,
    current_caller,
    within_scope,
)
from mapspeak.skill import (
    Arguments,
    OnProgress,
    Skill,
    SkillEffect,
    SkillOutcome,
    SkillSpec,
)
from mapspeak.skills.arguments import check_arguments, plain
from mapspeak.skills.guarding import SkillGate
from mapspeak.skills.missionrecord import MissionRecord
from mapspeak.skills.missionrunner import MissionRunner
from mapspeak.skills.skillsfile import OwnersEntry
from mapspeak.skills.steps import Mission, Step, StepKind, find_names

MOST_DRIVES = 1000
MOST_NESTED = 5
"""Missions within missions."""
DRIVING = frozenset({"drive", "look"})
"""The skills that send the robot to a place."""
MOST_TOLD = 160
"""Letters of the steps that a person is asked about; the tree has them all."""
FindSkill = Callable[[str], Skill]


@dataclass(frozen=True, slots=True)
class MissionBounds:
    """The bounds of a mission.

    Attributes:
        n_commands: The steps that do more than drive and read.
        asked: The skills in it for which a person is asked each time.
        parts: The missions within it, as they were when it was checked.
    """

    n_drives: int = 0
    n_commands: int = 0
    asked: frozenset[str] = frozenset()
    parts: Mapping[str, Mission] = field(default_factory=dict, compare=False)

    def __add__(self, other: "MissionBounds") -> "MissionBounds":
        return MissionBounds(
            self.n_drives + other.n_drives,
            self.n_commands + other.n_commands,
            self.asked | other.asked,
            {**self.parts, **other.parts},
        )

    def times(self, n: int) -> "MissionBounds":
        """Return the bounds of that many repetitions."""
        return MissionBounds(self.n_drives * n, self.n_commands * n, self.asked, self.parts)


KnownBounds = dict[tuple[str, int], MissionBounds]
"""By the mission's name and the count of missions above it."""


@dataclass(eq=False)
class MissionDesk:
    """Checks and runs the missions of one server.

    Attributes:
        find_skill: Raises `SkillError` for a name that it does not know.
        gate: Lets a mission begin, and ends it in time.
        record: On disk.
        present: Marks a client as present: a mission needs no client while it runs.
        begins: Called as a mission begins.
        latest: The latest mission; None before the first.
    """

    find_skill: FindSkill
    gate: SkillGate
    record: MissionRecord
    present: Callable[[], AbstractContextManager[None]] = nullcontext
    begins: Callable[[], None] = lambda: None
    latest: MissionRunner | None = None

    def check(
        self, mission: Mission, above: tuple[str, ...] = (), known: KnownBounds | None = None
    ) -> MissionBounds:
        """Return what a mission can do at most.

        Args:
            above: The missions that this one is within.
            known: The bounds that are known by now: missions of many missions would take as long
                as the product of their steps without them.

        Raises:
            SkillError: A part of it is unknown, not allowed, or does not fit.
        """
        within = (*above, mission.spec.name)
        if mission.spec.name in above or len(above) >= MOST_NESTED:
            way = " -> ".join(within)
            raise SkillError(f"The mission holds itself: {way}.", hint="Leave one step out.")
        known, key = {} if known is None else known, (mission.spec.name, len(above))
        if key in known:
            return known[key]
        names = {each.name for each in mission.spec.parameters}
        bounds = self._check(mission.tree, names, within, known)
        if bounds.n_drives > MOST_DRIVES:
            raise SkillError(
                f"The mission could drive {bounds.n_drives:,} times, the limit is {MOST_DRIVES:,}.",
                hint="Repeat less often.",
            )
        known[key] = bounds
        return bounds

    def _check(
        self, step: Step, names: set[str], within: tuple[str, ...], known: KnownBounds
    ) -> MissionBounds:
        """Check a step and the steps within; collect the names of its outputs."""
        if step.kind is StepKind.LEAF:
            return self._check_leaf(step, names, within, known)
        parts = [self._check(each, names, within, known) for each in step.steps]
        if step.kind is StepKind.PARALLEL and sum(part.n_drives > 0 for part in parts) > 1:
            raise SkillError(
                f"Step {step.number} drives to two places at once.",
                hint="Let only one branch of a parallel step drive or look.",
            )
        return sum(parts, MissionBounds()).times(step.times)

    def _check_leaf(
        self, step: Step, names: set[str], within: tuple[str, ...], known: KnownBounds
    ) -> MissionBounds:
        try:
            skill = self.find_skill(step.skill)
        except SkillError as error:
            raise SkillError(f"Step {step.number}: {error.message}", hint=error.hint) from error
        spec, what = skill.spec, f"Step {step.number} ({step.skill})"
        given = step.name_arguments(spec)
        for name in sorted(find_names(given) - names):
            raise SkillError(
                f"{what} uses {{{name}}}, which no step before gives.",
                hint=f"There are: {', '.join(sorted(names)) or 'none'}. `as: {name}` gives it.",
            )
        _check_given(spec, given, what=what)
        if step.output:
            names.add(step.output)
        asked = frozenset({step.skill} if spec.is_always_asked else ())
        if isinstance(skill, Mission):
            inner = self.check(skill, within, known)
            return inner + MissionBounds(asked=asked, parts={spec.name: skill})
        drives = step.skill in DRIVING
        is_free = (spec.effect is SkillEffect.READS or drives) and not asked
        return MissionBounds(int(drives), int(not is_free), asked)

    def open(self, entry: OwnersEntry, path: Path | None = None) -> Mission:
        """Return the mission that is written in an entry.

        Args:
            path: The file that it is saved in.

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
        """Run a mission.

        Raises:
            ApprovalNeededError: A person has to agree to it first, once for all of it.
            SkillError: It has a mistake, or another mission is under way.
            PolicyError: It is not allowed.
        """
        spec = mission.spec
        given = check_arguments(spec.parameters, arguments, skill=spec.name)
        if self.latest is not None and not self.latest.is_over:
            raise SkillError(
                "Another mission is under way; there is one at a time.",
                hint="Wait for its end, or cancel it.",
            )
        bounds = self.check(mission)
        scope, guard = _scope_of(mission, given, bounds), self.gate.guard
        self.latest = runner = self._build_runner(mission, given, on_progress, bounds.parts)
        self.begins()
        try:
            acting = replace(current_caller(), mission=spec.name)
            with self.present(), within_scope(scope), calling(acting):
                return await self.gate.run_once(
                    spec,
                    partial(self._run_recorded, runner),
                    command=RunSkill(
                        skill=spec.name, arguments=given, needs_word=self._needs_word(spec, bounds)
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
            self.record.end(said)
        return outcome

    def _build_runner(
        self,
        mission: Mission,
        given: Arguments,
        on_progress: OnProgress,
        parts: Mapping[str, Mission],
    ) -> MissionRunner:
        """Return what runs a mission with the missions within it as they were approved."""
        return MissionRunner(
            mission=mission,
            given=given,
            find_skill=partial(self._find_part, parts),
            facts=self.gate.facts,
            on_progress=on_progress,
            on_step=self.record.note,
        )

    def _find_part(self, parts: Mapping[str, Mission], name: str) -> Skill:
        part = parts.get(name)
        return self.find_skill(name) if part is None else self._within(part, parts)

    def _within(self, part: Mission, parts: Mapping[str, Mission]) -> Skill:
        """Return a mission as a part of another one, approved and recorded with that one."""
        spec = part.spec

        async def run(arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
            given = check_arguments(spec.parameters, arguments, skill=spec.name)
            runner = self._build_runner(part, given, on_progress, parts)
            return await self.gate.run_once(spec, runner.run, command=None)

        return Skill(spec, run)

    def _needs_word(self, spec: SkillSpec, bounds: MissionBounds) -> bool:
        """Return True where any part of it would need a person's word by itself."""
        guard = self.gate.guard
        kinds = frozenset() if guard is None else guard.policy.approval.kinds
        asks_to_drive = bounds.n_drives > 0 and CommandKind.DRIVE in kinds
        asks_for_more = bounds.n_commands > 0 and bool(kinds - {CommandKind.DRIVE})
        return spec.is_always_asked or bool(bounds.asked) or asks_to_drive or asks_for_more


def _check_given(spec: SkillSpec, given: Arguments, *, what: str) -> None:
    """Check arguments as far as they are known before the mission runs.

    Raises:
        SkillError: They do not fit.
    """
    later = {name for name, value in given.items() if find_names(value)}
    now = {name: value for name, value in given.items() if name not in later}
    known_now = tuple(each for each in spec.parameters if each.name not in later)
    check_arguments(known_now, now, skill=what)
    if strangers := later - {each.name for each in spec.parameters}:
        check_arguments(spec.parameters, dict.fromkeys(strangers), skill=what)


def _scope_of(mission: Mission, given: Arguments, bounds: MissionBounds) -> ApprovalScope:
    """Return the subject of an approval: this tree with these arguments, and no other one."""
    leaves = [
        " ".join(filter(None, (step.skill, plain(step.main or ""))))
        for step in mission.tree.walk()
        if step.skill
    ]
    steps = ", ".join(leaves)
    told = steps if len(steps) <= MOST_TOLD else f"{steps[:MOST_TOLD]}..."
    with_what = "".join(f", {name} {value}" for name, value in given.items())
    asked = f"; asks for {', '.join(sorted(bounds.asked))}" if bounds.asked else ""
    return ApprovalScope(
        what=f"run the mission {mission.spec.name}{with_what} "
        f"({told}{asked}; {_digest(mission, given, bounds.parts)})",
        n_drives=bounds.n_drives,
        duration_s=mission.spec.timeout_s,
        # A skill that calls an interface of the robot is a command, and its call another one.
        n_commands=2 * bounds.n_commands + 1,
    )


def _digest(mission: Mission, given: Arguments, parts: Mapping[str, Mission]) -> str:
    """Return what tells a mission from any other one, with the missions within it."""
    written = [(each.spec, each.tree) for each in (mission, *parts.values())]
    exact = repr(written) + json.dumps(given, default=str, sort_keys=True)
    return hashlib.sha256(exact.encode()).hexdigest()[:8]
