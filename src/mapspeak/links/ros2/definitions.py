"""What types look like: as the files say that ROS installs, else as rclpy's classes tell."""

import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from mapspeak.links.ros2.fields import write_definition
from mapspeak.links.ros2.types import KINDS, find_class
from mapspeak.ros.definitions import ACTION_PARTS, SERVICE_PARTS, TypeBook, split_parts
from mapspeak.ros.messages import bare_type

PREFIX_ABOVE = 6
"""At most so many folders above a package of Python lies the folder that holds `share`."""


def find_definitions(type_name: str) -> Mapping[str, str]:
    """Gives the texts of a type's parts and of all types within, as the port says."""
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
    """Gives the texts of a type's own parts by their names."""
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
