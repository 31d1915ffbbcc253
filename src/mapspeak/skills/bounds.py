"""What a mission can do at most, and what a person is asked for before it begins."""

import hashlib
import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field

from mapspeak.errors import SkillError
from mapspeak.safety import ApprovalScope, CommandKind
from mapspeak.skill import Arguments, Skill, SkillEffect, SkillSpec
from mapspeak.skills.arguments import check_arguments, plain
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


@dataclass(frozen=True, slots=True)
class MissionCheck:
    """Checks a mission whole before it begins.

    Attributes:
        find_skill: Raises `SkillError` for a name that it does not know.
        known: The bounds that are known by now, by the mission's name and the count of missions
            above it: missions of many missions would take as long as the product of their steps.
    """

    find_skill: FindSkill
    known: dict[tuple[str, int], MissionBounds] = field(default_factory=dict)

    def find_bounds(self, mission: Mission, above: tuple[str, ...] = ()) -> MissionBounds:
        """Return what a mission can do at most.

        Args:
            above: The missions that this one is within.

        Raises:
            SkillError: A part of it is unknown, not allowed, or does not fit.
        """
        within = (*above, mission.spec.name)
        if mission.spec.name in above or len(above) >= MOST_NESTED:
            way = " -> ".join(within)
            raise SkillError(f"The mission holds itself: {way}.", hint="Leave one step out.")
        if (key := (mission.spec.name, len(above))) in self.known:
            return self.known[key]
        names = {each.name for each in mission.spec.parameters}
        bounds = self._check(mission.tree, names, within)
        if bounds.n_drives > MOST_DRIVES:
            raise SkillError(
                f"The mission could drive {bounds.n_drives:,} times, the limit is {MOST_DRIVES:,}.",
                hint="Repeat less often.",
            )
        self.known[key] = bounds
        return bounds

    def _check(self, step: Step, names: set[str], within: tuple[str, ...]) -> MissionBounds:
        """Check a step and the steps within; collect the names of its outputs."""
        if step.kind is StepKind.LEAF:
            return self._check_leaf(step, names, within)
        parts = [self._check(each, names, within) for each in step.steps]
        if step.kind is StepKind.PARALLEL and sum(part.n_drives > 0 for part in parts) > 1:
            raise SkillError(
                f"Step {step.number} drives to two places at once.",
                hint="Let only one branch of a parallel step drive or look.",
            )
        return sum(parts, MissionBounds()).times(step.times)

    def _check_leaf(self, step: Step, names: set[str], within: tuple[str, ...]) -> MissionBounds:
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
            inner = self.find_bounds(skill, within)
            return inner + MissionBounds(asked=asked, parts={spec.name: skill})
        drives = step.skill in DRIVING
        is_free = (spec.effect is SkillEffect.READS or drives) and not asked
        return MissionBounds(int(drives), int(not is_free), asked)


def _check_given(spec: SkillSpec, given: Arguments, *, what: str) -> None:
    """Check arguments as far as they are known before the mission runs."""
    later = {each.name for each in spec.parameters if find_names(given.get(each.name))}
    known = [each for each in spec.parameters if each.name not in later]
    now = {name: value for name, value in given.items() if name not in later}
    check_arguments(known, now, skill=what)


def needs_word(spec: SkillSpec, bounds: MissionBounds, kinds: Collection[CommandKind]) -> bool:
    """Return True where any part of a mission is of the kinds that need a person's word."""
    asks_to_drive = bounds.n_drives > 0 and CommandKind.DRIVE in kinds
    asks_for_more = bounds.n_commands > 0 and any(each is not CommandKind.DRIVE for each in kinds)
    return spec.is_always_asked or bool(bounds.asked) or asks_to_drive or asks_for_more


def scope_of(mission: Mission, given: Arguments, bounds: MissionBounds) -> ApprovalScope:
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
