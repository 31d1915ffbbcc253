"""The size of messages, beside that of what is really sent."""

from typing import Any

import numpy as np
import pytest

from mapspeak.links.cdr import Codec
from mapspeak.ros.definitions.texts import known_definitions
from mapspeak.ros.definitions.types import TypeBook, measure_message
from mapspeak.ros.messages.fields import Dialect

HEADER = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"}
POSE = {"position": {"x": 1.0, "y": 2.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}  # fmt: skip
ENCAPSULATION = 4
"""Bytes before each message in CDR."""


@pytest.mark.parametrize(
    ("type_name", "message", "padding"),
    [
        ("std_msgs/String", {"data": "grün"}, 0),
        ("std_msgs/Bool", {"data": True}, 0),
        ("std_msgs/Float64MultiArray", {"layout": {"dim": [], "data_offset": 0},
                                        "data": [1.0, 2.0, 3.0]}, 4),
        ("sensor_msgs/JointState", {"header": HEADER, "name": ["left", "right"],
                                    "position": [0.5, 1.5], "velocity": [], "effort": []}, 14),
        ("nav_msgs/Path", {"header": HEADER, "poses": [{"header": HEADER, "pose": POSE}] * 3}, 14),
        ("sensor_msgs/CompressedImage", {"header": HEADER, "format": "jpeg",
                                         "data": bytes(1000)}, 4),
        ("nav_msgs/OccupancyGrid",
         {"header": HEADER, "info": {"map_load_time": {"sec": 0, "nanosec": 0}, "resolution": 0.1,
                                     "width": 10, "height": 10, "origin": POSE},
          "data": np.zeros(100, dtype=np.int8)}, 8),
        ("geometry_msgs/PoseWithCovariance", {"pose": POSE, "covariance": [0.0] * 36}, 0),
    ],
)  # fmt: skip
def test_a_message_is_as_large_as_what_is_sent_but_for_its_padding(
    type_name: str, message: dict[str, Any], padding: int
) -> None:
    book = TypeBook(known_definitions(Dialect.ROS2))
    sent = len(Codec(book).encode(type_name, message)) - ENCAPSULATION
    assert 0 <= sent - measure_message(book, type_name, message) <= padding


def test_bytes_in_text_are_counted_and_what_is_of_another_kind_is_not() -> None:
    book = TypeBook(known_definitions(Dialect.ROS2))
    image = {"header": 7, "format": None, "data": "AAAAAAAA"}
    assert measure_message(book, "sensor_msgs/CompressedImage", image) == 4 + 4 + 6
