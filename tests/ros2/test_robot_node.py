"""The robot of these tests is a robot to any ROS 2 program: seen through plain rclpy."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.geometry import Pose
from ros2.conftest import START, TWO_ROOMS
from ros2.robot_process import RobotProcess

if TYPE_CHECKING:  # importing it needs rclpy
    from ros2.ros_client import RosClient

pytestmark = pytest.mark.ros2

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
NEXT_ROOM = Pose(8.0, 2.25)
INSIDE_THE_WALL = Pose(5.25, 3.0)


@pytest.fixture
def client(robot: RobotProcess) -> Iterator["RosClient"]:
    from ros2.ros_client import open_ros_client  # noqa: PLC0415 - needs rclpy

    assert robot.process.poll() is None
    with open_ros_client() as opened:
        yield opened


def test_the_map_reaches_whoever_comes_later(client: "RosClient") -> None:
    from nav_msgs.msg import OccupancyGrid  # noqa: PLC0415

    from ros2.ros_client import LATCHED  # noqa: PLC0415

    message = client.wait_for_message(OccupancyGrid, "/map", qos=LATCHED)
    cells = np.array(message.data, dtype=np.int8).reshape(message.info.height, message.info.width)
    assert np.array_equal(cells, grid_from_text(TWO_ROOMS).cells)
    assert message.info.resolution == 0.5


def test_a_map_changes_when_it_is_told_to(robot: RobotProcess, client: "RosClient") -> None:
    from nav_msgs.msg import OccupancyGrid  # noqa: PLC0415

    from ros2.ros_client import LATCHED  # noqa: PLC0415

    robot.change_map("###\n#.#\n###")
    message = client.wait_for_message(
        OccupancyGrid, "/map", qos=LATCHED, where=lambda message: message.info.width == 3
    )
    assert list(message.data) == [100, 100, 100, 100, 0, 100, 100, 100, 100]


def test_transforms_lead_from_the_map_to_where_the_robot_is(client: "RosClient") -> None:
    from tf2_msgs.msg import TFMessage  # noqa: PLC0415

    from ros2.robot_topics import pose_from_message  # noqa: PLC0415

    frames: dict[str, Pose] = {}

    def collect(message: "TFMessage") -> bool:
        for frame in message.transforms:
            parts = type("Parts", (), {})()
            parts.position, parts.orientation = (
                frame.transform.translation,
                frame.transform.rotation,
            )
            frames[f"{frame.header.frame_id}>{frame.child_frame_id}"] = pose_from_message(parts)
        return {"map>odom", "odom>base_footprint"} <= frames.keys()

    client.wait_for_message(TFMessage, "/tf", where=collect)
    pose = frames["map>odom"] @ frames["odom>base_footprint"]
    assert (pose.x, pose.y, pose.yaw_rad) == pytest.approx((START.x, START.y, START.yaw_rad))


def test_a_goal_arrives_and_tells_how_far_it_is(robot: RobotProcess, client: "RosClient") -> None:
    robot.set_recoveries(2)
    told: list[Any] = []
    handle = client.send_goal(NEXT_ROOM, on_feedback=told.append)
    assert handle.accepted
    assert client.wait_for_result(handle).status == SUCCEEDED
    assert (robot.pose.x, robot.pose.y) == pytest.approx((NEXT_ROOM.x, NEXT_ROOM.y))
    distances_m = [feedback.distance_remaining for feedback in told]
    assert distances_m == sorted(distances_m, reverse=True)
    assert {feedback.number_of_recoveries for feedback in told} == {2}


def test_a_goal_behind_a_wall_is_aborted_with_a_reason(client: "RosClient") -> None:
    answer = client.wait_for_result(client.send_goal(INSIDE_THE_WALL))
    assert answer.status == ABORTED
    assert answer.result.error_code != 0
    assert answer.result.error_msg == "The way is blocked."


def test_a_goal_in_an_unknown_frame_is_rejected(client: "RosClient") -> None:
    assert not client.send_goal(NEXT_ROOM, frame="moon").accepted


def test_a_cancelled_goal_leaves_the_robot_where_it_is(
    robot: RobotProcess, client: "RosClient"
) -> None:
    handle = client.start_goal(NEXT_ROOM)
    assert client.cancel(handle)
    assert client.wait_for_result(handle).status == CANCELED
    assert not robot.is_driving
    assert robot.pose.x < NEXT_ROOM.x


def test_a_new_goal_ends_the_one_before(client: "RosClient") -> None:
    first, second = client.start_goal(NEXT_ROOM), client.start_goal(START)
    assert client.wait_for_result(first).status == ABORTED
    assert client.wait_for_result(second).status == SUCCEEDED


def test_without_motors_a_goal_stays_under_way(robot: RobotProcess, client: "RosClient") -> None:
    from std_srvs.srv import SetBool  # noqa: PLC0415

    assert client.call(SetBool, "/switch_motors", SetBool.Request(data=False)).success
    handle = client.start_goal(NEXT_ROOM)
    assert robot.is_driving
    client.call(SetBool, "/switch_motors", SetBool.Request(data=True))
    assert client.wait_for_result(handle).status == SUCCEEDED


def test_a_velocity_is_heard_and_followed(robot: RobotProcess, client: "RosClient") -> None:
    from geometry_msgs.msg import Twist  # noqa: PLC0415
    from nav_msgs.msg import Odometry  # noqa: PLC0415

    publisher = client.node.create_publisher(Twist, "/cmd_vel", 10)
    message = Twist()
    message.linear.x, message.angular.z = 0.25, 0.5
    first_x = client.wait_for_message(Odometry, "/odom").pose.pose.position.x
    client.wait_for_message(
        Odometry,
        "/odom",
        where=lambda odometry: odometry.pose.pose.position.x != first_x,
        meanwhile=lambda: publisher.publish(message),
    )
    assert robot.velocities[0] == (0.25, 0.5)


def test_pictures_have_padded_rows_and_a_known_lens(client: "RosClient") -> None:
    from sensor_msgs.msg import CameraInfo, Image  # noqa: PLC0415

    image = client.wait_for_message(Image, "/camera/image_raw")
    rows = np.frombuffer(bytes(image.data), dtype=np.uint8).reshape(image.height, image.step)
    pixels = rows[:, : image.width * 3].reshape(image.height, image.width, 3)
    assert image.step > image.width * 3
    assert list(pixels[10, 0]) == [255, 0, 0]
    assert list(pixels[10, -1]) == [0, 0, 255]
    assert client.wait_for_message(CameraInfo, "/camera/camera_info").k[2] == image.width / 2


def test_a_scan_sees_the_walls(client: "RosClient") -> None:
    from sensor_msgs.msg import LaserScan  # noqa: PLC0415

    ranges_m = client.wait_for_message(LaserScan, "/scan").ranges
    assert ranges_m[0] == pytest.approx(0.5, abs=0.13)  # behind it, where the scan begins


def test_parameters_of_every_kind_can_be_read(client: "RosClient") -> None:
    from rcl_interfaces.srv import GetParameters  # noqa: PLC0415

    names = ["robot_name", "robot_radius", "max_recoveries", "is_docked", "layers", "serial"]
    request = GetParameters.Request(names=names)
    name, radius, recoveries, is_docked, layers, serial = client.call(
        GetParameters, "/robot/get_parameters", request
    ).values
    assert (name.string_value, radius.double_value) == ("test robot", 0.22)
    assert (recoveries.integer_value, is_docked.bool_value) == (6, False)
    assert list(layers.string_array_value) == ["static", "obstacles"]
    assert list(serial.byte_array_value) == [b"\x01", b"\xff"]
