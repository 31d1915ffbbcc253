"""A ROS message type as flat parameters, and messages built of arguments and read back."""

import base64
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from mapspeak.errors import LinkError
from mapspeak.memory.quoting import clean_line
from mapspeak.ros.definitions.types import FLOATS, TEXTS, TIMES, WHOLES, Field, TypeBook, look_up
from mapspeak.ros.messages.fields import Message, bare_type
from mapspeak.skill import JsonValue, Schema, parameter

MOST_FLAT = 40
"""A type with more plain fields keeps its messages as objects."""
MOST_LISTED = 1000
"""A list of no stated length takes no more from a model."""
MOST_DESCRIBED = 3000
"""Fields, with those within others; no type that people use comes near."""
MOST_IN_LIST = 32
"""Of bytes; longer ones are given as one text in base64."""
MOST_TEXT = 100_000
MOST_REMARK = 100

UNITS = {
    "geometry_msgs/Point": dict.fromkeys("xyz", "m"),
    "geometry_msgs/Point32": dict.fromkeys("xyz", "m"),
    "geometry_msgs/Transform": {"translation": "m"},
    "geometry_msgs/Twist": {"linear": "m/s", "angular": "rad/s"},
    "geometry_msgs/Accel": {"linear": "m/s2", "angular": "rad/s2"},
    "geometry_msgs/Wrench": {"force": "N", "torque": "Nm"},
    "geometry_msgs/Pose2D": {"x": "m", "y": "m", "theta": "rad"},
    "control_msgs/GripperCommand": {"position": "m", "max_effort": "N"},
    "builtin_interfaces/Time": {"sec": "s", "nanosec": "ns"},
    "builtin_interfaces/Duration": {"sec": "s", "nanosec": "ns"},
    "time": {"secs": "s", "nsecs": "ns"},
    "duration": {"secs": "s", "nsecs": "ns"},
}
"""Of the fields of well-known types; a field that is a message hands its own on."""


@dataclass(frozen=True)
class MessageLayout:
    """A message type as the parameters of a skill.

    Attributes:
        parameters: By name, in the order of the fields.
        paths: Where in the message the value of each belongs.
    """

    parameters: Mapping[str, Schema]
    paths: Mapping[str, tuple[str, ...]]

    def build(self, arguments: Mapping[str, JsonValue]) -> dict[str, Any]:
        """Return the message with some arguments; missing ones stay out."""
        message: dict[str, Any] = {}
        for name, (*above, last) in self.paths.items():
            if name in arguments:
                inner = message
                for part in above:
                    inner = inner.setdefault(part, {})
                inner[last] = arguments[name]
        return message

    def read(self, message: Message) -> dict[str, JsonValue]:
        """Return a message as arguments that would build it; large lists by their length."""
        found: dict[str, JsonValue] = {}
        for name, path in self.paths.items():
            value: Any = message
            for part in path:
                value = value.get(part) if isinstance(value, Mapping) else None
            if value is not None:
                found[name] = _read_value(self.parameters[name], value)
        return found


def _read_value(schema: Schema, value: Any) -> JsonValue:  # noqa: ANN401 - ROS JSON
    """Return a value of a message as its argument would be given."""
    if schema["type"] == "object" and isinstance(value, Mapping):
        return {name: _read_value(schema["properties"][name], each) for name, each in value.items()}
    is_base64 = "contentEncoding" in schema
    if schema["type"] != "array" and not is_base64:
        return value.item() if isinstance(value, np.generic) else value
    value = base64.b64decode(value) if isinstance(value, str) else value
    if is_base64:
        data = bytes(value)
        return base64.b64encode(data).decode() if len(data) <= MOST_TEXT else f"({len(data)} bytes)"
    listed = value.tolist() if isinstance(value, np.ndarray) else list(value)
    if len(listed) > MOST_LISTED:
        return f"({len(listed)} values)"
    return [_read_value(schema["items"], each) for each in listed]


def build_layout(
    book: TypeBook, type_name: str, *, reserved: frozenset[str] = frozenset()
) -> MessageLayout:
    """Return a message type as parameters; one that would have a reserved name is called "its_…".

    LinkError where a type within is not described, or holds itself, or there are too many.
    """
    builder, way = _Builder(book), (bare_type(type_name),)
    leaves = dict(islice(builder.leaves(way, path=(), unit=""), MOST_FLAT + 1))
    if len(leaves) > MOST_FLAT:
        fields = book[type_name].fields
        leaves = {(each.name,): builder.describe(way, each, "") for each in fields}
    # Where two paths joined by one low line are the same, two stand between their parts.
    glue = "_" if len({"_".join(path) for path in leaves}) == len(leaves) else "__"
    joined = {glue.join(path): path for path in leaves}
    paths = {f"its_{name}" if name in reserved else name: path for name, path in joined.items()}
    return MessageLayout({name: leaves[path] for name, path in paths.items()}, paths)


class _Builder:
    """Makes parameters of fields; a way is the type that has the field, after those around it."""

    def __init__(self, book: TypeBook) -> None:
        self._book = book
        self._n_described = 0

    def leaves(
        self, way: tuple[str, ...], *, path: tuple[str, ...], unit: str
    ) -> Iterator[tuple[tuple[str, ...], Schema]]:
        """Yield the fields of a message that are no messages themselves, all the way down."""
        for field in look_up(self._book, way[-1], above=way[:-1]).fields:
            where = (*path, field.name)
            if _is_message(field) and field.length is None:
                its_unit = _unit(way, field, unit)
                yield from self.leaves((*way, field.type), path=where, unit=its_unit)
            else:
                yield where, self.describe(way, field, unit)

    def describe(self, way: tuple[str, ...], field: Field, unit: str) -> Schema:
        """Return what a field may be, whatever it holds."""
        self._n_described += 1
        if self._n_described > MOST_DESCRIBED:
            raise LinkError(
                f"A type with {way[-1]} within has more than {MOST_DESCRIBED} fields.",
                hint="No model could fill it in: leave it out.",
            )
        unit, remark = _unit(way, field, unit), self._remark(way, field)
        if field.length is None:
            return {**self._one(way, field, unit), **({"description": remark} if remark else {})}
        longest = field.length or field.most or MOST_LISTED
        if field.type == "uint8" and longest > MOST_IN_LIST:
            encoded = {"contentEncoding": "base64", "maxLength": MOST_TEXT}
            return parameter("string", **encoded, description=remark)
        limits = {"minItems": field.length or None, "maxItems": longest}
        items = self._one(way, field, "")
        return parameter("array", items=items, **limits, unit=unit, description=remark)

    def _one(self, way: tuple[str, ...], field: Field, unit: str) -> Schema:
        """Return what a field, or one of its list, may be."""
        if _is_message(field):
            inner, message = (*way, field.type), look_up(self._book, field.type, above=way)
            within = {each.name: self.describe(inner, each, unit) for each in message.fields}
            return parameter("object", properties=within)
        default = self._book.default(field) if field.default and field.length is None else None
        if field.type in TEXTS:
            return parameter("string", maxLength=field.most_letters or MOST_TEXT, default=default)
        is_number = field.type in FLOATS
        kind = "number" if is_number else "integer" if field.type in WHOLES else "boolean"
        least, most = WHOLES.get(field.type, (None, None))
        return parameter(kind, unit=unit, minimum=least, maximum=most, default=default)

    def _remark(self, way: tuple[str, ...], field: Field) -> str:
        """Return the definition's comment on a field; else the constants, of an only number."""
        message, said = self._book[way[-1]], field.comment
        wholes = [each for each in message.fields if each.type in WHOLES]
        if not said and message.constants and wholes == [field]:
            said = ", ".join(f"{name}={value}" for name, value in message.constants.items())
        return clean_line(said)[:MOST_REMARK]


def _is_message(field: Field) -> bool:
    return field.is_message or field.type in TIMES


def _unit(way: tuple[str, ...], field: Field, inherited: str) -> str:
    return UNITS.get(way[-1], {}).get(field.name, inherited)
