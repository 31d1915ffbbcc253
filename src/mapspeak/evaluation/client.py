"""An MCP client of a trial: every call goes past a witness, who hears the answer too."""

import base64
from dataclasses import dataclass, field
from typing import Any

from mcp.client import Client
from mcp_types import CallToolResult, ImageContent, TextContent, Tool

from mapspeak.errors import LinkError, MapspeakError


class OutOfBudgetError(MapspeakError):
    """A call would have gone beyond what was allowed; whoever gave the limits catches it."""


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
    """What a tool answered.

    Attributes:
        report: The structured part; empty where there is none.
        is_error: The tool could not do what was asked; the text says why.
    """

    text: str
    pictures: tuple[Picture, ...]
    report: dict[str, Any]
    is_error: bool


class Witness:
    """Hears every call, and may refuse one; this one hears nothing and refuses nothing."""

    def hear_call(self, tool: str, arguments: dict[str, Any]) -> None:
        """Hear of a call before it is made.

        Raises:
            OutOfBudgetError: It must not be made.
        """

    def hear_answer(self, tool: str, answer: ToolAnswer) -> None:
        """Hear what was answered."""

    def hear_words(
        self,
        role: str,
        text: str,
        *,
        n_input_tokens: int | None = None,
        n_output_tokens: int | None = None,
        n_picture_tokens: int | None = None,
    ) -> None:
        """Hear what was said besides calls: role is "system", "user" or "agent"."""


@dataclass(frozen=True, slots=True)
class ToolClient:
    """Calls tools over MCP.

    Attributes:
        client: The connected MCP client; None where the agent reaches the server by itself.
    """

    client: Client | None
    witness: Witness = field(default_factory=Witness)

    async def call(self, tool: str, /, **arguments: object) -> ToolAnswer:
        """Call a tool and return its answer, also when that is an error.

        Raises:
            LinkError: There is no client.
            OutOfBudgetError: The witness does not let it be made.
        """
        client = self._connected()
        self.witness.hear_call(tool, arguments)
        answer = _read(await client.call_tool(tool, arguments))
        self.witness.hear_answer(tool, answer)
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

    async def demand(self, tool: str, /, **arguments: object) -> ToolAnswer:
        """Call a tool that has to succeed.

        Raises:
            LinkError: It did not; its text says why.
        """
        answer = await self.call(tool, **arguments)
        if answer.is_error:
            raise LinkError(f"{tool} failed: {answer.text}", hint="See the calls before it.")
        return answer


def _read(result: CallToolResult) -> ToolAnswer:
    texts = [part.text for part in result.content if isinstance(part, TextContent)]
    pictures = [
        Picture(base64.b64decode(part.data), part.mime_type)
        for part in result.content
        if isinstance(part, ImageContent)
    ]
    return ToolAnswer(
        text="\n".join(texts),
        pictures=tuple(pictures),
        report=dict(result.structured_content or {}),
        is_error=bool(result.is_error),
    )
