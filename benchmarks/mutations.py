"""Frames of a rosbridge as they should be, and ways to spoil them, by a seed."""

import math
import random

import cbor2
import numpy as np
import orjson

__all__ = ["Frame", "mutate", "pieces_of", "seed_frames"]

Frame = tuple[bool, bytes]
"""Whether it is text, and its bytes."""
JSON_TOKENS = (
    b'"', b"\\", b"[", b"]", b"{", b"}", b",", b":", b"NaN", b"-Infinity", b"inf", b"1e999",
    b"null", b"\\u0000", b"\\ud800", b"9" * 40, b'"op":"png"', b'"op":"fragment"', b'"num":-1',
)  # fmt: skip
CBOR_TOKENS = (
    b"\x00", b"\xff", b"\x9f", b"\xbf", b"\x9b", b"\x5f", b"\xd8\x48", b"\xc2", b"\xd8\x1c",
)  # fmt: skip
TOKENS = JSON_TOKENS + CBOR_TOKENS
MOST_REPEATED_BYTES = 3_000_000


def pieces_of(text: str, n_characters: int) -> list[bytes]:
    """Return the fragments of a text."""
    total = math.ceil(len(text) / n_characters)
    starts = range(0, len(text), n_characters)
    return [
        orjson.dumps(
            {
                "op": "fragment",
                "id": 0,
                "num": number,
                "total": total,
                "data": text[start : start + n_characters],
            }
        )
        for number, start in enumerate(starts)
    ]


def seed_frames(topic: str) -> list[Frame]:
    """Return frames that are as they should be: JSON, CBOR, pictures, fragments."""
    cells = np.random.default_rng(0).choice(np.array([-1, 0, 100], np.int8), size=10_000)
    info = {"width": 100, "height": 100, "resolution": 0.05}
    told = {"op": "publish", "topic": topic, "msg": {"info": info, "data": cells.tolist()}}
    map_text = orjson.dumps(told)
    scan = {"ranges": [1.5, math.inf, math.nan] * 200, "angle_min": -1.57}
    poses = [{"position": {"x": 1.0, "y": 2.0}, "orientation": {"w": 1.0}}] * 50
    typed = {"info": info, "data": cbor2.CBORTag(72, cells.tobytes())}
    packed = {"scan": cbor2.CBORTag(85, np.ones(700, "<f4").tobytes()), "poses": poses}
    texts = [
        orjson.dumps({"op": "publish", "topic": topic, "msg": {"poses": poses}}),
        repr({"op": "publish", "topic": topic, "msg": scan}).replace("'", '"').encode(),
        orjson.dumps({"op": "service_response", "id": "1", "values": {"a": "é"}, "result": True}),
        orjson.dumps({"op": "action_result", "id": "1", "values": {}, "status": 4}),
        map_text,
        *pieces_of(map_text.decode(), 8_000),
    ]
    binaries = [
        cbor2.dumps({"op": "publish", "topic": topic, "msg": message})
        for message in (typed, packed)
    ]
    return [*((True, text) for text in texts), *((False, data) for data in binaries)]


def mutate(frame: Frame, other: Frame, chance: random.Random) -> Frame:
    """Return a frame that is spoilt in one to four places."""
    is_text, data = frame
    for _ in range(chance.randint(1, 4)):
        start = chance.randrange(len(data) + 1)
        end = min(len(data), start + chance.choice((1, 4, 60, 5_000)))
        match chance.randrange(7):
            case 0:
                middle = chance.randbytes(end - start)
            case 1:
                middle = b""
            case 2:
                middle = chance.choice(TOKENS)
            case 3:
                middle = data[start:end] * chance.choice((2, 3, 50))
            case 4 if chance.random() < 0.02:
                part = chance.choice((*TOKENS, data[start:end] or b"["))
                middle = part * (chance.randrange(MOST_REPEATED_BYTES) // len(part))
            case 5:
                place = chance.randrange(len(other[1]))
                middle = other[1][place : place + 200]
            case _:
                middle, end = b"", len(data) if chance.random() < 0.2 else end
        data = data[:start] + middle + data[end:]
    return (is_text if chance.random() < 0.95 else not is_text), data
