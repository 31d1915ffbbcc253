"""A tool as mapspeak declares it: a function, what it does to the world, a schema without waste."""

import inspect
import json
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, get_args, get_type_hints

from mcp_types import ToolAnnotations


class ToolEffect(StrEnum):
    """What calling a tool changes."""

    READS = "reads"
    REMEMBERS = "remembers"
    STOPS = "stops"
    MOVES = "moves"


@dataclass(frozen=True, slots=True, kw_only=True)
class Tool:
    """One tool of the MCP surface.

    Attributes:
        function: The coroutine function; its docstring is the tool's description.
        title: How a person reads it in a list.
        effect: What it changes.
        has_report: It answers with a pydantic report; else with text and pictures.
        is_entry: A model should see it at once, even where tools are searched for.
        former: The names that its arguments had before, which are taken too, with today's.
    """

    function: Callable[..., Awaitable[Any]]
    title: str
    effect: ToolEffect
    has_report: bool = False
    is_entry: bool = False
    former: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What a client calls it."""
        return self.function.__name__

    @property
    def arguments(self) -> frozenset[str]:
        """The names of what it takes."""
        return frozenset(inspect.signature(self.function).parameters) - {"context"}

    @property
    def numbers(self) -> frozenset[str]:
        """The names of the arguments that are numbers."""
        hints = get_type_hints(self.function)
        return frozenset(
            name for name in self.arguments if float in (hints[name], *get_args(hints[name]))
        )

    @property
    def description(self) -> str:
        """What a model reads: the docstring, a line for each of its paragraphs."""
        paragraphs = inspect.cleandoc(self.function.__doc__ or "").split("\n\n")
        return "\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)

    @property
    def annotations(self) -> ToolAnnotations:
        """The hints of the MCP specification; of a tool that reads, the others mean nothing."""
        if self.effect is ToolEffect.READS:
            return ToolAnnotations(read_only_hint=True)
        return ToolAnnotations(
            read_only_hint=False,
            destructive_hint=self.effect is ToolEffect.MOVES,
            idempotent_hint=self.effect is not ToolEffect.MOVES,
            open_world_hint=False,
        )

    @property
    def meta(self) -> dict[str, Any] | None:
        """Client-specific hints."""
        return {"anthropic/alwaysLoad": True} if self.is_entry else None


Schema = Any
"""JSON of any shape."""

REF = "#/$defs/"
CHECKED = ("title", "minLength", "maxLength", "maxItems", "additionalProperties")
"""What a model reads nothing in before it has broken it, and is told of then."""


def lean_input(schema: Schema) -> Schema:
    """Return the schema of a tool's arguments: what may be left out need not be null as well."""
    return _inline(_rewrite(_rewrite(schema, _without(CHECKED)), _short_optional))


def lean_output(schema: Schema) -> Schema:
    """Return the schema of a report: names carry units, and every field is always there.

    What stands in a list is promised its type only: its fields have their names in every answer.
    """
    if schema is None:
        return None
    lean = _rewrite(schema, _without(("title", "description", "required", "default")))
    return _inline(_prune(_rewrite(_plain_items(lean), _short_nullable)))


def _rewrite(schema: Schema, change: Callable[[dict[str, Schema]], dict[str, Schema]]) -> Schema:
    """Change every schema within a schema; names of properties are no keywords."""
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
    """Write `anyOf: [number, null]` with a default of null as the number alone."""
    options = schema.get("anyOf", [])
    if len(options) != 2 or options[1] != {"type": "null"}:
        return schema
    rest = {key: value for key, value in schema.items() if key not in ("anyOf", "default")}
    return {**options[0], **rest}


def _short_nullable(schema: dict[str, Schema]) -> dict[str, Schema]:
    """Write `anyOf: [number, null]` as `type: [number, null]`."""
    options = schema.get("anyOf", [])
    if len(options) != 2 or options[1] != {"type": "null"} or "type" not in options[0]:
        return schema
    rest = {key: value for key, value in schema.items() if key != "anyOf"}
    return {**options[0], **rest, "type": [options[0]["type"], "null"]}


def _plain_items(schema: Schema) -> Schema:
    """Write lists of reports as lists of objects."""
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
    """Drop the definitions that nothing leads to."""
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
    """Put definitions that are used once where they are used, and drop notes on classes."""
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
