"""The rows of the map that a client has read: unchanged ones are not told again."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TypeVar

from mapspeak.server.text.wording import build_table
from mapspeak.server.text.world.look import MapPart

Item = TypeVar("Item")

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?")
SAME = 0.3
"""Metres, or square metres: a smaller change is not told."""
SAME_RATIO = 0.05
WAY = "path m"
"""The column of ways, which change with each drive: only whether there is one is news."""
PICTURE = "picture"
"""What is told of it: its scale, and what it shows."""


class Told:
    """Compares new rows with those told before, and keeps them for the next time.

    Numbers are compared with the told ones, so that a slow drift is told once it is large.

    Args:
        before: The told texts by subject; None for a client that has read nothing yet.
    """

    def __init__(self, before: Mapping[str, str] | None = None) -> None:
        self.is_first = before is None
        self._before = dict(before or {})
        self._now: dict[str, str] = {}

    def is_new(self, subject: str, text: str, *, is_exact: bool = False) -> bool:
        """Return True for a subject that was not told, or told differently.

        Args:
            subject: An id, or words that end with one.
            text: Its text.
            is_exact: A small change of a number makes it new too.
        """
        known = self._before.get(subject)
        if known is not None and (known == text or (not is_exact and _is_alike(known, text))):
            self._now[subject] = known
            return False
        self._now[subject] = text
        return True

    def find_gone(self, subjects: Collection[str]) -> list[str]:
        """Return the told subjects that no longer exist.

        Args:
            subjects: All that exist now, told or not.
        """
        gone = set(map(_id_of, self._before)) - set(subjects)
        return sorted(gone, key=lambda each: (each[0], len(each), each))

    def keep(self, subjects: Collection[str]) -> Mapping[str, str]:
        """Return the texts of existing subjects that this client has read."""
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
        told: The rows that the reader knows, by their first cells.
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
