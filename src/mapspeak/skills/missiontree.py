"""A mission as a tree of steps: its largest cost, and a check that all its skills are known."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from mapspeak.errors import SkillError
from mapspeak.skill import Arguments, JsonValue, Skill, SkillEffect, SkillSpec, SkillState
from mapspeak.skills.arguments import check_arguments, plain

MOST_DRIVES = 1000
MOST_NESTED = 5
"""Missions within missions."""
DRIVING = frozenset({"drive", "look"})
"""The skills that send the robot to a place."""
TEMPLATE = re.compile(r"\{([a-z][a-z0-9_]*)(?:\.([A-Za-z0-9_]+))?\}")


class StepKind(StrEnum):
    """How a step does the steps within it; a leaf runs a skill."""

    SEQUENCE = "sequence"
    FALLBACK = "fallback"
    PARALLEL = "parallel"
    RETRY = "retry"
    TIMEOUT = "timeout_s"
    REPEAT = "repeat"
    EVERY = "every_min"
    UNTIL = "until"
    LEAF = "leaf"


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One step of a mission.

    Attributes:
        number: Its place in the tree, from 1, as it is read.
        steps: Those within it; of `UNTIL` the condition comes last.
        limit: Seconds of `TIMEOUT`, minutes of `EVERY`.
        times: The most repetitions of `RETRY`, `REPEAT`, `EVERY` and `UNTIL`.
        needs_all: Of `PARALLEL`: else one that succeeds is enough.
        skill: The name of the one that a leaf runs.
        main: A leaf's argument for the first parameter of its skill; None where it names all.
        arguments: A leaf's arguments by name; texts may hold "{name}" and "{name.field}".
        output: The name under which a leaf's result is passed on; empty for none.
    """

    kind: StepKind
    number: int
    steps: tuple["Step", ...] = ()
    limit: float = 0.0
    times: int = 1
    needs_all: bool = True
    skill: str = ""
    main: JsonValue = None
    arguments: Arguments = field(default_factory=dict)
    output: str = ""

    def walk(self) -> Iterator["Step"]:
        """Yield this step and all within it, in the order in which they are read."""
        yield self
        for each in self.steps:
            yield from each.walk()

    def name_arguments(self, spec: SkillSpec) -> dict[str, JsonValue]:
        """Return a leaf's arguments by name.

        Raises:
            SkillError: The skill takes none.
        """
        if self.main is None:
            return dict(self.arguments)
        if not spec.parameters:
            raise SkillError(f"{spec.name} takes nothing.", hint=f"Write only `{spec.name}`.")
        return {spec.parameters[0].name: self.main, **self.arguments}


@dataclass(frozen=True, slots=True, eq=False)
class Mission(Skill):
    """A skill that is a tree of skills.

    Attributes:
        remember: Remarks of people about it since it was saved.
        path: The file that it is saved in; None for one that is not.
    """

    tree: Step
    remember: tuple[str, ...] = ()
    path: Path | None = None


@dataclass(slots=True)
class MissionCourse:
    """The course of one mission.

    Attributes:
        states: Of the leaves that have begun, by their numbers.
    """

    mission: Mission
    given: Arguments
    states: dict[int, SkillState] = field(default_factory=dict)
    is_over: bool = False


@dataclass(frozen=True, slots=True)
class MissionBounds:
    """The bounds of a mission.

    Attributes:
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


FindSkill = Callable[[str], Skill]


@dataclass(frozen=True, slots=True)
class MissionChecker:
    """Checks missions before anything moves.

    Attributes:
        find_skill: Raises `SkillError` for a name that it does not know.
    """

    find_skill: FindSkill

    def check(self, mission: Mission, above: tuple[str, ...] = ()) -> MissionBounds:
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
        names = {each.name for each in mission.spec.parameters}
        bounds = self._check(mission.tree, names, within)
        if bounds.n_drives > MOST_DRIVES:
            raise SkillError(
                f"The mission could drive {bounds.n_drives:,} times, the limit is {MOST_DRIVES:,}.",
                hint="Repeat less often.",
            )
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
        if isinstance(skill, Mission):
            inner = self.check(skill, within)
            return inner + MissionBounds(parts={spec.name: skill})
        drives, asks = step.skill in DRIVING, spec.is_always_asked
        is_free = (spec.effect is SkillEffect.READS or drives) and not asks
        asked = frozenset({step.skill} if asks else ())
        return MissionBounds(int(drives), 0 if is_free else 2, asked)


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


def find_names(value: JsonValue) -> set[str]:
    """Return the names that texts within a value want filled in."""
    match value:
        case str():
            return {match[1] for match in TEMPLATE.finditer(value)}
        case Mapping():
            return find_names(list(value.values()))
        case list() | tuple():
            return {name for each in value for name in find_names(each)}
    return set()


def fill_in(value: JsonValue, values: Arguments) -> JsonValue:
    """Return a value with what its texts name; a text that is one name alone becomes that value.

    Raises:
        SkillError: A result has no field of that name.
    """
    match value:
        case str():
            whole = TEMPLATE.fullmatch(value)
            if whole is not None:
                return _look_up(whole, values)
            return TEMPLATE.sub(lambda match: plain(_look_up(match, values), ".6g"), value)
        case Mapping():
            return {name: fill_in(each, values) for name, each in value.items()}
        case list() | tuple():
            return [fill_in(each, values) for each in value]
    return value


def _look_up(match: re.Match[str], values: Arguments) -> JsonValue:
    found, part = values.get(match[1]), match[2]
    if not isinstance(found, Mapping):
        if found is None or part is not None:
            raise SkillError(
                f"There is no {match[0]}.", hint="The step that gives it was not done."
            )
        return found
    key = next(iter(found), None) if part is None else part
    if key is None or key not in found:
        raise SkillError(
            f"There is no {match[0]}.", hint=f"{match[1]} has: {', '.join(found) or 'nothing'}."
        )
    return found[key]
