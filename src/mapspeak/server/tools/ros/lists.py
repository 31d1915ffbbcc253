"""Lists a page at a time, filtered by name."""

import fnmatch
from collections.abc import Callable, Sequence
from typing import Annotated, TypeVar

from pydantic import Field

Item = TypeVar("Item")

PAGE_SIZE = 40

Filter = Annotated[
    str | None,
    Field(description='part of a name, or a pattern: "scan", "/robot1/*"', max_length=200),
]
Page = Annotated[int, Field(description="1 is the first", ge=1, le=1000)]


def choose(
    items: Sequence[Item], pattern: str | None, *, texts: Callable[[Item], Sequence[str]]
) -> list[Item]:
    """Gives the items one of whose texts a pattern fits; one without a star fits any part."""
    if not pattern:
        return list(items)
    wanted = pattern if any(sign in pattern for sign in "*?[") else f"*{pattern}*"
    return [
        item
        for item in items
        if any(fnmatch.fnmatchcase(text.lower(), wanted.lower()) for text in texts(item))
    ]


def say_page(
    what: str, items: Sequence[Item], page: int, *, line: Callable[[Item], str], n_all: int
) -> str:
    """Gives a heading and a line for each item of a page.

    Args:
        what: The items are, in the plural.
        items: All that were chosen.
        page: 1 is the first.
        line: Says one.
        n_all: How many there were to choose from.
    """
    shown = items[(page - 1) * PAGE_SIZE : page * PAGE_SIZE]
    of_all = "" if len(items) == n_all else f" of {n_all}"
    head = f"{what}: {len(items)}{of_all}"
    n_pages = max(1, -(-len(items) // PAGE_SIZE))
    if page > n_pages:
        last = "the only one" if n_pages == 1 else "the last"
        return f"{head}. There is no page {page}: page {n_pages} is {last}."
    if n_pages > 1:
        head += f", page {page} of {n_pages}"
    return "\n".join([head, *(line(item) for item in shown)])
