"""Bytes of one frame to plain data: JSON as rosbridge writes it, CBOR, and PNG."""

import base64
import io
import json
import re
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import cbor2
import numpy as np
import orjson
from numpy.typing import NDArray
from PIL import Image

MAX_FRAME_BYTES = 256 * 1024 * 1024
"""The largest message that is taken: a map of 8000x8000 cells as JSON fits, 10 GB do not."""
MAX_FRAME_PIXELS = MAX_FRAME_BYTES // 3
MAX_DEPTH = 64
"""Of CBOR containers within each other; ROS messages stay below ten."""
WORTH_CUTTING_BYTES = 16_384
"""Below this size, taking the numbers out first saves nothing."""

TYPED_ARRAYS = {
    65: ">u2", 66: ">u4", 67: ">u8", 69: "<u2", 70: "<u4", 71: "<u8",
    72: "i1", 73: ">i2", 74: ">i4", 75: ">i8", 77: "<i2", 78: "<i4", 79: "<i8",
    80: ">f2", 81: ">f4", 82: ">f8", 84: "<f2", 85: "<f4", 86: "<f8",
}  # fmt: skip
"""RFC 8746, section 2.1: the tag of a byte string that is an array of numbers."""
BYTE_TAGS = (64, 68)
"""Arrays of bytes, which Python has a type for."""
OTHER_TAGS = (0, 1, 2, 3, 4, 5, 25, 28, 29, 30, 35, 36, 37, 52, 54, 100, 256, 258, 260, 261, 1004)
"""Tags the library turns into objects of its own, some of which can hold themselves."""

BARE_NUMBER = re.compile(
    rb'"(?:[^"\\]|\\.)*"|(?<![\w.])([+-]?)(?:(nan)|inf(?:inity)?)(?![\w.])',
    re.IGNORECASE | re.DOTALL,
)
PART_BYTES = 500_000
DATA_ARRAY = re.compile(rb'"data"\s*:\s*\[')
CUT_OUT = "\x00cut out\x00"


class FrameError(Exception):
    """A frame that cannot be understood; never leaves the protocol."""


def decode_json(frame: bytes) -> Any:  # noqa: ANN401 - ROS JSON enters here
    """Gives what a JSON text says; a long list of whole numbers in `msg.data` as a numpy array.

    Raises:
        FrameError: It is no JSON, not even as Python or JavaScript programs write it.
    """
    if len(frame) >= WORTH_CUTTING_BYTES:
        value = _decode_with_data_apart(frame)
        if value is not None:
            return value
    try:
        return orjson.loads(frame)
    except orjson.JSONDecodeError as error:
        return _decode_lenient_json(frame, str(error))


def decode_cbor(frame: bytes) -> Any:  # noqa: ANN401 - ROS data enters here
    """Gives what a CBOR item says; typed arrays as read-only numpy arrays, uint8[] as bytes.

    Raises:
        FrameError: It is no CBOR, or uses tags that no ROS message needs.
    """
    try:
        return cbor2.loads(frame, semantic_decoders=_DECODERS, max_depth=MAX_DEPTH)
    except (cbor2.CBORDecodeError, ValueError, TypeError, OverflowError, RecursionError) as error:
        raise FrameError(f"no CBOR: {error}") from error


def decode_png(text: str) -> bytes:
    """Gives the text that rosbridge hid in the pixels of a picture.

    Raises:
        FrameError: It is no such picture.
    """
    try:
        with Image.open(io.BytesIO(base64.b64decode(text)), formats=["PNG"]) as picture:
            if picture.width * picture.height > MAX_FRAME_PIXELS:
                raise FrameError(f"a png of {picture.width}x{picture.height} pixels")
            pixels = picture.convert("RGB").tobytes()
    except (OSError, ValueError, SyntaxError, zlib.error, Image.DecompressionBombError) as error:
        raise FrameError(f"no png: {error}") from error
    # The last row is filled up with line ends.
    return pixels.rstrip(b"\n\x00")


def _decode_lenient_json(frame: bytes, complaint: str) -> Any:  # noqa: ANN401 - as above
    """Reads NaN and Infinity too, however a server spells them."""
    try:
        return json.loads(BARE_NUMBER.sub(_as_python_writes, frame))
    except (ValueError, RecursionError) as error:
        raise FrameError(f"no JSON: {complaint}") from error


def _as_python_writes(found: re.Match[bytes]) -> bytes:
    if found.group(1) is None:
        return found.group(0)
    if found.group(2) is not None:
        return b"NaN"
    return (b"-" if found.group(1) == b"-" else b"") + b"Infinity"


def _decode_with_data_apart(frame: bytes) -> Any | None:  # noqa: ANN401 - as above
    """Reads the numbers of `msg.data` apart, which takes half the time; None where it cannot."""
    opening = DATA_ARRAY.search(frame)
    if opening is None:
        return None
    start, end = opening.end(), frame.find(b"]", opening.end())
    numbers = frame[start:end]
    if len(numbers) < WORTH_CUTTING_BYTES // 2 or numbers.translate(None, b"-0123456789, \n"):
        return None
    try:
        rest = orjson.loads(b"".join((frame[: start - 1], orjson.dumps(CUT_OUT), frame[end + 1 :])))
        data = _read_numbers(numbers)
    except ValueError:
        return None
    message = rest.get("msg") if isinstance(rest, dict) else None
    if data is None or not isinstance(message, dict) or message.get("data") != CUT_OUT:
        return None
    message["data"] = data
    return rest


def _read_numbers(numbers: bytes) -> NDArray[np.int64] | None:
    signs = np.frombuffer(numbers, dtype=np.uint8)
    # A sign without a digit behind it is 0 to numpy.
    if signs[-1] == ord("-") or ((signs[:-1] == ord("-")) & (signs[1:] < ord("0"))).any():
        return None
    data = np.concatenate(
        [np.fromstring(part, dtype=np.int64, sep=",") for part in _parts_of(numbers)]
    )
    # What follows the last comma is the other thing that numpy does not insist on.
    return data if data.size == numbers.count(b",") + 1 else None


def _parts_of(numbers: bytes) -> Iterator[bytes]:
    """Cuts at commas: numpy lets no other thread run before it has read all it was given."""
    start = 0
    while start < len(numbers):
        comma = numbers.find(b",", start + PART_BYTES)
        end = len(numbers) if comma < 0 else comma
        yield numbers[start:end]
        start = end + 1


def _as_array(dtype: str) -> Callable[[Any, bool], NDArray[Any]]:
    def decode(data: Any, _immutable: bool) -> NDArray[Any]:  # noqa: ANN401, FBT001 - cbor2's call
        if not isinstance(data, bytes):
            raise TypeError("a typed array without bytes")
        return np.frombuffer(data, dtype=dtype)

    return decode


def _refuse(_data: Any, _immutable: bool) -> None:  # noqa: ANN401, FBT001 - cbor2's call
    raise ValueError("a tag that no ROS message needs")


def _as_bytes(data: Any, _immutable: bool) -> bytes:  # noqa: ANN401, FBT001 - cbor2's call
    if not isinstance(data, bytes):
        raise TypeError("a typed array without bytes")
    return data


_DECODERS: dict[int, Callable[[Any, bool], Any]] = (
    {tag: _as_array(dtype) for tag, dtype in TYPED_ARRAYS.items()}
    | dict.fromkeys(BYTE_TAGS, _as_bytes)
    | dict.fromkeys(OTHER_TAGS, _refuse)
)
