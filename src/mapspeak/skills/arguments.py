"""The arguments of a skill: checked against its parameters, and as the JSON schema of a tool."""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from mapspeak.errors import SkillError, say_nearest
from mapspeak.memory.quoting import quote
from mapspeak.skill import Arguments, JsonValue, ParameterKind, SkillParameter

MOST_SHOWN = 60
FLAGS = {"true": True, "false": False}
NUMBERS = (ParameterKind.NUMBER, ParameterKind.WHOLE)
KINDS = {
    ParameterKind.NUMBER: ("number", "a number"),
    ParameterKind.WHOLE: ("integer", "a whole number"),
    ParameterKind.TEXT: ("string", "a text"),
    ParameterKind.BYTES: ("string", "bytes in base64"),
    ParameterKind.FLAG: ("boolean", "true or false"),
    ParameterKind.LIST: ("array", "a list"),
    ParameterKind.OBJECT: ("object", "an object"),
}
"""What each is called in a schema, and in a fault."""
LIMITS = {
    ParameterKind.NUMBER: ("minimum", "maximum"),
    ParameterKind.WHOLE: ("minimum", "maximum"),
    ParameterKind.TEXT: ("minLength", "maxLength"),
    ParameterKind.LIST: ("minItems", "maxItems"),
}
LARGEST_SAID = 2**16
"""Beyond it the limits of a whole number or a text say no more than that it is one."""
Schema = dict[str, Any]
MOST_SCHEMA = 4_000
"""Bytes; of a longer one the messages within lists are told by the names of their fields."""
MOST_DESCRIPTION = 160
MOST_NAMED = 12
FULL_DEPTH = 8


def check_arguments(
    parameters: Sequence[SkillParameter], arguments: Arguments, *, skill: str, path: str = ""
) -> dict[str, JsonValue]:
    """Return the arguments of a skill, with defaults for missing ones.

    Args:
        path: The argument that these are fields of, such as "goal.via[2]."; empty for none.

    Raises:
        SkillError: They do not fit; names which, and what it must be.
    """
    known = {each.name: each for each in parameters}
    if stranger := next((str(name) for name in arguments if name not in known), None):
        takes = f"It takes {', '.join(known)}." if known else "It takes none."
        hint = f"{say_nearest(stranger, known)}{takes}"
        raise SkillError(f"{skill} takes no {stranger[:MOST_SHOWN]!r}.", hint=hint)
    checked: dict[str, JsonValue] = {}
    for name, parameter in known.items():
        if name in arguments:
            checked[name] = check_value(
                parameter, arguments[name], where=f"{path}{name}", what=skill
            )
        elif parameter.default is not None:
            checked[name] = parameter.default
        elif parameter.is_required:
            raise SkillError(f"{skill} needs {path}{name}.", hint=f"Give {say_wanted(parameter)}.")
    return checked


def check_value(parameter: SkillParameter, value: JsonValue, *, where: str, what: str) -> JsonValue:
    """Return one argument as its parameter holds it: "3" for a number, 3 for a text too.

    Args:
        where: The name of the argument, or the path to a part of it.
        what: The skill's name.

    Raises:
        SkillError: It does not fit.
    """
    fitting: JsonValue = None
    match parameter.kind:
        case ParameterKind.NUMBER | ParameterKind.WHOLE:
            fitting = _number(parameter, value)
        case ParameterKind.TEXT if isinstance(value, str | int | float):
            text = plain(value)
            fitting = text if _is_within(parameter, len(text)) else None
        case ParameterKind.BYTES if isinstance(value, str):
            fitting = value if _is_within(parameter, len(value)) else None
        case ParameterKind.FLAG:
            fitting = FLAGS.get(plain(value))
        case ParameterKind.LIST if isinstance(value, list | tuple):
            if _is_within(parameter, len(value)):
                fitting = [
                    each
                    if parameter.item is None
                    else check_value(parameter.item, each, where=f"{where}[{number}]", what=what)
                    for number, each in enumerate(value)
                ]
        case ParameterKind.OBJECT if isinstance(value, Mapping):
            fitting = check_arguments(parameter.fields, value, skill=what, path=f"{where}.")
    if fitting is None or (parameter.choices and fitting not in parameter.choices):
        shown = repr(value)
        shown = shown if len(shown) <= MOST_SHOWN else f"{shown[: MOST_SHOWN - 3]}..."
        raise SkillError(
            f"{what}: {where} cannot be {shown}.", hint=f"Give {say_wanted(parameter)}."
        )
    return fitting


def say_wanted(parameter: SkillParameter) -> str:
    """Return what a parameter takes, such as "a number from 0 to 0.085 m"."""
    if parameter.choices:
        return f"one of {', '.join(map(str, parameter.choices))}"
    wanted, least, most = KINDS[parameter.kind][1], parameter.least, parameter.most
    if parameter.kind in NUMBERS:
        unit = f" {parameter.unit}" if parameter.unit else ""
        from_least = "" if least is None else f" from {least:.15g}"
        to_most = "" if most is None else f" to {most:.15g}"
        return f"{wanted}{from_least}{to_most}{unit}"
    if most is None:
        return wanted
    if parameter.kind is not ParameterKind.LIST:
        return f"{wanted} of at most {most:g} letters"
    return f"a list of {'' if least == most else 'at most '}{most:g} values"


def _is_within(parameter: SkillParameter, size: float) -> bool:
    is_small = parameter.least is not None and size < parameter.least
    is_large = parameter.most is not None and size > parameter.most
    return not (is_small or is_large)


def plain(value: JsonValue, digits: str = ".15g") -> str:
    """Return a value as people write it: 3 for 3.0, true for True."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:{digits}}" if isinstance(value, float) else str(value)


def _number(parameter: SkillParameter, value: JsonValue) -> JsonValue | None:
    if isinstance(said := value, str):
        for read in (float, int):
            with suppress(ValueError):
                value = read(said)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not abs(value) <= sys.float_info.max:
        return None
    if parameter.kind is ParameterKind.WHOLE:
        # Models write 3.0 for 3.
        if value != int(value):
            return None
        value = int(value)
    return value if _is_within(parameter, value) else None


def schema_of(parameters: Iterable[SkillParameter]) -> Schema:
    """Return the schema of the arguments."""
    told = tuple(parameters)
    schema: Schema = {}
    for depth in (FULL_DEPTH, 3, 2, 1, 0):
        schema = _object(told, depth)
        if len(json.dumps(schema, separators=(",", ":"))) <= MOST_SCHEMA:
            break
    return schema


def _object(parameters: tuple[SkillParameter, ...], depth: int) -> Schema:
    schema: Schema = {"type": "object"}
    if parameters:
        schema["properties"] = {each.name: _schema(each, depth) for each in parameters}
    required = [each.name for each in parameters if each.is_required]
    return schema | ({"required": required} if required else {})


def _schema(parameter: SkillParameter, depth: int) -> Schema:
    schema: Schema = {"type": KINDS[parameter.kind][0]}
    if parameter.item is not None:
        schema["items"] = _schema(parameter.item, depth - 1)
    if parameter.kind is ParameterKind.OBJECT and depth > 0:
        schema |= _object(parameter.fields, depth - 1)
    for name, limit in zip(
        LIMITS.get(parameter.kind, ()), (parameter.least, parameter.most), strict=False
    ):
        if limit is not None and abs(limit) <= LARGEST_SAID:
            is_count = parameter.kind not in NUMBERS
            schema[name] = int(limit) if is_count else limit
    if parameter.choices:
        schema["enum"] = list(parameter.choices)
    if parameter.default is not None:
        schema["default"] = parameter.default
    said = _describe(parameter, depth)
    return schema | ({"description": said} if said else {})


def _describe(parameter: SkillParameter, depth: int) -> str:
    """Return unit, kind and the owner's words; these are quoted, for they may say anything."""
    parts = [parameter.unit]
    if parameter.kind is ParameterKind.BYTES:
        parts.append(KINDS[ParameterKind.BYTES][1])
    if parameter.description:
        parts.append(quote(parameter.description, most=MOST_DESCRIPTION))
    if parameter.kind is ParameterKind.OBJECT and depth <= 0:
        names = [each.name for each in parameter.fields]
        parts.append(f"fields: {', '.join(names[:MOST_NAMED])}")
    return "; ".join(filter(None, parts))
