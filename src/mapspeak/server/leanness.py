"""Schemas freed of what no model needs: every byte of a tool list is paid for in each conversation.

What is left out is checked all the same when a tool is called.
"""

import json
from collections.abc import Callable
from typing import Any

Schema = Any
"""JSON of any shape."""

REF = "#/$defs/"
CHECKED = ("title", "minLength", "maxLength", "maxItems", "additionalProperties")
"""What a model reads nothing in before it has broken it, and is told of then."""


def lean_input(schema: Schema) -> Schema:
    """Gives the schema of a tool's arguments: what may be left out need not be null as well."""
    return _inline(_rewrite(_rewrite(schema, _without(CHECKED)), _short_optional))


def lean_output(schema: Schema) -> Schema:
    """Gives the schema of a report: names carry units, and every field is always there.

    What stands in a list is promised its type only: its fields have their names in every answer.
    """
    if schema is None:
        return None
    lean = _rewrite(schema, _without(("title", "description", "required", "default")))
    return _inline(_prune(_rewrite(_plain_items(lean), _short_nullable)))


def _rewrite(schema: Schema, change: Callable[[dict[str, Schema]], dict[str, Schema]]) -> Schema:
    """Changes every schema within a schema; names of properties are no keywords."""
    if isinstance(schema, list):
        return [_rewrite(item, change) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        key: {name: _rewrite(part, change) for name, part in value.items()}
        if key in ("properties", "$defs")
        else _rewrite(value, change)
        for key, value in change(schema).items()
    }


def _without(keywords: tuple[str, ...]) -> Callable[[dict[str, Schema]], dict[str, Schema]]:
    return lambda schema: {key: value for key, value in schema.items() if key not in keywords}


def _short_optional(schema: dict[str, Schema]) -> dict[str, Schema]:
    """Writes `anyOf: [number, null]` with a default of null as the number alone."""
    options = schema.get("anyOf", [])
    if len(options) != 2 or options[1] != {"type": "null"}:
        return schema
    rest = {key: value for key, value in schema.items() if key not in ("anyOf", "default")}
    return {**options[0], **rest}


def _short_nullable(schema: dict[str, Schema]) -> dict[str, Schema]:
    """Writes `anyOf: [number, null]` as `type: [number, null]`."""
    options = schema.get("anyOf", [])
    if len(options) != 2 or options[1] != {"type": "null"} or "type" not in options[0]:
        return schema
    rest = {key: value for key, value in schema.items() if key != "anyOf"}
    return {**options[0], **rest, "type": [options[0]["type"], "null"]}


def _plain_items(schema: Schema) -> Schema:
    """Writes lists of reports as lists of objects."""
    reports = {
        f"{REF}{name}"
        for name, part in schema.get("$defs", {}).items()
        if part.get("type") == "object"
    }

    def plain(part: dict[str, Schema]) -> dict[str, Schema]:
        is_of_reports = part.get("items", {}).get("$ref") in reports
        return {**part, "items": {"type": "object"}} if is_of_reports else part

    return _rewrite(schema, plain)


def _prune(schema: Schema) -> Schema:
    """Drops the definitions that nothing leads to."""
    definitions = schema.get("$defs", {})
    body = _without(("$defs",))(schema)
    used: dict[str, Schema] = {}
    left = [body]
    while left:
        text = json.dumps(left.pop())
        for name, part in definitions.items():
            if name not in used and f'"{REF}{name}"' in text:
                used[name] = part
                left.append(part)
    return {**body, "$defs": used} if used else body


def _inline(schema: Schema) -> Schema:
    """Puts definitions that are used once where they are used, and drops notes on classes."""
    if not isinstance(schema, dict) or "$defs" not in schema:
        return schema
    definitions = {
        name: {key: value for key, value in part.items() if key != "description"}
        for name, part in schema["$defs"].items()
    }
    text = json.dumps(schema)
    once = {name for name in definitions if text.count(f'"{REF}{name}"') == 1}
    rest = {name: part for name, part in definitions.items() if name not in once}
    body = {**schema, "$defs": rest} if rest else _without(("$defs",))(schema)

    def place(part: dict[str, Schema]) -> dict[str, Schema]:
        name = str(part.get("$ref", "")).removeprefix(REF)
        return {**definitions[name], **_without(("$ref",))(part)} if name in once else part

    return _rewrite(body, place)
