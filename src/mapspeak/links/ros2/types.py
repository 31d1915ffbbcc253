"""The classes that rclpy has for types of messages, services and actions."""

import importlib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.ros import TYPE
from mapspeak.ros.messages import bare_type

KINDS = ("msg", "srv", "action")
NAMED = {"msg": "message", "srv": "service", "action": "action"}

RosClass = Any  # rclpy has no types


def find_message(type_name: str) -> RosClass:
    """Gives the class of a type of messages.

    Raises:
        LinkError: The name is none, or this Python does not have the type.
    """
    return _wanted(type_name, "msg")


def find_service(type_name: str) -> RosClass:
    """Gives the class of a type of services.

    Raises:
        LinkError: As for messages.
    """
    return _wanted(type_name, "srv")


def find_action(type_name: str) -> RosClass:
    """Gives the class of a type of actions.

    Raises:
        LinkError: As for messages.
    """
    return _wanted(type_name, "action")


def find_class(type_name: str, kind: str) -> RosClass | None:
    """Gives the class of a type of one kind (msg, srv, action), or None where there is none."""
    parts = type_name.split("/")
    if not TYPE.fullmatch(type_name) or (len(parts) == 3 and parts[1] != kind):
        return None
    package, name = parts[0], parts[-1]
    if not _has_types(package, kind):
        return None
    return getattr(importlib.import_module(f"{package}.{kind}"), name, None)


def name_of(message_class: RosClass) -> str:
    """Gives the type of a class of messages, as "package/Type"."""
    return f"{message_class.__module__.partition('.')[0]}/{message_class.__name__}"


def _has_types(package: str, kind: str) -> bool:
    """True for a package that ROS made; a name that somebody gives must import nothing else."""
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
