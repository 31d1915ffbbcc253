"""A local server in a model provider's place: it answers by the mock model's script.

Which protocol it speaks is a `Speech`: there is one for each provider in `modelspeech`. Whatever
the protocol, it checks what it is sent as a strict provider would, says the same, costs the same,
and fails in the same ways when a test has it fail.
"""

import json
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from enum import StrEnum
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Protocol

from mapspeak.evaluation.agents.models.chat import Reply
from mapspeak.evaluation.agents.models.mock import decide

N_READ, N_CACHED, N_WRITTEN, N_THOUGHT = 100, 40, 10, 4
"""Tokens of every answer: all read, and of it from a cache; all written, and of it thoughts."""
SIGNATURE = "c2lnbmVk"
"""What a provider signs its model's thoughts with, and wants back: "signed" in base64."""


class Trouble(StrEnum):
    """What a request may come to besides an answer."""

    BUSY = "429"
    BROKEN = "500"
    REFUSED = "the model refuses to answer"
    CUT_OFF = "the answer is longer than it may be"
    SILENT = "there is no answer, ever"
    DENIED = "401"


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """What a request says, whatever the protocol.

    Attributes:
        system: What the model is told first.
        prompt: What it is asked.
        tools: What it may call.
        answers: What its calls were answered, in their order, with the errors.
        errors: For each answer, whether it is marked as an error; None where that cannot be said.
        n_pictures: How many pictures there are in it all.
        thinking: How much the model shall think, as the protocol says it; None where not said.
        seed: Of its draws.
        wants_stream: The answer is to come piece by piece.
    """

    system: str
    prompt: str
    tools: tuple[str, ...]
    answers: tuple[str, ...]
    errors: tuple[bool | None, ...]
    n_pictures: int
    thinking: Any = None
    seed: int = 0
    wants_stream: bool = False


class Speech(Protocol):
    """A provider's protocol.

    Attributes:
        model: A model's name, as `inspect-ai` knows it.
        key: The variable in which the key stands.
    """

    @property
    def model(self) -> str: ...

    @property
    def key(self) -> str: ...

    def settings(self, url: str) -> dict[str, str]:
        """Gives the variables that lead the library to the server, the key among them."""
        ...

    def read(self, path: str, request: dict[str, Any]) -> Heard:
        """Reads a request, and fails where a strict provider would refuse it."""
        ...

    def answer(self, replies: list[Reply], n_heard: int) -> dict[str, Any]:
        """Gives an answer that calls what the moves call, or says the words of the only one."""
        ...

    def stream(self, answer: dict[str, Any]) -> str:
        """Gives an answer as a stream of events."""
        ...

    def stop(self, trouble: Trouble) -> dict[str, Any]:
        """Gives the answer of a model that refuses, or that was cut off."""
        ...

    def fail(self, status: int) -> dict[str, Any]:
        """Gives the body of an error."""
        ...


@dataclass(slots=True)
class ModelServer:
    """What the server was asked.

    Attributes:
        url: Its address.
        speech: What it speaks.
        troubles: What the next requests come to, each once, before it answers properly.
        heard: Every request that was answered, in their order.
        faults: What was wrong with requests, as a strict provider sees it.
        n_asked: All requests, those that came to trouble among them.
    """

    url: str
    speech: Speech
    troubles: list[Trouble] = field(default_factory=list)
    heard: list[Heard] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    n_asked: int = 0
    is_over: threading.Event = field(default_factory=threading.Event)

    def answer(self, path: str, request: dict[str, Any]) -> tuple[int, str]:
        """Gives status and body of the answer to one request."""
        if path.endswith("/count_tokens"):
            return 200, json.dumps({"input_tokens": N_READ})
        self.n_asked += 1
        trouble = self.troubles.pop(0) if self.troubles else None
        if trouble is Trouble.SILENT:
            self.is_over.wait()
        if trouble in (Trouble.BUSY, Trouble.BROKEN, Trouble.DENIED):
            return int(trouble), json.dumps(self.speech.fail(int(trouble)))
        try:
            heard = self.speech.read(path, request)
        except (AssertionError, KeyError, TypeError, StopIteration) as error:
            self.faults.append("".join(traceback.format_exception(error)[-2:]))
            return 400, json.dumps(self.speech.fail(400))
        self.heard.append(heard)
        if trouble in (Trouble.REFUSED, Trouble.CUT_OFF):
            answer = self.speech.stop(trouble)
        else:
            answer = self.speech.answer(list(_replies(heard)), len(heard.answers))
        return 200, self.speech.stream(answer) if heard.wants_stream else json.dumps(answer)


def _replies(heard: Heard) -> Iterator[Reply]:
    """Gives what comes next; the first two calls come at once, as models call things."""
    begun = [heard.answers] if heard.answers else [(), ("",)]
    for answers in begun:
        yield decide(heard.seed, prompt=heard.prompt, heard=answers, tools=heard.tools)


@contextmanager
def serve_model(speech: Speech, *troubles: Trouble) -> Iterator[ModelServer]:
    """Gives a server on a port of its own."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            status, answer = served.answer(self.path, json.loads(body))
            data = answer.encode()
            is_stream = answer.startswith("event:")
            self.send_response(status)
            self.send_header("Content-Type", f"{_TYPES[is_stream]}; charset=utf-8")
            self.send_header("Content-Length", str(len(data)))
            if status != 200:
                # As briefly as the libraries can wait before they ask again.
                self.send_header("retry-after-ms", "1")
                self.send_header("Retry-After", "0.001")
            self.end_headers()
            with suppress(ConnectionError):  # nobody waits any more
                self.wfile.write(data)

        def log_message(self, *_words: object) -> None:
            """Says nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    served = ModelServer(f"http://127.0.0.1:{server.server_port}", speech, list(troubles))
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield served
    finally:
        served.is_over.set()
        server.shutdown()
        thread.join()
        server.server_close()


_TYPES = ("application/json", "text/event-stream")
