"""What ROS types look like: definitions read, known ones, messages shown, checked and built."""

from mapspeak.ros.definitions.book import TypeBook
from mapspeak.ros.definitions.checking import check_message
from mapspeak.ros.definitions.describing import describe_type, say_fields
from mapspeak.ros.definitions.known import DISTROS, known_definitions
from mapspeak.ros.definitions.parsing import (
    FLOATS,
    TIMES,
    WHOLES,
    Constant,
    Field,
    MessageType,
    find_odd_lines,
    parse_definition,
)
from mapspeak.ros.definitions.parts import (
    ACTION_PARTS,
    GENERATED,
    SERVICE_PARTS,
    find_actions_of_ros1,
    kinds_of,
    name_parts,
    split_definition,
    split_parts,
    write_definition,
)
from mapspeak.ros.definitions.typestore import (
    NOTHING,
    describe_field,
    hash_type,
    look_up,
    name_in_ros2,
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
    "Constant",
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
    "name_in_ros2",
    "name_parts",
    "parse_definition",
    "say_fields",
    "split_definition",
    "split_parts",
    "write_definition",
]
