"""A tool as mapspeak declares it: a function, what it does to the world, how it is found."""

import inspect
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, get_args, get_type_hints

from mcp_types import ToolAnnotations


class Effect(StrEnum):
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
    effect: Effect
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
        if self.effect is Effect.READS:
            return ToolAnnotations(read_only_hint=True)
        return ToolAnnotations(
            read_only_hint=False,
            destructive_hint=self.effect is Effect.MOVES,
            idempotent_hint=self.effect is not Effect.MOVES,
            open_world_hint=False,
        )

    @property
    def meta(self) -> dict[str, Any] | None:
        """Client-specific hints."""
        return {"anthropic/alwaysLoad": True} if self.is_entry else None
