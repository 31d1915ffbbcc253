"""A mission as a tree of steps, read from what a model or a person wrote: faults by line."""

import itertools
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from mapspeak.errors import SkillError
from mapspeak.skill import Arguments, JsonValue, Schema, Skill, SkillSpec, parameter
from mapspeak.skills.arguments import check_arguments, plain

TEMPLATE = re.compile(r"\{([a-z][a-z0-9_]*)(?:\.([A-Za-z0-9_]+))?\}")
MOST_STEPS = 300
DEEPEST = 16
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
        """Return a leaf's arguments by name; SkillError where it takes none, or one twice."""
        if self.main is None:
            return dict(self.arguments)
        if not spec.parameters:
            raise SkillError(f"{spec.name} takes nothing.", hint=f"Write only `{spec.name}`.")
        first = next(iter(spec.parameters))
        if first in self.arguments:
            raise SkillError(f"{spec.name} is given {first} twice.", hint="Leave one out.")
        return {first: self.main, **self.arguments}


@dataclass(frozen=True, slots=True, eq=False)
class Mission(Skill):
    """A skill that is a tree of skills.

    Attributes:
        remember: Remarks of people about it since it was saved.
    """

    tree: Step
    remember: tuple[str, ...] = ()
    path: Path = Path()


MOST_S, MOST_TIMES = 86_400, 1000
_STEPS, _STEP = parameter("array", minItems=1), {"required": True}
_SPAN = parameter("number", minimum=0.001, maximum=MOST_S)
_TIMES = parameter("integer", minimum=1, maximum=MOST_TIMES)
FORMS: Mapping[StepKind, Mapping[str, Schema]] = {
    StepKind.SEQUENCE: {"sequence": _STEPS},
    StepKind.FALLBACK: {"fallback": _STEPS},
    StepKind.PARALLEL: {
        "parallel": _STEPS,
        "needs": parameter("string", enum=["all", "one"], default="all"),
    },
    StepKind.RETRY: {"retry": _TIMES, "do": _STEP},
    StepKind.REPEAT: {"repeat": _TIMES, "do": _STEP},
    StepKind.TIMEOUT: {"timeout_s": _SPAN, "do": _STEP},
    StepKind.EVERY: {"every_min": _SPAN, "times": {**_TIMES, "default": 24}, "do": _STEP},
    StepKind.UNTIL: {"until": {}, "times": {**_TIMES, "default": 10}, "do": _STEP},
}
"""What stands in a step that holds steps."""
CONTROL = frozenset(FORMS)
FORM = "Write each step as `skill: argument`, or as one of " + ", ".join(sorted(CONTROL)) + "."


def parse_tree(written: object) -> Any:  # noqa: ANN401 - whatever was written
    """Return the value of a text in YAML or JSON, or of JSON read before; SkillError for others."""
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
    """Return a mission as steps, or raise SkillError with the line of a mistake, where known."""
    return _read(written, itertools.count(1), 0)


def _read(written: object, numbers: Iterator[int], depth: int) -> Step:
    """Read one step; a list is a sequence, a word a skill that is given nothing."""
    number = next(numbers)
    if number > MOST_STEPS:
        raise _fault(written, f"the mission has more than {MOST_STEPS} steps")
    if depth > DEEPEST:
        raise _fault(written, f"the mission is more than {DEEPEST} steps deep, or holds itself")
    form = {StepKind.SEQUENCE: written} if isinstance(written, list) else written
    if isinstance(form, str):
        return Step(kind=StepKind.LEAF, number=number, skill=_name(form, written))
    if not isinstance(form, Mapping) or not form:
        shown = "an empty step" if isinstance(form, Mapping) else _shown(form)
        raise _fault(written, f"{shown} is no step")
    kind = next((StepKind(key) for key in form if key in CONTROL), None)
    if kind is None:
        return _read_leaf(form, number)
    given = check_arguments(FORMS[kind], form, skill=f"{_find_line(written)}{kind}")
    within = given[kind] if "do" not in given else [given["do"]]
    if kind is StepKind.UNTIL:
        within.append({"check": given[kind]})
    return Step(
        kind=kind,
        number=number,
        steps=tuple(_read(each, numbers, depth + 1) for each in within),
        limit=given[kind] if FORMS[kind][kind] is _SPAN else 0.0,
        times=given[kind] if FORMS[kind][kind] is _TIMES else given.get("times", 1),
        needs_all=given.get("needs") != "one",
    )


def _read_leaf(written: Mapping[str, Any], number: int) -> Step:
    # Some clients sort the names of JSON.
    first, *others = sorted(written, key=lambda key: key == "as")
    given, output = _plain(written[first]), written.get("as", "")
    named = {str(key): _plain(written[key]) for key in others if key != "as"}
    if isinstance(given, Mapping):
        named, given = {**given, **named}, None
    skill = _name(first, written)
    leaf = Step(kind=StepKind.LEAF, number=number, skill=skill, main=given, arguments=named)
    return replace(leaf, output=_name(output, written)) if output else leaf


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


def _find_line(written: object) -> str:
    place = getattr(written, "lc", None)
    return "" if place is None or place.line is None else f"Line {place.line + 1}: "


def _fault(written: object, what: str) -> SkillError:
    return SkillError(f"{_find_line(written)}{what}.", hint=FORM)


def _shown(value: object) -> str:
    return "a list" if isinstance(value, Mapping | list) else repr(value)[:MOST_NAME]


def find_names(value: JsonValue) -> set[str]:
    """Return the names that texts within a value want filled in."""
    return {match[1] for match in TEMPLATE.finditer(json.dumps(value, default=str))}


def fill_in(value: JsonValue, values: Arguments) -> JsonValue:
    """Return a value with what its texts name, or raise SkillError; a name alone is its value."""
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
