"""The robot of these tests is a robot to any ROS 2 program: seen through plain rclpy."""

import math
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


# --- what can be wrong with it


def test_a_goal_accepted_late_cannot_be_cancelled_before(
    robot: RobotProcess, client: "RosClient"
) -> None:
    from action_msgs.srv import CancelGoal  # noqa: PLC0415

    robot.set_faults(acceptance_s=math.inf)
    sent = client.begin_goal(NEXT_ROOM)
    client.wait_until(lambda: robot.tell()["n_goals"] == 1)
    name = "/navigate_to_pose/_action/cancel_goal"
    assert not client.call(CancelGoal, name, CancelGoal.Request()).goals_canceling
    assert robot.driven_m == 0.0
    robot.set_faults(acceptance_s=0.0)
    handle = client.wait_for(sent)
    assert client.wait_for_result(handle).status == SUCCEEDED
    assert robot.driven_m == pytest.approx(NEXT_ROOM.x - START.x, abs=0.1)


def test_goals_are_rejected_aborted_or_not_cancelled_as_told(
    robot: RobotProcess, client: "RosClient"
) -> None:
    robot.set_faults(rejects=True)
    assert not client.send_goal(NEXT_ROOM).accepted
    robot.set_faults(rejects=False, aborts=True)
    assert client.wait_for_result(client.send_goal(NEXT_ROOM)).status == ABORTED
    robot.set_faults(aborts=False, ignores_cancels=True)
    handle = client.start_goal(NEXT_ROOM)
    assert not client.cancel(handle)
    assert client.wait_for_result(handle).status == SUCCEEDED


def test_a_silent_topic_keeps_its_publisher(robot: RobotProcess, client: "RosClient") -> None:
    from sensor_msgs.msg import LaserScan  # noqa: PLC0415

    client.wait_for_message(LaserScan, "/scan")
    robot.set_faults(silent=["/scan"])
    with pytest.raises(TimeoutError):
        client.wait_for_message(LaserScan, "/scan", patience_s=2.0)
    assert client.node.count_publishers("/scan") == 1
    robot.set_faults(silent=[])
    client.wait_for_message(LaserScan, "/scan")


def test_a_spin_turns_the_robot_on_its_spot(robot: RobotProcess, client: "RosClient") -> None:
    from nav2_msgs.action import Spin  # noqa: PLC0415

    handle = client.send(Spin, "spin", Spin.Goal(target_yaw=1.5))
    assert client.wait_for_result(handle).status == SUCCEEDED
    assert robot.pose.yaw_rad == pytest.approx(1.5)
    assert robot.driven_m == 0.0


DRIVES_BY_VELOCITY = ("--drives-by-velocity",)


@pytest.mark.parametrize("robot", [DRIVES_BY_VELOCITY], indirect=True)
def test_without_watchdog_a_base_drives_on_when_navigation_dies(
    robot: RobotProcess, client: "RosClient"
) -> None:
    robot.set_faults(has_watchdog=False)
    client.start_goal(NEXT_ROOM)
    client.wait_until(lambda: robot.driven_m > 0.2)
    robot.kill_navigation()
    driven_m = robot.driven_m
    client.wait_until(lambda: robot.driven_m > driven_m + 1.0)
    assert (2.0, 0.0) in robot.velocities


LATE = ("--later", "actions", "scan", "--also", "goal_topic", "costmaps")


@pytest.mark.parametrize("robot", [LATE], indirect=True)
def test_parts_appear_when_they_are_told_to(robot: RobotProcess, client: "RosClient") -> None:
    from rcl_interfaces.srv import GetParameters  # noqa: PLC0415

    request = GetParameters.Request(names=["robot_radius"])
    name = "/local_costmap/local_costmap/get_parameters"
    assert client.call(GetParameters, name, request).values[0].double_value == 0.35
    assert not client.has_navigation(within_s=1.0)
    assert client.node.count_publishers("/scan") == 0
    robot.appear("scan")
    robot.appear("actions")
    client.wait_until(lambda: client.node.count_publishers("/scan") == 1)
    assert client.wait_for_result(client.send_goal(NEXT_ROOM)).status == SUCCEEDED


NAMED = ("--namespace", "/robot1", "--participants", "12")


@pytest.mark.parametrize("robot", [NAMED], indirect=True)
def test_a_namespace_is_before_all_names_and_others_are_in_the_domain(
    robot: RobotProcess, client: "RosClient"
) -> None:
    assert robot.process.poll() is None
    wanted = {"/robot1/tf", "/robot1/tf_static", "/robot1/map", "/robot1/scan", "/robot1/cmd_vel"}
    client.wait_until(
        lambda: wanted <= {name for name, _ in client.node.get_topic_names_and_types()}
    )
    client.wait_until(lambda: len(set(client.node.get_node_names())) == 15)
