"""Types that only DDS shows: what middlewares tell each other, and what ROS 2 makes of actions."""

import re
from collections.abc import Mapping, Sequence

from mapspeak.errors import LinkError
from mapspeak.ros.definitions import TypeBook, known_definitions
from mapspeak.ros.messages import Dialect, Message, bare_type

_NODES = (
    "string<=256 node_namespace\nstring<=256 node_name\n"
    "rmw_dds_common/{gid}[] reader_gid_seq\nrmw_dds_common/{gid}[] writer_gid_seq"
)
_TEXTS = {
    "rmw_dds_common/Gid": "uint8[16] data",
    "rmw_dds_common/NodeEntitiesInfo": _NODES.format(gid="Gid"),
    "rmw_dds_common/ParticipantEntitiesInfo": (
        "rmw_dds_common/Gid gid\nrmw_dds_common/NodeEntitiesInfo[] node_entities_info_seq"
    ),
    # Humble has longer ids, under the same names.
    "rmw_dds_common/LongGid": "uint8[24] data",
    "rmw_dds_common/LongNodeEntitiesInfo": _NODES.format(gid="LongGid"),
    "rmw_dds_common/LongParticipantEntitiesInfo": (
        "rmw_dds_common/LongGid gid\nrmw_dds_common/LongNodeEntitiesInfo[] node_entities_info_seq"
    ),
}

_ACTION_PARTS = {
    "SendGoal_Request": "unique_identifier_msgs/UUID goal_id\n{action}_Goal goal",
    "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
    "GetResult_Request": "unique_identifier_msgs/UUID goal_id",
    "GetResult_Response": "int8 status\n{action}_Result result",
    "FeedbackMessage": "unique_identifier_msgs/UUID goal_id\n{action}_Feedback feedback",
}

_PLAIN_TYPES = {
    2: "int8", 3: "uint8", 4: "int16", 5: "uint16", 6: "int32", 7: "uint32", 8: "int64",
    9: "uint64", 10: "float32", 11: "float64", 13: "char", 15: "bool", 16: "byte", 17: "string",
    18: "wstring", 21: "string", 22: "wstring",
}  # fmt: skip
"""By type_description_interfaces/FieldType, below the step from one kind of list to the next."""
_STEP, _NESTED = 48, 1
_LIMITED = (21, 22)
_ONE, _ARRAY, _BOUNDED, _SEQUENCE = range(4)
_ROS_NAME = re.compile(r"[A-Za-z]\w*(?:/(?:msg|srv|action))?/[A-Za-z]\w*")


def build_type_book(distro: str = "") -> TypeBook:
    """Gives the types that come with mapspeak, and those that DDS needs.

    Args:
        distro: See `known_definitions`.
    """
    texts = {**known_definitions(Dialect.ROS2, distro=distro), **_TEXTS}
    for name in [name for name in texts if name.endswith("_Goal")]:
        texts |= action_parts(name.removesuffix("_Goal"))
    return TypeBook(texts)


def action_parts(action_type: str) -> dict[str, str]:
    """Gives the texts of what ROS 2 makes of an action, by name."""
    bare = bare_type(action_type)
    return {
        f"{bare}_{part}": text.replace("{action}", bare) for part, text in _ACTION_PARTS.items()
    }


def read_type_description(answer: Message) -> dict[str, str]:
    """Gives the texts of all types in an answer of type_description_interfaces/GetTypeDescription.

    Raises:
        LinkError: The node does not describe the type.
    """
    if not answer["successful"]:
        raise LinkError(
            f"The robot does not describe a type: {str(answer['failure_reason'])[:200]}",
            hint="Take rosbridge, which reads its types on the robot.",
        )
    description = answer["type_description"]
    described = [description["type_description"], *description["referenced_type_descriptions"]]
    return {bare_type(each["type_name"]): _text_of(each["fields"]) for each in described}


def _text_of(fields: Sequence[Mapping[str, Message]]) -> str:
    lines = [f"{_type_of(each['type'])} {each['name']}" for each in fields]
    return "\n".join(lines)


def _type_of(described: Message) -> str:
    shape, plain = divmod(int(described["type_id"]), _STEP)
    name = str(described["nested_type_name"]) if plain == _NESTED else _PLAIN_TYPES.get(plain)
    if name is None or (plain == _NESTED and not _ROS_NAME.fullmatch(name)):
        raise LinkError(
            f"The robot describes a field of the kind {described['type_id']}, unknown to us.",
            hint="Take rosbridge, which reads its types on the robot.",
        )
    if plain in _LIMITED:
        name = f"{name}<={int(described['string_capacity'])}"
    capacity = int(described["capacity"])
    return name + {_ONE: "", _ARRAY: f"[{capacity}]", _BOUNDED: f"[<={capacity}]"}.get(shape, "[]")
