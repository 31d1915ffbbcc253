"""What a client has read of the map: what is as it was told is not told again."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TypeVar

from mapspeak.server.text.look import MapPart
from mapspeak.server.text.wording import build_table, list_some

Item = TypeVar("Item")
MOST_SAME = 12

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?")
SAME = 0.3
"""Metres, or square metres: what has changed by no more is as it was told."""
SAME_RATIO = 0.05
WAY = "path m"
"""The column of ways, which change with each drive: only whether there is one is news."""


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

    def is_new(self, subject: str, text: str) -> bool:
        """Return True for what was not told, or not so.

        Args:
            subject: An id, or words that end with one.
            text: What there is to tell of it.
        """
        known = self._before.get(subject)
        if known is not None and _is_alike(known, text):
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
    part: MapPart[Item],
    row: Callable[[Item], Sequence[str]],
) -> str:
    """Return a table; of rows that the reader knows the ids and the ways alone, in one line.

    Args:
        told: What the reader knows, by the first cell of each row.
        heading: What the table shows.
        columns: Their names, `WAY` among them.
        part: What is listed.
        row: Gives an item's line.
    """
    way, rows = columns.index(WAY), [tuple(row(item)) for item in part.items]
    n_left_out = part.n_all - len(rows)
    fresh = [cells for cells in rows if told.is_new(cells[0], _without_way(cells, way))]
    same = [f"{cells[0]} {cells[way]}" for cells in rows if cells not in fresh]
    table = build_table(
        heading if told.is_first else f"{heading}: new or changed",
        columns,
        fresh,
        lambda cells: cells,
        n_all=len(fresh) + n_left_out,
        gap_after=part.gap_after if told.is_first else None,
    )
    lines = [table] if fresh or told.is_first else []
    if same:
        lines.append(f"As told, {WAY}: {list_some(same, most=MOST_SAME)}.")
    return "\n".join(lines)


def _without_way(cells: Sequence[str], way: int) -> str:
    kind = "way" if cells[way].replace(".", "").isdigit() else cells[way]
    return " | ".join([*cells[:way], kind, *cells[way + 1 :]])
