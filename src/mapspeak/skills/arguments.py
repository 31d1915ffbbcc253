"""The arguments of a skill: checked against the schemas that its tool publishes."""

import json
from collections.abc import Mapping
from contextlib import suppress
from typing import Annotated, Any

from pydantic import BeforeValidator, FiniteFloat, TypeAdapter, ValidationError

from mapspeak.errors import SkillError, say_nearest
from mapspeak.memory.quoting import quote
from mapspeak.skill import Arguments, JsonValue, Schema

FLAGS = {"true": True, "false": False}
MOST_SHOWN = 60
MOST_DIGITS = 309
"""No number that a robot takes has more."""
SAID = {
    "number": "a number",
    "integer": "a whole number",
    "string": "a text",
    "boolean": "true or false",
    "array": "a list",
    "object": "an object",
    "base64": "bytes in base64",
    None: "a value",
}
LIMITS = {
    "number": ("minimum", "maximum"),
    "integer": ("minimum", "maximum"),
    "string": ("minLength", "maxLength"),
    "array": ("minItems", "maxItems"),
}
OURS = frozenset({"unit", "required", "contentEncoding", "description", "items", "properties"})
"""The words of a schema that are published in another form than they are kept in."""
LARGEST_SAID = 2**16
"""Beyond it the limits of a whole number or a text say no more than that it is one."""
MOST_SCHEMA = 4_000
"""Bytes; of a longer one the messages within lists are told by the names of their fields."""
MOST_DESCRIPTION = 160
MOST_NAMED = 12
FULL_DEPTH = 8


def _refuse_others(value: JsonValue) -> JsonValue:
    return None if isinstance(value, bool) or len(str(value)) > MOST_DIGITS else value


def _write_number(value: JsonValue) -> JsonValue:
    return plain(value) if isinstance(value, int | float) else value


CONVERSIONS: Mapping[str | None, TypeAdapter[Any]] = {
    "number": TypeAdapter(Annotated[int | FiniteFloat, BeforeValidator(_refuse_others)]),
    "integer": TypeAdapter(Annotated[int, BeforeValidator(_refuse_others)]),
    "string": TypeAdapter(Annotated[str, BeforeValidator(_write_number)]),
    "boolean": TypeAdapter(Annotated[bool, BeforeValidator(lambda said: FLAGS.get(plain(said)))]),
    "array": TypeAdapter(list[Any]),
    "object": TypeAdapter(dict[str, Any]),
    "base64": TypeAdapter(str),
    None: TypeAdapter(Any),
}


def check_arguments(
    parameters: Mapping[str, Schema], arguments: Arguments, *, skill: str, path: str = ""
) -> dict[str, JsonValue]:
    """Return the arguments of a skill, with defaults for missing ones.

    SkillError names which does not fit, and what it must be; `path` is the argument that these are
    fields of, such as "goal.via[2].".
    """
    if stranger := next((str(name) for name in arguments if name not in parameters), None):
        takes = f"It takes {', '.join(parameters)}." if parameters else "It takes none."
        hint = f"{say_nearest(stranger, parameters)}{takes}"
        raise SkillError(f"{skill} takes no {stranger[:MOST_SHOWN]!r}.", hint=hint)
    checked: dict[str, JsonValue] = {}
    for name, schema in parameters.items():
        if name in arguments:
            checked[name] = check_value(schema, arguments[name], where=f"{path}{name}", what=skill)
        elif "default" in schema:
            checked[name] = schema["default"]
        elif schema.get("required"):
            raise SkillError(f"{skill} needs {path}{name}.", hint=f"Give {say_wanted(schema)}.")
    return checked


def check_value(schema: Schema, value: JsonValue, *, where: str, what: str) -> JsonValue:
    """Return an argument as its schema wants it, "3" as a number and 3 as a text, or SkillError.

    Args:
        where: The name of the argument, or the path to a part of it.
        what: The skill's name.
    """
    if (kind := _kind_of(schema)) == "object" and isinstance(value, Mapping):
        fields = schema.get("properties", {})
        return check_arguments(fields, value, skill=what, path=f"{where}.")
    fitting = None
    with suppress(ValidationError):
        fitting = CONVERSIONS[kind].validate_python(value)
    if fitting is None or not _is_allowed(schema, fitting):
        shown = repr(value)
        shown = shown if len(shown) <= MOST_SHOWN else f"{shown[: MOST_SHOWN - 3]}..."
        raise SkillError(f"{what}: {where} cannot be {shown}.", hint=f"Give {say_wanted(schema)}.")
    if kind == "array" and "items" in schema:
        return [
            check_value(schema["items"], each, where=f"{where}[{number}]", what=what)
            for number, each in enumerate(fitting)
        ]
    return fitting


def _kind_of(schema: Schema) -> JsonValue:
    return schema.get("contentEncoding", schema.get("type"))


def _is_allowed(schema: Schema, value: JsonValue) -> bool:
    least, most = find_limits(schema)
    size = len(value) if isinstance(value, str | list) else value
    is_small, is_large = least is not None and size < least, most is not None and size > most
    return not (is_small or is_large) and value in schema.get("enum", (value,))


def find_limits(schema: Schema) -> tuple[float | None, float | None]:
    """Return the least and the largest number, or count of letters or values."""
    least, most = LIMITS.get(schema.get("type", ""), ("", ""))
    return schema.get(least), schema.get(most)


def say_wanted(schema: Schema) -> str:
    """Return what a parameter takes, such as "a number from 0 to 0.085 m"."""
    if "enum" in schema:
        return f"one of {', '.join(map(str, schema['enum']))}"
    kind, (least, most) = _kind_of(schema), find_limits(schema)
    wanted = SAID[kind]
    if kind in ("number", "integer"):
        from_least = "" if least is None else f" from {least:.15g}"
        to_most = "" if most is None else f" to {most:.15g}"
        return f"{wanted}{from_least}{to_most} {schema.get('unit', '')}".rstrip()
    if most is None:
        return wanted if least is None else f"{wanted} of at least {least:g}"
    what = "values" if kind == "array" else "letters"
    return f"{wanted} of {'' if least == most else 'at most '}{most:g} {what}"


def plain(value: JsonValue, digits: str = ".15g") -> str:
    """Return a value as people write it: 3 for 3.0, true for True."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:{digits}}" if isinstance(value, float) else str(value)


def schema_of(parameters: Mapping[str, Schema]) -> dict[str, Any]:
    """Return the schema of the arguments as a tool publishes it, not too long."""
    told: dict[str, Any] = {}
    for depth in (FULL_DEPTH, 3, 2, 1, 0):
        told = _publish({"type": "object", "properties": parameters}, depth + 1)
        if len(json.dumps(told, separators=(",", ":"))) <= MOST_SCHEMA:
            break
    return told


def _publish(schema: Schema, depth: int) -> dict[str, Any]:
    """Return a schema with unit and encoding in its description; owners' words are quoted."""
    kind, fields = schema["type"], schema.get("properties", {})
    told = {
        word: each
        for word, each in schema.items()
        if word not in OURS and not (word in LIMITS.get(kind, ()) and abs(each) > LARGEST_SAID)
    }
    said = [schema.get("unit"), SAID["base64"] if "contentEncoding" in schema else ""]
    if description := schema.get("description"):
        said.append(quote(description, most=MOST_DESCRIPTION))
    if "items" in schema:
        told["items"] = _publish(schema["items"], depth - 1)
    if fields and depth > 0:
        told["properties"] = {name: _publish(each, depth - 1) for name, each in fields.items()}
        if required := [name for name, each in fields.items() if each.get("required")]:
            told["required"] = required
    elif fields:
        said.append(f"fields: {', '.join(list(fields)[:MOST_NAMED])}")
    words = "; ".join(filter(None, said))
    return told | ({"description": words} if words else {})
