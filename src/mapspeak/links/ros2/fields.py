"""The types of a message's fields, as rclpy names them."""

import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from mapspeak.errors import LinkError

FIELD = re.compile(
    r"sequence<(?P<any>.+?)(?:, (?P<most>\d+))?>|(?P<each>[^\[\]]+)\[(?P<length>\d+)\]|(?P<one>.+)"
)
TEXT = re.compile(r"(?P<text>w?string)<(?P<most>\d+)>")
DEFINED_AS = {"boolean": "bool", "octet": "byte", "float": "float32", "double": "float64"}
"""As .msg files name what rclpy names as IDL does."""
BYTES = ("uint8", "octet")
NUMBERS = (
    *("float", "double", "int8", "uint8", "int16", "uint16"),
    *("int32", "uint32", "int64", "uint64"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldType:
    """What a field holds.

    Attributes:
        base: Of one value: "double", "string" or "package/Type".
        is_list: There are many.
        length: How many, where that is fixed.
        most: How many at most, where that is limited.
        most_letters: Of a text, where that is limited.
    """

    base: str
    is_list: bool = False
    length: int | None = None
    most: int | None = None
    most_letters: int | None = None

    @property
    def is_message(self) -> bool:
        """True where each value is a message itself."""
        return "/" in self.base

    @property
    def definition(self) -> str:
        """As a .msg file writes it."""
        base = DEFINED_AS.get(self.base, self.base)
        letters = "" if self.most_letters is None else f"<={self.most_letters}"
        most = "" if self.most is None else f"<={self.most}"
        number = most if self.length is None else str(self.length)
        return f"{base}{letters}[{number}]" if self.is_list else f"{base}{letters}"


@cache
def fields_of(message_class: Any) -> dict[str, FieldType]:  # noqa: ANN401 - rclpy has no types
    """Gives the fields of a class of messages, in their order."""
    return {
        name: _read_type(text)
        for name, text in message_class.get_fields_and_field_types().items()
        # An empty message has a field that ROS never shows.
        if name != "structure_needs_at_least_one_member"
    }


def write_definition(message_class: Any) -> str:  # noqa: ANN401 - likewise
    """Return the definition of a class of messages, as far as rclpy tells it."""
    fields = fields_of(message_class)
    return "\n".join(f"{kind.definition} {name}" for name, kind in fields.items())


def _read_type(text: str) -> FieldType:
    found = FIELD.fullmatch(text)
    if found is None:
        raise LinkError(
            f"A field of the type {text[:80]!r} is unknown to us.", hint="Please report it."
        )
    base = found["any"] or found["each"] or found["one"]
    limited = TEXT.fullmatch(base)
    return FieldType(
        base=limited["text"] if limited else base,
        is_list=found["one"] is None,
        length=int(found["length"]) if found["length"] else None,
        most=int(found["most"]) if found["most"] else None,
        most_letters=int(limited["most"]) if limited else None,
    )
