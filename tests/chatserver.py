"""A local server that speaks OpenAI's chat protocol and answers by the mock model's script.

It checks what it is sent as a strict provider would: every answer belongs to a call, tools have
names and schemas, pictures are PNG or JPEG in a data URL.
"""

import base64
import json
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from mapspeak.evaluation.agents.models.mock import decide

DATA_URL = re.compile(r"data:image/(png|jpeg);base64,(.+)", re.DOTALL)
MAGIC = {"png": b"\x89PNG", "jpeg": b"\xff\xd8"}


@dataclass(slots=True)
class ChatServer:
    """What the server was asked.

    Attributes:
        url: Its address, with the version.
        requests: Every request's body, in their order.
        n_pictures: How many pictures each of them held.
    """

    url: str
    requests: list[dict[str, Any]] = field(default_factory=list)
    n_pictures: list[int] = field(default_factory=list)

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """Gives the answer to one request."""
        messages = request["messages"]
        _check_calls(messages)
        assert all(tool["function"]["parameters"]["type"] == "object" for tool in request["tools"])
        self.requests.append(request)
        self.n_pictures.append(sum(map(_count_pictures, messages)))
        heard = [_text_of(message) for message in messages if message["role"] == "tool"]
        move = decide(
            request.get("seed", 0),
            prompt=next(_text_of(each) for each in messages if each["role"] == "user"),
            heard=heard,
            tools=[tool["function"]["name"] for tool in request["tools"]],
        )
        said: dict[str, Any] = {"role": "assistant", "content": move.text}
        if move.tool is not None:
            called = {"name": move.tool, "arguments": json.dumps(move.arguments)}
            said["tool_calls"] = [{"id": f"c{len(heard)}", "type": "function", "function": called}]
        return {
            "id": f"chat-{len(self.requests)}",
            "object": "chat.completion",
            "created": 0,
            "model": request["model"],
            "choices": [
                {
                    "index": 0,
                    "message": said,
                    "finish_reason": "stop" if move.tool is None else "tool_calls",
                }
            ],
            "usage": {"prompt_tokens": 100, "completion_tokens": 10, "total_tokens": 110},
        }


@contextmanager
def serve_chat() -> Iterator[ChatServer]:
    """Gives a server on a port of its own."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            data = json.dumps(chat.answer(json.loads(body))).encode()
            self.send_response(200 if self.path.endswith("/chat/completions") else 404)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        def log_message(self, *_words: object) -> None:
            """Says nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    chat = ChatServer(f"http://127.0.0.1:{server.server_port}/v1")
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield chat
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def _check_calls(messages: list[dict[str, Any]]) -> None:
    called = {call["id"] for message in messages for call in message.get("tool_calls") or ()}
    answered = [each["tool_call_id"] for each in messages if each["role"] == "tool"]
    assert set(answered) == called
    assert len(answered) == len(called)


def _parts(message: dict[str, Any]) -> list[dict[str, Any]]:
    content = message.get("content") or ""
    return [{"type": "text", "text": content}] if isinstance(content, str) else content


def _text_of(message: dict[str, Any]) -> str:
    return "".join(part.get("text", "") for part in _parts(message))


def _count_pictures(message: dict[str, Any]) -> int:
    urls = [part["image_url"]["url"] for part in _parts(message) if part["type"] == "image_url"]
    for url in urls:
        match = DATA_URL.fullmatch(url)
        assert match is not None
        assert base64.b64decode(match[2]).startswith(MAGIC[match[1]])
    return len(urls)
