"""Limits of a frame and its fragments: checked by counting, before anything is built."""

import math
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

MAX_FRAME_BYTES = 100_000_000
"""The largest message that is taken: a map of 16 million cells as JSON has 35 to 80 MB."""
MAX_REST_BYTES = 24_000_000
"""Of a JSON text without its long lists of numbers; 16 million cells as base64 fit."""
MAX_CONTAINERS = 80_000
"""Lists and objects of one message; a path of 10,000 poses has 60,000."""
MAX_ELEMENTS = 350_000
"""Values of one message, long lists of numbers apart."""
MAX_DEPTH = 64
"""Of containers within each other; ROS messages stay below ten."""
SMALL_BYTES = 16_384
"""A frame below this size cannot hold enough to be worth counting."""
PART_BYTES = 1_000_000
"""Bytes counted in one go: other threads may run between two parts."""


Raw = bytes | bytearray | memoryview
"""A large frame is handed on as it came: copying it takes longer than other calls may wait."""


class FrameFault(StrEnum):
    """The fault of a frame."""

    NO_JSON = "no_json"
    NO_CBOR = "no_cbor"
    NO_FRAGMENT = "no_fragment"
    TOO_LARGE = "too_large"
    TOO_DEEP = "too_deep"
    UNKNOWN_OPERATION = "unknown_operation"
    MISSING_FIELD = "missing_field"


class FrameError(Exception):
    """A frame that cannot be understood; never leaves the protocol."""

    def __init__(self, fault: FrameFault, detail: object) -> None:
        super().__init__(f"{fault}: {detail}")
        self.fault = fault
        self.detail = str(detail)


def check_json(text: Raw) -> int:
    """Check that a JSON text is quick to parse, and return how many lists it has at most.

    Objects count as lists.

    Raises:
        FrameError: It holds too much.
    """
    if len(text) > MAX_REST_BYTES:
        raise FrameError(
            FrameFault.TOO_LARGE, f"{len(text)} > {MAX_REST_BYTES} bytes without numbers"
        )
    if len(text) < SMALL_BYTES:
        small = bytes(text)
        return small.count(b"[") + small.count(b"{")
    n_containers = n_elements = 0
    is_inside, escape = False, b""
    for start, end in parts_of(len(text)):
        # Without escaped quotes, each quote begins or ends a string.
        part = (escape + bytes(text[start:end])).replace(b"\\\\", b"").replace(b'\\"', b"")
        escape = b"\\" if part.endswith(b"\\") else b""
        codes = np.frombuffer(part, dtype=np.uint8)
        quotes = np.flatnonzero(codes == ord('"'))
        n_containers += sum(_count_outside(codes, sign, quotes, is_inside) for sign in b"[{")
        n_elements += _count_outside(codes, ord(","), quotes, is_inside)
        is_inside ^= bool(quotes.size % 2)
        _check_counts(n_containers, n_elements)
    return n_containers


def _count_outside(
    codes: NDArray[np.uint8],
    sign: int,
    quotes: NDArray[np.intp],
    is_inside: bool,  # noqa: FBT001
) -> int:
    """Return how often a sign stands outside strings."""
    n_quotes_before = np.searchsorted(quotes, np.flatnonzero(codes == sign))
    return int(np.count_nonzero(n_quotes_before % 2 == is_inside))


def check_cbor(frame: Raw) -> None:
    """Check that a CBOR item is quick to decode, by stepping from head to head.

    Raises:
        FrameError: It holds too much, or says so.
    """
    if len(frame) < SMALL_BYTES:
        return
    n_containers = n_elements = position = 0
    open_ends: list[float] = [1]
    while open_ends and position < len(frame):
        if open_ends[-1] == 0:
            open_ends.pop()
            continue
        major, short = frame[position] >> 5, frame[position] & 31
        if frame[position] == _BREAK:
            open_ends.pop()
            position += 1
            continue
        length, position = _read_length(frame, position, short)
        n_elements += 1
        open_ends[-1] -= major != _TAG
        if major in _STRINGS and short != _INDEFINITE:
            position += int(length)
        elif major in _STRINGS or major in _CONTAINERS:
            n_containers += 1
            n_values = length * _CONTAINERS.get(major, 1)
            if short != _INDEFINITE and n_values > len(frame) - position:
                raise FrameError(FrameFault.NO_CBOR, "a list longer than its frame")
            open_ends.append(n_values)
            if len(open_ends) > MAX_DEPTH:
                raise FrameError(FrameFault.TOO_DEEP, f"> {MAX_DEPTH}")
        _check_counts(n_containers, n_elements)


_STRINGS, _CONTAINERS, _TAG = (2, 3), {4: 1, 5: 2}, 6
_BREAK, _INDEFINITE, _FIRST_LONG = 0xFF, 31, 24


def _read_length(frame: Raw, position: int, short: int) -> tuple[float, int]:
    """Return the argument of a head (RFC 8949, section 3), and where its content begins."""
    position += 1
    if short < _FIRST_LONG:
        return short, position
    if short == _INDEFINITE:
        return float("inf"), position
    n_bytes = 1 << (short - _FIRST_LONG) if short < _FIRST_LONG + 4 else 0
    return int.from_bytes(frame[position : position + n_bytes]), position + n_bytes


def _check_counts(n_containers: int, n_elements: int) -> None:
    if n_containers > MAX_CONTAINERS or n_elements > MAX_ELEMENTS:
        raise FrameError(FrameFault.TOO_LARGE, f"> {MAX_CONTAINERS} lists or {MAX_ELEMENTS} values")


def parts_of(length: int, size: int = PART_BYTES) -> Iterator[tuple[int, int]]:
    """Return where each part of a long text begins and ends."""
    return ((start, min(start + size, length)) for start in range(0, length, size))


MAX_PIECES = 10_000
MAX_UNFINISHED = 8


@dataclass(slots=True)
class _Unfinished:
    """One message of which some pieces have come."""

    pieces: dict[int, bytes] = field(default_factory=dict)
    n_bytes: int = 0


class FragmentStore:
    """Puts pieces together in whatever order they come; forgets the oldest when it gets too much.

    Args:
        max_bytes: The most that all pieces together may hold.
    """

    def __init__(self, *, max_bytes: int = MAX_FRAME_BYTES) -> None:
        self._max_bytes = max_bytes
        self._unfinished: OrderedDict[tuple[str, int], _Unfinished] = OrderedDict()

    @property
    def n_bytes(self) -> int:
        """Held at present."""
        return sum(message.n_bytes for message in self._unfinished.values())

    def add(self, operation: dict[str, Any]) -> bytes | None:
        """Take one piece, and return the whole text once it is complete."""
        number, n_pieces, text = _read_piece(operation)
        # The server gives small numbers as ids, the same one to every message.
        key = (str(operation.get("id")), n_pieces)
        message = self._unfinished.setdefault(key, _Unfinished())
        self._unfinished.move_to_end(key)
        if message.pieces.get(number, text) != text:
            message = self._unfinished[key] = _Unfinished()
        if number not in message.pieces:
            message.pieces[number] = text
            message.n_bytes += len(text)
        if len(message.pieces) == n_pieces:
            del self._unfinished[key]
            return b"".join(message.pieces[index] for index in range(n_pieces))
        while len(self._unfinished) > MAX_UNFINISHED or self.n_bytes > self._max_bytes:
            self._unfinished.popitem(last=False)
        return None


def _read_piece(operation: dict[str, Any]) -> tuple[int, int, bytes]:
    number, total, text = (operation.get(key) for key in ("num", "total", "data"))
    if not (_is_number(number) and _is_number(total) and isinstance(text, str)):
        raise FrameError(FrameFault.NO_FRAGMENT, "num, total, data")
    # rosbridge tells (length - 1) / size + 1 without rounding: 7.0058 means 7 pieces.
    n_pieces = math.floor(total)
    if not 1 <= n_pieces <= MAX_PIECES or number not in range(n_pieces):
        raise FrameError(FrameFault.NO_FRAGMENT, f"{number} of {total}")
    return int(number), n_pieces, text.encode("utf-8", "surrogatepass")


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
