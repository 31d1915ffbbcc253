"""The types of the ROS on this machine, and their messages as plain values."""

import array
import base64
import importlib
import re
import sys
from collections.abc import Callable, Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from mapspeak.errors import LinkError
from mapspeak.ros.definitions.checking import check_message
from mapspeak.ros.definitions.texts import ACTION_PARTS, SERVICE_PARTS, split_parts
from mapspeak.ros.definitions.types import FLOATS, WHOLES, Field, TypeBook, parse_definition
from mapspeak.ros.definitions.typestore import NOTHING
from mapspeak.ros.messages.fields import TYPE, bare_type

FIELD = re.compile(
    r"sequence<(?P<any>.+?)(?:, (?P<most>\d+))?>|(?P<each>[^\[\]]+)\[(?P<length>\d+)\]|(?P<one>.+)"
)
TEXT = re.compile(r"(?P<text>w?string)<(?P<most>\d+)>")
DEFINED_AS = {"boolean": "bool", "octet": "byte", "float": "float32", "double": "float64"}
"""As .msg files name what rclpy names as IDL does."""
NUMBERS = frozenset((*FLOATS, *WHOLES)) - {"byte", "char"}


@cache
def fields_of(message_class: Any) -> dict[str, Field]:  # noqa: ANN401 - rclpy has no types
    """Return the fields of a class of messages, in their order."""
    message = parse_definition(name_of(message_class), write_definition(message_class))
    return {field.name: field for field in message.fields}


def write_definition(message_class: Any) -> str:  # noqa: ANN401 - likewise
    """Return the definition of a class of messages, as far as rclpy tells it."""
    types = message_class.get_fields_and_field_types()
    # An empty message has a field that ROS never shows.
    return "\n".join(
        f"{_write_type(text)} {name}" for name, text in types.items() if name != NOTHING.name
    )


def _write_type(text: str) -> str:
    """Return "float64[<=3]", as .msg files write it, for "sequence<double, 3>"."""
    found = FIELD.fullmatch(text)
    if found is None:
        raise LinkError(
            f"A field of the type {text[:80]!r} is unknown to us.", hint="Please report it."
        )
    base = found["any"] or found["each"] or found["one"]
    limited = TEXT.fullmatch(base)
    base = f"{limited['text']}<={limited['most']}" if limited else DEFINED_AS.get(base, base)
    if found["one"]:
        return base
    return f"{base}[{'<=' + found['most'] if found['most'] else found['length'] or ''}]"


KINDS = ("msg", "srv", "action")
NAMED = {"msg": "message", "srv": "service", "action": "action"}

RosClass = Any  # rclpy has no types


def find_message(type_name: str, kind: str = "msg") -> RosClass:
    """Return the class of a type of messages, or of another kind: "srv" or "action".

    Raises:
        LinkError: The name is none, or this Python does not have the type.
    """
    found = find_class(type_name, kind)
    if found is not None:
        return found
    if not TYPE.fullmatch(type_name):
        raise LinkError(f"{type_name[:80]!r} is no type.", hint=f'Such as "package/{kind}/Type".')
    bare = bare_type(type_name)
    package = bare.partition("/")[0].replace("_", "-")[:60]
    raise LinkError(
        f"This Python's ROS knows no {NAMED[kind]} of the type {bare[:80]}.",
        hint=f"Install the package (`sudo apt install ros-$ROS_DISTRO-{package}`), or source the "
        "workspace that has it, and start mapspeak again.",
    )


def find_class(type_name: str, kind: str) -> RosClass | None:
    """Return the class of a type of one kind (msg, srv, action), or None where there is none."""
    parts = type_name.split("/")
    if not TYPE.fullmatch(type_name) or (len(parts) == 3 and parts[1] != kind):
        return None
    package, name = parts[0], parts[-1]
    if not _has_types(package, kind):
        return None
    return getattr(importlib.import_module(f"{package}.{kind}"), name, None)


def name_of(message_class: RosClass) -> str:
    """Return the type of a class of messages, as "package/Type"."""
    return f"{message_class.__module__.partition('.')[0]}/{message_class.__name__}"


def _has_types(package: str, kind: str) -> bool:
    """Return True for a package that ROS made.

    A name that somebody gives must import nothing else.
    """
    spec = find_spec(package)
    folders = [] if spec is None else spec.submodule_search_locations or []
    return any(
        (Path(folder) / kind / "__init__.py").is_file()
        and any(Path(folder).glob(f"{package}_s__rosidl_typesupport_*"))
        for folder in folders
    )


PREFIX_ABOVE = 6
"""At most so many folders above a package of Python lies the folder that holds `share`."""


def find_definitions(type_name: str) -> Mapping[str, str]:
    """Return the texts of a type's parts and of all types within, as the port says."""
    for kind in KINDS:
        if find_class(type_name, kind) is not None:
            texts = dict(_texts_of(bare_type(type_name), kind))
            names = tuple(texts)
            _add_what_is_within(texts, names)
            book = TypeBook(texts)
            within = [each for name in names for each in book.within(name)]
            return {each: book.texts[each] for each in dict.fromkeys(within)}
    return {}


def _add_what_is_within(texts: dict[str, str], names: tuple[str, ...]) -> None:
    looked_for: set[str] = set()
    while True:
        book = TypeBook(texts)
        missing = {each for name in names for each in book.missing(name)} - looked_for
        if not missing:
            return
        looked_for |= missing
        for each in missing:
            if find_class(each, "msg") is not None:
                texts |= _texts_of(each, "msg")


@cache
def _texts_of(bare: str, kind: str) -> Mapping[str, str]:
    """Return the texts of a type's own parts by their names."""
    found = find_class(bare, kind)
    parts = {
        "msg": {bare: found},
        "srv": {f"{bare}_{part}": getattr(found, part, None) for part in SERVICE_PARTS},
        "action": {f"{bare}_{part}": getattr(found, part, None) for part in ACTION_PARTS},
    }[kind]
    text = _read_file(found, bare, kind)
    if text is not None and split_parts(bare, text).keys() == parts.keys():
        return split_parts(bare, text)
    return {name: write_definition(part) for name, part in parts.items()}


def _read_file(found: Any, bare: str, kind: str) -> str | None:  # noqa: ANN401 - rclpy has no types
    package, _, name = bare.partition("/")
    module = sys.modules[found.__module__.partition(".")[0]]
    for folder in list(Path(module.__path__[0]).parents)[:PREFIX_ABOVE]:
        path = folder / "share" / package / kind / f"{name}.{kind}"
        if path.is_file():
            return path.read_text(encoding="utf-8")
    return None


Reader = Callable[[Any], Any]


def read_message(message: Any) -> dict[str, Any]:  # noqa: ANN401 - rclpy has no types
    """Return a message as rosbridge does: uint8[] as bytes, other numbers as numpy arrays."""
    return {
        name: getattr(message, name) if read is None else read(getattr(message, name))
        for name, read in _readers_of(message.__class__)
    }


@cache
def _readers_of(message_class: Any) -> tuple[tuple[str, Reader | None], ...]:  # noqa: ANN401
    return tuple((name, _reader_of(kind)) for name, kind in fields_of(message_class).items())


def _reader_of(field: Field) -> Reader | None:
    is_list = field.length is not None
    if field.is_message:
        return _read_all if is_list else read_message
    if field.type == "byte":
        return b"".join if is_list else _read_octet
    if not is_list:
        return None
    if field.type == "uint8":
        return bytes
    return np.asarray if field.type in NUMBERS else list


def _read_all(messages: Any) -> list[dict[str, Any]]:  # noqa: ANN401 - rclpy has no types
    return [read_message(message) for message in messages]


def _read_octet(octet: bytes) -> int:
    return octet[0]


RosMessage = Any  # rclpy has no types


def write_message(message_class: Any, values: object) -> RosMessage:  # noqa: ANN401
    """Return a message with these values; the fields they leave out keep their defaults."""
    checked = check_message(_book_of(message_class), name_of(message_class), values)
    return _fill(message_class, checked)


@cache
def _book_of(message_class: Any) -> TypeBook:  # noqa: ANN401 - rclpy has no types
    texts: dict[str, str] = {}
    _describe(message_class, texts)
    return TypeBook(texts)


def _describe(message_class: Any, texts: dict[str, str]) -> None:  # noqa: ANN401 - likewise
    fields = fields_of(message_class)
    texts[name_of(message_class)] = write_definition(message_class)
    for field in fields.values():
        if field.is_message and field.type not in texts:
            _describe(find_message(field.type), texts)


def _fill(message_class: Any, values: Mapping[str, Any]) -> RosMessage:  # noqa: ANN401 - likewise
    message = message_class()
    fields = fields_of(message_class)
    for name, value in values.items():
        setattr(message, name, _write_field(fields[name], value, getattr(message, name)))
    return message


def _write_field(field: Field, value: Any, default: Any) -> Any:  # noqa: ANN401
    is_list = field.length is not None
    if is_list and isinstance(value, str):
        value = base64.b64decode(value, validate=True)
    if is_list and field.type in NUMBERS:
        return _write_numbers(value, default)
    if field.is_message:
        inner = find_message(field.type)
        return [_fill(inner, each) for each in value] if is_list else _fill(inner, value)
    if field.type == "byte":
        octets = [bytes([each % 256]) for each in (value if is_list else [value])]
        return octets if is_list else octets[0]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _write_numbers(values: Any, default: Any) -> Any:  # noqa: ANN401
    """Return many numbers as rclpy keeps them."""
    is_fixed = isinstance(default, np.ndarray)
    dtype = default.dtype if is_fixed else np.dtype(default.typecode)
    if isinstance(values, bytes | bytearray | memoryview):
        values = np.frombuffer(values, np.uint8)
    packed = np.ascontiguousarray(values, dtype=dtype)
    return packed if is_fixed else array.array(default.typecode, packed.tobytes())
