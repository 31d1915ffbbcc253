"""What a server in a provider's place speaks: OpenAI's protocol, Anthropic's, or Google's."""

import base64
import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from mapspeak.evaluation.agents.models.chat import Reply
from modelserver import (
    N_CACHED,
    N_READ,
    N_THOUGHT,
    N_WRITTEN,
    SIGNATURE,
    Heard,
    Speech,
    Trouble,
)

__all__ = ["SPEECHES", "AnthropicMessages", "GoogleContents", "OpenAIChat"]

MAGIC = {"image/png": b"\x89PNG", "image/jpeg": b"\xff\xd8"}
DATA_URL = re.compile(r"data:(image/(?:png|jpeg));base64,(.+)", re.DOTALL)
THOUGHT = "It is best to look first."
REFUSAL = "I would rather not."


@dataclass(frozen=True, slots=True)
class OpenAIChat:
    """OpenAI's chat completions, as local servers speak them too."""

    model: str = "openai-api/local/scripted"
    key: str = "LOCAL_API_KEY"

    def settings(self, url: str) -> dict[str, str]:
        return {"LOCAL_BASE_URL": f"{url}/v1", self.key: "none-needed"}

    def read(self, path: str, request: dict[str, Any]) -> Heard:
        assert path == "/v1/chat/completions"
        messages = request["messages"]
        called = [call["id"] for each in messages for call in each.get("tool_calls") or ()]
        told = [each for each in messages if each["role"] == "tool"]
        assert [each["tool_call_id"] for each in told] == called
        tools = [tool["function"] for tool in request["tools"]]
        assert all(tool["parameters"]["type"] == "object" for tool in tools)
        return Heard(
            system=_join(_texts(_of_role(messages, "system"))),
            prompt=next(_texts(_of_role(messages, "user"))),
            tools=tuple(tool["name"] for tool in tools),
            answers=tuple(_texts(told)),
            errors=(None,) * len(told),
            n_pictures=sum(_count_urls(each) for each in messages),
            thinking=request.get("reasoning_effort"),
            seed=request.get("seed", 0),
            wants_stream=request.get("stream", False),
        )

    def answer(self, replies: list[Reply], n_heard: int) -> dict[str, Any]:
        said: dict[str, Any] = {"role": "assistant", "content": replies[0].text}
        calls = [
            {
                "id": f"c{n_heard + number}",
                "type": "function",
                "function": {"name": call.tool, "arguments": json.dumps(call.arguments)},
            }
            for number, reply in enumerate(replies)
            for call in reply.calls
        ]
        if calls:
            said["tool_calls"] = calls
        return self._whole(said, "tool_calls" if calls else "stop")

    def stop(self, trouble: Trouble) -> dict[str, Any]:
        if trouble is Trouble.REFUSED:
            said = {"role": "assistant", "content": None, "refusal": REFUSAL}
            return self._whole(said, "content_filter")
        return self._whole({"role": "assistant", "content": "I was about to"}, "length")

    def _whole(self, said: dict[str, Any], reason: str) -> dict[str, Any]:
        return {
            "id": "chat-1",
            "object": "chat.completion",
            "created": 0,
            "model": "scripted",
            "choices": [{"index": 0, "message": said, "finish_reason": reason}],
            "usage": {
                "prompt_tokens": N_READ,
                "completion_tokens": N_WRITTEN,
                "total_tokens": N_READ + N_WRITTEN,
                "prompt_tokens_details": {"cached_tokens": N_CACHED},
                "completion_tokens_details": {"reasoning_tokens": N_THOUGHT},
            },
        }

    def stream(self, answer: dict[str, Any]) -> str:
        raise NotImplementedError

    def fail(self, status: int) -> dict[str, Any]:
        return {"error": {"message": f"trouble {status}", "type": "trouble", "code": str(status)}}


@dataclass(frozen=True, slots=True)
class AnthropicMessages:
    """Anthropic's messages."""

    model: str = "anthropic/claude-opus-4-1"
    key: str = "ANTHROPIC_API_KEY"

    def settings(self, url: str) -> dict[str, str]:
        return {"ANTHROPIC_BASE_URL": url, self.key: "none-needed"}

    def read(self, path: str, request: dict[str, Any]) -> Heard:
        assert path.partition("?")[0] == "/v1/messages"
        assert request["max_tokens"] > 0
        messages = request["messages"]
        roles = [each["role"] for each in messages]
        assert roles == ["user", "assistant"] * (len(roles) // 2) + ["user"], "they take turns"
        for said, told in zip(messages[1::2], messages[2::2], strict=True):
            called = [each["id"] for each in _of_type(said, "tool_use")]
            assert [each["tool_use_id"] for each in _of_type(told, "tool_result")] == called
        thinking = request.get("thinking")
        thoughts = [each for said in messages[1::2] for each in _of_type(said, "thinking")]
        assert all(each["signature"] == SIGNATURE for each in thoughts)
        assert thinking is None or len(thoughts) == len(messages) // 2, "thoughts are wanted back"
        assert all(tool["input_schema"]["type"] == "object" for tool in request["tools"])
        told = [each for message in messages for each in _of_type(message, "tool_result")]
        return Heard(
            system=_join(_texts([{"content": request["system"]}])),
            prompt=next(_texts(messages)),
            tools=tuple(tool["name"] for tool in request["tools"]),
            answers=tuple(_texts(told)),
            errors=tuple(each.get("is_error", False) for each in told),
            n_pictures=sum(_count_sources(each) for each in told),
            thinking=thinking,
            wants_stream=request.get("stream", False),
        )

    def answer(self, replies: list[Reply], n_heard: int) -> dict[str, Any]:
        calls = [
            {
                "type": "tool_use",
                "id": f"toolu_{n_heard + number}",
                "name": call.tool,
                "input": call.arguments,
            }
            for number, reply in enumerate(replies)
            for call in reply.calls
        ]
        thought = {"type": "thinking", "thinking": THOUGHT, "signature": SIGNATURE}
        words = {"type": "text", "text": replies[0].text}
        return self._whole([thought, words, *calls], "tool_use" if calls else "end_turn")

    def stop(self, trouble: Trouble) -> dict[str, Any]:
        if trouble is Trouble.REFUSED:
            return self._whole([{"type": "text", "text": REFUSAL}], "refusal")
        return self._whole([{"type": "text", "text": "I was about to"}], "max_tokens")

    def _whole(self, content: list[dict[str, Any]], reason: str) -> dict[str, Any]:
        return {
            "id": "msg_1",
            "type": "message",
            "role": "assistant",
            "model": "claude-opus-4-1",
            "content": content,
            "stop_reason": reason,
            "stop_sequence": None,
            "usage": {
                "input_tokens": N_READ - N_CACHED - 30,
                "cache_read_input_tokens": N_CACHED,
                "cache_creation_input_tokens": 30,
                "output_tokens": N_WRITTEN,
            },
        }

    def stream(self, answer: dict[str, Any]) -> str:
        return "".join(
            f"event: {event['type']}\ndata: {json.dumps(event)}\n\n" for event in _events(answer)
        )

    def fail(self, status: int) -> dict[str, Any]:
        kinds = {400: "invalid_request_error", 401: "authentication_error", 429: "rate_limit_error"}
        error = {"type": kinds.get(status, "api_error"), "message": f"trouble {status}"}
        return {"type": "error", "error": error}


_EMPTY: dict[str, dict[str, Any]] = {
    "text": {"text": ""},
    "thinking": {"thinking": "", "signature": ""},
    "tool_use": {"input": {}},
}
"""What of a block is there before its pieces have come."""


def _events(answer: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Gives the pieces in which Anthropic streams a message."""
    yield {
        "type": "message_start",
        "message": {**answer, "content": [], "stop_reason": None},
    }
    for index, block in enumerate(answer["content"]):
        begun = {**block, **_EMPTY[block["type"]]}
        yield {"type": "content_block_start", "index": index, "content_block": begun}
        for delta in _deltas(block):
            yield {"type": "content_block_delta", "index": index, "delta": delta}
        yield {"type": "content_block_stop", "index": index}
    ending = {"stop_reason": answer["stop_reason"], "stop_sequence": None}
    yield {"type": "message_delta", "delta": ending, "usage": answer["usage"]}
    yield {"type": "message_stop"}


def _deltas(block: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if block["type"] == "text":
        yield {"type": "text_delta", "text": block["text"]}
    elif block["type"] == "thinking":
        yield {"type": "thinking_delta", "thinking": block["thinking"]}
        yield {"type": "signature_delta", "signature": block["signature"]}
    else:
        yield {"type": "input_json_delta", "partial_json": json.dumps(block["input"])}


@dataclass(frozen=True, slots=True)
class GoogleContents:
    """Google's generateContent."""

    model: str = "google/gemini-2.5-pro"
    key: str = "GOOGLE_API_KEY"

    def settings(self, url: str) -> dict[str, str]:
        return {"GOOGLE_BASE_URL": url, self.key: "none-needed"}

    def read(self, path: str, request: dict[str, Any]) -> Heard:
        assert path.endswith("models/gemini-2.5-pro:generateContent")
        request = _camel(request)
        contents = request["contents"]
        for said, told in pairwise(contents):
            called = [each["name"] for each in _parts_of(said, "functionCall")]
            answered = [each["name"] for each in _parts_of(told, "functionResponse")]
            assert said["role"] != "model" or answered == called, "each call is answered at once"
        called = [part for each in contents for part in each["parts"] if "functionCall" in part]
        # Only the first of several calls at once is signed.
        signed = [part for part in called if part.get("thoughtSignature") == SIGNATURE]
        assert len(signed) == sum(bool(_parts_of(each, "functionCall")) for each in contents)
        told = [each for content in contents for each in _parts_of(content, "functionResponse")]
        pictures = [each for content in contents for each in _parts_of(content, "inlineData")]
        assert all(_is_picture(each["mimeType"], each["data"]) for each in pictures)
        tools = [each for tool in request["tools"] for each in tool["functionDeclarations"]]
        assert all(_has_schema(each) for each in tools)
        configuration = request["generationConfig"]
        return Heard(
            system=_join(part["text"] for part in request["systemInstruction"]["parts"]),
            prompt=contents[0]["parts"][0]["text"],
            tools=tuple(each["name"] for each in tools),
            answers=tuple(_join(map(str, each["response"].values())) for each in told),
            errors=tuple("error" in each["response"] for each in told),
            n_pictures=len(pictures),
            thinking=configuration.get("thinkingConfig"),
            seed=configuration.get("seed", 0),
        )

    def answer(self, replies: list[Reply], n_heard: int) -> dict[str, Any]:
        del n_heard
        calls = [
            {"functionCall": {"name": call.tool, "args": call.arguments}}
            for reply in replies
            for call in reply.calls
        ]
        if calls:
            calls[0]["thoughtSignature"] = SIGNATURE  # type: ignore[assignment]  # JSON
        thought = {"text": THOUGHT, "thought": True}
        return self._whole([thought, {"text": replies[0].text}, *calls], "STOP")

    def stop(self, trouble: Trouble) -> dict[str, Any]:
        if trouble is Trouble.REFUSED:
            return self._whole([], "SAFETY")
        return self._whole([{"text": "I was about to"}], "MAX_TOKENS")

    def _whole(self, parts: list[dict[str, Any]], reason: str) -> dict[str, Any]:
        content = {"role": "model", "parts": parts} if parts else {"role": "model"}
        return {
            "candidates": [{"index": 0, "content": content, "finishReason": reason}],
            "modelVersion": "gemini-2.5-pro",
            "responseId": "r1",
            "usageMetadata": {
                "promptTokenCount": N_READ,
                "cachedContentTokenCount": N_CACHED,
                "candidatesTokenCount": N_WRITTEN - N_THOUGHT,
                "thoughtsTokenCount": N_THOUGHT,
                "totalTokenCount": N_READ + N_WRITTEN,
            },
        }

    def stream(self, answer: dict[str, Any]) -> str:
        raise NotImplementedError

    def fail(self, status: int) -> dict[str, Any]:
        kinds = {400: "INVALID_ARGUMENT", 401: "UNAUTHENTICATED", 429: "RESOURCE_EXHAUSTED"}
        said = {"code": status, "message": f"trouble {status}"}
        return {"error": {**said, "status": kinds.get(status, "INTERNAL")}}


SPEECHES: tuple[Speech, ...] = (OpenAIChat(), AnthropicMessages(), GoogleContents())


# --- parts of messages -------------------------------------------------------------------------


def _join(texts: Iterable[str]) -> str:
    return "".join(texts)


def _of_role(messages: Iterable[dict[str, Any]], role: str) -> list[dict[str, Any]]:
    return [each for each in messages if each["role"] == role]


def _blocks(message: dict[str, Any]) -> list[dict[str, Any]]:
    content = message.get("content") or ""
    return [{"type": "text", "text": content}] if isinstance(content, str) else content


def _of_type(message: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [block for block in _blocks(message) if block["type"] == kind]


def _texts(messages: Iterable[dict[str, Any]]) -> Iterator[str]:
    for message in messages:
        yield _join(block.get("text", "") for block in _blocks(message))


def _parts_of(content: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [part[kind] for part in content.get("parts", ()) if kind in part]


def _count_urls(message: dict[str, Any]) -> int:
    urls = [each["image_url"]["url"] for each in _of_type(message, "image_url")]
    for url in urls:
        match = DATA_URL.fullmatch(url)
        assert match is not None
        assert _is_picture(match[1], match[2])
    return len(urls)


def _count_sources(message: dict[str, Any]) -> int:
    sources = [each["source"] for each in _of_type(message, "image")]
    assert all(_is_picture(each["media_type"], each["data"]) for each in sources)
    return len(sources)


def _is_picture(media_type: str, data: str) -> bool:
    # Google's JSON has the alphabet of URLs.
    return base64.b64decode(
        data, altchars=b"-_" if "_" in data or "-" in data else None
    ).startswith(MAGIC[media_type])


def _camel(value: Any) -> Any:  # noqa: ANN401 - any JSON
    """Gives JSON with the names that Google documents: it takes those with underscores too."""
    if isinstance(value, list):
        return [_camel(each) for each in value]
    if not isinstance(value, dict):
        return value
    return {
        re.sub(r"_([a-z])", lambda found: found[1].upper(), name): each
        if name in {"args", "response"}
        else _camel(each)
        for name, each in value.items()
    }


def _has_schema(declaration: dict[str, Any]) -> bool:
    schema = declaration.get("parameters") or declaration.get("parametersJsonSchema")
    return schema is None or schema["type"].lower() == "object"
