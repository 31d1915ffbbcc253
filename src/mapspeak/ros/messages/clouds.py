"""Point clouds: sensor_msgs/PointCloud2 as an array of points."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Message, bytes_of, read_header, whole_of

HINT = "Look at the fields of the message; the node that sends it may be misconfigured."
KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""By sensor_msgs/PointField, numpy's names."""
LARGEST_STEP = 65_536
MOST_POINTS = 50_000_000


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PointCloud:
    """The points of a cloud; compared by identity.

    Attributes:
        points: Metres in the cloud's frame, shape (points, 3); only finite ones.
        n_points: All of them.
        fields: What each point carries.
        frame_id: The sensor's frame.
    """

    points: NDArray[np.float64]
    n_points: int
    fields: tuple[str, ...]
    frame_id: str


def read_cloud(message: Message) -> PointCloud:
    """Read sensor_msgs/PointCloud2, in either byte order, rows padded or not.

    Raises:
        LinkError: It is invalid, or its points have no x, y and z.
    """
    frame_id, _ = read_header(message)
    width, height, point_step, row_step = (
        whole_of(message, key, low=0, high=2**31)
        for key in ("width", "height", "point_step", "row_step")
    )
    fields = [field for field in message.get("fields") or [] if isinstance(field, dict)]
    kind = _point_kind(fields, point_step, is_bigendian=bool(message.get("is_bigendian")))
    data = np.frombuffer(bytes_of(message.get("data")), dtype=np.uint8)
    row_step = row_step or width * point_step
    if width * height > MOST_POINTS or row_step < width * point_step:
        raise LinkError(f"A cloud of {width} x {height} points cannot be so.", hint=HINT)
    if data.size < row_step * (height - 1) + width * point_step:
        raise LinkError(
            f"A cloud of {width} x {height} points brings {data.size} bytes only.", hint=HINT
        )
    rows = [
        data[row * row_step : row * row_step + width * point_step].view(kind)
        for row in range(height)
    ]
    packed = np.concatenate(rows) if rows else np.zeros(0, dtype=kind)
    points = np.stack([packed[axis].astype(np.float64) for axis in "xyz"], axis=1)
    return PointCloud(
        points=points[np.isfinite(points).all(axis=1)],
        n_points=width * height,
        fields=tuple(str(field.get("name")) for field in fields),
        frame_id=frame_id,
    )


def _point_kind(
    fields: list[dict[str, Any]], point_step: int, *, is_bigendian: bool
) -> np.dtype[Any]:
    order = ">" if is_bigendian else "<"
    found = {str(field.get("name")): field for field in fields}
    if not {"x", "y", "z"} <= set(found):
        raise LinkError("The cloud's points have no x, y and z.", hint=HINT)
    formats: list[str] = []
    offsets: list[int] = []
    for axis in "xyz":
        code, offset = found[axis].get("datatype"), found[axis].get("offset")
        if code not in KINDS or not isinstance(offset, int):
            raise LinkError(f"The cloud's field {axis} is of no known type.", hint=HINT)
        formats.append(f"{order}{KINDS[code]}")
        offsets.append(offset)
    try:
        return np.dtype(
            {"names": list("xyz"), "formats": formats, "offsets": offsets, "itemsize": point_step}
        )
    except ValueError as error:
        raise LinkError(
            f"The cloud's fields do not fit into {point_step} bytes.", hint=HINT
        ) from error
