"""ROS messages of both dialects, read and written: grids, poses, transforms, scans, velocities."""

import base64
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from drawing import grid_from_text, text_from_grid
from mapspeak.errors import LinkError, MapError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.links.rosbridge.protocol.codec import decode_cbor, decode_json, to_cbor, to_json
from mapspeak.ros.messages.fields import Dialect, read_stamp, write_header, write_stamp
from mapspeak.ros.messages.grids import apply_grid_update, read_grid, write_grid
from mapspeak.ros.messages.poses import (
    FramedPose,
    FrameTransform,
    Twist,
    read_pose,
    read_pose_stamped,
    read_transforms,
    read_twist,
    write_odometry,
    write_pose,
    write_pose_stamped,
    write_pose_with_covariance,
    write_transforms,
    write_twist,
)
from mapspeak.ros.messages.scans import (
    LaserScan,
    read_fov_rad,
    read_scan,
    write_camera_info,
    write_scan,
)
from mapspeak.spatial import OccupancyGrid

DIALECTS = st.sampled_from(Dialect)
METRES = st.floats(-1e6, 1e6)
POSES = st.builds(Pose, METRES, METRES, st.floats(-math.pi, math.pi))
STAMPS = st.floats(0.0, 4e9)
FRAMES = st.text(st.characters(codec="ascii", exclude_characters="/"))
GRIDS = st.builds(
    OccupancyGrid,
    cells=arrays.arrays(
        np.int8, st.tuples(*[st.integers(1, 9)] * 2), elements=st.integers(-1, 100)
    ),
    resolution_m=st.sampled_from([0.01, 0.05, 0.1, 0.025, 1.0]),
    origin=POSES,
    stamp_s=STAMPS,
)
HEADER = {"stamp": {"sec": 1, "nanosec": 500_000_000}, "frame_id": "map"}
FLOOR = """
#####
#..?#
#####
"""


def grid_message(**changes: object) -> dict[str, object]:
    info = {"width": 3, "height": 2, "resolution": 0.05, "origin": write_pose(Pose(1.0, 2.0))}
    data = changes.pop("data", [0, -1, 100, 0, 0, 0])
    header = changes.pop("header", HEADER)
    return {"header": header, "info": {**info, **changes}, "data": data}


def assert_same_place(one: Pose, other: Pose) -> None:
    assert (one.x, one.y) == (other.x, other.y)
    assert wrap_angle(one.yaw_rad - other.yaw_rad) == pytest.approx(0.0, abs=1e-9)


def assert_same_grid(one: OccupancyGrid, other: OccupancyGrid) -> None:
    assert np.array_equal(one.cells, other.cells)
    assert one.resolution_m == other.resolution_m
    assert one.stamp_s == pytest.approx(other.stamp_s, abs=1e-6)
    assert_same_place(one.origin, other.origin)


@given(grid=GRIDS, dialect=DIALECTS)
def test_a_map_is_the_same_after_json(grid: OccupancyGrid, dialect: Dialect) -> None:
    assert_same_grid(read_grid(decode_json(to_json(write_grid(grid, dialect=dialect)))), grid)


@given(grid=GRIDS, dialect=DIALECTS)
def test_a_map_is_the_same_after_cbor(grid: OccupancyGrid, dialect: Dialect) -> None:
    assert_same_grid(read_grid(decode_cbor(to_cbor(write_grid(grid, dialect=dialect)))), grid)


@given(stamp_s=STAMPS, dialect=DIALECTS)
def test_a_time_is_the_same_to_a_microsecond(stamp_s: float, dialect: Dialect) -> None:
    assert read_stamp(write_stamp(stamp_s, dialect=dialect)) == pytest.approx(stamp_s, abs=1e-6)


@given(pose=POSES, frame_id=FRAMES, stamp_s=STAMPS, dialect=DIALECTS)
def test_a_stamped_pose_is_the_same_however_it_travels(
    pose: Pose, frame_id: str, stamp_s: float, dialect: Dialect
) -> None:
    framed = FramedPose(pose=pose, frame_id=frame_id, stamp_s=stamp_s)
    still = Twist(forward_mps=0.0, left_mps=0.0, turn_radps=0.0)
    odometry = write_odometry(framed, still, child="base_link", dialect=dialect)
    read = [
        read_pose_stamped(write_pose_stamped(framed, dialect=dialect)),
        read_pose_stamped(write_pose_with_covariance(framed, dialect=dialect)),
        read_pose_stamped(odometry),
    ]
    for each in read:
        assert_same_place(each.pose, pose)
        assert each.frame_id == frame_id
        assert each.stamp_s == pytest.approx(stamp_s, abs=1e-6)


@given(poses=st.lists(POSES, max_size=4), dialect=DIALECTS)
def test_transforms_are_the_same_and_in_order(poses: list[Pose], dialect: Dialect) -> None:
    given_ones = [
        FrameTransform(parent_from_child=pose, parent=f"f{n}", child=f"f{n + 1}", stamp_s=1.5)
        for n, pose in enumerate(poses)
    ]
    read = read_transforms(write_transforms(given_ones, dialect=dialect))
    assert [(each.parent, each.child) for each in read] == [
        (each.parent, each.child) for each in given_ones
    ]
    for one, other in zip(read, given_ones, strict=True):
        assert_same_place(one.parent_from_child, other.parent_from_child)


@given(forward=METRES, left=METRES, turn=METRES)
def test_a_velocity_is_the_same_stamped_or_not(forward: float, left: float, turn: float) -> None:
    twist = Twist(forward_mps=forward, left_mps=left, turn_radps=turn)
    assert read_twist(write_twist(twist)) == twist
    assert read_twist({"header": HEADER, "twist": write_twist(twist)}) == twist


@pytest.mark.parametrize("dialect", Dialect)
def test_a_scan_keeps_its_beams_and_nothing_beyond_its_limits(dialect: Dialect) -> None:
    scan = LaserScan(
        ranges_m=np.array([0.5, np.nan, 3.0, 99.0, 0.01]),
        first_angle_rad=-1.0,
        angle_step_rad=0.5,
        least_range_m=0.1,
        largest_range_m=10.0,
        frame_id="laser",
        stamp_s=2.0,
    )
    for message in (
        decode_json(to_json(write_scan(scan, dialect=dialect))),
        decode_cbor(to_cbor(write_scan(scan, dialect=dialect))),
    ):
        read = read_scan(message)
        assert read.ranges_m == pytest.approx([0.5, np.nan, 3.0, np.nan, np.nan], nan_ok=True)
        assert (read.frame_id, read.first_angle_rad, read.stamp_s) == ("laser", -1.0, 2.0)


@pytest.mark.parametrize("dialect", Dialect)
def test_a_beam_that_met_nothing_is_told_from_one_that_says_nothing(dialect: Dialect) -> None:
    met_nothing = np.array([False, True, False])
    scan = LaserScan(
        ranges_m=np.array([0.5, np.nan, np.nan]),
        first_angle_rad=-1.0,
        angle_step_rad=0.5,
        least_range_m=0.1,
        largest_range_m=10.0,
        frame_id="laser",
        stamp_s=2.0,
        met_nothing=met_nothing,
    )
    message = decode_cbor(to_cbor(write_scan(scan, dialect=dialect)))
    assert read_scan(message).is_open.tolist() == met_nothing.tolist()


@pytest.mark.parametrize("largest_m", [8.0, 12.1, 3.3000001])
def test_a_beam_at_its_limit_met_nothing(largest_m: float) -> None:
    message = {
        "header": write_header("laser", 1.0, dialect=Dialect.ROS1),
        "angle_min": 0.0, "angle_increment": 0.1, "range_min": 0.1, "range_max": largest_m,
        "ranges": np.array([largest_m, 0.999 * largest_m, np.inf], dtype=np.float32),
    }  # fmt: skip
    scan = read_scan(message)
    assert scan.is_open.tolist() == [True, False, True]
    assert np.isfinite(scan.ranges_m).tolist() == [False, True, False]


@given(fov_rad=st.none() | st.floats(0.1, 3.0), dialect=DIALECTS)
def test_a_cameras_angle_comes_from_its_matrix(fov_rad: float | None, dialect: Dialect) -> None:
    info = write_camera_info(
        write_header("camera", 1.0, dialect=dialect),
        width_px=640,
        height_px=480,
        horizontal_fov_rad=fov_rad,
        dialect=dialect,
    )
    read = read_fov_rad(decode_json(to_json(info)))
    assert read == (None if fov_rad is None else pytest.approx(fov_rad))


def test_types_and_times_are_written_as_each_ros_does() -> None:
    assert Dialect.ROS1.type_name("nav_msgs/msg/Path") == "nav_msgs/Path"
    assert Dialect.ROS2.type_name("nav_msgs/Path") == "nav_msgs/msg/Path"
    assert Dialect.ROS2.type_name("std_srvs/Empty", "srv") == "std_srvs/srv/Empty"
    assert write_stamp(1.25, dialect=Dialect.ROS1) == {"secs": 1, "nsecs": 250_000_000}
    assert write_stamp(1.25, dialect=Dialect.ROS2) == {"sec": 1, "nanosec": 250_000_000}


def test_the_first_row_is_the_one_at_the_origin() -> None:
    grid = read_grid(grid_message())
    assert text_from_grid(grid) == "...\n.?#"
    assert grid.origin == Pose(1.0, 2.0)
    assert grid.stamp_s == 1.5


@pytest.mark.parametrize(
    "data",
    [
        [0, -1, 100, 0, 0, 0],
        base64.b64encode(b"\x00\xff\x64\x00\x00\x00").decode(),
        b"\x00\xff\x64\x00\x00\x00",
        np.array([0, -1, 100, 0, 0, 0], dtype=np.int8),
        np.array([0, 255, 100, 0, 0, 0], dtype=np.uint8),
        np.array([0, -1, 100, 0, 0, 0], dtype=np.int64),
    ],
)
def test_cells_arrive_in_many_shapes(data: object) -> None:
    assert text_from_grid(read_grid(grid_message(data=data))) == "...\n.?#"


def test_a_resolution_loses_the_noise_of_single_precision() -> None:
    assert read_grid(grid_message(resolution=0.05000000074505806)).resolution_m == 0.05


def test_an_update_changes_its_part_of_the_map_alone() -> None:
    grid = grid_from_text(FLOOR)
    update = {"header": HEADER, "x": 2, "y": 1, "width": 2, "height": 1, "data": [100, 0]}
    assert text_from_grid(apply_grid_update(grid, update)) == "#####\n#.#.#\n#####"
    assert text_from_grid(grid) == "#####\n#..?#\n#####"


@pytest.mark.parametrize(("x", "y"), [(-1, 0), (4, 0), (0, 3)])
def test_an_update_beside_the_map_is_refused(x: int, y: int) -> None:
    update = {"header": HEADER, "x": x, "y": y, "width": 2, "height": 1, "data": [0, 0]}
    with pytest.raises(MapError, match="fetch the whole map"):
        apply_grid_update(grid_from_text(FLOOR), update)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"width": 0, "height": 0, "data": []}, "empty"),
        ({"width": 4}, "says 4x2 cells and brings 6"),
        ({"width": 100_000, "height": 100_000}, "limit"),
        ({"width": -3}, "width"),
        ({"width": 3.0}, "width"),
        ({"resolution": None}, "resolution"),
        ({"resolution": math.nan}, "resolution"),
        ({"resolution": 0.0}, "resolution"),
        ({"resolution": 10**400}, "resolution"),
        ({"origin": write_pose(Pose(1e300, 0.0))}, "origin"),
        ({"origin": {"position": {"x": 0, "y": 0}}}, "orientation"),
        ({"data": [0, 1.5, 0, 0, 0, 0]}, "data"),
        ({"data": [0, "1", 0, 0, 0, 0]}, "data"),
        ({"data": [0, 300, 0, 0, 0, 0]}, "data"),
        ({"data": [0, 101, 0, 0, 0, 0]}, "101"),
        ({"data": "no base64!"}, "data"),
        ({"data": None}, "data"),
        ({"header": None}, "header"),
        ({"header": {"stamp": {"sec": 0, "nanosec": -1}, "frame_id": "map"}}, "nanosec"),
    ],
)
def test_a_map_that_cannot_be_is_refused_with_a_reason(
    changes: dict[str, object], said: str
) -> None:
    with pytest.raises((LinkError, MapError), match=said) as refusal:
        read_grid(grid_message(**changes))
    assert refusal.value.hint


@pytest.mark.parametrize(
    "quaternion", [(0, 0, 0, 0), (0, 0, 1, 1), (0, 0, 0, 0.9), (0, 0, 0, None)]
)
def test_a_quaternion_that_is_no_rotation_is_refused(quaternion: tuple[float, ...]) -> None:
    orientation = dict(zip("xyzw", quaternion, strict=True))
    with pytest.raises(LinkError):
        read_pose({"position": {"x": 0, "y": 0, "z": 0}, "orientation": orientation})


def test_a_quaternion_written_with_two_digits_is_understood() -> None:
    orientation = {"x": 0, "y": 0, "z": 0.71, "w": 0.71}
    pose = read_pose({"position": {"x": 0, "y": 0, "z": 0}, "orientation": orientation})
    assert pose.yaw_deg == pytest.approx(90.0)


@pytest.mark.parametrize("dialect", Dialect)
def test_a_transform_keeps_height_and_tilt_beside_the_pose_seen_from_above(
    dialect: Dialect,
) -> None:
    upside_down = FrameTransform(
        parent_from_child=Pose(0.1, 0.2, 0.0),
        parent="base_link",
        child="laser",
        stamp_s=0.0,
        height_m=0.3,
        rotation=(1.0, 0.0, 0.0, 0.0),
    )
    message = write_transforms([upside_down], dialect=dialect)
    assert read_transforms(decode_json(to_json(message))) == (upside_down,)
