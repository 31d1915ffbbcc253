"""A tool as mapspeak declares it: a function, its effect on the world, and a lean schema."""

import inspect
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from mcp_types import ToolAnnotations
from pydantic import RootModel

from mapspeak.server.text.offered import lead

MARK = "mapspeak_tool"


class ToolEffect(StrEnum):
    """What calling a tool changes."""

    READS = "reads"
    REMEMBERS = "remembers"
    STOPS = "stops"
    MOVES = "moves"


@dataclass(frozen=True, kw_only=True)
class Tool:
    """One tool of the MCP surface.

    Attributes:
        function: The coroutine function; its docstring is the tool's description.
        title: Its name for people in a list.
        effect: Its effect.
        has_report: It answers with a pydantic report; else with text and pictures.
        is_entry: A model should see it at once, even where clients search for tools.
        leads: Sentences about other tools, which follow the description where these are offered.
        former: The names that its arguments had before, which are taken too, with today's.
    """

    function: Callable[..., Awaitable[Any]]
    title: str
    effect: ToolEffect
    has_report: bool = False
    is_entry: bool = False
    leads: str = ""
    former: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Its name for clients."""
        return self.function.__name__

    @cached_property
    def arguments(self) -> frozenset[str]:
        """The names of its arguments."""
        return frozenset(inspect.signature(self.function).parameters) - {"context"}

    @cached_property
    def numbers(self) -> frozenset[str]:
        """The names of the arguments that are numbers."""
        hints = get_type_hints(self.function)
        return frozenset(
            name for name in self.arguments if float in (hints[name], *get_args(hints[name]))
        )

    @cached_property
    def lists(self) -> frozenset[str]:
        """The names of the arguments that are lists."""
        hints = get_type_hints(self.function)
        return frozenset(
            name
            for name in self.arguments
            if any(map(_is_list, (hints[name], *get_args(hints[name]))))
        )

    @property
    def description(self) -> str:
        """Its description for a model: the docstring, one line for each paragraph, and the leads.

        A sentence that leads to a tool, as "Ask {find_place} first.", is there where that is
        offered.
        """
        paragraphs = inspect.cleandoc(self.function.__doc__ or "").split("\n\n")
        lines = [lead(" ".join(paragraph.split())) for paragraph in paragraphs]
        return "\n".join(filter(None, [*lines, lead(self.leads)]))

    @property
    def annotations(self) -> ToolAnnotations:
        """The hints of the MCP specification where they are not what it takes for granted."""
        if self.effect is ToolEffect.READS:
            return ToolAnnotations(read_only_hint=True)
        if self.effect is ToolEffect.MOVES:
            return ToolAnnotations(open_world_hint=False)
        return ToolAnnotations(destructive_hint=False, idempotent_hint=True, open_world_hint=False)

    @property
    def meta(self) -> dict[str, Any] | None:
        """Client-specific hints."""
        return {"anthropic/alwaysLoad": True} if self.is_entry else None


def _is_list(kind: object) -> bool:
    is_model = isinstance(kind, type) and issubclass(kind, RootModel)
    return is_model or get_origin(kind) is list


T = TypeVar("T", bound=Callable[..., Awaitable[Any]])


def tool(
    title: str,
    effect: ToolEffect,
    *,
    has_report: bool = False,
    is_entry: bool = False,
    leads: str = "",
    former: Mapping[str, str] | None = None,
) -> Callable[[T], T]:
    """Make a method a tool of its class; the arguments are those of `Tool`."""

    def mark(method: T) -> T:
        declared = Tool(
            function=method,
            title=title,
            effect=effect,
            has_report=has_report,
            is_entry=is_entry,
            leads=leads,
            former=former or {},
        )
        setattr(method, MARK, declared)
        return method

    return mark


def tools_of(*owners: object) -> list[Tool]:
    """Return the tools of some objects, in the order in which their classes define them."""
    return [
        replace(member.mapspeak_tool, function=getattr(owner, name))
        for owner in owners
        for name, member in vars(type(owner)).items()
        if hasattr(member, MARK)
    ]


Schema = Any
"""JSON of any shape."""

REF = "#/$defs/"
CHECKED = ("title", "minLength", "maxLength", "maxItems", "additionalProperties")
"""Keys of a schema that a model need not read: a call that violates them gets an error."""


def lean_input(schema: Schema) -> Schema:
    """Return the schema of a tool's arguments: an optional one need not be null as well."""
    lean = _rewrite(_rewrite(_flatten(schema), _without(CHECKED)), _short_optional)
    return {**lean, "properties": _tell_items_once(lean.get("properties", {}))}


def lean_output(schema: Schema) -> Schema:
    """Return the schema of a report: its fields by name, for names carry units and kinds."""
    return schema and {"type": "object", "properties": {name: {} for name in schema["properties"]}}


def _tell_items_once(properties: dict[str, Schema]) -> dict[str, Schema]:
    """Refer a list of objects like those of an argument before it to that argument."""
    told: dict[str, Schema] = {}
    for name, part in properties.items():
        same = next((before for before in told if _is_same_list(told[before], part)), None)
        if same is not None:
            what = filter(None, [part.get("description"), f"items as in {same}"])
            told[name] = {**part, "items": {}, "description": "; ".join(what)}
        else:
            told[name] = part
    return told


def _is_same_list(one: Schema, other: Schema) -> bool:
    """Return True for two lists with the same items, of which there is more to say than a type."""
    items = one.get("items", {})
    return bool(items == other.get("items")) and "anyOf" in items


def _flatten(schema: Schema) -> Schema:
    """Put every definition where it is used: some clients read none. Ours never hold themselves."""
    definitions = schema.get("$defs", {})

    def place(part: dict[str, Schema]) -> dict[str, Schema]:
        if "$ref" not in part:
            return part
        # The description of a class adds nothing for a model to that of its field.
        named = _without(("description",))(definitions[part["$ref"].removeprefix(REF)])
        return place({**named, **_without(("$ref",))(part)})

    return _rewrite(_without(("$defs",))(schema), place)


def _rewrite(schema: Schema, change: Callable[[dict[str, Schema]], dict[str, Schema]]) -> Schema:
    """Change every schema within a schema; names of properties are no keywords."""
    if isinstance(schema, list):
        return [_rewrite(item, change) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        key: {name: _rewrite(part, change) for name, part in value.items()}
        if key == "properties"
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
