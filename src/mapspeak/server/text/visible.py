"""Control signs made visible: what robots, maps and notes say must not act on who reads it."""

import re
from collections.abc import Mapping
from typing import Any

from mcp_types import CallToolResult, TextContent

CONTROL = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b\u200e\u200f\u2028-\u202e\u2060-\u2069\ufeff]"
)
"""All but line feed and tabulator, and what turns the direction of reading or shows nothing."""


def show_controls(text: str) -> str:
    """Return a text with every control sign as it is written in JSON, such as u001b."""
    return CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def show_controls_of(answer: CallToolResult) -> CallToolResult:
    """Return a tool's answer likewise."""
    content = [
        part.model_copy(update={"text": show_controls(part.text)})
        if isinstance(part, TextContent)
        else part
        for part in answer.content
    ]
    structured = _show_within(answer.structured_content)
    return answer.model_copy(update={"content": content, "structured_content": structured})


def _show_within(value: Any) -> Any:  # noqa: ANN401 - JSON of any shape
    match value:
        case str():
            return show_controls(value)
        case Mapping():
            return {key: _show_within(each) for key, each in value.items()}
        case list():
            return [_show_within(each) for each in value]
        case _:
            return value
