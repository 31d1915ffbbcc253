"""Missions of one server: what each can do at most, approved once, one at a time, recorded."""

import hashlib
import json
import logging
import os
import secrets
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mapspeak.atomic import append_line
from mapspeak.errors import SkillError
from mapspeak.hold import is_running
from mapspeak.safety import (
    ApprovalScope,
    CommandKind,
    RunSkill,
    calling,
    current_caller,
    within_scope,
)
from mapspeak.skill import Arguments, OnProgress, Skill, SkillEffect, SkillOutcome, SkillSpec
from mapspeak.skills.arguments import check_arguments, plain
from mapspeak.skills.guarding import SkillGate
from mapspeak.skills.skillsfile import OwnersEntry
from mapspeak.skills.steps import Mission, Step, StepKind, find_names

if TYPE_CHECKING:
    from mapspeak.skills.missionrunner import MissionRunner

MOST_DRIVES = 1000
MOST_NESTED = 5
"""Missions within missions."""
DRIVING = frozenset({"drive", "look"})
"""The skills that send the robot to a place."""
MOST_TOLD = 160
"""Letters of the steps that a person is asked about; the tree has them all."""
MOST_BYTES, MOST_INTERRUPTED = 5_000_000, 5
Parts = Mapping[str, Mission]
logger = logging.getLogger(__name__)


@dataclass(slots=True, eq=False)
class MissionBounds:
    """What a mission can do at most, as the check of all its steps finds.

    Attributes:
        n_commands: The steps that do more than drive and read.
        asked: The skills in it for which a person is asked each time.
        parts: The missions within it, as they were when it was checked.
        _counts: Those that are known by now, by the mission's name and the count of missions
            above it: missions of many missions would take as long as the product of their steps.
    """

    find_skill: Callable[[str], Skill]
    n_drives: int = 0
    n_commands: int = 0
    asked: set[str] = field(default_factory=set)
    parts: dict[str, Mission] = field(default_factory=dict)
    _counts: dict[tuple[str, int], tuple[int, int]] = field(default_factory=dict)

    def count(self, mission: Mission, above: tuple[str, ...] = ()) -> tuple[int, int]:
        """Return the drives and commands of a mission within those above, or raise SkillError."""
        within = (*above, mission.spec.name)
        if mission.spec.name in above or len(above) >= MOST_NESTED:
            way = " -> ".join(within)
            raise SkillError(f"The mission holds itself: {way}.", hint="Leave one step out.")
        if (key := (mission.spec.name, len(above))) not in self._counts:
            self._counts[key] = self._add_up(mission.tree, set(mission.spec.parameters), within)
        if (n_drives := self._counts[key][0]) > MOST_DRIVES:
            raise SkillError(
                f"The mission could drive {n_drives:,} times, the limit is {MOST_DRIVES:,}.",
                hint="Repeat less often.",
            )
        return self._counts[key]

    def _add_up(self, step: Step, names: set[str], within: tuple[str, ...]) -> tuple[int, int]:
        """Return the counts of a step and the steps within; collect the names of its outputs."""
        if step.kind is StepKind.LEAF:
            return self._check_leaf(step, names, within)
        counts = [self._add_up(each, names, within) for each in step.steps]
        if step.kind is StepKind.PARALLEL and sum(n_drives > 0 for n_drives, _ in counts) > 1:
            raise SkillError(
                f"Step {step.number} drives to two places at once.",
                hint="Let only one branch of a parallel step drive or look.",
            )
        n_drives, n_commands = map(sum, zip(*counts, strict=True))
        return n_drives * step.times, n_commands * step.times

    def _check_leaf(self, step: Step, names: set[str], within: tuple[str, ...]) -> tuple[int, int]:
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
        # What templates stand for is checked when the step begins.
        later = {name for name in spec.parameters if find_names(given.get(name))}
        known = {name: each for name, each in spec.parameters.items() if name not in later}
        now = {name: each for name, each in given.items() if name not in later}
        check_arguments(known, now, skill=what)
        if step.output:
            names.add(step.output)
        if spec.is_always_asked:
            self.asked.add(step.skill)
        if isinstance(skill, Mission):
            self.parts[spec.name] = skill
            return self.count(skill, within)
        drives = step.skill in DRIVING
        is_free = (spec.effect is SkillEffect.READS or drives) and not spec.is_always_asked
        return int(drives), int(not is_free)


def _scope_of(mission: Mission, given: Arguments, bounds: MissionBounds) -> ApprovalScope:
    """Return the subject of an approval: this tree with these arguments, and no other one."""
    leaves = [step for step in mission.tree.walk() if step.skill]
    steps = ", ".join(f"{step.skill} {plain(step.main or '')}".rstrip() for step in leaves)
    told = steps if len(steps) <= MOST_TOLD else f"{steps[:MOST_TOLD]}..."
    with_what = "".join(f", {name} {value}" for name, value in given.items())
    asked = f"; asks for {', '.join(sorted(bounds.asked))}" if bounds.asked else ""
    written = [(each.spec, each.tree) for each in (mission, *bounds.parts.values())]
    exact = repr(written) + json.dumps(given, default=str, sort_keys=True)
    digest = hashlib.sha256(exact.encode()).hexdigest()[:8]
    return ApprovalScope(
        what=f"run the mission {mission.spec.name}{with_what} ({told}{asked}; {digest})",
        n_drives=bounds.n_drives,
        duration_s=mission.spec.timeout_s,
        # A skill that calls an interface of the robot is a command, and its call another one.
        n_commands=2 * bounds.n_commands + 1,
    )


@dataclass(slots=True)
class Interrupted:
    """A mission that a server began, at a time in ISO 8601, and did not live to end."""

    name: str
    begun: str
    steps: list[str] = field(default_factory=list)


@dataclass(eq=False)
class MissionRecord:
    """Writes one file, and finds in it the missions that an earlier server left unfinished."""

    path: Path
    wall_clock: Callable[[], datetime | None]
    _run: str = ""

    async def keep(self, name: str, work: Callable[[], Awaitable[SkillOutcome]]) -> SkillOutcome:
        """Do the work of a mission between the notes that it begins and that it has ended."""
        self._run, said = secrets.token_hex(4), "cut off"
        self.note(name, event="begun")
        try:
            outcome = await work()
            said = str(outcome.state)
            return outcome
        finally:
            self.note(said, event="ended")

    def note(self, said: str, *, event: str = "step") -> None:
        """Note a step, or how the mission has "ended"; no fault of the disk ends a mission."""
        at = self.wall_clock()
        line = {
            "at": None if at is None else at.isoformat(timespec="seconds"),
            "run": self._run,
            "process": os.getpid(),
            "event": event,
            "said": said,
        }
        try:
            append_line(self.path, json.dumps(line).encode(), most_bytes=MOST_BYTES)
        except OSError as error:
            logger.warning("What missions do could not be noted: %s", error.strerror)

    def take_interrupted(self) -> tuple[Interrupted, ...]:
        """Return the missions that no server will end any more, once: they are noted as ended."""
        found: dict[str, Interrupted] = {}
        for line in self._read():
            run, event, said = str(line.get("run")), line.get("event"), str(line.get("said"))
            process = line.get("process")
            # Another server goes on; this one has begun nothing before it looks.
            if event == "begun" and (process == os.getpid() or not is_running(process)):
                found[run] = Interrupted(said, str(line.get("at")))
            elif event == "step" and run in found:
                found[run].steps.append(said)
            elif event == "ended":
                found.pop(run, None)
        for self._run in found:
            self.note("interrupted: its server ended", event="ended")
        return tuple(found.values())[-MOST_INTERRUPTED:]

    def _read(self) -> Iterator[dict[str, Any]]:
        with suppress(OSError):
            for line in self.path.read_text(encoding="utf-8").splitlines():
                with suppress(ValueError):
                    if isinstance(read := json.loads(line), dict):
                        yield read


@dataclass(eq=False)
class MissionDesk:
    """Checks and runs the missions of one server.

    Attributes:
        present: Marks a client as present: a mission needs no client while it runs.
        begins: Called as a mission begins.
    """

    find_skill: Callable[[str], Skill]
    gate: SkillGate
    record: MissionRecord
    present: Callable[[], AbstractContextManager[None]] = nullcontext
    begins: Callable[[], None] = lambda: None
    latest: "MissionRunner | None" = None

    def check(self, mission: Mission) -> MissionBounds:
        """Return what a mission can do at most, or raise SkillError where it cannot be run."""
        bounds = MissionBounds(self.find_skill)
        bounds.n_drives, bounds.n_commands = bounds.count(mission)
        return bounds

    def open(self, entry: OwnersEntry, path: Path = Path()) -> Mission:
        """Return the mission of an entry, saved in a file; SkillError for a mistake in its tree."""

        async def run(arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
            return await self._run(mission, arguments, on_progress)

        mission = Mission(entry.spec, run, entry.tree, tuple(entry.remember), path)
        return mission

    async def _run(
        self, mission: Mission, arguments: Arguments, on_progress: OnProgress
    ) -> SkillOutcome:
        """Run a mission, for which a person is asked once, unless another one is under way."""
        spec, guard = mission.spec, self.gate.guard
        if self.latest is not None and not self.latest.is_over:
            raise SkillError(
                "Another mission is under way; there is one at a time.",
                hint="Wait for its end, or cancel it.",
            )
        bounds = self.check(mission)
        self.latest = runner = self._build_runner(mission, arguments, bounds.parts, on_progress)
        given, scope = runner.given, _scope_of(mission, runner.given, bounds)
        needs_word = self._needs_word(spec, bounds)
        command = RunSkill(skill=spec.name, arguments=given, needs_word=needs_word)
        self.begins()
        work = partial(self.record.keep, spec.name, runner.run)
        try:
            acting = replace(current_caller(), mission=spec.name)
            with self.present(), within_scope(scope), calling(acting):
                return await self.gate.run_once(spec, work, command=command, is_covering=False)
        finally:
            runner.is_over = True
            if guard is not None:
                guard.end_scope(scope)

    def _build_runner(
        self, mission: Mission, arguments: Arguments, parts: Parts, on_progress: OnProgress
    ) -> "MissionRunner":
        # Loads py_trees: a server that runs no mission does without.
        from mapspeak.skills.missionrunner import MissionRunner  # noqa: PLC0415

        given = check_arguments(mission.spec.parameters, arguments, skill=mission.spec.name)
        find = partial(self._find_part, parts)
        return MissionRunner(mission, given, self.gate.facts, find, self.record.note, on_progress)

    def _needs_word(self, spec: SkillSpec, bounds: MissionBounds) -> bool:
        """Return True where any part of a mission is of the kinds that need a person's word."""
        guard = self.gate.guard
        kinds = frozenset() if guard is None else guard.policy.approval.kinds
        asks_to_drive = bounds.n_drives > 0 and CommandKind.DRIVE in kinds
        asks_for_more = bounds.n_commands > 0 and bool(kinds - {CommandKind.DRIVE})
        return spec.is_always_asked or bool(bounds.asked) or asks_to_drive or asks_for_more

    def _find_part(self, parts: Parts, name: str) -> Skill:
        """Return the skill of a leaf as it is now; a mission as it was when it was approved.

        That is approved and recorded with the one around it.
        """
        if (part := parts.get(name)) is None:
            return self.find_skill(name)

        async def run(arguments: Arguments, on_progress: OnProgress) -> SkillOutcome:
            runner = self._build_runner(part, arguments, parts, on_progress)
            return await self.gate.run_once(part.spec, runner.run, command=None)

        return Skill(part.spec, run)
