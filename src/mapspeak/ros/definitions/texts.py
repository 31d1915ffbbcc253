"""Texts of definitions: as they are sent and filed, and those that come with mapspeak.

rosbags brings the messages of ROS's own packages; `interfaces/` holds what it does not: services,
actions, and Nav2's interfaces, which differ from distribution to distribution.
"""

import re
from collections.abc import Container, Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import files

from mapspeak.ros.messages.fields import Dialect, bare_type

RULER_LINE = "=" * 80
RULER = re.compile(r"^=+\nMSG: (?P<name>\S+)\n?", re.MULTILINE)
DIVIDER = re.compile(r"^---[ \t]*$\n?", re.MULTILINE)
KINDS = ("msg", "srv", "action")
SERVICE_PARTS = ("Request", "Response")
ACTION_PARTS = ("Goal", "Result", "Feedback")
GENERATED = re.compile(r"_(Request|Response|Goal|Result|FeedbackMessage|Feedback)$")
"""Suffixes of types that ROS 2 derives; messages that people define have no underscore."""


def split_definition(type_name: str, text: str) -> dict[str, str]:
    """Return the text of a type and of each type within it, by name as "package/Type".

    A ruler and "MSG: package/Type" stand before each but the first.
    """
    first, *rest = RULER.split(text)
    texts = {bare_type(type_name): first.strip("\n")}
    for name, part in zip(rest[::2], rest[1::2], strict=True):
        texts.setdefault(bare_type(name), part.strip("\n"))
    return texts


def write_definition(texts: Mapping[str, str], names: Iterable[str]) -> str:
    """Return the texts of some types as one, as `split_definition` reads it; the first leads."""
    first, *others = names
    parts = [f"{RULER_LINE}\nMSG: {name}\n{texts[name]}" for name in others]
    return "\n".join([texts[first], *parts])


def name_parts(type_name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names that the parts of a service and of an action of that type would have."""
    bare = bare_type(type_name)
    return (
        tuple(f"{bare}_{part}" for part in SERVICE_PARTS),
        tuple(f"{bare}_{part}" for part in ACTION_PARTS),
    )


def find_parts(
    texts: Container[str], type_name: str, kinds: Iterable[str] = KINDS
) -> tuple[str, ...]:
    """Return the names of a type in some texts: its own, or those of its parts.

    Args:
        texts: By name as "package/Type", as `RosConnection.fetch_definitions` gives them.
        type_name: Of a message, a service or an action.
        kinds: The kinds it may be, the likeliest first.
    """
    service, action = name_parts(type_name)
    options = {"msg": (bare_type(type_name),), "srv": service, "action": action}
    found = (options[kind] for kind in kinds)
    return next((names for names in found if all(name in texts for name in names)), ())


def split_parts(type_name: str, text: str) -> dict[str, str]:
    """Return the texts of a message, or of the parts of a service or an action, by their names.

    Two parts are a service, three an action, as in .srv and .action files.
    """
    parts = [part.strip("\n") for part in DIVIDER.split(text)]
    names = {2: name_parts(type_name)[0], 3: name_parts(type_name)[1]}.get(len(parts))
    if names is None:
        return {bare_type(type_name): parts[0]}
    return dict(zip(names, parts, strict=True))


def kinds_of(texts: Iterable[str]) -> dict[str, str]:
    """Return the kind of each type by its name: "msg", "srv" or "action", where parts are named."""
    kinds: dict[str, str] = {}
    for name in texts:
        part = GENERATED.search(name)
        if part is None:
            kinds.setdefault(name, "msg")
        else:
            kind = "srv" if part[1] in SERVICE_PARTS else "action"
            kinds[name.removesuffix(part[0])] = kind
    return kinds


def find_actions_of_ros1(texts: Mapping[str, str]) -> dict[str, str]:
    """Return parts of actions, which ROS 1 writes as messages of their own, named as ROS 2's."""
    named = (name.removesuffix("ActionGoal") for name in texts if name.endswith("ActionGoal"))
    return {
        f"{action}_{part}": texts[f"{action}{part}"]
        for action in named
        for part in ACTION_PARTS
        if f"{action}{part}" in texts
    }


PARTS_OF_ACTION = {
    "SendGoal_Request": "unique_identifier_msgs/UUID goal_id\n{action}_Goal goal",
    "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
    "GetResult_Request": "unique_identifier_msgs/UUID goal_id",
    "GetResult_Response": "int8 status\n{action}_Result result",
    "FeedbackMessage": "unique_identifier_msgs/UUID goal_id\n{action}_Feedback feedback",
}


def action_parts(action_type: str) -> dict[str, str]:
    """Return the texts of the types that ROS 2 derives from an action, by name."""
    bare = bare_type(action_type)
    return {
        f"{bare}_{part}": text.replace("{action}", bare) for part, text in PARTS_OF_ACTION.items()
    }


DISTROS = ("kilted", "jazzy", "humble", "lyrical")
"""Of ROS 2, whose interfaces of Nav2 are known; the first stands for those that are not."""
ENTRY = re.compile(r"^(?:MSG|SRV|ACTION): (?P<name>\S+)\n", re.MULTILINE)
TIMES_OF_ROS1 = {"builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration"}
DEFAULTS = {
    "geometry_msgs/Quaternion": ("float64 w", "float64 w 1"),
    "sensor_msgs/NavSatStatus": ("int8 status\n", "int8 status -2\n"),
}
"""The parts of ROS 2's definitions that rosbags leaves out."""


def known_definitions(dialect: Dialect, *, distro: str = "") -> dict[str, str]:
    """Return the texts of all types that come with mapspeak, by name as "package/Type".

    The parts of services and actions are named as `RosConnection.fetch_definitions` says. Where a
    distribution of ROS 2, such as "jazzy", is not known, the usual one stands for it.
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
    """Return the ROS 1 form of a ROS 2 text: its own times, and another name in rosapi."""
    for ros2, ros1 in TIMES_OF_ROS1.items():
        text = text.replace(ros2, ros1)
    if name.startswith("rosapi/GetParam_"):
        text = text.replace("default_value", "default")
    return text
