"""A mission as a tree of steps: its largest cost, and a check that all its skills are known."""

import difflib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from mapspeak.errors import SkillError
from mapspeak.skill import (
    JsonValue,
    Skill,
    SkillApproval,
    SkillEffect,
    SkillParameter,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.arguments import check_arguments
from mapspeak.skills.comparing import plain

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
    arguments: Mapping[str, JsonValue] = field(default_factory=dict)
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


@dataclass(frozen=True, slots=True)
class MissionBounds:
    """The bounds of a mission.

    Attributes:
        asked: The skills in it for which a person is asked each time.
    """

    n_drives: int = 0
    n_commands: int = 0
    asked: frozenset[str] = frozenset()

    def __add__(self, other: "MissionBounds") -> "MissionBounds":
        return MissionBounds(
            self.n_drives + other.n_drives,
            self.n_commands + other.n_commands,
            self.asked | other.asked,
        )

    def times(self, n: int) -> "MissionBounds":
        """Return the bounds of that many repetitions."""
        return MissionBounds(self.n_drives * n, self.n_commands * n, self.asked)


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionPlan:
    """A mission before it is run.

    Attributes:
        remember: Remarks of people about it since it was saved.
    """

    spec: SkillSpec
    tree: Step
    remember: tuple[str, ...] = ()


@dataclass(slots=True)
class MissionCourse:
    """The course of one mission.

    Attributes:
        states: Of the leaves that have begun, by their numbers.
    """

    plan: MissionPlan
    given: Mapping[str, JsonValue]
    states: dict[int, SkillState] = field(default_factory=dict)
    is_over: bool = False


FindSkill = Callable[[str], Skill]


def check_plan(
    plan: MissionPlan, find_skill: FindSkill, known: Iterable[str], *, above: tuple[str, ...] = ()
) -> MissionBounds:
    """Return what a mission can do at most.

    Args:
        find_skill: Raises `SkillError` for a name that it does not know.
        known: The names of all skills, for a hint at a misspelled one.
        above: The missions that this one is within.

    Raises:
        SkillError: A part of it is unknown, not allowed, or does not fit.
    """
    name = plan.spec.name
    if name in above or len(above) >= MOST_NESTED:
        way = " -> ".join((*above, name))
        raise SkillError(f"The mission holds itself: {way}.", hint="Leave one of these steps out.")
    checker = _Checker(find_skill, tuple(known), (*above, name))
    bounds = checker.check(plan.tree, {each.name for each in plan.spec.parameters})
    if bounds.n_drives > MOST_DRIVES:
        raise SkillError(
            f"The mission could drive {bounds.n_drives:,} times, the limit is {MOST_DRIVES:,}.",
            hint="Repeat less often.",
        )
    return bounds


class _Checker:
    def __init__(
        self, find_skill: FindSkill, known: tuple[str, ...], above: tuple[str, ...]
    ) -> None:
        self._find_skill = find_skill
        self._known = known
        self._above = above

    def check(self, step: Step, names: set[str]) -> MissionBounds:
        """Check a step and the steps within; collect the names of its outputs."""
        if step.kind is StepKind.LEAF:
            return self._check_leaf(step, names)
        parts = [self.check(each, names) for each in step.steps]
        if step.kind is StepKind.PARALLEL and sum(part.n_drives > 0 for part in parts) > 1:
            raise SkillError(
                f"Step {step.number} drives to two places at once.",
                hint="Let only one branch of a parallel step drive or look.",
            )
        return sum(parts, MissionBounds()).times(step.times)

    def _check_leaf(self, step: Step, names: set[str]) -> MissionBounds:
        try:
            skill = self._find_skill(step.skill)
        except SkillError as error:
            near = difflib.get_close_matches(step.skill, self._known, n=1)
            hint = f"Did you mean {near[0]}?" if near else f"There are: {', '.join(self._known)}."
            raise SkillError(f"Step {step.number}: {error.message}", hint=hint) from error
        spec = skill.spec
        given = step.name_arguments(spec)
        for name in sorted(find_names(given) - names):
            raise SkillError(
                f"Step {step.number} ({step.skill}) uses {{{name}}}, which no step before gives.",
                hint=f"There are: {', '.join(sorted(names)) or 'none'}. `as: {name}` gives it.",
            )
        check_given(spec, given, what=f"Step {step.number} ({step.skill})")
        if step.output:
            names.add(step.output)
        if isinstance(plan := getattr(skill, "plan", None), MissionPlan):
            return check_plan(plan, self._find_skill, self._known, above=self._above)
        asked = spec.approval is SkillApproval.ALWAYS
        n_commands = 0 if spec.effect is SkillEffect.READS or step.skill in DRIVING else 2
        return MissionBounds(
            n_drives=int(step.skill in DRIVING),
            n_commands=max(n_commands, 2 * asked),
            asked=frozenset({step.skill} if asked else ()),
        )


def check_given(spec: SkillSpec, given: Mapping[str, JsonValue], *, what: str) -> None:
    """Return when arguments fit as far as they are known before the mission runs.

    Raises:
        SkillError: They do not.
    """
    later = {name for name, value in given.items() if find_names(value)}
    now = {name: value for name, value in given.items() if name not in later}
    stand_ins = tuple(each for each in spec.parameters if each.name not in later)
    check_arguments(stand_ins, fit_kinds(stand_ins, now), skill=what)
    if strangers := later - {each.name for each in spec.parameters}:
        check_arguments(spec.parameters, dict.fromkeys(strangers), skill=what)


def fit_kinds(
    parameters: Iterable[SkillParameter], given: Mapping[str, JsonValue]
) -> dict[str, JsonValue]:
    """Return arguments with numbers written as text where their parameters are texts."""
    texts = {each.name for each in parameters if each.kind == "text"}
    return {
        name: plain(value) if name in texts and isinstance(value, int | float) else value
        for name, value in given.items()
    }


def find_names(value: JsonValue) -> set[str]:
    """Return the names that texts within a value want filled in."""
    match value:
        case str():
            return {match[1] for match in TEMPLATE.finditer(value)}
        case Mapping():
            return {name for each in value.values() for name in find_names(each)}
        case list() | tuple():
            return {name for each in value for name in find_names(each)}
    return set()


def fill_in(value: JsonValue, values: Mapping[str, JsonValue]) -> JsonValue:
    """Return a value with what its texts name; a text that is one name alone becomes that value.

    Raises:
        SkillError: A result has no field of that name.
    """
    match value:
        case str():
            whole = TEMPLATE.fullmatch(value)
            if whole is not None:
                return _look_up(whole, values)
            return TEMPLATE.sub(lambda match: plain(_look_up(match, values)), value)
        case Mapping():
            return {name: fill_in(each, values) for name, each in value.items()}
        case list() | tuple():
            return [fill_in(each, values) for each in value]
    return value


def _look_up(match: re.Match[str], values: Mapping[str, JsonValue]) -> JsonValue:
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
