"""A message type as a value, read from its .msg text."""

import re
from dataclasses import dataclass

from mapspeak.ros.messages import bare_type

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
TIMES = ("time", "duration")
"""What ROS 1 has no message for: seconds and nanoseconds."""
PLAIN = frozenset((*FLOATS, *WHOLES, *TEXTS, *TIMES, "bool"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """One field of a message.

    Attributes:
        type: Of the value, or of one in a list; another message as "package/Type".
        length: Of a list: 0 where it is not fixed; None where it is no list.
        most: How long a list may be at most; None where that is not said.
        most_letters: How long a text may be at most; None where that is not said.
        default: What it holds unless said otherwise, as the definition says it.
    """

    name: str
    type: str
    length: int | None = None
    most: int | None = None
    most_letters: int | None = None
    default: str = ""

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
class Constant:
    """A value that a message type gives a name to; the value is left as text."""

    name: str
    type: str
    value: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageType:
    """What messages of one type look like."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()

    def find(self, name: str) -> Field | None:
        """Find a field by its name."""
        return next((field for field in self.fields if field.name == name), None)


def parse_definition(type_name: str, text: str) -> MessageType:
    """Read the text of one message type; lines that say nothing are passed over.

    Args:
        type_name: Of the type; its package is that of types named without one.
        text: As in a .msg file, remarks included.
    """
    package = type_name.partition("/")[0]
    fields: list[Field] = []
    constants: list[Constant] = []
    for line in text.splitlines():
        found = LINE.fullmatch(line.strip())
        if found is None or line.strip().startswith("#"):
            continue
        if found["rest"].startswith("="):
            constants.append(_constant(found))
        else:
            fields.append(_field(found, package))
    return MessageType(name=bare_type(type_name), fields=tuple(fields), constants=tuple(constants))


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


def _constant(found: re.Match[str]) -> Constant:
    value = found["rest"].removeprefix("=").strip()
    if found["type"] not in TEXTS:
        # In a text the sign for a remark is a sign like any other.
        value = value.partition("#")[0].strip()
    return Constant(name=found["name"], type=found["type"], value=value)


def _field(found: re.Match[str], package: str) -> Field:
    length = None
    if found["list"]:
        length = int(found["length"] or 0)
    return Field(
        name=found["name"],
        type=_full_type(found["type"], package),
        length=length,
        most=int(found["most"]) if found["most"] else None,
        most_letters=int(found["most_letters"]) if found["most_letters"] else None,
        default=found["rest"].partition("#")[0].strip(),
    )


def _full_type(name: str, package: str) -> str:
    if name in PLAIN:
        return name
    if "/" in name:
        return bare_type(name)
    return HEADER if name == "Header" else f"{package}/{name}"
