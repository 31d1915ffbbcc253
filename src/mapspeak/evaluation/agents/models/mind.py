"""The port of models: what is said to one, and what it says and wishes to have called."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol

from mcp_types import Tool

from mapspeak.evaluation.client import ToolAnswer

__all__ = ["Ending", "Mind", "Reply", "Talk", "Thinking", "ToolCallRequest", "Usage"]


class Thinking(StrEnum):
    """How much a model may think before it answers."""

    NONE = "none"
    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolCallRequest:
    """A call that a model wants made.

    Attributes:
        id: The model's own, by which it knows the answer again.
        tool: Its name.
        arguments: What to call it with.
        mistake: Why it cannot be called as it was written; None where it can.
    """

    id: str
    tool: str
    arguments: dict[str, Any] = field(default_factory=dict)
    mistake: str | None = None


@dataclass(frozen=True, slots=True)
class Usage:
    """What one request has cost, as the model's API counts.

    Attributes:
        n_input_tokens: Read, cached ones included.
        n_output_tokens: Written, thoughts included.
    """

    n_input_tokens: int
    n_output_tokens: int


class Ending(StrEnum):
    """Why a model says no more in a reply."""

    ITS_OWN = "its own"
    """It has said what it had to say."""
    REFUSED = "refused"
    """The model, or its provider for it, does not want to answer."""
    CUT_OFF = "cut off"
    """It has written as much as it may, or has more to read than it can."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """What a model answers to all that was said.

    Attributes:
        text: In words.
        wishes: Calls that it wants made, in their order; none when it has finished.
        usage: What it has cost; None where the API does not say.
        ending: Why it ends.
    """

    text: str
    wishes: tuple[ToolCallRequest, ...] = ()
    usage: Usage | None = None
    ending: Ending = Ending.ITS_OWN


class Talk(Protocol):
    """One conversation, which keeps all that was said in it."""

    async def ask(self) -> Reply:
        """Return the model's answer to all that was said so far.

        Raises:
            LinkError: The model cannot be reached, or does not take what it was asked.
        """
        ...

    def tell(self, wish: ToolCallRequest, answer: ToolAnswer) -> None:
        """Say what a call was answered, with its pictures, or the error as an error."""
        ...


class Mind(Protocol):
    """A model that can be talked to."""

    def begin(self, *, system: str, prompt: str, tools: Sequence[Tool], seed: int) -> Talk:
        """Begin a conversation.

        Args:
            system: What it is told before.
            prompt: What it is asked.
            tools: What it may call, as the server lists it.
            seed: Of its draws, where it takes one.
        """
        ...
