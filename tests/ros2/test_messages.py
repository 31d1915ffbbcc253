"""Mappings become messages of rclpy and come back as they were, or are refused with their field."""

import base64
import json
import random
from typing import Any

import numpy as np
import pytest

from benchmarks.typemaking import make_message, make_types
from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Dialect
from mapspeak.skills.layout import build_layout
from ros2.conftest import import_what_warns

pytestmark = pytest.mark.ros2


def there_and_back(type_name: str, values: Any) -> Any:  # noqa: ANN401 - rclpy has no types
    import_what_warns()
    from rclpy.serialization import deserialize_message, serialize_message  # noqa: PLC0415

    from mapspeak.links.rclpy.types import RclpyTypes, find_message  # noqa: PLC0415

    types = RclpyTypes()
    message = deserialize_message(types.encode(type_name, values), find_message(type_name))
    return types.decode(type_name, serialize_message(message))


@pytest.mark.parametrize(
    ("type_name", "field", "value"),
    [
        ("std_msgs/msg/String", "data", "größer"),
        ("std_msgs/msg/Bool", "data", True),
        ("std_msgs/msg/Byte", "data", 255),
        ("std_msgs/msg/UInt64", "data", 2**64 - 1),
        ("std_msgs/Float32", "data", 0.5),
        ("rcl_interfaces/msg/ParameterValue", "byte_array_value", b"\x01\xff"),
        ("rcl_interfaces/msg/ParameterValue", "string_array_value", ["a", ""]),
        ("rcl_interfaces/msg/ParameterValue", "bool_array_value", [True, False]),
        ("sensor_msgs/msg/Image", "data", b"\x00\xff"),
        ("unique_identifier_msgs/msg/UUID", "uuid", bytes(range(16))),
    ],
)
def test_a_value_comes_back_as_it_was(type_name: str, field: str, value: object) -> None:
    assert there_and_back(type_name, {field: value})[field] == value


@pytest.mark.parametrize(
    ("type_name", "field", "value", "dtype"),
    [
        ("sensor_msgs/msg/LaserScan", "ranges", [0.5, 1], "float32"),
        ("sensor_msgs/msg/CameraInfo", "k", list(range(9)), "float64"),
        ("nav_msgs/msg/OccupancyGrid", "data", [-1, 0, 100], "int8"),
        ("nav_msgs/msg/OccupancyGrid", "data", [], "int8"),
        ("nav_msgs/msg/OccupancyGrid", "data", np.array([-1, 100], np.int64), "int8"),
        ("rcl_interfaces/msg/ParameterValue", "integer_array_value", [2**62], "int64"),
    ],
)
def test_numbers_come_back_in_an_array_of_their_type(
    type_name: str, field: str, value: object, dtype: str
) -> None:
    array = there_and_back(type_name, {field: value})[field]
    assert array.dtype == dtype
    assert array.tolist() == list(np.asarray(value))


def test_bytes_may_be_sent_as_json_has_them() -> None:
    text = base64.b64encode(b"\x00\xff").decode()
    assert there_and_back("sensor_msgs/msg/Image", {"data": text})["data"] == b"\x00\xff"
    assert there_and_back("sensor_msgs/msg/Image", {"data": [0, 255]})["data"] == b"\x00\xff"


def test_messages_within_lists_are_kept_in_their_order() -> None:
    frames = [{"child_frame_id": "base"}, {"child_frame_id": "camera"}]
    read = there_and_back("tf2_msgs/msg/TFMessage", {"transforms": frames})["transforms"]
    assert [frame["child_frame_id"] for frame in read] == ["base", "camera"]
    assert read[0]["transform"]["rotation"]["w"] == 1.0


@pytest.mark.parametrize("seed", [7, 8])
def test_every_type_that_python_has_comes_through_as_arguments_of_a_tool(seed: int) -> None:
    """Of two hundred drawn types those that ROS has, and no other, are there."""
    import_what_warns()
    from mapspeak.links.rclpy.types import find_message  # noqa: PLC0415

    dice = random.Random(seed)  # noqa: S311 - no secrets
    book, names = make_types(seed, dialect=Dialect.ROS2, n_made_up=0)
    n_same = 0
    for name in names:
        try:
            find_message(name)
        except LinkError:
            continue
        layout = build_layout(book, name)
        given = json.loads(json.dumps(layout.read(make_message(book, name, dice))))
        back = there_and_back(name, layout.build(given))
        assert json.loads(json.dumps(layout.read(back))) == given, name
        n_same += 1
    assert n_same >= 60


def test_an_empty_message_has_no_fields() -> None:
    assert there_and_back("std_msgs/msg/Empty", {}) == {}


@pytest.mark.parametrize(
    ("type_name", "values", "said"),
    [
        ("std_msgs/msg/UInt8", {"data": 256}, "data wants a whole number from 0 to 255"),
        ("std_msgs/msg/Int64", {"data": 2**63}, "data wants a whole number"),
        ("std_msgs/msg/Float32", {"data": 1e39}, "data wants a finite number"),
        ("std_msgs/msg/Float64", {"data": 10**400}, "data wants a finite number"),
        ("std_msgs/msg/String", {"data": "a\0b"}, "data wants a text"),
        ("std_msgs/msg/String", {"data": "\ud800"}, "data wants a text"),
        ("std_msgs/msg/String", {"data": None}, "data wants a text"),
        ("sensor_msgs/msg/CameraInfo", {"k": [1.0]}, "k has 1 values; its type is float64.9."),
        (
            "sensor_msgs/msg/Image",
            {"data": "!"},
            "data wants .*bytes in base64",
        ),
        ("sensor_msgs/msg/LaserScan", {"ranges": [1.0, float("nan")]}, r"ranges\[1\] wants a fin"),
        ("sensor_msgs/msg/LaserScan", {"ranges": np.array([np.inf])}, "ranges wants a finite"),
        ("sensor_msgs/msg/LaserScan", {"ranges": 1.0}, "ranges wants a list"),
        ("tf2_msgs/msg/TFMessage", {"transforms": [{"x": 1}]}, r"'transforms\[0\].x'"),
        ("tf2_msgs/msg/TFMessage", {"transforms": [1]}, r"transforms\[0\] wants an object"),
        ("tf2_msgs/msg/TFMessage", [], "message wants an object"),
        ("std_msgs/msg/Header", {"stamp": {"secs": 1}}, "'stamp.secs'. Did you mean stamp.sec?"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_field(
    type_name: str, values: object, said: str
) -> None:
    with pytest.raises(LinkError, match=said):
        there_and_back(type_name, values)


@pytest.mark.parametrize(
    "type_name", ["antigravity/msg/Fly", "os/msg/Path", "no type", "std_msgs/srv/String", ""]
)
def test_a_type_that_ros_does_not_have_imports_nothing(type_name: str) -> None:
    with pytest.raises(LinkError, match=r"is not the name of a ROS type|knows no message"):
        there_and_back(type_name, {})
