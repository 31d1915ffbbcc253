"""Messages that arrive in pieces, put together within bounds."""

import math
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Any, TypeGuard

from mapspeak.links.rosbridge.protocol.bounds import MAX_FRAME_BYTES, FrameError

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
        """Take one piece, and return the whole text once it is complete.

        Raises:
            FrameError: It is no piece.
        """
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
        self._forget_what_is_too_much()
        return None

    def _forget_what_is_too_much(self) -> None:
        while len(self._unfinished) > MAX_UNFINISHED or self.n_bytes > self._max_bytes:
            self._unfinished.popitem(last=False)


def _read_piece(operation: dict[str, Any]) -> tuple[int, int, bytes]:
    number, total, text = (operation.get(key) for key in ("num", "total", "data"))
    if not (_is_number(number) and _is_number(total) and isinstance(text, str)):
        raise FrameError("a fragment without num, total and data")
    # rosbridge tells (length - 1) / size + 1 without rounding: 7.0058 means 7 pieces.
    n_pieces = math.floor(total)
    if not 1 <= n_pieces <= MAX_PIECES or number not in range(n_pieces):
        raise FrameError(f"fragment {number} of {total}")
    return int(number), n_pieces, text.encode("utf-8", "surrogatepass")


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
