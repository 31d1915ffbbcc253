"""The definitions that come with mapspeak, in the words of either ROS.

rosbags brings the messages of ROS's own packages; `interfaces/` holds what it does not: services,
actions, and Nav2's interfaces, which differ from distribution to distribution.
"""

import re
from collections.abc import Iterator
from functools import cache
from importlib.resources import files

from mapspeak.ros.definitions.parts import find_actions_of_ros1, split_definition, split_parts
from mapspeak.ros.messages import Dialect

DISTROS = ("kilted", "jazzy", "humble", "lyrical")
"""Of ROS 2, whose interfaces of Nav2 are known; the first stands for those that are not."""
ENTRY = re.compile(r"^(?:MSG|SRV|ACTION): (?P<name>\S+)\n", re.MULTILINE)
TIMES = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}
DEFAULTS = {
    "geometry_msgs/Quaternion": ("float64 w", "float64 w 1"),
    "sensor_msgs/NavSatStatus": ("int8 status\n", "int8 status -2\n"),
}
"""What rosbags leaves out of ROS 2's definitions."""


def known_definitions(dialect: Dialect, *, distro: str = "") -> dict[str, str]:
    """Return the texts of all types that come with mapspeak, by name as "package/Type".

    The parts of services and actions are named as `RosConnection.fetch_definitions` says.

    Args:
        dialect: Which ROS.
        distro: Of ROS 2, such as "jazzy"; the usual one where it is none that is known.
    """
    return dict(_definitions(dialect, distro if distro in DISTROS else DISTROS[0]))


@cache
def _definitions(dialect: Dialect, distro: str) -> dict[str, str]:
    known = _messages_of_rosbags(f"ROS2_{distro.upper()}")
    for name, (said, meant) in DEFAULTS.items():
        known[name] = known[name].replace(said, meant)
    for said, text in _entries(distro):
        name = said.replace("rosapi_msgs/", "rosapi/") if dialect is Dialect.ROS1 else said
        for part, part_text in split_parts(name, text).items():
            known[part] = part_text
            if part.endswith("_Feedback"):
                known[f"{part}Message"] = f"unique_identifier_msgs/UUID goal_id\n{part} feedback"
    if dialect is Dialect.ROS1:
        known = {name: _translate(name, text) for name, text in known.items()}
        known |= _messages_of_rosbags("ROS1_NOETIC")
        known |= find_actions_of_ros1(known)
    return known


def _messages_of_rosbags(store_name: str) -> dict[str, str]:
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - takes 0.3 s

    store = get_typestore(Stores[store_name])
    ros_version = 1 if store_name.startswith("ROS1") else 2
    found: dict[str, str] = {}
    for name in store.fielddefs:
        text, _ = store.generate_msgdef(name, ros_version=ros_version)
        found |= split_definition(name, text)
    return found


def _entries(distro: str) -> Iterator[tuple[str, str]]:
    folder = files("mapspeak.ros.definitions") / "interfaces"
    for group in ("ros", "rosapi", f"nav2_{distro}"):
        text = (folder / f"{group}.txt").read_text(encoding="utf-8")
        _, *found = ENTRY.split(text)
        for name, definition in zip(found[::2], found[1::2], strict=True):
            yield name, definition.strip("\n")


def _translate(name: str, text: str) -> str:
    """Return what ROS 1 says instead of ROS 2: its own times, and another name in rosapi."""
    for ros2, ros1 in TIMES.items():
        text = text.replace(ros2, ros1)
    if name.startswith("rosapi/GetParam_"):
        text = text.replace("default_value", "default")
    return text
