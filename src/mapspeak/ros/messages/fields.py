"""The fields of ROS messages, taken out one by one, and how either ROS writes types and times."""

import base64
import math
import re
from array import array
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError

Message = Mapping[str, Any]
"""A ROS message as rosbridge gives it: fields by name, arrays as lists, bytes or numpy arrays."""

HINT = "The topic may be of another type than expected: look its type up on the robot."


BASE64_PART = 400_000
"""Characters decoded in one go, a multiple of four: other threads may run in between."""


def decode_base64(text: str) -> bytes:
    """Return the bytes of a base64 text.

    Raises:
        ValueError: It holds other characters.
    """
    parts = (text[start : start + BASE64_PART] for start in range(0, len(text), BASE64_PART))
    return b"".join(base64.b64decode(part, validate=True) for part in parts)


def bytes_of(value: object, name: str = "data") -> bytes:
    """Return the value of a field of uint8[]: base64 text, bytes, an array or a list."""
    try:
        match value:
            case str():
                return decode_base64(value)
            case bytes() | bytearray() | memoryview():
                return bytes(value)
            case np.ndarray() if value.dtype.itemsize == 1:
                return value.tobytes()
            case list() | tuple():
                return array("B", value).tobytes()
    except (OverflowError, TypeError, ValueError):
        pass
    raise misfit(name, value, "bytes, in base64 or as a list of numbers from 0 to 255")


def misfit(name: str, value: object, wanted: str) -> LinkError:
    """Return the error for a field that holds something else."""
    return LinkError(f"A ROS message's field {name!r} is {_shown(value)}, not {wanted}.", hint=HINT)


def _shown(value: object) -> str:
    """Return a value shortly: a hostile message may hold megabytes, and a model would read them."""
    match value:
        case int() if value.bit_length() > 128:
            return "a huge number"
        case str():
            return repr(value if len(value) <= 40 else f"{value[:37]}...")
        case int() | float() | None:
            return repr(value)
        case _:
            return f"a {type(value).__name__}"


def part_of(message: object, name: str) -> Message:
    """Return a field that is a message itself."""
    value = _field(message, name)
    if not isinstance(value, Mapping):
        raise misfit(name, value, "a message")
    return value


def parts_of(message: object, name: str) -> Sequence[object]:
    """Return a field that is a list."""
    value = _field(message, name)
    if not isinstance(value, list | tuple):
        raise misfit(name, value, "a list")
    return value


def text_of(message: object, name: str) -> str:
    """Return a field that is a text."""
    value = _field(message, name)
    if not isinstance(value, str):
        raise misfit(name, value, "a text")
    return value


def number_of(message: object, name: str) -> float:
    """Return a field that is a finite number; ROS 1 writes NaN and infinity as null."""
    value = _field(message, name)
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
        raise misfit(name, value, "a finite number")
    try:
        number = float(value)
    except OverflowError:
        raise misfit(name, value, "a finite number") from None
    if not math.isfinite(number):
        raise misfit(name, value, "a finite number")
    return number


def whole_of(message: object, name: str, *, low: int, high: int) -> int:
    """Return a field that is a whole number between two limits, both included."""
    value = _field(message, name)
    wanted = f"a whole number from {low} to {high}"
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise misfit(name, value, wanted)
    if not low <= value <= high:
        raise misfit(name, value, wanted)
    return int(value)


def floats_of(message: object, name: str) -> NDArray[np.float64]:
    """Return a field that is a list of numbers; null is NaN, as ROS 1 writes it."""
    value = _field(message, name)
    if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "iuf":
        return value.astype(np.float64)
    is_list = isinstance(value, list | tuple)
    if not is_list or not set(map(type, value)) <= {int, float, type(None)}:
        raise misfit(name, value, "a list of numbers")
    try:
        return np.array(value, dtype=np.float64)
    except (OverflowError, ValueError, TypeError):
        raise misfit(name, value, "a list of numbers") from None


def _field(message: object, name: str) -> Any:  # noqa: ANN401 - ROS JSON enters here
    if not isinstance(message, Mapping):
        raise LinkError(f"A ROS message is a {type(message).__name__}, not an object.", hint=HINT)
    if name not in message:
        raise LinkError(f"A ROS message has no field {name!r}.", hint=HINT)
    return message[name]


NAME = re.compile(r"[~/]?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")
TYPE = re.compile(r"[A-Za-z]\w*(?:/(?:msg|srv|action))?/[A-Za-z]\w*")
"""Patterns of names of ROS, and of its types."""


def check_name(name: str, *, is_full: bool = False) -> None:
    """Do nothing for the name of a topic, a service or an action; a full one begins with a slash.

    Raises:
        LinkError: It is none.
    """
    if NAME.fullmatch(name) is None or (is_full and not name.startswith("/")):
        raise LinkError(
            f"{name[:80]!r} is not the name of a ROS topic, service or action.",
            hint="It looks like /camera/image_raw: letters, digits, _ and /.",
        )


def check_type(name: str) -> None:
    """Do nothing for the name of a type.

    Raises:
        LinkError: It is none.
    """
    if TYPE.fullmatch(name) is None:
        raise LinkError(
            f"{name[:80]!r} is not the name of a ROS type.",
            hint="It looks like geometry_msgs/msg/Twist (ROS 2) or geometry_msgs/Twist (ROS 1).",
        )


LATEST_S = 0.0
"""A stamp that ROS takes for "as it is now"; our idea of robot time may be off."""
NANOSECONDS = 1_000_000_000
LARGEST_SECONDS = 2**32 - 1


BULKY = frozenset(
    {
        "map_msgs/OccupancyGridUpdate",
        "nav_msgs/OccupancyGrid",
        "sensor_msgs/CompressedImage",
        "sensor_msgs/Image",
        "sensor_msgs/LaserScan",
        "sensor_msgs/PointCloud2",
    }
)
"""Types of large arrays without fixed length, which come faster in binary."""
VELOCITIES = frozenset(
    {
        "geometry_msgs/Twist",
        "geometry_msgs/TwistStamped",
        "ackermann_msgs/AckermannDrive",
        "ackermann_msgs/AckermannDriveStamped",
    }
)
"""Types on which a robot goes on until it is told otherwise, or its driver loses patience."""


class Dialect(StrEnum):
    """The version of ROS at the other end."""

    ROS1 = "ros1"
    ROS2 = "ros2"

    def type_name(self, name: str, kind: str = "msg") -> str:
        """Return a type as this ROS writes it, such as "nav_msgs/msg/OccupancyGrid"."""
        package, _, last = bare_type(name).partition("/")
        return f"{package}/{kind}/{last}" if self is Dialect.ROS2 else f"{package}/{last}"


def bare_type(name: str) -> str:
    """Return a type as "package/Type", however it was written."""
    parts = name.strip("/").split("/")
    return f"{parts[0]}/{parts[-1]}"


def read_stamp(stamp: Message) -> float:
    """Read a time of either dialect, in seconds."""
    is_ros1 = "secs" in stamp
    whole_s = whole_of(
        stamp, "secs" if is_ros1 else "sec", low=-LARGEST_SECONDS, high=LARGEST_SECONDS
    )
    rest = whole_of(stamp, "nsecs" if is_ros1 else "nanosec", low=0, high=NANOSECONDS - 1)
    return whole_s + rest / NANOSECONDS


def find_stamp(message: Message) -> float | None:
    """Return a message's own time in seconds of robot time; None where it has none."""
    header = message.get("header")
    stamp = (header if isinstance(header, Mapping) else message).get("stamp")
    try:
        return read_stamp(stamp) if isinstance(stamp, Mapping) else None
    except LinkError:
        return None


def write_stamp(stamp_s: float, *, dialect: Dialect) -> dict[str, int]:
    """Write a time given in seconds."""
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
    """Read the frame and the time in seconds that a message's header gives."""
    header = part_of(message, "header")
    return text_of(header, "frame_id").lstrip("/"), read_stamp(part_of(header, "stamp"))


def write_header(frame_id: str, stamp_s: float, *, dialect: Dialect) -> dict[str, Any]:
    """Write a header; the time in seconds."""
    stamp = write_stamp(stamp_s, dialect=dialect)
    if dialect is Dialect.ROS1:
        return {"seq": 0, "stamp": stamp, "frame_id": frame_id}
    return {"stamp": stamp, "frame_id": frame_id}
