"""A mission as a tree of steps, read from what a model or a person wrote: faults by line."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from mapspeak.errors import SkillError
from mapspeak.skill import Arguments, JsonValue, Skill, SkillSpec
from mapspeak.skills.arguments import plain

TEMPLATE = re.compile(r"\{([a-z][a-z0-9_]*)(?:\.([A-Za-z0-9_]+))?\}")
MOST_STEPS = 300
DEEPEST = 16
MOST_TIMES = 1000
MOST_S = 86_400
MOST_TEXT = 30_000
MOST_NAME = 40


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
            SkillError: The skill takes none, or is given one twice.
        """
        if self.main is None:
            return dict(self.arguments)
        if not spec.parameters:
            raise SkillError(f"{spec.name} takes nothing.", hint=f"Write only `{spec.name}`.")
        first = spec.parameters[0].name
        if first in self.arguments:
            raise SkillError(f"{spec.name} is given {first} twice.", hint="Leave one out.")
        return {first: self.main, **self.arguments}


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


CONTROL = frozenset(StepKind) - {StepKind.LEAF}
OPTIONS: Mapping[StepKind, frozenset[str]] = {
    **dict.fromkeys((StepKind.SEQUENCE, StepKind.FALLBACK), frozenset[str]()),
    StepKind.PARALLEL: frozenset({"needs"}),
    **dict.fromkeys((StepKind.RETRY, StepKind.TIMEOUT, StepKind.REPEAT), frozenset({"do"})),
    **dict.fromkeys((StepKind.EVERY, StepKind.UNTIL), frozenset({"do", "times"})),
}
FORM = "Write each step as `skill: argument`, or as one of " + ", ".join(sorted(CONTROL)) + "."


def parse_tree(written: object) -> Any:  # noqa: ANN401 - whatever was written
    """Return the value of a text in YAML or JSON; a value read from JSON before is taken too.

    Raises:
        SkillError: It is neither, or too long.
    """
    text = written if isinstance(written, str) else json.dumps(written, default=str)
    if len(text) > MOST_TEXT:
        raise SkillError(
            f"The mission has {len(text):,} characters, the limit is {MOST_TEXT:,}.",
            hint="Save parts of it as missions of their own.",
        )
    try:
        return YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        line = f"Line {error.problem_mark.line + 1}: " if error.problem_mark else ""
        raise SkillError(f"{line}this is no YAML: {error.problem}.", hint=FORM) from error
    except (YAMLError, ValueError, RecursionError) as error:
        raise SkillError(f"This is no YAML: {error}.", hint=FORM) from error


def read_tree(written: object) -> Step:
    """Return a mission as steps.

    Raises:
        SkillError: It has a mistake; says the line where that is known.
    """
    return _Reader().read(written, 0)


class _Reader:
    def __init__(self) -> None:
        self._n_steps = 0

    def read(self, written: object, depth: int) -> Step:
        """Read one step; a list is a sequence, a word a skill that is given nothing."""
        self._n_steps += 1
        number = self._n_steps
        if number > MOST_STEPS:
            raise _fault(written, f"the mission has more than {MOST_STEPS} steps")
        if depth > DEEPEST:
            raise _fault(written, f"the mission is more than {DEEPEST} steps deep, or holds itself")
        if isinstance(written, str):
            return Step(kind=StepKind.LEAF, number=number, skill=_name(written, written))
        if isinstance(written, list):
            return self._many(StepKind.SEQUENCE, written, written, number, depth)
        if not isinstance(written, Mapping) or not written:
            shown = "an empty step" if isinstance(written, Mapping) else _shown(written)
            raise _fault(written, f"{shown} is no step")
        kind = next((StepKind(key) for key in written if key in CONTROL), None)
        if kind is None:
            return _leaf(written, number)
        if strangers := [str(key) for key in written if key not in (kind, *OPTIONS[kind])]:
            raise _fault(written, f"{strangers[0][:MOST_NAME]!r} does not belong to {kind}")
        if "do" in OPTIONS[kind]:
            return self._one(kind, written, number, depth)
        return self._many(kind, written[kind], written, number, depth)

    def _many(
        self, kind: StepKind, steps: object, written: object, number: int, depth: int
    ) -> Step:
        if not isinstance(steps, list) or not steps:
            raise _fault(written, f"{kind} needs a list of steps")
        needs = written.get("needs", "all") if isinstance(written, Mapping) else "all"
        if needs not in ("all", "one"):
            raise _fault(written, "needs is all or one")
        read = tuple(self.read(each, depth + 1) for each in steps)
        return Step(kind=kind, number=number, steps=read, needs_all=needs == "all")

    def _one(self, kind: StepKind, written: Mapping[str, Any], number: int, depth: int) -> Step:
        if "do" not in written:
            raise _fault(written, f"{kind} needs `do`, the step that it is about")
        steps: tuple[Step, ...] = (self.read(written["do"], depth + 1),)
        limit, times = 0.0, 1.0
        match kind:
            case StepKind.TIMEOUT:
                limit = _number(written, kind, most=MOST_S)
            case StepKind.EVERY:
                limit = _number(written, kind, most=MOST_S)
                times = _number(written, "times", most=MOST_TIMES, default=24)
            case StepKind.UNTIL:
                steps = (*steps, self.read({"check": written[kind]}, depth + 1))
                times = _number(written, "times", most=MOST_TIMES, default=10)
            case _:
                times = _number(written, kind, most=MOST_TIMES)
        return Step(kind=kind, number=number, steps=steps, limit=limit, times=int(times))


def _leaf(written: Mapping[str, Any], number: int) -> Step:
    # Some clients sort the names of JSON.
    first, *others = sorted(written, key=lambda key: key == "as")
    given, output = _plain(written[first]), written.get("as", "")
    named = {str(key): _plain(written[key]) for key in others if key != "as"}
    if isinstance(given, Mapping):
        named, given = {**given, **named}, None
    return Step(
        kind=StepKind.LEAF,
        number=number,
        skill=_name(first, written),
        main=given,
        arguments=named,
        output=_name(output, written) if output else "",
    )


def _plain(value: object) -> JsonValue:
    """Return a value of YAML without what its reader adds."""
    try:
        return json.loads(json.dumps(value, default=str))
    except (ValueError, RecursionError) as error:
        raise _fault(value, "an argument holds itself, or is nested too deep") from error


def _name(name: object, written: object) -> str:
    if not isinstance(name, str) or not name.isidentifier() or len(name) > 2 * MOST_NAME:
        raise _fault(written, f"{_shown(name)} is no name of a skill or a result")
    return name


def _number(
    written: Mapping[str, Any], key: str, *, most: float, default: float | None = None
) -> float:
    value = written.get(key, default)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not 0 < value <= most:
        raise _fault(written, f"{key} cannot be {_shown(value)}: give a number up to {most:g}")
    return float(value)


def _fault(written: object, what: str) -> SkillError:
    place = getattr(written, "lc", None)
    line = f"Line {place.line + 1}: " if place is not None and place.line is not None else ""
    return SkillError(f"{line}{what}.", hint=FORM)


def _shown(value: object) -> str:
    return "a list" if isinstance(value, Mapping | list) else repr(value)[:MOST_NAME]


def find_names(value: JsonValue) -> set[str]:
    """Return the names that texts within a value want filled in."""
    return {match[1] for match in TEMPLATE.finditer(json.dumps(value, default=str))}


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
