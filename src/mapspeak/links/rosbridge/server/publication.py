"""What goes out on a topic, in the forms that rosbridge knows, made once for all clients."""

import base64
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from PIL import Image

from mapspeak.links.rosbridge.protocol.encoding import to_cbor, to_json
from mapspeak.ros.messages import Message


class Compression(StrEnum):
    """How a client wants a topic's messages; later ones win where it asked for several."""

    NONE = "none"
    PNG = "png"
    CBOR = "cbor"


@dataclass(frozen=True, slots=True)
class Frame:
    """One websocket message.

    Attributes:
        data: UTF-8 text, or bytes.
        is_text: Which of them.
    """

    data: bytes
    is_text: bool


class Publication:
    """One message on one topic.

    Attributes:
        topic: Its name.
        type: Of the message, as "package/Type".
        message: Its fields; arrays as numpy arrays, uint8[] as bytes.
    """

    def __init__(self, topic: str, message_type: str, message: Message) -> None:
        self.topic = topic
        self.type = message_type
        self.message = message

    def frame(self, compression: Compression) -> Frame:
        """Gives the message as a client wants it."""
        match compression:
            case Compression.CBOR:
                return Frame(self._cbor, is_text=False)
            case Compression.PNG:
                return Frame(self._png, is_text=True)
            case Compression.NONE:
                return Frame(self._json, is_text=True)

    @property
    def _operation(self) -> dict[str, object]:
        return {"op": "publish", "topic": self.topic, "msg": self.message}

    @cached_property
    def _json(self) -> bytes:
        return to_json(self._operation)

    @cached_property
    def _cbor(self) -> bytes:
        return to_cbor(self._operation)

    @cached_property
    def _png(self) -> bytes:
        return to_json({"op": "png", "data": base64.b64encode(_as_picture(self._json)).decode()})


def answer_frame(operation: Message, answer: Message) -> Frame:
    """Gives the answer to an operation, with its id if it had one."""
    named = {**answer, "id": operation["id"]} if "id" in operation else answer
    return Frame(to_json(named), is_text=True)


def fragments_of(frame: Frame, *, length: int, fragment_id: str) -> Iterator[Frame]:
    """Gives a text in pieces of so many characters, as the operation `fragment`."""
    text = frame.data.decode()
    for number, start in enumerate(range(0, len(text), length)):
        piece = {
            "op": "fragment",
            "id": fragment_id,
            "data": text[start : start + length],
            "num": number,
            # The real one forgets to round down.
            "total": (len(text) - 1) / length + 1,
        }
        yield Frame(to_json(piece), is_text=True)


def _as_picture(text: bytes) -> bytes:
    """Lays a text out as the pixels of a PNG, filled up with line ends, as rosbridge does."""
    n_pixels = len(text) / 3.0
    width_px = max(math.floor(math.sqrt(n_pixels)), 1)
    height_px = max(math.ceil(n_pixels / width_px), 1)
    padded = text.ljust(width_px * height_px * 3, b"\n")
    encoded = io.BytesIO()
    Image.frombytes("RGB", (width_px, height_px), padded).save(encoded, format="PNG")
    return encoded.getvalue()
