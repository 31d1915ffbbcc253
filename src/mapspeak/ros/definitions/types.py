"""Message types as values, read from .msg texts; books of them, and how large messages are."""

import dataclasses
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Message, bare_type

LINE = re.compile(
    r"(?P<type>[\w/]+)(?:<=(?P<most_letters>\d+))?"
    r"(?P<list>\[(?:(?P<length>\d+)|<=(?P<most>\d+))?\])?\s+(?P<name>\w+)\s*(?P<rest>.*)"
)
HEADER = "std_msgs/Header"
FLOATS = ("float32", "float64")
WHOLES = {
    "byte": (-128, 255), "char": (0, 255), "int8": (-(2**7), 2**7 - 1), "uint8": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1), "uint16": (0, 2**16 - 1), "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1), "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**64 - 1),
}  # fmt: skip
"""The kinds of whole numbers, each with the least and the largest."""
TEXTS = ("string", "wstring")
TIMES = {"time": "uint32 secs\nuint32 nsecs", "duration": "int32 secs\nint32 nsecs"}
"""Primitive types of ROS 1 that have no message, as the text that one would have."""
PLAIN = frozenset((*FLOATS, *WHOLES, *TEXTS, *TIMES, "bool"))
SIZES = {
    "bool": 1, "byte": 1, "char": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2,
    "int32": 4, "uint32": 4, "float32": 4, "int64": 8, "uint64": 8, "float64": 8,
    "time": 8, "duration": 8,
}  # fmt: skip
COUNT = 4
"""Bytes of a number before each text and each list without fixed length."""
OF_ACTION = ("Goal", "Result", "Feedback", "FeedbackMessage")
OF_SERVICE = ("Request", "Response")
OF_ACTIONS_SERVICE = ("SendGoal", "GetResult")


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One field of a message.

    Attributes:
        type: Of the value, or of one in a list; another message as "package/Type".
        length: Of a list: 0 where it is not fixed; None for a field that is not a list.
        most: The largest length of a list; None without a bound.
        most_letters: The largest length of a text; None without a bound.
        default: Its default, as written in the definition.
        comment: On it, as written in the definition.
    """

    name: str
    type: str
    length: int | None = None
    most: int | None = None
    most_letters: int | None = None
    default: str = ""
    comment: str = dataclasses.field(default="", compare=False)

    @property
    def is_message(self) -> bool:
        """True when its values are messages themselves."""
        return self.type not in PLAIN

    @property
    def shown_type(self) -> str:
        """Its type as a definition says it, such as "float64[36]"."""
        letters = "" if self.most_letters is None else f"<={self.most_letters}"
        if self.length is None:
            return f"{self.type}{letters}"
        inside = f"<={self.most}" if self.most is not None else str(self.length or "")
        return f"{self.type}{letters}[{inside}]"


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageType:
    """The definition of a type of messages; the values of constants are left as text, by name."""

    name: str
    fields: tuple[Field, ...]
    constants: Mapping[str, str]

    def find(self, name: str) -> Field | None:
        """Find a field by its name."""
        return next((field for field in self.fields if field.name == name), None)


def parse_definition(type_name: str, text: str) -> MessageType:
    """Read the text of one message type; lines that say nothing are passed over."""
    package = type_name.partition("/")[0]
    fields: list[Field] = []
    constants: dict[str, str] = {}
    for line in text.splitlines():
        found = LINE.fullmatch(line.strip())
        if found is None or line.strip().startswith("#"):
            continue
        if found["rest"].startswith("="):
            constants[found["name"]] = _value_of(found)
        else:
            fields.append(_field(found, package))
    return MessageType(name=bare_type(type_name), fields=tuple(fields), constants=constants)


def find_odd_lines(text: str) -> list[str]:
    """Return the lines of a definition that define nothing and are no remarks."""
    return [line.strip() for line in text.splitlines() if _is_odd(line.strip())]


def _is_odd(line: str) -> bool:
    if not line or line.startswith("#"):
        return False
    found = LINE.fullmatch(line)
    if found is None:
        return True
    rest = found["rest"].partition("#")[0].strip()
    # After the name comes a constant's value, or the default of a plain value.
    return bool(rest) and not rest.startswith("=") and found["type"] not in PLAIN


def _value_of(constant: re.Match[str]) -> str:
    value = constant["rest"].removeprefix("=").strip()
    # In a text the sign for a remark is a sign like any other.
    return value if constant["type"] in TEXTS else value.partition("#")[0].strip()


def _field(found: re.Match[str], package: str) -> Field:
    length = None
    if found["list"]:
        length = int(found["length"] or 0)
    default, _, comment = found["rest"].partition("#")
    return Field(
        name=found["name"],
        type=_full_type(found["type"], package),
        length=length,
        most=int(found["most"]) if found["most"] else None,
        most_letters=int(found["most_letters"]) if found["most_letters"] else None,
        default=default.strip(),
        comment=comment.strip("# "),
    )


def _full_type(name: str, package: str) -> str:
    if name in PLAIN:
        return name
    if "/" in name:
        return bare_type(name)
    return HEADER if name == "Header" else f"{package}/{name}"


MOST_NESTED = 32
"""No message is nested deeper; one that is holds itself, by a definition that is wrong."""


class TypeBook:
    """Message types by their names, each read when it is first asked for."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        self.texts = {bare_type(name): text for name, text in texts.items()}
        self._types: dict[str, MessageType] = {}

    def knows(self, name: str) -> bool:
        """Return True for a type that is described here, however its name is written."""
        return name in TIMES or bare_type(name) in self.texts

    def __getitem__(self, name: str) -> MessageType:
        """Return a type that is known; the times of ROS 1 are types of two numbers."""
        bare = name if name in TIMES else bare_type(name)
        if bare not in self._types:
            text = TIMES[bare] if bare in TIMES else self.texts[bare]
            self._types[bare] = parse_definition(bare, text)
        return self._types[bare]

    def within(self, name: str) -> list[str]:
        """Return a type and all types within that are known: first itself, then in their order."""
        found = [bare_type(name)]
        for each in found:
            inner = [field.type for field in self[each].fields if field.type in self.texts]
            found += [kind for kind in dict.fromkeys(inner) if kind not in found]
        return found

    def texts_of(self, names: Iterable[str]) -> dict[str, str]:
        """Return the texts of some types, and of all types within that are known."""
        listed = list(names)
        within = [each for name in listed for each in self.within(name)]
        return {each: self.texts[each] for each in dict.fromkeys((*listed, *within))}

    def missing(self, name: str) -> list[str]:
        """Return the types within a known one that are not described."""
        types = [field.type for each in self.within(name) for field in self[each].fields]
        named = [kind for kind in dict.fromkeys(types) if "/" in kind]
        return [kind for kind in named if kind not in self.texts]

    def fill(self, name: str, message: Mapping[str, Any]) -> dict[str, Any]:
        """Return a checked message with all its fields; those left out hold their defaults."""
        return {
            field.name: self._fill_field(field, message[field.name])
            if field.name in message
            else self.default(field)
            for field in self[name].fields
        }

    def _fill_field(self, field: Field, value: Any) -> Any:  # noqa: ANN401 - ROS JSON
        if not field.is_message and field.type not in TIMES:
            return value
        if field.length is None:
            return self.fill(field.type, value)
        return [self.fill(field.type, each) for each in value]

    def default(self, field: Field, depth: int = 0) -> Any:  # noqa: ANN401 - ROS JSON
        """Return the default of a field."""
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


NOTHING = Field(name="structure_needs_at_least_one_member", type="uint8")
"""The field that ROS 2 puts in a message without fields."""


def name_in_ros2(name: str) -> str:
    """Return a type as "package/kind/Type"; the parts of services and actions by their names."""
    package, _, last = bare_type(name).partition("/")
    stem, _, part = last.rpartition("_")
    if part in OF_ACTION or stem.rpartition("_")[2] in OF_ACTIONS_SERVICE:
        return f"{package}/action/{last}"
    return f"{package}/{'srv' if part in OF_SERVICE else 'msg'}/{last}"


def hash_type(book: TypeBook, name: str) -> str:
    """Return a type's hash, as nodes of ROS 2 tell it since Iron: "RIHS01_...".

    Raises:
        LinkError: It or a type within is unknown, contains itself, or cannot be encoded in CDR.
    """
    from rosbags.typesys.store import Typestore  # noqa: PLC0415 - takes 0.1 s

    store = Typestore()
    _add(store.fielddefs, book, name, above=())
    return store.hash_rihs01(name_in_ros2(name))


def _add(found: dict[str, Any], book: TypeBook, name: str, *, above: tuple[str, ...]) -> None:
    message = look_up(book, name, above=above)
    if name_in_ros2(name) in found:
        return
    for kind in dict.fromkeys(field.type for field in message.fields if field.is_message):
        _add(found, book, kind, above=(*above, message.name))
    fields = message.fields or (NOTHING,)
    found[name_in_ros2(name)] = ([], [(field.name, _describe(field)) for field in fields])


def _describe(field: Field) -> Any:  # noqa: ANN401 - rosbags' nested tuples
    if field.is_message:
        return describe_field(field, name_in_ros2(field.type))
    return describe_field(field, "uint8" if field.type == "char" else field.type)


def look_up(book: TypeBook, name: str, *, above: tuple[str, ...]) -> MessageType:
    """Return a type that is within others.

    Raises:
        LinkError: It is not described, or holds itself.
    """
    bare = bare_type(name)
    if bare in above or len(above) > MOST_NESTED:
        raise LinkError(
            f"The type {above[0][:80]} holds itself, in {above[-1][:80]}.",
            hint="No message can be of such a type: correct its definition.",
        )
    if not book.knows(name):
        raise LinkError(
            f"The type {bare[:80]} is not described.",
            hint="Robots of ROS 2 Jazzy and later tell it for topics; for others take rosbridge, "
            "or give its definition where a tool asks for one.",
        )
    return book[name]


def describe_field(field: Field, kind: str) -> Any:  # noqa: ANN401 - rosbags' nested tuples
    """Return a field as rosbags describes it; its kind is one of number, or its messages' name.

    Raises:
        LinkError: CDR cannot hold it.
    """
    from rosbags.interfaces import Nodetype  # noqa: PLC0415 - as above

    if field.type == "wstring":
        raise LinkError(
            f"The field {field.name[:80]} holds a wstring, which mapspeak has no CDR for.",
            hint="Take rosbridge for it.",
        )
    is_name = field.is_message
    one: Any = (
        (Nodetype.NAME, kind) if is_name else (Nodetype.BASE, (kind, field.most_letters or 0))
    )
    if field.length is None:
        return one
    if field.length:
        return (Nodetype.ARRAY, (one, field.length))
    return (Nodetype.SEQUENCE, (one, field.most or 0))
