"""The arguments given to a skill, checked against its parameters."""

import difflib
import math
from collections.abc import Mapping, Sequence

from mapspeak.errors import SkillError
from mapspeak.skill import JsonValue, ParameterKind, SkillParameter

MOST_SHOWN = 60
WANTED = {
    ParameterKind.NUMBER: "a number",
    ParameterKind.WHOLE: "a whole number",
    ParameterKind.TEXT: "a text",
    ParameterKind.BYTES: "bytes in base64",
    ParameterKind.FLAG: "true or false",
    ParameterKind.LIST: "a list",
    ParameterKind.OBJECT: "an object",
}


def check_arguments(
    parameters: Sequence[SkillParameter], arguments: Mapping[str, JsonValue], *, skill: str
) -> dict[str, JsonValue]:
    """Return the arguments of a skill, with defaults for missing ones.

    Raises:
        SkillError: They do not fit; names which, and what it must be.
    """
    return _check_fields(parameters, arguments, path="", what=skill)


def _check_fields(
    parameters: Sequence[SkillParameter],
    given: Mapping[str, JsonValue],
    *,
    path: str,
    what: str,
) -> dict[str, JsonValue]:
    known = {each.name: each for each in parameters}
    for name in given:
        if name not in known:
            raise _stranger(str(name), list(known), what)
    checked: dict[str, JsonValue] = {}
    for name, parameter in known.items():
        where = f"{path}.{name}" if path else name
        if name in given:
            checked[name] = check_value(parameter, given[name], where=where, what=what)
        elif parameter.default is not None:
            checked[name] = parameter.default
        elif parameter.is_required:
            raise SkillError(
                f"{what} needs {where}.",
                hint=f"Give {say_wanted(parameter)}.",
            )
    return checked


def check_value(parameter: SkillParameter, value: JsonValue, *, where: str, what: str) -> JsonValue:
    """Return one argument as its parameter holds it.

    Args:
        where: The name of the argument, or the path to a part of it.
        what: The skill's name.

    Raises:
        SkillError: It does not fit.
    """
    match parameter.kind:
        case ParameterKind.NUMBER | ParameterKind.WHOLE:
            fitting = _number(parameter, value)
        case ParameterKind.TEXT | ParameterKind.BYTES:
            is_text = isinstance(value, str)
            is_fitting = is_text and (parameter.most is None or len(value) <= parameter.most)
            fitting = value if is_fitting else None
        case ParameterKind.FLAG:
            fitting = value if isinstance(value, bool) else None
        case ParameterKind.LIST:
            fitting = _list(parameter, value, where=where, what=what)
        case ParameterKind.OBJECT:
            is_object = isinstance(value, Mapping)
            fitting = (
                _check_fields(parameter.fields, value, path=where, what=what) if is_object else None
            )
    is_chosen = not parameter.choices or fitting in parameter.choices
    if fitting is None or not is_chosen:
        raise SkillError(
            f"{what}: {where} cannot be {_shown(value)}.", hint=f"Give {say_wanted(parameter)}."
        )
    return fitting


def say_wanted(parameter: SkillParameter) -> str:
    """Return what a parameter takes, such as "a number from 0 to 0.085 m"."""
    if parameter.choices:
        return f"one of {', '.join(map(str, parameter.choices))}"
    wanted, most = WANTED[parameter.kind], parameter.most
    if parameter.kind in (ParameterKind.NUMBER, ParameterKind.WHOLE):
        return f"{wanted}{_say_limits(parameter)}"
    if most is None:
        return wanted
    if parameter.kind is ParameterKind.LIST:
        how_many = "" if parameter.least == most else "at most "
        return f"a list of {how_many}{most:g} values"
    return f"{wanted} of at most {most:g} letters"


def _say_limits(parameter: SkillParameter) -> str:
    unit = f" {parameter.unit}" if parameter.unit else ""
    least, most = parameter.least, parameter.most
    if least is not None and most is not None:
        return f" from {least:.15g} to {most:.15g}{unit}"
    if least is not None:
        return f" of at least {least:.15g}{unit}"
    return unit if most is None else f" of at most {most:.15g}{unit}"


def _number(parameter: SkillParameter, value: JsonValue) -> JsonValue | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if parameter.kind is ParameterKind.WHOLE:
        # Models write 3.0 for 3.
        if value != int(value):
            return None
        value = int(value)
    is_small = parameter.least is not None and value < parameter.least
    is_large = parameter.most is not None and value > parameter.most
    return None if is_small or is_large else value


def _list(
    parameter: SkillParameter, value: JsonValue, *, where: str, what: str
) -> list[JsonValue] | None:
    if not isinstance(value, list | tuple):
        return None
    is_short = parameter.least is not None and len(value) < parameter.least
    is_long = parameter.most is not None and len(value) > parameter.most
    if is_short or is_long:
        return None
    item = parameter.item
    if item is None:
        return list(value)
    return [
        check_value(item, each, where=f"{where}[{number}]", what=what)
        for number, each in enumerate(value)
    ]


def _stranger(name: str, known: list[str], what: str) -> SkillError:
    near = difflib.get_close_matches(name, known, n=1)
    takes = f"It takes {', '.join(known)}." if known else "It takes none."
    hint = f"Did you mean {near[0]}? {takes}" if near else takes
    return SkillError(f"{what} takes no {name[:MOST_SHOWN]!r}.", hint=hint)


def _shown(value: JsonValue) -> str:
    shown = repr(value)
    return shown if len(shown) <= MOST_SHOWN else f"{shown[: MOST_SHOWN - 3]}..."
