"""Messages that fit no type: always an error with a hint, never another exception."""

import contextlib
import copy
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mapspeak.errors import LinkError, MapError
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge.protocol.bounds import FrameError
from mapspeak.links.rosbridge.protocol.codec import decode_json, to_json
from mapspeak.ros.messages.fields import Dialect, write_header
from mapspeak.ros.messages.grids import apply_grid_update, read_grid, write_grid
from mapspeak.ros.messages.pictures import read_compressed_image, read_image
from mapspeak.ros.messages.poses import (
    FramedPose,
    FrameTransform,
    Twist,
    read_pose_stamped,
    read_transforms,
    read_twist,
    write_pose_stamped,
    write_pose_with_covariance,
    write_transforms,
    write_twist,
)
from mapspeak.ros.messages.scans import (
    LaserScan,
    read_cloud,
    read_fov_rad,
    read_scan,
    write_camera_info,
    write_scan,
)
from mapspeak.spatial import OccupancyGrid

GRID = OccupancyGrid(cells=np.zeros((2, 3), dtype=np.int8), resolution_m=0.05)
HERE = FramedPose(pose=Pose(1.0, 2.0, 0.5), frame_id="map", stamp_s=1.0)
LINK = FrameTransform(parent_from_child=Pose(1.0, 0.0), parent="map", child="odom", stamp_s=1.0)
CAMERA = write_camera_info(
    write_header("camera", 1.0, dialect=Dialect.ROS1),
    width_px=4,
    height_px=2,
    horizontal_fov_rad=1.0,
    dialect=Dialect.ROS1,
)
SCAN = LaserScan(
    ranges_m=np.ones(3),
    first_angle_rad=0.0,
    angle_step_rad=0.1,
    least_range_m=0.1,
    largest_range_m=9.0,
    frame_id="laser",
    stamp_s=1.0,
)
TWIST = Twist(forward_mps=0.1, left_mps=0.0, turn_radps=0.0)
HEADER = write_pose_stamped(HERE, dialect=Dialect.ROS2)["header"]
IMAGE = {
    "header": HEADER, "width": 2, "height": 2, "encoding": "rgb8", "step": 6,
    "is_bigendian": 0, "data": [0] * 12,
}  # fmt: skip
UPDATE = {"header": HEADER, "x": 0, "y": 0, "width": 1, "height": 1, "data": [0]}
COMPRESSED = {"header": HEADER, "format": "jpeg", "data": [255, 216, 255]}

Reader = Callable[[Any], object]
READERS: dict[str, tuple[Reader, Any]] = {
    "grid": (read_grid, write_grid(GRID, dialect=Dialect.ROS1)),
    "update": (lambda message: apply_grid_update(GRID, message), UPDATE),
    "pose": (read_pose_stamped, write_pose_stamped(HERE, dialect=Dialect.ROS2)),
    "estimate": (read_pose_stamped, write_pose_with_covariance(HERE, dialect=Dialect.ROS1)),
    "transforms": (read_transforms, write_transforms([LINK], dialect=Dialect.ROS2)),
    "camera": (read_fov_rad, CAMERA),
    "scan": (read_scan, write_scan(SCAN, dialect=Dialect.ROS2)),
    "twist": (read_twist, write_twist(TWIST)),
    "image": (read_image, IMAGE),
    "compressed": (read_compressed_image, COMPRESSED),
}
HOSTILE: list[Any] = [
    None, True, -1, 0, 10**400, 2**63, 1e308, math.nan, math.inf, -math.inf, "", "NaN", "\ud800",
    "x" * 10_000, b"", b"\xff\xfe", [], [None], [[1]], ["1"], [1.5], [10**400], [True], {},
    {"x": {}}, {"secs": 1}, np.zeros((2, 2)), np.array(["a"]), np.zeros(3), object(),
]  # fmt: skip


def places_in(value: object, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Finds the way to every field of a message."""
    yield path
    if isinstance(value, dict):
        for name in value:
            yield from places_in(value[name], (*path, name))
    if isinstance(value, list) and len(value) < 4:
        for number in range(len(value)):
            yield from places_in(value[number], (*path, number))


def changed(message: Any, path: tuple[Any, ...], value: object) -> Any:  # noqa: ANN401
    if not path:
        return value
    message = copy.deepcopy(message)
    place = message
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    return message


def read_or_refuse(reader: Reader, message: object) -> None:
    try:
        reader(message)
    except (LinkError, MapError) as refusal:
        is_well_said = bool(refusal.hint) and len(refusal.message) < 300
    else:
        is_well_said = True
    assert is_well_said


@pytest.mark.parametrize("name", READERS)
def test_any_value_in_any_field_is_read_or_refused(name: str) -> None:
    reader, message = READERS[name]
    for path in places_in(message):
        for value in HOSTILE:
            read_or_refuse(reader, changed(message, path, value))


@pytest.mark.parametrize("name", READERS)
def test_a_missing_field_is_read_over_or_refused(name: str) -> None:
    reader, message = READERS[name]
    for path in places_in(message):
        if path and isinstance(path[-1], str):
            less = copy.deepcopy(message)
            place = less
            for step in path[:-1]:
                place = place[step]
            del place[path[-1]]
            read_or_refuse(reader, less)


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data(), name=st.sampled_from(sorted(READERS)))
def test_a_message_of_another_type_is_read_or_refused(data: st.DataObject, name: str) -> None:
    other = data.draw(st.sampled_from([message for _, message in READERS.values()]))
    read_or_refuse(READERS[name][0], other)


@given(st.data())
def test_a_mutated_frame_is_read_or_refused(data: st.DataObject) -> None:
    frame = bytearray(to_json(write_grid(GRID, dialect=Dialect.ROS2)))
    for _ in range(data.draw(st.integers(1, 4))):
        frame[data.draw(st.integers(0, len(frame) - 1))] = data.draw(st.integers(0, 255))
    with contextlib.suppress(FrameError):
        read_or_refuse(read_grid, decode_json(bytes(frame)))


AXES = [
    {"name": name, "datatype": 7, "offset": offset, "count": 1}
    for name, offset in (("x", 0), ("y", 4), ("z", 8))
]


def cloud(**changed: Any) -> dict[str, Any]:  # noqa: ANN401 - ROS JSON
    header = write_header("lidar", 1.0, dialect=Dialect.ROS2)
    size = {"width": 1, "height": 1, "point_step": 12, "row_step": 12}
    return {"header": header, **size, "fields": AXES, "data": bytes(12), **changed}


@pytest.mark.parametrize(
    "changed",
    [
        {"fields": 5},
        {"fields": [{**AXES[0], "datatype": []}, *AXES[1:]]},
        {"fields": [{**AXES[0], "offset": 2**70}, *AXES[1:]]},
        {"fields": [{**AXES[0], "offset": True}, *AXES[1:]]},
        {"fields": [{**AXES[0], "offset": -1}, *AXES[1:]]},
        {"point_step": 0},
        {"width": 2},
        {"width": 2**31, "height": 2**31},
    ],
)
def test_a_cloud_that_is_none_is_told_as_such(changed: dict[str, Any]) -> None:
    with pytest.raises(LinkError):
        read_cloud(cloud(**changed))


@pytest.mark.parametrize("size", [(0, 0), (0, 2**31), (2**31, 0)])
def test_a_cloud_without_points_is_read_at_once_whatever_its_sides(size: tuple[int, int]) -> None:
    width, height = size
    empty = cloud(width=width, height=height, row_step=0, data=b"")
    assert read_cloud(empty).n_points == 0
