"""Bytes of one frame to plain data: JSON as rosbridge writes it, CBOR, and PNG."""

import base64
import io
import json
import re
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cbor2
import numpy as np
import orjson
from numpy.typing import NDArray
from PIL import Image

from mapspeak.errors import ConfigError
from mapspeak.links.rosbridge.protocol.bounds import (
    MAX_DEPTH,
    MAX_FRAME_BYTES,
    FrameError,
    Raw,
    check_cbor,
    check_json,
)
from mapspeak.links.rosbridge.protocol.numberlists import (
    WORTH_CUTTING_BYTES,
    Numbers,
    cut_out_numbers,
    marker_of,
)

MAX_FRAME_PIXELS = MAX_FRAME_BYTES // 3
MAX_LENIENT_BYTES = 200_000
"""Of a text that only the slower parser reads; long lists of numbers apart."""

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
    rb'"(?:[^"\\]++|\\.?)*+(?:"|\Z)'
    rb"|(?<![\w.])([+-]?)(?:(nan)|inf(?:inity)?)(?![\w.])",
    re.IGNORECASE | re.DOTALL,
)
"""A string, also one without an end, or a number that JSON does not have.

Nothing is read twice: a string is taken to its end or to that of the text, never given back.
"""


def decode_json(frame: Raw) -> Any:  # noqa: ANN401 - ROS JSON enters here
    """Return what a JSON text says; long lists of numbers as read-only numpy arrays.

    Raises:
        FrameError: It is no JSON, not even as Python or JavaScript programs write it, or it holds
            too much.
    """
    if len(frame) < WORTH_CUTTING_BYTES:
        return _parse_json(frame)
    rest, lists = cut_out_numbers(frame)
    if not lists:
        return _parse_json(rest)
    try:
        return _put_back(_parse_json(rest), lists)
    except FrameError:
        # A list may have stood within a string.
        return _parse_json(frame)


def decode_cbor(frame: Raw) -> Any:  # noqa: ANN401 - ROS data enters here
    """Gives what a CBOR item says; typed arrays as read-only numpy arrays, uint8[] as bytes.

    Raises:
        FrameError: It is no CBOR, or uses tags that no ROS message needs.
    """
    check_cbor(frame)
    try:
        return cbor2.loads(frame, semantic_decoders=_DECODERS, max_depth=MAX_DEPTH)
    except (cbor2.CBORDecodeError, ValueError, TypeError, OverflowError, RecursionError) as error:
        raise FrameError(f"no CBOR: {error}") from error


def require_cbor() -> None:
    """Check that the CBOR library in use is one that `decode_cbor` can call.

    Raises:
        ConfigError: It is not: another one stands before it on Python's path.
    """
    try:
        cbor2.loads(cbor2.dumps(None), semantic_decoders=_DECODERS, max_depth=MAX_DEPTH)
    except TypeError as error:
        raise ConfigError(
            f"The Python package cbor2 in {Path(cbor2.__file__).parent} is too old: {error}.",
            hint="A sourced ROS puts its packages first: start mapspeak with PYTHONPATH unset.",
        ) from error


def decode_png(text: str) -> memoryview:
    """Return the text that rosbridge hid in the pixels of a picture.

    Raises:
        FrameError: It is no such picture.
    """
    try:
        with Image.open(io.BytesIO(base64.b64decode(text)), formats=["PNG"]) as picture:
            if picture.width * picture.height > MAX_FRAME_PIXELS:
                raise FrameError(f"a png of {picture.width}x{picture.height} pixels")
            pixels = (picture if picture.mode == "RGB" else picture.convert("RGB")).tobytes()
    except (OSError, ValueError, SyntaxError, zlib.error, Image.DecompressionBombError) as error:
        raise FrameError(f"no png: {error}") from error
    # The last row is filled up with line ends.
    n_filled = 3 * picture.width
    end = len(pixels) - n_filled + len(pixels[-n_filled:].rstrip(b"\n\x00"))
    return memoryview(pixels)[:end]


def _parse_json(text: Raw) -> Any:  # noqa: ANN401 - as above
    n_containers = check_json(text)
    try:
        value = orjson.loads(text)
    except orjson.JSONDecodeError as error:
        value = _parse_lenient_json(text, str(error))
    if n_containers > MAX_DEPTH:
        _put_back(value, [])
    return value


def _parse_lenient_json(text: Raw, complaint: str) -> Any:  # noqa: ANN401 - as above
    """Read NaN and Infinity too, however a server spells them."""
    if len(text) > MAX_LENIENT_BYTES:
        raise FrameError(f"no JSON: {complaint}")
    try:
        return json.loads(BARE_NUMBER.sub(_as_python_writes, text))
    except (ValueError, RecursionError) as error:
        raise FrameError(f"no JSON: {complaint}") from error


def _put_back(value: Any, lists: Sequence[Numbers]) -> Any:  # noqa: ANN401 - as above
    """Put lists where their markers are, and check how deep the value is nested.

    Raises:
        FrameError: It is nested too deep.
    """
    places = {marker_of(number): each for number, each in enumerate(lists)}
    level = [value]
    for _ in range(MAX_DEPTH):
        inner = []
        for container in level:
            each = enumerate(container) if isinstance(container, list) else container.items()
            for key, child in each:
                if isinstance(child, dict | list):
                    inner.append(child)
                elif places and isinstance(child, str) and child[:1] == "\x00":
                    inner_list = places.get(child)
                    container[key] = child if inner_list is None else inner_list
        level = inner
    if level:
        raise FrameError(f"JSON that is nested more than {MAX_DEPTH} levels deep")
    return value


def _as_python_writes(found: re.Match[bytes]) -> bytes:
    if found.group(1) is None:
        return found.group(0)
    if found.group(2) is not None:
        return b"NaN"
    return (b"-" if found.group(1) == b"-" else b"") + b"Infinity"


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
