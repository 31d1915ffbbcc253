"""Agents: their assignment, how they end, and the client by which they call tools.

A witness takes note of every call and its answer.
"""

import base64
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from mcp.client import Client
from mcp_types import CallToolResult, ImageContent, TextContent, Tool

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.evaluation.trials import Limits, TokenCounts, ToolCall, TrialState, Turn


class OutOfBudgetError(MapspeakError):
    """A call would have exceeded the limits; the code that set the limits catches this."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture in a tool's answer."""

    data: bytes
    media_type: str

    @property
    def suffix(self) -> str:
        """The file name's ending."""
        return ".jpg" if self.media_type == "image/jpeg" else ".png"


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolAnswer:
    """Answer of a tool.

    Attributes:
        report: The structured part; empty without one.
        is_error: The tool failed; the text says why.
    """

    text: str
    pictures: tuple[Picture, ...] = ()
    report: dict[str, Any] = field(default_factory=dict)
    is_error: bool = False


class Witness:
    """Is told of the conversation, and may refuse a call; this one refuses nothing."""

    def hear(self, turn: Turn, pictures: tuple[Picture, ...] = ()) -> None:
        """Take note of a text, a call (before it is made) or an answer (with its pictures).

        Raises:
            OutOfBudgetError: The call must not be made.
        """

    def hear_call(self, tool: str, arguments: dict[str, Any]) -> None:
        """Take note of a call before it is made.

        Raises:
            OutOfBudgetError: It must not be made.
        """
        self.hear(Turn(role="agent", call=ToolCall(tool=tool, arguments=arguments)))

    def hear_answer(self, tool: str, answer: ToolAnswer) -> None:
        """Take note of an answer."""
        call = ToolCall(tool=tool, arguments={})
        turn = Turn(role="tool", text=answer.text, call=call, is_error=answer.is_error)
        self.hear(turn, answer.pictures)


@dataclass(frozen=True, slots=True)
class ToolClient:
    """Calls tools over MCP.

    Attributes:
        client: The connected MCP client; None where the agent reaches the server by itself.
    """

    client: Client | None
    witness: Witness = field(default_factory=Witness)

    async def call(self, tool: str, /, **arguments: object) -> ToolAnswer:
        """Call a tool and return its answer, even if that is an error.

        Raises:
            LinkError: There is no client.
            OutOfBudgetError: The witness refuses it.
        """
        client = self._connected()
        self.witness.hear_call(tool, arguments)
        answer = _read(await client.call_tool(tool, arguments))
        self.witness.hear_answer(tool, answer)
        return answer

    async def demand(self, tool: str, /, **arguments: object) -> ToolAnswer:
        """Call a tool that has to succeed.

        Raises:
            LinkError: It did not; its text says why.
        """
        answer = await self.call(tool, **arguments)
        if answer.is_error:
            raise LinkError(f"{tool} failed: {answer.text}", hint="See the calls before it.")
        return answer

    async def list_tools(self) -> list[Tool]:
        """Return the tools as the server describes them to any model.

        Raises:
            LinkError: There is no client.
        """
        return (await self._connected().list_tools()).tools

    def _connected(self) -> Client:
        if self.client is None:
            raise LinkError("No client is connected.", hint="Call through the agent's own program.")
        return self.client


def _read(result: CallToolResult) -> ToolAnswer:
    pictures = [
        Picture(base64.b64decode(part.data), part.mime_type)
        for part in result.content
        if isinstance(part, ImageContent)
    ]
    return ToolAnswer(
        text="\n".join(part.text for part in result.content if isinstance(part, TextContent)),
        pictures=tuple(pictures),
        report=dict(result.structured_content or {}),
        is_error=bool(result.is_error),
    )


class ServerAccess(StrEnum):
    """Connection of an agent to the robot's server."""

    MEMORY = "memory"
    """In the trial's own process: for scripts, which need no pipe."""
    STDIO = "stdio"
    """Over stdio to `mapspeak serve` in a process of its own, as any client does."""
    COMMAND = "command"
    """The agent starts `Assignment.server` itself, through a program of its own; its `ToolClient`
    has no client, and its calls are counted from the server's audit log."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """Assignment of an agent.

    Attributes:
        system: The server's instructions and the guidance of the task.
        server: The command line of its server, for agents that start it themselves.
        folder: The trial's folder; an agent may keep files there.
    """

    prompt: str
    system: str
    limits: Limits
    seed: int
    server: tuple[str, ...]
    folder: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentEnd(TokenCounts):
    """End of an agent: finished, gave_up or out_of_budget.

    Attributes:
        n_decisions: Model turns; None counts the calls.
    """

    answer: str
    state: TrialState = TrialState.FINISHED
    n_decisions: int | None = None


def gave_up(why: str) -> AgentEnd:
    """Return the end of an agent that cannot go on."""
    return AgentEnd(answer=why, state=TrialState.GAVE_UP)


Work = Callable[[Assignment, ToolClient], Awaitable[AgentEnd]]


@dataclass(frozen=True, slots=True)
class Agent:
    """A script, a model or a client program.

    Attributes:
        work: Carries out an assignment by calling tools; it lets an OutOfBudgetError pass through.
        connection: How it reaches the server: scripts read what tools answer, and need no pipe.
    """

    name: str
    work: Work
    connection: ServerAccess = ServerAccess.MEMORY
