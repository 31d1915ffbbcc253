"""Message types as one ROS knows them: described, filled in, and what does not fit refused."""

import re
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.server.definitions import MESSAGES, SERVICES
from mapspeak.ros.messages import Dialect, bare_type

__all__ = ["Interfaces"]

FIELD = re.compile(r"(?P<type>[\w/]+)(?P<array>\[\d*\])? (?P<name>\w+)(?: (?P<default>\S+))?")
CONSTANT = re.compile(r"[\w/]+ (?P<name>\w+)=(?P<value>\S+)")
FLOATS = ("float32", "float64")
WHOLES = {
    "byte": (-128, 255), "char": (0, 255), "int8": (-(2**7), 2**7 - 1), "uint8": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1), "uint16": (0, 2**16 - 1), "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1), "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**64 - 1),
}  # fmt: skip
TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}
PLAIN_DEFAULTS = {"string": "", "bool": False}
RULER = "=" * 80
GENERATED = re.compile(r"_(Request|Response|Goal|Result|FeedbackMessage|Feedback)$")
"""What ROS 2 makes of services and actions; no message of a person has an underscore."""
KIND_OF_GENERATED = {
    **dict.fromkeys(("Request", "Response"), "srv"),
    **dict.fromkeys(("Goal", "Result", "Feedback", "FeedbackMessage"), "action"),
}

Answer = Callable[[dict[str, Any]], Awaitable[dict[str, Any]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldType:
    """One field of a message.

    Attributes:
        name: Of the field.
        type: Of the value, or of one in a list.
        length: Of a list: 0 where it is not fixed; None where it is no list.
        default: What it holds unless said otherwise, as the definition says it.
    """

    name: str
    type: str
    length: int | None
    default: str


class Interfaces:
    """The message types of one dialect."""

    def __init__(self, dialect: Dialect) -> None:
        self._dialect = dialect
        self._texts = {name: self._translate(name, text) for name, text in MESSAGES.items()}
        for name, (request, response) in SERVICES.items():
            self._texts[f"{name}_Request"] = self._translate(name, request)
            self._texts[f"{name}_Response"] = self._translate(name, response)
        self._fields = {name: _parse(text) for name, text in self._texts.items()}
        self._with_fixed_array = {name for name in self._texts if self._finds_fixed_array(name)}

    @property
    def names(self) -> list[str]:
        """All messages, services and actions, as this ROS writes their names."""
        return sorted({GENERATED.sub("", self.said(name)) for name in self._texts})

    def said(self, name: str) -> str:
        """Gives a type's name as this ROS writes it; one that is no message keeps its name."""
        generated = GENERATED.search(name)
        if "/" not in name or self._dialect is Dialect.ROS1:
            return name
        kind = "msg" if generated is None else KIND_OF_GENERATED[generated[1]]
        package, _, last = bare_type(name).partition("/")
        return f"{package}/{kind}/{last}"

    def knows(self, name: str) -> bool:
        """True for a type that is described here, however its name is written."""
        return bare_type(name) in self._texts

    def fields_of(self, name: str) -> list[FieldType]:
        """Gives a type's fields in their order."""
        return self._fields[bare_type(name)]

    def has_fixed_array(self, name: str) -> bool:
        """True when a list of fixed length is somewhere within."""
        return bare_type(name) in self._with_fixed_array

    def full_text(self, name: str) -> str:
        """Gives a type's definition and those of all types within, as `gendeps --cat` does."""
        first, *others = self._within(bare_type(name))
        parts = [self._texts[first]]
        parts += [f"{RULER}\nMSG: {each}\n{self._texts[each]}" for each in others]
        return "\n".join(parts)

    def details(self, name: str) -> list[dict[str, object]]:
        """Gives what rosapi's message_details says of a type and of all types within."""
        return [self._detail(each) for each in self._within(bare_type(name))]

    def fill(self, name: str, message: object) -> dict[str, Any]:
        """Gives a client's message with all fields; those left out hold their defaults.

        Raises:
            LinkError: A field is not of that type, or does not hold what it should.
        """
        if not isinstance(message, Mapping):
            raise _misfit(name, "message", message)
        fields = {each.name: each for each in self.fields_of(name)}
        for given in message:
            if given not in fields:
                raise LinkError(
                    f"Message type {name} does not have a field {given}.", hint="Leave it out."
                )
        return {
            each.name: self._fill_field(each, message[each.name])
            if each.name in message
            else self._default(each)
            for each in fields.values()
        }

    def filled(self, name: str, answer: Answer) -> Answer:
        """Gives what answers a request of that type, once it has all its fields."""

        async def reply(request: dict[str, Any]) -> dict[str, Any]:
            return await answer(self.fill(name, request))

        return reply

    def _fill_field(self, field: FieldType, value: object) -> Any:  # noqa: ANN401 - ROS JSON
        if field.length is None:
            return self._fill_value(field, value)
        if field.type == "uint8" and isinstance(value, str | bytes):
            return value
        is_list = isinstance(value, list | tuple | np.ndarray)
        if not is_list or (field.length and len(value) != field.length):  # type: ignore[arg-type]
            raise _misfit(field.type, field.name, value)
        if isinstance(value, np.ndarray):
            return value
        return [self._fill_value(field, each) for each in value]  # type: ignore[attr-defined]

    def _fill_value(self, field: FieldType, value: object) -> Any:  # noqa: ANN401 - ROS JSON
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        match field.type:
            case "string" if isinstance(value, str) and _is_unicode(value):
                return value
            case "bool" if isinstance(value, bool | int):
                return bool(value)
            case kind if kind in FLOATS and is_number:
                return value
            case kind if kind in WHOLES and is_number and isinstance(value, int):
                low, high = WHOLES[kind]
                if low <= value <= high:
                    return value
            case "time" | "duration" if isinstance(value, Mapping):
                # A stamp in the words of ROS 2 is silently replaced.
                is_known = {"secs", "nsecs"} <= set(value)
                return dict(value) if is_known else {"secs": 0, "nsecs": 0}
            case kind if kind in self._texts:
                return self.fill(kind, value)
        raise _misfit(field.type, field.name, value)

    def _default(self, field: FieldType) -> Any:  # noqa: ANN401 - ROS JSON
        if field.length is not None:
            one = FieldType(name=field.name, type=field.type, length=None, default="")
            return [self._default(one) for _ in range(field.length)]
        if field.type in FLOATS:
            return float(field.default or 0.0)
        if field.type in WHOLES:
            return 0
        if field.type in PLAIN_DEFAULTS:
            return PLAIN_DEFAULTS[field.type]
        return (
            {"secs": 0, "nsecs": 0} if field.type in TIMES.values() else self.fill(field.type, {})
        )

    def _finds_fixed_array(self, name: str) -> bool:
        return any(
            bool(each.length) or (each.type in self._texts and self._finds_fixed_array(each.type))
            for each in self._fields[name]
        )

    def _within(self, name: str) -> list[str]:
        found = [name]
        for each in found:
            inner = [field.type for field in self.fields_of(each) if field.type in self._texts]
            found += [kind for kind in dict.fromkeys(inner) if kind not in found]
        return found

    def _detail(self, name: str) -> dict[str, object]:
        fields = self.fields_of(name)
        constants = [CONSTANT.fullmatch(line) for line in self._texts[name].splitlines()]
        known = [each for each in constants if each is not None]
        return {
            "type": self.said(name),
            "fieldnames": [each.name for each in fields],
            "fieldtypes": [self.said(each.type) for each in fields],
            "fieldarraylen": [-1 if each.length is None else each.length for each in fields],
            "examples": [_example(each) for each in fields],
            "constnames": [each["name"] for each in known],
            "constvalues": [each["value"] for each in known],
        }

    def _translate(self, name: str, text: str) -> str:
        if self._dialect is Dialect.ROS2:
            return text
        for ros2, ros1 in TIMES.items():
            text = text.replace(ros2, ros1)
        if name == "std_msgs/Header":
            text = f"uint32 seq\n{text}"
        if name == "geometry_msgs/Quaternion":
            text = re.sub(r" \d$", "", text, flags=re.MULTILINE)
        if name == "sensor_msgs/CameraInfo":
            text = re.sub(r"\b([dkrp])$", lambda match: match[1].upper(), text, flags=re.MULTILINE)
        return text


def _is_unicode(text: str) -> bool:
    """False for half a surrogate pair, which JSON can say and no wire can carry."""
    return not any("\ud800" <= sign <= "\udfff" for sign in text)


def _parse(text: str) -> list[FieldType]:
    found = (FIELD.fullmatch(line) for line in text.splitlines())
    return [
        FieldType(
            name=each["name"],
            type=each["type"],
            length=int(each["array"][1:-1] or 0) if each["array"] else None,
            default=each["default"] or "",
        )
        for each in found
        if each is not None
    ]


def _example(field: FieldType) -> str:
    if field.length is not None:
        return "[]"
    if field.type in FLOATS:
        return "0.0"
    if field.type in WHOLES:
        return "0"
    return {"string": "", "bool": "False"}.get(field.type, "{}")


def _misfit(wanted: str, name: str, value: object) -> LinkError:
    return LinkError(
        f"Expected {wanted} in {name}, got {type(value).__name__}.", hint="Look the type up."
    )
