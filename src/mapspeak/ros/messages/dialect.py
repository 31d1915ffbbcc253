"""How ROS 1 and ROS 2 write the same thing: types, and time."""

import math
import re
from enum import StrEnum
from typing import Any

from mapspeak.ros.messages.fields import Message, misfit, part_of, text_of, whole_of

NAME = re.compile(r"[~/]?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")
TYPE = re.compile(r"[A-Za-z]\w*(?:/(?:msg|srv|action))?/[A-Za-z]\w*")
"""What names of ROS, and those of its types, look like."""
NANOSECONDS = 1_000_000_000
LARGEST_SECONDS = 2**32 - 1


class Dialect(StrEnum):
    """Which ROS the other end speaks."""

    ROS1 = "ros1"
    ROS2 = "ros2"

    def type_name(self, name: str) -> str:
        """Return a message's type as this ROS writes it, such as "nav_msgs/msg/OccupancyGrid"."""
        package, _, last = bare_type(name).partition("/")
        return f"{package}/msg/{last}" if self is Dialect.ROS2 else f"{package}/{last}"

    def service_type_name(self, name: str) -> str:
        """Return a service's type as this ROS writes it, such as "std_srvs/srv/Empty"."""
        package, _, last = bare_type(name).partition("/")
        return f"{package}/srv/{last}" if self is Dialect.ROS2 else f"{package}/{last}"


def bare_type(name: str) -> str:
    """Return a type as "package/Type", however it was written."""
    parts = name.strip("/").split("/")
    return f"{parts[0]}/{parts[-1]}"


def read_stamp(stamp: Message) -> float:
    """Read a time of either dialect, in seconds.

    Raises:
        LinkError: It is no time.
    """
    is_ros1 = "secs" in stamp
    whole_s = whole_of(
        stamp, "secs" if is_ros1 else "sec", low=-LARGEST_SECONDS, high=LARGEST_SECONDS
    )
    rest = whole_of(stamp, "nsecs" if is_ros1 else "nanosec", low=0, high=NANOSECONDS - 1)
    return whole_s + rest / NANOSECONDS


def write_stamp(stamp_s: float, *, dialect: Dialect) -> dict[str, int]:
    """Write a time given in seconds.

    Raises:
        LinkError: ROS cannot say that time.
    """
    if not (math.isfinite(stamp_s) and abs(stamp_s) < LARGEST_SECONDS):
        raise misfit("stamp", stamp_s, "a time in seconds")
    whole_s = math.floor(stamp_s)
    rest = round((stamp_s - whole_s) * NANOSECONDS)
    if rest == NANOSECONDS:
        whole_s, rest = whole_s + 1, 0
    if dialect is Dialect.ROS1:
        return {"secs": whole_s, "nsecs": rest}
    return {"sec": whole_s, "nanosec": rest}


def read_header(message: Message) -> tuple[str, float]:
    """Read the frame and the time in seconds that a message's header gives.

    Raises:
        LinkError: The message has no such header.
    """
    header = part_of(message, "header")
    return text_of(header, "frame_id").lstrip("/"), read_stamp(part_of(header, "stamp"))


def write_header(frame_id: str, stamp_s: float, *, dialect: Dialect) -> dict[str, Any]:
    """Write a header; the time in seconds."""
    stamp = write_stamp(stamp_s, dialect=dialect)
    if dialect is Dialect.ROS1:
        return {"seq": 0, "stamp": stamp, "frame_id": frame_id}
    return {"stamp": stamp, "frame_id": frame_id}
