"""The parameters of a skill as the JSON schema of a tool, as flat and as short as they allow."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from mapspeak.memory.quoting import quote
from mapspeak.skill import ParameterKind, SkillParameter
from mapspeak.skills.arguments import WANTED
from mapspeak.skills.layout import MOST_TEXT

Schema = dict[str, Any]

MOST_SCHEMA = 4_000
"""Bytes; of a longer one the messages within lists are told by the names of their fields."""
MOST_DESCRIPTION = 160
MOST_NAMED = 12
FULL_DEPTH = 8
LARGEST_SAID = 2**16
"""Beyond it the limits of a whole number say no more than that it is one."""
TYPES = {
    ParameterKind.NUMBER: "number",
    ParameterKind.WHOLE: "integer",
    ParameterKind.TEXT: "string",
    ParameterKind.BYTES: "string",
    ParameterKind.FLAG: "boolean",
    ParameterKind.LIST: "array",
    ParameterKind.OBJECT: "object",
}


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
    schema: Schema = {"type": TYPES[parameter.kind]}
    match parameter.kind:
        case ParameterKind.LIST:
            schema |= _list(parameter, depth)
        case ParameterKind.OBJECT if depth > 0:
            schema |= _object(parameter.fields, depth - 1)
        case ParameterKind.NUMBER | ParameterKind.WHOLE:
            schema |= _limits(parameter)
        case ParameterKind.TEXT if parameter.most not in (None, MOST_TEXT):
            schema["maxLength"] = parameter.most
    if parameter.choices:
        schema["enum"] = list(parameter.choices)
    if parameter.default is not None:
        schema["default"] = parameter.default
    said = _describe(parameter, depth)
    return schema | ({"description": said} if said else {})


def _list(parameter: SkillParameter, depth: int) -> Schema:
    schema: Schema = {} if parameter.item is None else {"items": _schema(parameter.item, depth - 1)}
    if parameter.least:
        schema["minItems"] = int(parameter.least)
    if parameter.most is not None:
        schema["maxItems"] = int(parameter.most)
    return schema


def _limits(parameter: SkillParameter) -> Mapping[str, float]:
    limits = {"minimum": parameter.least, "maximum": parameter.most}
    return {
        name: limit
        for name, limit in limits.items()
        if limit is not None and abs(limit) <= LARGEST_SAID
    }


def _describe(parameter: SkillParameter, depth: int) -> str:
    """Return unit, kind and the owner's words; these are quoted, for they may say anything."""
    parts = [parameter.unit]
    if parameter.kind is ParameterKind.BYTES:
        parts.append(WANTED[ParameterKind.BYTES])
    if parameter.description:
        parts.append(quote(parameter.description, most=MOST_DESCRIPTION))
    if parameter.kind is ParameterKind.OBJECT and depth <= 0:
        names = [each.name for each in parameter.fields]
        parts.append(f"fields: {', '.join(names[:MOST_NAMED])}")
    return "; ".join(filter(None, parts))
