"""The bytes that mapspeak writes over DDS are those that rclpy writes, and it reads rclpy's."""

import re
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from messaging import messages_of, plain
from ros2.conftest import import_what_warns

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

pytestmark = pytest.mark.ros2

DISTRO = "kilted"
TYPES = [
    "std_msgs/Byte",
    "std_msgs/Char",
    "std_msgs/Empty",
    "std_msgs/String",
    "std_msgs/UInt64",
    "geometry_msgs/TwistStamped",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/Polygon",
    "nav_msgs/OccupancyGrid",
    "nav_msgs/Odometry",
    "nav_msgs/Path",
    "sensor_msgs/CameraInfo",
    "sensor_msgs/CompressedImage",
    "sensor_msgs/Image",
    "sensor_msgs/JointState",
    "sensor_msgs/LaserScan",
    "sensor_msgs/NavSatFix",
    "sensor_msgs/PointCloud2",
    "tf2_msgs/TFMessage",
    "action_msgs/GoalStatusArray",
    "rcl_interfaces/ParameterEvent",
    "rcl_interfaces/ParameterValue",
    "rosgraph_msgs/Clock",
    "unique_identifier_msgs/UUID",
    "lifecycle_msgs/TransitionEvent",
]


def written_by_rclpy(type_name: str, message: dict[str, Any]) -> bytes:
    from rclpy.serialization import serialize_message  # noqa: PLC0415 - needs ROS

    written: bytes = serialize_message(filled(type_name, message))
    return written


def filled(type_name: str, values: dict[str, Any]) -> Any:  # noqa: ANN401 - rclpy has no types
    from mapspeak.links.rclpy.types import find_message  # noqa: PLC0415

    message = find_message(type_name)()
    types = message.get_fields_and_field_types()
    for name, value in values.items():
        inner = re.search(r"\w+/\w+", types[name])
        make: Callable[[Any], object] = _as_it_is
        if inner:
            make = partial(filled, inner[0])
        elif "octet" in types[name]:
            make = _octet
        setattr(
            message,
            name,
            [make(each) for each in value] if isinstance(value, list) else make(value),
        )
    return message


def _as_it_is(value: object) -> object:
    return value


def _octet(value: int) -> bytes:
    return bytes([value])


def read_by_rclpy(type_name: str, data: bytes) -> Any:  # noqa: ANN401 - likewise
    from rclpy.serialization import deserialize_message  # noqa: PLC0415 - needs ROS

    from mapspeak.links.rclpy.types import find_message  # noqa: PLC0415

    return spelled_out(deserialize_message(data, find_message(type_name)))


def spelled_out(value: Any) -> Any:  # noqa: ANN401 - likewise
    """Give a message of rclpy as plain values."""
    if hasattr(value, "get_fields_and_field_types"):
        names = value.get_fields_and_field_types()
        shown = (name for name in names if name != "structure_needs_at_least_one_member")
        return {name: spelled_out(getattr(value, name)) for name in shown}
    if isinstance(value, bytes):
        return value[0]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value if isinstance(value, str | int | float) else [spelled_out(each) for each in value]


@pytest.fixture(scope="module")
def tools() -> tuple[Any, Any]:
    import_what_warns()
    from mapspeak.links.cdr import Codec  # noqa: PLC0415 - optional
    from mapspeak.links.dds.types import build_type_book  # noqa: PLC0415

    book = build_type_book(DISTRO)
    return book, Codec(book)


@pytest.mark.parametrize("type_name", TYPES)
@settings(max_examples=60)
@given(data=st.data())
def test_either_writes_the_same_bytes_and_reads_the_others(
    tools: tuple[Any, Any], type_name: str, data: st.DataObject
) -> None:
    book, codec = tools
    message = data.draw(messages_of(book, type_name))
    ours, theirs = codec.encode(type_name, message), written_by_rclpy(type_name, message)
    # Behind the message rclpy leaves what it had reserved too much.
    theirs = theirs[: len(ours)]
    assert theirs[:2] == ours[:2]
    # What else differs is padding: what we leave zero, and what says nothing to the reader.
    others = {mine for mine, other in zip(ours[4:], theirs[4:], strict=True) if mine != other}
    assert others <= {0}
    read = plain(codec.decode(type_name, ours))
    assert plain(codec.decode(type_name, theirs)) == read
    assert read_by_rclpy(type_name, ours) == read
