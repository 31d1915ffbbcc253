"""A mission's tree read from what a model or a person wrote; each mistake with its place."""

import json
from collections.abc import Mapping
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from mapspeak.errors import SkillError
from mapspeak.skills.missions.tree import Step, StepKind

MOST_STEPS = 300
DEEPEST = 16
MOST_TIMES = 1000
MOST_TEXT = 30_000
MOST_NAME = 40
MANY = (StepKind.SEQUENCE, StepKind.FALLBACK, StepKind.PARALLEL)
CONTROL = frozenset(StepKind) - {StepKind.LEAF}
OPTIONS: Mapping[StepKind, frozenset[str]] = {
    StepKind.PARALLEL: frozenset({"needs"}),
    StepKind.RETRY: frozenset({"do"}),
    StepKind.TIMEOUT: frozenset({"do"}),
    StepKind.REPEAT: frozenset({"do"}),
    StepKind.EVERY: frozenset({"do", "times"}),
    StepKind.UNTIL: frozenset({"do", "times"}),
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
    return _Reader().read(written, ())


class _Reader:
    def __init__(self) -> None:
        self._n_steps = 0

    def read(self, written: object, above: tuple[int, ...]) -> Step:
        """Read one step; a list is a sequence, a word a skill that is given nothing."""
        self._n_steps += 1
        number = self._n_steps
        if self._n_steps > MOST_STEPS:
            raise _fault(written, f"the mission has more than {MOST_STEPS} steps")
        if id(written) in above:
            raise _fault(written, "the mission holds itself")
        if len(above) > DEEPEST:
            raise _fault(written, f"the mission is more than {DEEPEST} steps deep")
        within = (*above, id(written))
        if isinstance(written, str):
            return Step(kind=StepKind.LEAF, number=number, skill=_name(written, written))
        if isinstance(written, list):
            return self._many(StepKind.SEQUENCE, written, written, number, within)
        if not isinstance(written, Mapping) or not written:
            raise _fault(written, f"{_shown(written)} is no step")
        control = [StepKind(key) for key in written if key in CONTROL]
        if not control:
            return _leaf(written, number)
        kind = control[0]
        strangers = [
            str(key) for key in written if key != kind and key not in OPTIONS.get(kind, ())
        ]
        if strangers:
            raise _fault(written, f"{strangers[0][:MOST_NAME]!r} does not belong to {kind}")
        if kind in MANY:
            return self._many(kind, written[kind], written, number, within)
        return self._one(kind, written, number, within)

    def _many(
        self, kind: StepKind, steps: object, written: object, number: int, within: tuple[int, ...]
    ) -> Step:
        if not isinstance(steps, list) or not steps:
            raise _fault(written, f"{kind} needs a list of steps")
        needs = written.get("needs", "all") if isinstance(written, Mapping) else "all"
        if needs not in ("all", "one"):
            raise _fault(written, "needs is all or one")
        # The list may be the way in which a step holds itself, not the step.
        if id(steps) in within[:-1] or (steps is not written and id(steps) in within):
            raise _fault(written, "the mission holds itself")
        inside = (*within, id(steps))
        read = tuple(self.read(each, inside) for each in steps)
        return Step(kind=kind, number=number, steps=read, needs_all=needs == "all")

    def _one(
        self, kind: StepKind, written: Mapping[str, Any], number: int, within: tuple[int, ...]
    ) -> Step:
        if "do" not in written:
            raise _fault(written, f"{kind} needs `do`, the step that it is about")
        inner = self.read(written["do"], within)
        if kind is StepKind.UNTIL:
            condition = self.read({"check": written[kind]}, within)
            times = _number(written, "times", most=MOST_TIMES, default=10)
            return Step(kind=kind, number=number, steps=(inner, condition), times=int(times))
        if kind in (StepKind.RETRY, StepKind.REPEAT):
            times = _number(written, kind, most=MOST_TIMES)
            return Step(kind=kind, number=number, steps=(inner,), times=int(times))
        limit = _number(written, kind, most=86_400)
        times = _number(written, "times", most=MOST_TIMES, default=24)
        is_every = kind is StepKind.EVERY
        return Step(
            kind=kind,
            number=number,
            steps=(inner,),
            limit=limit,
            times=int(times) if is_every else 1,
        )


def _leaf(written: Mapping[str, Any], number: int) -> Step:
    first, *others = written
    skill, given = _name(first, written), written[first]
    output = written.get("as", "")
    if output:
        output = _name(output, written)
    named = {str(key): written[key] for key in others if key != "as"}
    if isinstance(given, Mapping):
        named, given = {**{str(key): each for key, each in given.items()}, **named}, None
    return Step(
        kind=StepKind.LEAF,
        number=number,
        skill=skill,
        main=None if given is None else _plain(given),
        arguments={name: _plain(each) for name, each in named.items()},
        output=output,
    )


def _plain(value: object, depth: int = 0) -> Any:  # noqa: ANN401 - YAML
    """Return a value of YAML without what its reader adds.

    Raises:
        SkillError: It is nested too deep, as a value that contains itself is.
    """
    if depth > DEEPEST:
        raise _fault(value, "an argument is nested too deep")
    match value:
        case Mapping():
            return {str(key): _plain(each, depth + 1) for key, each in value.items()}
        case list():
            return [_plain(each, depth + 1) for each in value]
        case bool() | None:
            return value
        case int() | float():
            return int(value) if isinstance(value, int) else float(value)
    return str(value)


def _name(name: object, written: object) -> str:
    is_name = isinstance(name, str) and name.isidentifier() and len(name) <= 2 * MOST_NAME
    if not is_name:
        raise _fault(written, f"{_shown(name)} is no name of a skill or a result")
    return str(name)


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
    if isinstance(value, Mapping | list):
        return "a list" if isinstance(value, list) else "an empty step"
    return repr(value)[:MOST_NAME]
