"""How large messages are on ROS's own wire, whichever way they came to us."""

from collections.abc import Mapping

import numpy as np

from mapspeak.ros.definitions.types import TEXTS, Field, TypeBook
from mapspeak.ros.messages.fields import Message

SIZES = {
    "bool": 1, "byte": 1, "char": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2,
    "int32": 4, "uint32": 4, "float32": 4, "int64": 8, "uint64": 8, "float64": 8,
    "time": 8, "duration": 8,
}  # fmt: skip
COUNT = 4
"""Bytes of a number before each text and each list without fixed length."""


def measure_message(book: TypeBook, type_name: str, message: Message) -> int:
    """Return the bytes of a message, without the padding of CDR (at most 7 for each value).

    What is missing or of another kind than its type says counts nothing.
    """
    return sum(_measure(book, each, message.get(each.name)) for each in book[type_name].fields)


def _measure(book: TypeBook, field: Field, value: object) -> int:
    if field.length is None:
        return _measure_value(book, field, value)
    count = 0 if field.length else COUNT
    if isinstance(value, str):  # As rosbridge writes bytes in JSON.
        return count + 3 * len(value) // 4
    if field.type in SIZES and isinstance(value, list | tuple | np.ndarray | bytes | bytearray):
        return count + len(value) * SIZES[field.type]
    if isinstance(value, list | tuple):
        return count + sum(_measure_value(book, field, each) for each in value)
    return count


def _measure_value(book: TypeBook, field: Field, value: object) -> int:
    if field.type in SIZES:
        return SIZES[field.type]
    if field.type in TEXTS:
        return COUNT + 1 + len(value.encode(errors="replace")) if isinstance(value, str) else COUNT
    if isinstance(value, Mapping) and book.knows(field.type):
        return measure_message(book, field.type, value)
    return 0
