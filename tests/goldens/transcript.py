"""Calls through an in-memory client, and everything that they answered, as text."""

import base64
import hashlib
import io
import json
import re
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from mcp.client import Client
from mcp_types import CallToolResult, ImageContent
from PIL import Image

from goldens.claims import CLAIMS
from goldens.statements import CHECKS, Statements
from guarding import audit_of, make_guard
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import Robot
from mapspeak.ros.port import RosConnection
from mapspeak.safety import Policy
from mapspeak.server.app import build_server
from mapspeak.session import Session
from served import pictures_of, text_of

IDS = re.compile(r"\b[RCODFWTE]\d+\b")
SECONDS = re.compile(r"\b\d+(?:\.\d+)?(?= s\b)")
DIGEST = re.compile(r"(?<=\bo)[0-9a-f]{12}\b|(?<=Z-)[0-9a-f]{12}(?=\.jpg)")
"""Of an observation or a camera's picture: from all digits of a pose, which the processor sways."""
EVERYTHING = ("look", "places", "drive", "explore", "routes", "paper", "memory")


class Transcript:
    """Calls tools, and keeps each call with its answer.

    Args:
        client: Connected to the server.
        statements: Check what is answered; None to believe it.
        is_paced: Time passes by the wall clock: durations are left out of what is kept.
    """

    def __init__(
        self, client: Client, statements: Statements | None = None, *, is_paced: bool = False
    ) -> None:
        self.entries: list[str] = []
        self._client = client
        self._statements = statements
        self._is_paced = is_paced

    async def call(self, tool: str, /, **arguments: Any) -> str:  # noqa: ANN401
        """Call a tool; return its text."""
        result = await self._client.call_tool(tool, arguments)
        said = "! " if result.is_error else ""
        head = f"[{len(self.entries) + 1}] {tool} {_compact(arguments)}"
        body = [said + text_of(result), *_structure(result), *map(_digest, pictures_of(result))]
        entry = "\n".join([head, *(part for part in body if part)])
        self.entries.append(SECONDS.sub("#", entry) if self._is_paced else entry)
        if self._statements is not None:
            number = len(self.entries)
            self._statements.check(number, tool, said + text_of(result), result.structured_content)
        return text_of(result)

    def note(self, title: str, lines: list[str]) -> None:
        """Keep something that no tool answered."""
        self.entries.append("\n".join([f"== {title}", *lines]))

    @property
    def text(self) -> str:
        """All of it, one call after the other; digests are numbered."""
        text = "\n\n".join(self.entries) + "\n"
        digests = list(dict.fromkeys(DIGEST.findall(text)))
        return DIGEST.sub(lambda found: f"{digests.index(found[0]) + 1}", text)


@asynccontextmanager
async def playing(
    robot: Robot,
    folder: Path,
    *,
    toolsets: tuple[str, ...] = EVERYTHING,
    policy: Policy | None = None,
    ros: RosConnection | None = None,
    is_paced: bool = False,
) -> AsyncGenerator[Transcript]:
    """Offer the transcript of a client of a server over that robot; the audit log ends it."""
    memory = SemanticMapStore(folder / "memory.yaml", map_id=robot.description.map_name)
    guard = make_guard(folder, policy)
    session = Session(robot, memory, lease_s=60.0, guard=guard, ros=ros, find_model=lambda: None)
    server = build_server(session, toolsets=toolsets)
    async with Client(server) as client:
        statements = None if is_paced else Statements(session, (CHECKS, CLAIMS))
        transcript = Transcript(client, statements, is_paced=is_paced)
        yield transcript
    if statements is not None:
        transcript.note("statements", statements.say())
    lines = [
        " ".join(_compact(getattr(line, name, "")) for name in ("event", "tool", "verdict", "said"))
        for line in audit_of(folder)
    ]
    transcript.note("audit", [SECONDS.sub("#", line) if is_paced else line for line in lines])


def ids_in(text: str, letters: str) -> list[str]:
    """Return the ids of some kinds that a text names, in their order."""
    found = dict.fromkeys(match[0] for match in IDS.finditer(text))
    return sorted((each for each in found if each[0] in letters), key=_order)


def _order(place_id: str) -> tuple[str, int]:
    return place_id[0], int(place_id[1:])


def _structure(result: CallToolResult) -> list[str]:
    """Return the structured answer where the text does not already say all of it."""
    structured = result.structured_content
    if structured is None or structured == {"result": text_of(result)}:
        return []
    try:
        if json.loads(text_of(result)) == structured:
            return []
    except ValueError:
        pass
    return [f"= {_compact(structured)}"]


def _digest(picture: ImageContent) -> str:
    image = Image.open(io.BytesIO(base64.b64decode(picture.data)))
    size = f"picture {picture.mime_type} {image.width}x{image.height}"
    if picture.mime_type == "image/jpeg":
        # A camera's: the last digits of its pose, and so of its pixels, depend on the processor.
        return size
    return f"{size} {hashlib.sha256(image.convert('RGB').tobytes()).hexdigest()[:16]}"


def _compact(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), default=str)
