"""Types that know each other: what is within a type, and what a message of it holds unsaid."""

from collections.abc import Callable, Mapping
from typing import Any

from mapspeak.ros.definitions.parsing import (
    FLOATS,
    TEXTS,
    TIMES,
    WHOLES,
    Field,
    MessageType,
    parse_definition,
)
from mapspeak.ros.messages import bare_type

TIME_OF_ROS1 = {
    "time": "uint32 secs\nuint32 nsecs",
    "duration": "int32 secs\nint32 nsecs",
}
MOST_NESTED = 32
"""No message is nested deeper; one that is holds itself, by a definition that is wrong."""


class TypeBook:
    """Message types by their names, each read when it is first asked for.

    Args:
        texts: Definitions by name, as "package/Type".
    """

    def __init__(self, texts: Mapping[str, str]) -> None:
        self.texts = {bare_type(name): text for name, text in texts.items()}
        self._types: dict[str, MessageType] = {}

    def knows(self, name: str) -> bool:
        """Return True for a type that is described here, however its name is written."""
        return bare_type(name) in self.texts

    def __getitem__(self, name: str) -> MessageType:
        """Return a type that is known; the times of ROS 1 are types of two numbers."""
        bare = name if name in TIMES else bare_type(name)
        if bare not in self._types:
            text = TIME_OF_ROS1[bare] if bare in TIMES else self.texts[bare]
            self._types[bare] = parse_definition(bare, text)
        return self._types[bare]

    def within(self, name: str) -> list[str]:
        """Return a type and all types within that are known: first itself, then in their order."""
        found = [bare_type(name)]
        for each in found:
            inner = [field.type for field in self[each].fields if field.type in self.texts]
            found += [kind for kind in dict.fromkeys(inner) if kind not in found]
        return found

    def missing(self, name: str) -> list[str]:
        """Return the types within a known one that nobody has described."""
        types = [field.type for each in self.within(name) for field in self[each].fields]
        named = [kind for kind in dict.fromkeys(types) if "/" in kind]
        return [kind for kind in named if kind not in self.texts]

    def default(self, field: Field, depth: int = 0) -> Any:  # noqa: ANN401 - ROS JSON
        """Return what a field holds unless said otherwise."""
        if field.length is not None:
            one = Field(name=field.name, type=field.type)
            return [self.default(one, depth) for _ in range(field.length)]
        if not field.is_message and field.type not in TIMES:
            return _plain_default(field)
        if depth > MOST_NESTED:
            return {}
        inner = self[field.type].fields
        return {each.name: self.default(each, depth + 1) for each in inner}


def _plain_default(field: Field) -> bool | float | str:
    if field.type in FLOATS:
        return _number(field.default, float)
    if field.type in WHOLES:
        return _number(field.default, _whole)
    if field.type in TEXTS:
        return field.default.strip("\"'")
    return field.default.lower() in ("true", "1")


def _whole(text: str) -> int:
    return int(text, 0)


def _number(text: str, read: Callable[[str], float]) -> float:
    """Return a default that is a number; 0 where none is said, or none that can be read."""
    try:
        return read(text)
    except ValueError:
        return read("0")
