"""The last that is done to an answer: remarks are added, and it is made short and harmless.

Remarks tell of the earlier memory, and of ids that mean something else by now.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any

from mcp_types import CallToolResult, TextContent

from mapspeak.errors import SemanticMapError
from mapspeak.memory import SemanticMap
from mapspeak.places.naming import REGION_ID, find_renamed
from mapspeak.server.text.memory import say_loaded
from mapspeak.server.text.wording import say_renamed, show_controls
from mapspeak.server.tools.caller import LONGEST_WAIT_S, shorten_wait
from mapspeak.session import Session

CUT = f"wait_s was cut to {LONGEST_WAIT_S:g}, the most that one call waits: call again to go on."


class Remarks:
    """Remarks that each client gets unasked.

    Args:
        session: The session with the memory.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._found: dict[str, SemanticMap | None] = {}

    async def meet(self, client: str) -> None:
        """Note the memory before the first call of a client."""
        if client not in self._found:
            try:
                found = await self._session.compute(self._session.memory.read)
            except SemanticMapError:
                # The tools report its faults.
                found = None
            # Another first call of the client may have been answered meanwhile.
            self._found.setdefault(client, found)

    async def tell(
        self, client: str, arguments: Mapping[str, Any], answer: CallToolResult
    ) -> CallToolResult:
        """Add the new meanings of named ids, the memory found at first contact, and a cut wait."""
        answer = await self._tell_found(client, answer)
        wait_s = arguments.get("wait_s")
        if wait_s != shorten_wait(wait_s):
            cut = TextContent(type="text", text=CUT)
            answer = answer.model_copy(update={"content": [*answer.content, cut]})
        renamed = await self.say_renamed(arguments)
        if not renamed:
            return answer
        line = TextContent(type="text", text=renamed)
        return answer.model_copy(update={"content": [line, *answer.content]})

    async def say_renamed(self, arguments: Mapping[str, Any]) -> str:
        """Say which regions that arguments name are called otherwise now; empty where none is."""
        world, words = self._session.world, " ".join(_list_texts(arguments))
        if world is None or not REGION_ID.search(words):
            return ""
        return say_renamed(await self._session.compute(lambda: find_renamed(world, words)))

    async def _tell_found(self, client: str, answer: CallToolResult) -> CallToolResult:
        """Add to the first answer that knows the map what was found; before a text, after data."""
        memory, found = self._session.memory, self._found.get(client)
        if found is None or not memory.keeper.has_met:
            return answer
        self._found[client] = None
        now = self._session.find_wall_time()
        placed = await self._session.compute(memory.read)
        robot = self._session.robot.description.name
        said = say_loaded(found, placed, robot=robot, now=now)
        if not said:
            return answer
        line = TextContent(type="text", text=said)
        is_data = isinstance(answer.structured_content, Mapping)
        content = [*answer.content, line] if is_data else [line, *answer.content]
        return answer.model_copy(update={"content": content})


def _list_texts(value: object) -> Iterator[str]:
    """Return all texts of arguments, keys too."""
    match value:
        case str():
            yield value
        case Mapping():
            for key, each in value.items():
                yield str(key)
                yield from _list_texts(each)
        case list():
            for each in value:
                yield from _list_texts(each)


def shorten_report(answer: CallToolResult) -> CallToolResult:
    """Return an answer whose report is one line of text, without what is empty in it."""
    report = answer.structured_content
    content = [
        part.model_copy(update={"text": _say_report(report)})
        if isinstance(part, TextContent) and report and part.text.startswith("{")
        else part
        for part in answer.content
    ]
    return answer.model_copy(update={"content": content})


def _say_report(report: Any) -> str:  # noqa: ANN401 - JSON of any shape
    return json.dumps(_without_empty(report), ensure_ascii=False, separators=(",", ":"))


def _without_empty(value: Any) -> Any:  # noqa: ANN401 - JSON of any shape
    match value:
        case Mapping():
            kept = {key: _without_empty(each) for key, each in value.items()}
            return {key: each for key, each in kept.items() if each not in (None, "", [], {})}
        case list():
            return [_without_empty(each) for each in value]
        case _:
            return value


def show_controls_of(answer: CallToolResult) -> CallToolResult:
    """Return an answer with every control sign in it as it is written in JSON."""
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
