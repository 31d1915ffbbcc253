"""What ROS types look like: definitions read, known ones, messages shown, checked and built."""

from mapspeak.ros.definitions.checking import check_message, describe_type
from mapspeak.ros.definitions.texts import (
    ACTION_PARTS,
    DISTROS,
    GENERATED,
    SERVICE_PARTS,
    find_actions_of_ros1,
    kinds_of,
    known_definitions,
    name_parts,
    split_definition,
    split_parts,
    write_definition,
)
from mapspeak.ros.definitions.types import (
    FLOATS,
    TIMES,
    WHOLES,
    Field,
    MessageType,
    TypeBook,
    find_odd_lines,
    parse_definition,
)
from mapspeak.ros.definitions.typestore import (
    NOTHING,
    describe_field,
    hash_type,
    look_up,
)

__all__ = [
    "ACTION_PARTS",
    "DISTROS",
    "FLOATS",
    "GENERATED",
    "NOTHING",
    "SERVICE_PARTS",
    "TIMES",
    "WHOLES",
    "Field",
    "MessageType",
    "TypeBook",
    "check_message",
    "describe_field",
    "describe_type",
    "find_actions_of_ros1",
    "find_odd_lines",
    "hash_type",
    "kinds_of",
    "known_definitions",
    "look_up",
    "name_parts",
    "parse_definition",
    "split_definition",
    "split_parts",
    "write_definition",
]
