"""Laser scans and point clouds of ROS messages, and the field of view of cameras."""

import math
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import (
    Dialect,
    Message,
    bytes_of,
    floats_of,
    misfit,
    number_of,
    parts_of,
    read_header,
    whole_of,
    write_header,
)

LARGEST_SIDE_PX = 65535
MOST_BEAMS = 1_000_000
FLOAT32_STEP = float(np.finfo(np.float32).eps)
SAYING_NOTHING: dict[str, Any] = {
    "header": {"frame_id": "(not said)", "stamp": {"sec": 0, "nanosec": 0}},
    "angle_min": 0.0,
    "angle_increment": 0.0,
    "range_min": 0.0,
    "range_max": sys.float_info.max,
}
"""The values that replace impossible ones in a scan's fields."""
HINT = "Look at the fields of the message; the node that sends it may be misconfigured."
KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""By sensor_msgs/PointField, numpy's names."""
LARGEST_STEP = 65_536
MOST_POINTS = 50_000_000


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LaserScan:
    """One turn of a LiDAR; compared by identity.

    Attributes:
        ranges_m: One distance per beam; NaN where the beam met nothing or was not valid.
        first_angle_rad: Of the first beam, counter-clockwise from the sensor's x axis.
        met_nothing: For each beam, whether it is known to have met nothing as far as
            `largest_range_m`; None where all without a range are.
    """

    ranges_m: NDArray[np.float64]
    first_angle_rad: float
    angle_step_rad: float
    least_range_m: float
    largest_range_m: float
    frame_id: str
    stamp_s: float
    met_nothing: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        ranges_m = np.array(self.ranges_m, dtype=np.float64)
        ranges_m.setflags(write=False)
        object.__setattr__(self, "ranges_m", ranges_m)
        if self.met_nothing is not None:
            met_nothing = np.array(self.met_nothing, dtype=np.bool_)
            met_nothing.setflags(write=False)
            object.__setattr__(self, "met_nothing", met_nothing)

    @property
    def is_open(self) -> NDArray[np.bool_]:
        """True for the beams that met nothing as far as the laser reaches."""
        return np.isnan(self.ranges_m) if self.met_nothing is None else self.met_nothing


def read_scan(message: Message) -> LaserScan:
    """Read sensor_msgs/LaserScan; ranges outside its own limits become NaN.

    A beam that met nothing is infinite (REP 117), or at its limit or beyond, as Stage and some
    drivers of ROS 1 write it, and as AMCL reads it. Zero, NaN and ranges that are too near say
    nothing: drivers write them for dark things, glass, and the robot's own posts.
    """
    frame_id, stamp_s = read_header(message)
    ranges_m = floats_of(message, "ranges")
    if ranges_m.size > MOST_BEAMS:
        raise misfit("ranges", f"{ranges_m.size} long", f"at most {MOST_BEAMS} beams")
    least_m, largest_m = number_of(message, "range_min"), number_of(message, "range_max")
    met_nothing = ranges_m >= largest_m * (1.0 - FLOAT32_STEP)
    is_valid = (ranges_m >= least_m) & ~met_nothing
    return LaserScan(
        ranges_m=np.where(is_valid, ranges_m, np.nan),
        first_angle_rad=number_of(message, "angle_min"),
        angle_step_rad=number_of(message, "angle_increment"),
        least_range_m=least_m,
        largest_range_m=largest_m,
        frame_id=frame_id,
        stamp_s=stamp_s,
        met_nothing=met_nothing,
    )


def mend_scan(message: Message) -> tuple[dict[str, Any], dict[str, str]]:
    """Return a readable sensor_msgs/LaserScan, and the faults of its fields.

    A wrong field gets a neutral value instead: zero for an angle, no limit for a range, NaN for a
    single beam.
    """
    mended, faults = dict(message), dict[str, str]()
    for name, nothing in SAYING_NOTHING.items():
        try:
            read_header(message) if name == "header" else number_of(message, name)
        except LinkError as error:
            mended[name], faults[name] = nothing, error.message
    ranges = message.get("ranges")
    if isinstance(ranges, list | tuple):
        odd = [number for number, each in enumerate(ranges) if not _is_range(each)]
        if odd:
            mended["ranges"] = [each if _is_range(each) else None for each in ranges]
            more = f" ({len(odd) - 1:,} more are none either)" if len(odd) > 1 else ""
            fault = misfit(f"ranges[{odd[0]}]", ranges[odd[0]], f"a number{more}")
            faults["ranges"] = fault.message
    return mended, faults


def write_scan(scan: LaserScan, *, dialect: Dialect) -> dict[str, Any]:
    """Write sensor_msgs/LaserScan; a beam that met nothing becomes infinite (REP 117)."""
    ranges_m = np.where(scan.is_open, np.inf, scan.ranges_m)
    last_rad = scan.first_angle_rad + scan.angle_step_rad * max(len(ranges_m) - 1, 0)
    return {
        "header": write_header(scan.frame_id, scan.stamp_s, dialect=dialect),
        "angle_min": scan.first_angle_rad,
        "angle_max": last_rad,
        "angle_increment": scan.angle_step_rad,
        "time_increment": 0.0,
        "scan_time": 0.0,
        "range_min": scan.least_range_m,
        "range_max": scan.largest_range_m,
        "ranges": ranges_m.astype(np.float32),
        "intensities": np.zeros(0, dtype=np.float32),
    }


def read_fov_rad(message: Message) -> float | None:
    """Read the horizontal field of view of a sensor_msgs/CameraInfo; None without calibration."""
    read_header(message)
    width_px = whole_of(message, "width", low=0, high=LARGEST_SIDE_PX)
    # ROS 1 writes the intrinsic matrix with a capital letter.
    matrix = floats_of(message, "K" if "K" in message else "k")
    if matrix.size != 9:
        raise misfit("k", f"{matrix.size} long", "a matrix of 9 numbers")
    return _fov(width_px, focal_px=float(matrix[0]), centre_px=float(matrix[2]))


def write_camera_info(
    header: Message,
    *,
    width_px: int,
    height_px: int,
    horizontal_fov_rad: float | None,
    dialect: Dialect,
) -> dict[str, Any]:
    """Write sensor_msgs/CameraInfo of a camera without distortion, with square pixels."""
    focal_px = 0.0
    if horizontal_fov_rad is not None:
        focal_px = width_px / (2.0 * math.tan(horizontal_fov_rad / 2.0))
    u, v = width_px / 2.0, height_px / 2.0
    intrinsic = [focal_px, 0.0, u, 0.0, focal_px, v, 0.0, 0.0, 1.0]
    projection = [focal_px, 0.0, u, 0.0, 0.0, focal_px, v, 0.0, 0.0, 0.0, 1.0, 0.0]
    matrices = {
        "D": [0.0] * 5,
        "K": intrinsic,
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": projection,
    }
    is_ros1 = dialect is Dialect.ROS1
    return {
        "header": header,
        "height": height_px,
        "width": width_px,
        "distortion_model": "plumb_bob",
        **{name if is_ros1 else name.lower(): values for name, values in matrices.items()},
        "binning_x": 0,
        "binning_y": 0,
        "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
    }


def _is_range(value: object) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _fov(width_px: int, *, focal_px: float, centre_px: float) -> float | None:
    """Return the angle between the edges; drivers leave the matrix at zero until calibrated."""
    if not (focal_px > 0.0 and 0.0 <= centre_px <= width_px and width_px > 0):
        return None
    fov_rad = math.atan(centre_px / focal_px) + math.atan((width_px - centre_px) / focal_px)
    return fov_rad if 0.0 < fov_rad < math.pi else None


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
    fields = [field for field in parts_of(message, "fields") if isinstance(field, dict)]
    kind = _point_kind(fields, point_step, is_bigendian=bool(message.get("is_bigendian")))
    data = np.frombuffer(bytes_of(message.get("data")), dtype=np.uint8)
    row_step = row_step or width * point_step
    if width * height > MOST_POINTS or row_step < width * point_step:
        raise LinkError(f"A cloud of {width} x {height} points cannot be so.", hint=HINT)
    if data.size < row_step * (height - 1) + width * point_step:
        raise LinkError(
            f"A cloud of {width} x {height} points brings {data.size} bytes only.", hint=HINT
        )
    if width * height == 0:
        row_step = height = 0
    # The last row may come without its padding.
    rows = np.zeros(height * row_step, dtype=np.uint8)
    rows[: data.size] = data[: rows.size]
    packed = rows.reshape(height, row_step)[:, : width * point_step].copy().view(kind).ravel()
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
        kind = KINDS.get(code) if isinstance(code, int) else None
        if kind is None or type(offset) is not int or not 0 <= offset < point_step:
            raise LinkError(f"The cloud's field {axis} is of no known type.", hint=HINT)
        formats.append(f"{order}{kind}")
        offsets.append(offset)
    try:
        return np.dtype(
            {"names": list("xyz"), "formats": formats, "offsets": offsets, "itemsize": point_step}
        )
    except ValueError as error:
        raise LinkError(
            f"The cloud's fields do not fit into {point_step} bytes.", hint=HINT
        ) from error
