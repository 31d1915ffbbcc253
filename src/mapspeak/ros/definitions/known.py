"""The definitions that come with mapspeak, in the words of either ROS."""

import re
from collections.abc import Iterator

from mapspeak.ros.definitions.parts import find_actions_of_ros1, split_parts
from mapspeak.ros.definitions.texts import (
    ACTIONS,
    GEOMETRY,
    NAVIGATION,
    PARAMETERS,
    ROSAPI,
    SENSORS,
    STANDARD,
)
from mapspeak.ros.messages import Dialect

__all__ = ["known_definitions"]

ENTRY = re.compile(r"^(?P<kind>MSG|SRV|ACTION): (?P<name>\S+)\n", re.MULTILINE)
TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}


def known_definitions(dialect: Dialect) -> dict[str, str]:
    """Gives the texts of all types that come with mapspeak, by name as "package/Type".

    The parts of services and actions are named as `RosConnection.fetch_definitions` says.
    """
    known: dict[str, str] = {}
    for said, text in _entries():
        name = said.replace("rosapi_msgs/", "rosapi/") if dialect is Dialect.ROS1 else said
        for part, part_text in split_parts(name, text).items():
            known[part] = _translate(part, part_text, dialect)
            if part.endswith("_Feedback"):
                known[f"{part}Message"] = f"unique_identifier_msgs/UUID goal_id\n{part} feedback"
    if dialect is Dialect.ROS1:
        known |= find_actions_of_ros1(known)
    return known


def _entries() -> Iterator[tuple[str, str]]:
    for group in (STANDARD, PARAMETERS, GEOMETRY, SENSORS, NAVIGATION, ACTIONS, ROSAPI):
        _, *found = ENTRY.split(group)
        for name, text in zip(found[1::3], found[2::3], strict=True):
            yield name, text.strip("\n")


def _translate(name: str, text: str, dialect: Dialect) -> str:
    """Gives what ROS 1 says instead: its own times, `seq` in the header, capital letters."""
    if dialect is Dialect.ROS2:
        return text
    for ros2, ros1 in TIMES.items():
        text = text.replace(ros2, ros1)
    if name == "std_msgs/Header":
        text = f"uint32 seq\n{text}"
    if name == "geometry_msgs/Quaternion":
        text = re.sub(r" \d$", "", text, flags=re.MULTILINE)
    if name.startswith("rosapi/GetParam_"):
        text = text.replace("default_value", "default")
    if name == "sensor_msgs/CameraInfo":
        text = re.sub(r"\b([dkrp])$", lambda match: match[1].upper(), text, flags=re.MULTILINE)
    return text
