"""What a client has read of the map: what is as it was told is not told again."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TypeVar

from mapspeak.server.text.look import MapPart
from mapspeak.server.text.wording import build_table

Item = TypeVar("Item")

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?")
SAME = 0.3
"""Metres, or square metres: what has changed by no more is as it was told."""
SAME_RATIO = 0.05
WAY = "path m"
"""The column of ways, which change with each drive: only whether there is one is news."""
PICTURE = "picture"
"""What is told of it: its scale, and what it shows."""


class Told:
    """Compares what there is to tell with what was told, and keeps it for the next time.

    Numbers are compared with those that were told, so that what creeps is told once it has moved.

    Args:
        before: What was told, by what it is about; None for a client that has read nothing yet.
    """

    def __init__(self, before: Mapping[str, str] | None = None) -> None:
        self.is_first = before is None
        self._before = dict(before or {})
        self._now: dict[str, str] = {}

    def is_new(self, subject: str, text: str, *, is_exact: bool = False) -> bool:
        """Return True for what was not told, or not so.

        Args:
            subject: An id, or words that end with one.
            text: What there is to tell of it.
            is_exact: Numbers that changed a little make it new too.
        """
        known = self._before.get(subject)
        if known is not None and (known == text or (not is_exact and _is_alike(known, text))):
            self._now[subject] = known
            return False
        self._now[subject] = text
        return True

    def find_gone(self, subjects: Collection[str]) -> list[str]:
        """Return what was told of and is no more.

        Args:
            subjects: All there is now, whether it was told or not.
        """
        gone = set(map(_id_of, self._before)) - set(subjects)
        return sorted(gone, key=lambda each: (each[0], len(each), each))

    def keep(self, subjects: Collection[str]) -> Mapping[str, str]:
        """Return what this client has read by now of what there is."""
        read = self._before | self._now
        return {each: text for each, text in read.items() if _id_of(each) in subjects}


def _id_of(subject: str) -> str:
    return subject.rpartition(" ")[2]


def _is_alike(one: str, other: str) -> bool:
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(
        abs(a - b) <= max(SAME, SAME_RATIO * abs(a))
        for a, b in ((float(x), float(y)) for x, y in pairs)
    )


def tell_rows(
    told: Told,
    heading: str,
    columns: Sequence[str],
    parts: Sequence[MapPart[Item]],
    row: Callable[[Item], Sequence[str]],
) -> str:
    """Return a table of what the reader does not know; empty where that is nothing.

    Args:
        told: What the reader knows, by the first cell of each row.
        heading: What the table shows.
        columns: Their names, `WAY` among them.
        parts: What is listed.
        row: Gives an item's line.
    """
    way, rows = columns.index(WAY), [tuple(row(item)) for part in parts for item in part.items]
    n_left_out = sum(part.n_all for part in parts) - len(rows)
    fresh = [cells for cells in rows if told.is_new(cells[0], _without_way(cells, way))]
    if not fresh and not told.is_first:
        return ""
    return build_table(
        heading,
        columns,
        fresh,
        lambda cells: cells,
        n_all=len(fresh) + n_left_out,
        gap_after=parts[0].gap_after if told.is_first else None,
    )


def _without_way(cells: Sequence[str], way: int) -> str:
    kind = "way" if cells[way].replace(".", "").isdigit() else cells[way]
    return " | ".join([*cells[:way], kind, *cells[way + 1 :]])
