"""The types of the ROS on this machine, as its own files and classes tell them."""

import importlib
import re
import sys
from collections.abc import Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.links.cdr import Codec, KnownTypes
from mapspeak.links.endpoints import ACTION_PART, whole_type
from mapspeak.ros.definitions.texts import (
    ACTION_PARTS,
    KINDS,
    SERVICE_PARTS,
    action_parts,
    split_parts,
)
from mapspeak.ros.definitions.types import NOTHING, TypeBook
from mapspeak.ros.messages.fields import TYPE, bare_type, check_type

FIELD = re.compile(
    r"sequence<(?P<any>.+?)(?:, (?P<most>\d+))?>|(?P<each>[^\[\]]+)\[(?P<length>\d+)\]|(?P<one>.+)"
)
TEXT = re.compile(r"(?P<text>w?string)<(?P<most>\d+)>")
DEFINED_AS = {"boolean": "bool", "octet": "byte", "float": "float32", "double": "float64"}
"""Names of .msg files for rclpy's IDL names."""
IN_ACTION = {
    "_SendGoal": "SendGoalService",
    "_GetResult": "GetResultService",
    "_FeedbackMessage": "FeedbackMessage",
}
"""The attributes in which rclpy keeps the classes of an action's parts."""


class RclpyTypes(KnownTypes):
    """Encodes and decodes, after the definitions of the ROS on this machine."""

    def __init__(self) -> None:
        super().__init__(TypeBook({}))

    def knows(self, type_name: str) -> bool:
        """Return True for a type that is installed here."""
        try:
            self._find(type_name)
        except LinkError:
            return False
        return True

    def encode(self, type_name: str, message: Mapping[str, Any]) -> bytes:
        """Return the bytes of a message; the fields it leaves out hold their defaults."""
        return self._find(type_name).encode(type_name, message)

    def decode(self, type_name: str, data: bytes) -> dict[str, Any]:
        """Return the message in some bytes; rclpy may give more than it has filled."""
        return self._find(type_name).decode(type_name, data, is_exact=False)

    def _find(self, type_name: str) -> Codec:
        """Return the encoder of a type; rclpy's thread and the event loop may call at once."""
        if self._book.knows(type_name):
            return self._codec
        whole = whole_type(type_name)
        kind = next((kind for kind in KINDS if find_class(whole, kind) is not None), "msg")
        find_message(whole, kind)
        texts = dict(_texts_of(bare_type(whole), kind))
        if kind == "action":
            texts |= action_parts(whole)
        _add_what_is_within(texts, tuple(texts))
        self._use(TypeBook({**self._book.texts, **texts}))
        return self._codec


def write_definition(message_class: Any) -> str:  # noqa: ANN401 - likewise
    """Return the definition of a class of messages, as far as rclpy tells it."""
    types, usual = message_class.get_fields_and_field_types(), message_class()
    # An empty message has a field that ROS never shows.
    return "\n".join(
        f"{_write_type(text)} {name}{_write_default(getattr(usual, name))}"
        for name, text in types.items()
        if name != NOTHING.name
    )


def _write_default(value: object) -> str:
    if isinstance(value, bytes):
        return f" {value[0]}"
    return f" {value}" if isinstance(value, bool | int | float | str) and value else ""


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


NAMED = {"msg": "message", "srv": "service", "action": "action"}

RosClass = Any  # rclpy has no types


def find_message(type_name: str, kind: str = "msg") -> RosClass:
    """Return the class of a type of messages, or of another kind: "srv" or "action".

    Raises:
        LinkError: The name is invalid, or this Python does not have the type.
    """
    found = find_class(type_name, kind)
    if found is not None:
        return found
    check_type(type_name)
    bare = bare_type(type_name)
    package = bare.partition("/")[0].replace("_", "-")[:60]
    raise LinkError(
        f"This Python's ROS knows no {NAMED[kind]} of the type {bare[:80]}.",
        hint=f"Install the package (`sudo apt install ros-$ROS_DISTRO-{package}`), or source the "
        "workspace that has it, and start mapspeak again.",
    )


def find_class(type_name: str, kind: str) -> RosClass | None:
    """Return the class of a type of one kind (msg, srv, action), or None where there is none."""
    part = ACTION_PART.search(type_name)
    if part is not None:
        action = find_class(type_name[: part.start()], "action")
        return None if action is None else getattr(action.Impl, IN_ACTION[part[0]])
    parts = type_name.split("/")
    if not TYPE.fullmatch(type_name) or (len(parts) == 3 and parts[1] != kind):
        return None
    package, name = parts[0], parts[-1]
    if not _has_types(package, kind):
        return None
    return getattr(importlib.import_module(f"{package}.{kind}"), name, None)


@cache
def _has_types(package: str, kind: str) -> bool:
    """Return True for a package that ROS made. A given name must not import anything else."""
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
            return TypeBook(texts).texts_of(names)
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
