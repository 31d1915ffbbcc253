"""The calls of clients as a page shows them: arguments, answers and pictures, the latest few."""

import base64
import itertools
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

from mcp_types import ImageContent, TextContent

from mapspeak.server.view.document import CallView
from mapspeak.server.wire.calllog import CallNote, CallNoting

MOST_CALLS = 100
MOST_WITH_PICTURES = 30
"""Calls whose pictures are kept, whether or not a page is open."""
MOST_CHARACTERS = 20_000
"""Of one text; the rest is told to be cut."""
MOST_OF_ARGUMENT = 2_000
MOST_KEPT = 200_000
"""Characters of all calls together: a page is told all of them whenever it comes back."""


class CallFeed:
    """Tells pages of calls while they are noted in a log, if there is one.

    Args:
        log: The call log, which also gets every call.
    """

    def __init__(self, log: CallNoting | None = None) -> None:
        self._log = log
        self._numbers = itertools.count(1)
        self._calls: dict[int, CallView] = {}
        self._begun_s: dict[int, float] = {}
        self._n_characters: dict[int, int] = {}
        self._pictures: dict[int, list[ImageContent]] = {}
        self.tell: Callable[[CallView], None] = lambda _: None

    @property
    def calls(self) -> tuple[CallView, ...]:
        """The latest calls, the oldest first, with their present ages."""
        return tuple(map(self._date, self._calls.values()))

    def _date(self, call: CallView) -> CallView:
        age_s = round(time.monotonic() - self._begun_s[call.number], 1)
        return call.model_copy(update={"age_s": age_s})

    def find_picture(self, number: int, index: int) -> tuple[bytes, str] | None:
        """Return a picture of a call and its media type; None where it is no longer kept."""
        pictures = self._pictures.get(number, ())
        if not 0 <= index < len(pictures):
            return None
        return base64.b64decode(pictures[index].data), pictures[index].mime_type

    @contextmanager
    def noting(self, tool: str, arguments: dict[str, Any]) -> Iterator[CallNote]:
        """Note a call, when it begins and when it has come to its end."""
        number = next(self._numbers)
        shown = {_cut(name, MOST_OF_ARGUMENT): _shorten(value) for name, value in arguments.items()}
        begun = CallView(number=number, tool=tool, arguments=shown, is_over=False)
        self._begun_s[number] = time.monotonic()
        self._keep(begun)
        own = nullcontext(CallNote(error="It came to no answer."))
        with self._log.noting(tool, arguments) if self._log else own as note:
            try:
                yield note
            finally:
                self._keep(self._end(begun, note))

    def _end(self, begun: CallView, note: CallNote) -> CallView:
        answer, took_s = note.answer, round(time.monotonic() - self._begun_s[begun.number], 1)
        if answer is None:
            ended = {"is_over": True, "is_error": True, "text": _cut(note.error), "took_s": took_s}
            return begun.model_copy(update=ended)
        pictures = [part for part in answer.content if isinstance(part, ImageContent)]
        texts = [part.text for part in answer.content if isinstance(part, TextContent)]
        if pictures:
            self._pictures[begun.number] = pictures
            for number in list(self._pictures)[:-MOST_WITH_PICTURES]:
                del self._pictures[number]
        return begun.model_copy(
            update={
                "is_over": True,
                "is_error": bool(answer.is_error),
                "took_s": took_s,
                "text": _cut("\n".join(texts)),
                "pictures": tuple(
                    f"calls/{begun.number}/{index}" for index in range(len(pictures))
                ),
            }
        )

    def _keep(self, call: CallView) -> None:
        self._calls[call.number] = call
        self._n_characters[call.number] = len(call.model_dump_json())
        while len(self._calls) > MOST_CALLS or (
            len(self._calls) > 1 and sum(self._n_characters.values()) > MOST_KEPT
        ):
            oldest = next(iter(self._calls))
            del self._calls[oldest], self._n_characters[oldest], self._begun_s[oldest]
            self._pictures.pop(oldest, None)
        self.tell(self._date(call))


def _cut(text: str, most: int = MOST_CHARACTERS) -> str:
    if len(text) <= most:
        return text
    return f"{text[:most]}\n... {len(text) - most} characters more"


def _shorten(value: object) -> object:
    text = json.dumps(value, default=str)
    return value if len(text) <= MOST_OF_ARGUMENT else _cut(text, MOST_OF_ARGUMENT)
