"""A type in words: every field with its type, down to the plain values."""

from mapspeak.ros.definitions.book import MOST_NESTED, TypeBook
from mapspeak.ros.definitions.parsing import Field, MessageType

MOST_INLINE = 4
MOST_CONSTANTS = 40
INDENT = "  "


def describe_type(book: TypeBook, name: str) -> list[str]:
    """Return a line for each field, indented by its depth; a type is spelled out once."""
    return _Describer(book).lines(book[name], depth=0)


def say_fields(message: MessageType) -> str:
    """Return a type's own fields in a sentence: "Its fields are x: float64, y: float64."."""
    fields = ", ".join(map(_say_field, message.fields))
    return f"Its fields are {fields}." if fields else "It has no fields."


class _Describer:
    def __init__(self, book: TypeBook) -> None:
        self._book = book
        self._told: set[str] = set()

    def lines(self, message: MessageType, *, depth: int) -> list[str]:
        lines: list[str] = []
        for field in message.fields:
            lines += self._of_field(field, depth)
        if message.constants:
            shown = [f"{each.name}={each.value}" for each in message.constants[:MOST_CONSTANTS]]
            lines.append(f"{INDENT * depth}# constants: {', '.join(shown)}")
        return lines

    def _of_field(self, field: Field, depth: int) -> list[str]:
        head = f"{INDENT * depth}{_say_field(field)}"
        if not field.is_message:
            return [head]
        if not self._book.knows(field.type):
            return [f"{head} (not described)"]
        inner = self._book[field.type]
        if _is_short(inner):
            return [f"{head} {{{', '.join(map(_say_field, inner.fields))}}}"]
        if field.type in self._told or depth > MOST_NESTED:
            return [f"{head} (as above)"]
        self._told.add(field.type)
        return [head, *self.lines(inner, depth=depth + 1)]


def _say_field(field: Field) -> str:
    default = f" = {field.default}" if field.default not in ("", "0", "false") else ""
    return f"{field.name}: {field.shown_type}{default}"


def _is_short(message: MessageType) -> bool:
    is_plain = not any(field.is_message for field in message.fields)
    return is_plain and len(message.fields) <= MOST_INLINE and not message.constants
