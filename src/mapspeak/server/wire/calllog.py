"""The call log: every call and its answer as a JSON line, pictures beside it.

The audit log holds commands; this one also holds calls that only read, for replay and for scoring
clients that keep no log of their own.
"""

import base64
import itertools
import json
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from copy import copy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from mcp_types import CallToolResult, ImageContent, TextContent

SUFFIXES = {"image/jpeg": ".jpg"}


@dataclass(slots=True)
class CallNote:
    """The notes of one call while it goes on.

    Attributes:
        answer: The result; None where the tool refused.
        error: The error of its refusal.
    """

    answer: CallToolResult | None = None
    error: str = ""


class CallNoting(Protocol):
    """Logs calls."""

    def noting(self, tool: str, arguments: dict[str, Any]) -> AbstractContextManager[CallNote]:
        """Note a call when it has come to its end, however that is."""
        ...


@dataclass(slots=True)
class CallLog:
    """Writes one file; a call's line is there before its answer leaves the server.

    A line has: number, robot, tool, arguments, text, is_error, report, pictures (file names in the
    folder that is called as the file is, without its ending) and wall_s.

    Attributes:
        path: The file; its folder is made, and what it held is lost.
        robot: Whose calls are noted; "" for an only one.
    """

    path: Path
    robot: str = ""
    _numbers: Iterator[int] = field(default_factory=lambda: itertools.count(1), init=False)

    def __post_init__(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.write_bytes(b"")

    def of(self, robot: str) -> "CallLog":
        """Return the same log for the calls of one robot, whose lines name it."""
        own = copy(self)
        own.robot = robot
        return own

    @property
    def pictures(self) -> Path:
        """The folder of pictures."""
        return self.path.with_suffix("")

    @contextmanager
    def noting(self, tool: str, arguments: dict[str, Any]) -> Iterator[CallNote]:
        """Note a call when it has come to its end, however that is."""
        note, begun_s = CallNote(error="It came to no answer."), time.monotonic()
        number = next(self._numbers)
        try:
            yield note
        finally:
            line = {
                "number": number,
                "robot": self.robot,
                "tool": tool,
                "arguments": arguments,
                **self._read(note, number),
                "wall_s": round(time.monotonic() - begun_s, 3),
            }
            # Half a sign of UTF-16 is written as in JSON.
            with self.path.open("a", encoding="utf-8", errors="backslashreplace") as file:
                file.write(json.dumps(line, ensure_ascii=False, default=str) + "\n")

    def _read(self, note: CallNote, number: int) -> dict[str, Any]:
        answer = note.answer
        if answer is None:
            return {"text": note.error, "is_error": True, "report": {}, "pictures": []}
        texts = [part.text for part in answer.content if isinstance(part, TextContent)]
        pictures = [part for part in answer.content if isinstance(part, ImageContent)]
        return {
            "text": "\n".join(texts),
            "is_error": bool(answer.is_error),
            "report": answer.structured_content or {},
            "pictures": [self._keep(part, number, n) for n, part in enumerate(pictures)],
        }

    def _keep(self, picture: ImageContent, number: int, n: int) -> str:
        self.pictures.mkdir(exist_ok=True)
        name = f"{number:04d}-{n}{SUFFIXES.get(picture.mime_type, '.png')}"
        (self.pictures / name).write_bytes(base64.b64decode(picture.data))
        return name
