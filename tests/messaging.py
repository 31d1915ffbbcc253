"""Any message of a type, for tests of properties."""

from typing import Any

import numpy as np
from hypothesis import strategies as st

from mapspeak.ros.definitions.types import FLOATS, TIMES, WHOLES, Field, TypeBook

MOST_LISTED = 3
MOST_LETTERS = 6
UNSIGNED = {"byte": (0, 255)}
"""In ROS 2, where bytes are read as they are."""


def messages_of(book: TypeBook, name: str) -> st.SearchStrategy[dict[str, Any]]:
    """Give messages of a type with all fields, or without some that then hold their defaults."""
    fields = {field.name: _values_of(book, field) for field in book[name].fields}
    return st.fixed_dictionaries({}, optional=fields) | st.fixed_dictionaries(fields)


def _values_of(book: TypeBook, field: Field) -> st.SearchStrategy[Any]:
    one = _one_of(book, field)
    if field.length is None:
        return one
    most = MOST_LISTED if field.most is None else min(field.most, MOST_LISTED)
    return st.lists(one, min_size=field.length or 0, max_size=field.length or most)


def _one_of(book: TypeBook, field: Field) -> st.SearchStrategy[Any]:
    if field.is_message or field.type in TIMES:
        return st.deferred(lambda: messages_of(book, field.type))
    if field.type == "bool":
        return st.booleans()
    if field.type == "string":
        letters = st.characters(exclude_characters="\x00", codec="utf-8")
        return st.text(letters, max_size=min(field.most_letters or MOST_LETTERS, MOST_LETTERS))
    if field.type in FLOATS:
        most = float(np.finfo(field.type).max)
        return st.floats(-most, most, width=32 if field.type == "float32" else 64)
    low, high = UNSIGNED.get(field.type, WHOLES.get(field.type, (0, 0)))
    return st.integers(low, high)


def plain(value: object) -> Any:  # noqa: ANN401 - ROS JSON
    """Give what was read with lists in place of arrays and bytes."""
    match value:
        case dict():
            return {name: plain(each) for name, each in value.items()}
        case list():
            return [plain(each) for each in value]
        case bytes():
            return list(value)
        case np.ndarray():
            return value.tolist()
        case _:
            return value
