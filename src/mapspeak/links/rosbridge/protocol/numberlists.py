"""Long lists of numbers in a JSON text, read apart from the rest and a part at a time.

A parser holds Python's lock until it has read all that it was given, so that nothing else runs
meanwhile; between two parts the other threads do. It also takes half the time.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.links.rosbridge.protocol.bounds import (
    MAX_CONTAINERS,
    MAX_REST_BYTES,
    Raw,
    parts_of,
)

WORTH_CUTTING_BYTES = 16_384
"""Below this size, reading numbers apart saves nothing."""
PART_BYTES = 100_000
WHOLE_SIGNS = b"-0123456789, \t\r\n"
SIGNS = WHOLE_SIGNS + b"+.eENaIinfty"
"""Also of numbers as Python and JavaScript write them when they are none."""

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
    # What follows the last comma is what numpy does not insist on.
    return numbers if numbers.size == text.count(b",") + 1 else None
