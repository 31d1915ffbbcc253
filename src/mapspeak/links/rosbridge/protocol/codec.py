"""ROS messages and the bytes of a frame: JSON as rosbridge writes it, and CBOR."""

import base64
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cbor2
import numpy as np
import orjson
from numpy.typing import NDArray

from mapspeak.errors import ConfigError
from mapspeak.links.rosbridge.protocol.bounds import (
    MAX_CONTAINERS,
    MAX_DEPTH,
    MAX_REST_BYTES,
    FrameError,
    FrameFault,
    Raw,
    check_cbor,
    check_json,
    parts_of,
)
from mapspeak.ros.messages.fields import Message

TAGS = {
    "u2": 69, "u4": 70, "u8": 71, "i1": 72, "i2": 77, "i4": 78, "i8": 79, "f4": 85, "f8": 86,
}  # fmt: skip
"""The typed arrays that rosbridge itself sends, all little-endian; uint8[] is a byte string."""


def to_json(message: Message) -> bytes:
    """Return a message as JSON: uint8[] as base64 text, other arrays as lists, NaN as null."""
    try:
        return orjson.dumps(message, default=_plain, option=orjson.OPT_SERIALIZE_NUMPY)
    except TypeError:
        # Half a surrogate pair, or a number of more than 64 bits: only an id given by the other
        # end can hold them, and it wants it back.
        return json.dumps(message, default=_plain).encode()


def to_cbor(message: Message) -> bytes:
    """Return a message as CBOR: uint8[] as bytes, numpy arrays as typed arrays."""
    return cbor2.dumps(message, default=_encode_array)


def _plain(value: object) -> object:
    if isinstance(value, bytes):
        return base64.b64encode(value).decode("ascii")
    if isinstance(value, np.ndarray):  # one that lies in memory in pieces
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is nothing that ROS sends.")


def _encode_array(encoder: cbor2.CBOREncoder, value: object) -> None:
    if isinstance(value, np.ndarray) and value.dtype.str[1:] in TAGS:
        little = value.astype(value.dtype.newbyteorder("<"), copy=False)
        encoder.encode(cbor2.CBORTag(TAGS[value.dtype.str[1:]], little.tobytes()))
        return
    raise TypeError(f"{type(value).__name__} is nothing that ROS sends.")


WORTH_CUTTING_BYTES = 16_384
"""Below this size, reading numbers apart saves nothing."""
PART_BYTES = 100_000
WHOLE_SIGNS = b"-0123456789, \t\r\n"
SIGNS = WHOLE_SIGNS + b"+.eENaIinfty"
"""Also of NaN and infinity as Python and JavaScript write them."""

Numbers = NDArray[np.number[Any]]


def marker_of(number: int) -> str:
    """Return the text that stands in place of a list in the rest."""
    return f"\x00list {number}"


def cut_out_numbers(frame: Raw) -> tuple[Raw, list[Numbers]]:
    """Return a JSON text with a marker in place of each long list of numbers, and those lists.

    A list with a fault in it stays where it is, for the parser to complain about. A marker within
    a string ends that string, so that the parser complains too.
    """
    codes, view = np.frombuffer(frame, dtype=np.uint8), memoryview(frame)
    kept: list[bytes | memoryview] = []
    lists: list[Numbers] = []
    done = 0
    for start, end in _find_long_stretches(codes):
        numbers = _read_numbers(view[start + 1 : end])
        if numbers is not None:
            kept += [view[done:start], b'"\\u0000list %d"' % len(lists)]
            lists.append(numbers)
            done = end + 1
    kept.append(view[done:])
    is_long = sum(map(len, kept)) > MAX_REST_BYTES
    return frame if is_long or not lists else b"".join(kept), lists


def _find_long_stretches(codes: NDArray[np.uint8]) -> list[tuple[int, int]]:
    """Return where each opening bracket is that has nothing but a closing one far behind it."""
    opened, closed = _find(codes, b"["), _find(codes, b"]")
    index = np.searchsorted(closed, opened)
    opened, index = opened[index < closed.size], index[index < closed.size]
    ends = closed[index]
    is_long = ends - opened > WORTH_CUTTING_BYTES
    # Of several opening brackets before one closing bracket, the last is its own.
    is_last = np.append(index[1:] != index[:-1], np.ones(min(index.size, 1), dtype=bool))
    return list(
        zip(opened[is_long & is_last].tolist(), ends[is_long & is_last].tolist(), strict=True)
    )


def _find(codes: NDArray[np.uint8], sign: bytes) -> NDArray[np.intp]:
    """Return where a sign stands; nowhere where that is too often to be worth cutting."""
    found, n_found = [np.empty(0, dtype=np.intp)], 0
    for start, end in parts_of(codes.size):
        places = np.flatnonzero(codes[start:end] == ord(sign)) + start
        n_found += places.size
        if n_found > MAX_CONTAINERS:
            return np.empty(0, dtype=np.intp)
        found.append(places)
    return np.concatenate(found)


def _read_numbers(text: memoryview) -> Numbers | None:
    """Return the numbers between two brackets; None where it is not numbers that stand there."""
    parts = []
    start = 0
    while start <= len(text):
        part = bytes(text[start : start + PART_BYTES])
        if start + len(part) < len(text):
            part, comma, _ = part.rpartition(b",")
            if not comma:
                return None
        numbers = _read_part(part)
        if numbers is None:
            return None
        parts.append(numbers)
        start += len(part) + 1
    data = np.concatenate(parts)
    data.setflags(write=False)
    return data


def _read_part(text: bytes) -> Numbers | None:
    if not text.translate(None, WHOLE_SIGNS):
        return _read_whole(text)
    if text.translate(None, SIGNS):
        return None
    return _parse(text, np.float64)


def _read_whole(text: bytes) -> Numbers | None:
    signs = np.frombuffer(text, dtype=np.uint8)
    # A sign without a digit behind it is 0 to numpy.
    is_minus = signs == ord("-")
    if signs.size == 0 or is_minus[-1] or (is_minus[:-1] & (signs[1:] < ord("0"))).any():
        return None
    numbers = _parse(text, np.int64)
    if numbers is None:
        return None
    fits = numbers.size and int(numbers.min()) >= -128 and int(numbers.max()) <= 127
    return numbers.astype(np.int8) if fits else numbers


def _parse(text: bytes, dtype: type[np.int64 | np.float64]) -> Numbers | None:
    try:
        numbers: Numbers = np.fromstring(text, dtype=dtype, sep=",")
    except ValueError:
        return None
    # numpy does not insist on a number after the last comma.
    return numbers if numbers.size == text.count(b",") + 1 else None


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
    """Return the value of a JSON text; long lists of numbers as read-only numpy arrays.

    Raises:
        FrameError: It is not JSON, not even as Python or JavaScript programs write it, or holds too
            much.
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
    """Return the value of a CBOR item; typed arrays as read-only numpy arrays, uint8[] as bytes.

    Raises:
        FrameError: It is not CBOR, or uses tags that no ROS message needs.
    """
    check_cbor(frame)
    try:
        return cbor2.loads(frame, semantic_decoders=_DECODERS, max_depth=MAX_DEPTH)
    except (cbor2.CBORDecodeError, ValueError, TypeError, OverflowError, RecursionError) as error:
        raise FrameError(FrameFault.NO_CBOR, error) from error


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
        raise FrameError(FrameFault.NO_JSON, complaint)
    try:
        return json.loads(BARE_NUMBER.sub(_as_python_writes, text))
    except (ValueError, RecursionError) as error:
        raise FrameError(FrameFault.NO_JSON, complaint) from error


def _put_back(value: Any, lists: Sequence[Numbers]) -> Any:  # noqa: ANN401 - as above
    """Put lists where their markers are, and check how deep the value is nested."""
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
        raise FrameError(FrameFault.TOO_DEEP, f"> {MAX_DEPTH}")
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
