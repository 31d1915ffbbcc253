"""The types of the ROS on this machine: their fields, classes and definitions."""

import importlib
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros import TYPE
from mapspeak.ros.definitions import ACTION_PARTS, SERVICE_PARTS, TypeBook, split_parts
from mapspeak.ros.messages import bare_type

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
    """Return the fields of a class of messages, in their order."""
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


KINDS = ("msg", "srv", "action")
NAMED = {"msg": "message", "srv": "service", "action": "action"}

RosClass = Any  # rclpy has no types


def find_message(type_name: str) -> RosClass:
    """Return the class of a type of messages.

    Raises:
        LinkError: The name is none, or this Python does not have the type.
    """
    return _wanted(type_name, "msg")


def find_service(type_name: str) -> RosClass:
    """Return the class of a type of services.

    Raises:
        LinkError: As for messages.
    """
    return _wanted(type_name, "srv")


def find_action(type_name: str) -> RosClass:
    """Return the class of a type of actions.

    Raises:
        LinkError: As for messages.
    """
    return _wanted(type_name, "action")


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


def _wanted(type_name: str, kind: str) -> RosClass:
    found = find_class(type_name, kind)
    if found is None:
        if not TYPE.fullmatch(type_name):
            raise LinkError(
                f"{type_name[:80]!r} is no type.", hint=f'Such as "package/{kind}/Type".'
            )
        package = bare_type(type_name).partition("/")[0]
        raise LinkError(
            f"This Python's ROS knows no {NAMED[kind]} of the type {bare_type(type_name)[:80]}.",
            hint=f"Install the package (`sudo apt install ros-$ROS_DISTRO-"
            f"{package.replace('_', '-')[:60]}`), or source the workspace that has it, and start "
            "mapspeak again.",
        )
    return found


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
