"""In which order stops are driven past so that the whole way is short.

Few stops are ordered exactly, by dynamic programming over the sets of stops behind (Held and Karp,
"A dynamic programming approach to sequencing problems", 1962); of more the order is made better
piece by piece until no piece turned round or moved elsewhere makes it shorter (2-opt and or-opt).
"""

import math
from collections.abc import Callable, Sequence
from enum import StrEnum

from mapspeak.spatial.grid import FloatArray

MOST_EXACT = 10
"""2 ** 10 sets of stops behind are looked at in some ten milliseconds."""
LONGEST_PIECE = 3
SHORTER_M = 1e-6


class RouteOrder(StrEnum):
    """What decides the order of the stops."""

    AS_GIVEN = "as_given"
    SHORTEST = "shortest"


def order_shortest(legs_m: FloatArray, *, is_end_fixed: bool) -> list[int]:
    """Return the numbers of stops in the order with the shortest way, which need not come back.

    Args:
        legs_m: From the start, row 0, or a stop to each stop, shape (n + 1, n); infinite where no
            way leads.
        is_end_fixed: The last one stays the last.
    """
    n_stops = legs_m.shape[1]
    if n_stops <= MOST_EXACT:
        return _order_exactly(legs_m, is_end_fixed=is_end_fixed)
    begun = (_order_by_nearest(legs_m, is_end_fixed=is_end_fixed), list(range(n_stops)))
    shortest = min(begun, key=lambda order: measure_order(legs_m, order))
    return _improve(legs_m, shortest, is_end_fixed=is_end_fixed)


def measure_order(legs_m: FloatArray, order: Sequence[int]) -> float:
    """Return the whole way past stops in an order."""
    starts = [0, *(stop + 1 for stop in order[:-1])]
    return math.fsum(legs_m[start, stop] for start, stop in zip(starts, order, strict=True))


def _order_exactly(legs_m: FloatArray, *, is_end_fixed: bool) -> list[int]:
    n_stops = legs_m.shape[1]
    # What has been driven past, and which of it last, with the way so far and its order.
    best: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {
        (1 << stop, stop): (float(legs_m[0, stop]), (stop,)) for stop in range(n_stops)
    }
    for _ in range(n_stops - 1):
        longer: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {}
        for (behind, last), (spent_m, order) in best.items():
            for stop in range(n_stops):
                if behind & (1 << stop):
                    continue
                key = behind | (1 << stop), stop
                found = spent_m + float(legs_m[last + 1, stop]), (*order, stop)
                if key not in longer or found < longer[key]:
                    longer[key] = found
        best = longer
    whole = [found for (_, last), found in best.items() if not is_end_fixed or last == n_stops - 1]
    return list(min(whole)[1])


def _order_by_nearest(legs_m: FloatArray, *, is_end_fixed: bool) -> list[int]:
    n_stops = legs_m.shape[1]
    ahead = list(range(n_stops - 1 if is_end_fixed else n_stops))
    order: list[int] = []
    while ahead:
        row = order[-1] + 1 if order else 0
        nearest = min(ahead, key=lambda stop: float(legs_m[row, stop]))
        ahead.remove(nearest)
        order.append(nearest)
    return [*order, n_stops - 1] if is_end_fixed else order


def _improve(legs_m: FloatArray, order: list[int], *, is_end_fixed: bool) -> list[int]:
    free = len(order) - 1 if is_end_fixed else len(order)
    shortest_m = measure_order(legs_m, order)
    while True:
        found = min(
            (
                (measure_order(legs_m, changed), changed)
                for change in (_turn_round, _move_elsewhere)
                for changed in _change(order, free, change)
            ),
            default=(shortest_m, order),
        )
        if not found[0] < shortest_m - SHORTER_M:
            return order
        shortest_m, order = found


_Change = Callable[[list[int], int], list[list[int]]]


def _change(order: list[int], free: int, change: _Change) -> list[list[int]]:
    return [[*changed, *order[free:]] for changed in change(order[:free], free)]


def _turn_round(order: list[int], free: int) -> list[list[int]]:
    return [
        [*order[:begin], *reversed(order[begin:end]), *order[end:]]
        for begin in range(free)
        for end in range(begin + 2, free + 1)
    ]


def _move_elsewhere(order: list[int], free: int) -> list[list[int]]:
    moved = []
    for length in range(1, LONGEST_PIECE + 1):
        for begin in range(free - length + 1):
            piece, rest = order[begin : begin + length], order[:begin] + order[begin + length :]
            moved += [[*rest[:at], *piece, *rest[at:]] for at in range(len(rest) + 1)]
    return moved
