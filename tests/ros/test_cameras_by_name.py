"""Several cameras of one robot, by their names, on both ROS."""

import math
from dataclasses import replace

import pytest

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import PoseDoubt
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.discovery.topics import name_camera
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import write_header
from mapspeak.ros.messages.poses import FrameTransform, write_transforms
from rosbridge_robot import ScriptedRobot, connect_scripted

pytestmark = pytest.mark.anyio

QUICK = Patience(first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0)
PATIENCE = replace(QUICK, settling_s=0.0)
FRONT, REAR = "/front_camera/image_raw", "/rear_camera/image_raw"
OPTICAL = (-0.5, 0.5, -0.5, 0.5)
"""The rotation of an optical frame that looks ahead (REP 103), as (x, y, z, w)."""
BACKWARDS = (-0.5, -0.5, 0.5, 0.5)
"""One that looks back: half a turn about the robot's z axis, then the above."""
both = pytest.mark.parametrize("ros", [1, 2])


def with_cameras(ros: int) -> ScriptedRobot:
    scripted = ScriptedRobot(ros=ros)
    type_name = scripted.dialect.type_name("sensor_msgs/Image")
    for width, topic in enumerate((FRONT, REAR), start=1):
        scripted.topics[topic] = type_name
        frame = f"{topic.split('/')[1]}_optical"
        scripted.latched[topic] = {
            "header": write_header(frame, 3.0, dialect=scripted.dialect),
            "height": 1, "width": width, "encoding": "rgb8", "step": 3 * width,
            "data": [255, 0, 0] * width,
        }  # fmt: skip
    return scripted


def mount(scripted: ScriptedRobot, **rotations: tuple[float, float, float, float]) -> None:
    """Tell where cameras are on the robot."""
    mounted = [
        FrameTransform(
            parent_from_child=Pose(0.1, 0.0), parent="base_link", child=child, stamp_s=0.0,
            rotation=rotation, height_m=0.5,
        )
        for child, rotation in rotations.items()
    ]  # fmt: skip
    body = FrameTransform(
        parent_from_child=Pose(1.0, 2.0, 0.5), parent="map", child="base_link", stamp_s=100.0
    )
    scripted.latched["/tf"] = write_transforms([body, *mounted], dialect=scripted.dialect)


@both
async def test_a_second_camera_is_looked_through_by_its_name(ros: int) -> None:
    scripted = with_cameras(ros)
    mount(scripted, front_camera_optical=OPTICAL, rear_camera_optical=BACKWARDS)
    async with connect_scripted(scripted, patience=PATIENCE) as robot:
        assert robot.description.cameras == ("front_camera", "rear_camera")
        ahead, behind = await robot.fetch_picture(), await robot.fetch_picture("Rear_camera")
    assert (ahead.width_px, behind.width_px) == (1, 2)
    assert ahead.pose.point == behind.pose.point
    assert ahead.pose.yaw_rad == pytest.approx(0.5)
    assert behind.pose.yaw_rad == pytest.approx(0.5 - math.pi)
    assert behind.pose_doubt is not PoseDoubt.CAMERA_TURN


@both
async def test_a_picture_is_placed_where_the_robot_was_when_it_was_taken(ros: int) -> None:
    scripted = with_cameras(ros)
    turning = [
        FrameTransform(
            parent_from_child=Pose(1.0, at_s, at_s), parent="map", child="base_link", stamp_s=at_s
        )
        for at_s in (2.0, 2.9, 3.1, 100.0)
    ]
    scripted.latched["/tf"] = write_transforms(turning, dialect=scripted.dialect)
    async with connect_scripted(scripted, patience=PATIENCE) as robot:
        picture = await robot.fetch_picture()
    assert picture.stamp_s == 3.0
    assert picture.pose.y == pytest.approx(3.0)
    assert picture.pose.yaw_rad == pytest.approx(3.0)


@both
async def test_a_camera_of_which_the_frames_do_not_tell_is_in_doubt_unless_it_is_the_main_one(
    ros: int,
) -> None:
    async with connect_scripted(with_cameras(ros), patience=PATIENCE) as robot:
        ahead, behind = await robot.fetch_picture(), await robot.fetch_picture("rear_camera")
    assert ahead.pose_doubt is not PoseDoubt.CAMERA_TURN
    assert behind.pose_doubt is PoseDoubt.CAMERA_TURN
    assert behind.pose.yaw_rad == pytest.approx(0.5)


@both
async def test_a_camera_of_another_name_is_answered_with_the_names(ros: int) -> None:
    async with connect_scripted(with_cameras(ros), patience=PATIENCE) as robot:
        with pytest.raises(LinkError, match="no camera 'left'") as told:
            await robot.fetch_picture("left")
    assert "front_camera, rear_camera" in str(told.value)


async def test_a_camera_that_is_started_later_is_found_when_it_is_named() -> None:
    scripted = with_cameras(2)
    kind = scripted.topics.pop(REAR)
    async with connect_scripted(scripted, patience=PATIENCE) as robot:
        assert robot.description.cameras == ("front_camera",)
        scripted.topics[REAR] = kind
        assert (await robot.fetch_picture("rear_camera")).width_px == 2


async def test_a_second_camera_that_nobody_publishes_is_not_offered() -> None:
    scripted = with_cameras(2)
    scripted.services["/rosapi/publishers"] = lambda call: {
        "publishers": [] if call["args"]["topic"] == REAR else ["/driver"]
    }
    async with connect_scripted(scripted, patience=PATIENCE) as robot:
        assert robot.description.cameras == ("front_camera",)


async def test_robot_yaml_names_the_cameras_and_the_first_of_them_looks_ahead() -> None:
    named = RobotOverrides(cameras={"fork": REAR, "mast": FRONT})
    async with connect_scripted(with_cameras(2), patience=PATIENCE, overrides=named) as robot:
        assert robot.description.cameras == ("fork", "mast")
        assert (await robot.fetch_picture()).width_px == 2


@pytest.mark.parametrize(
    ("topic", "name"),
    [
        ("/camera/image_raw/compressed", "camera"),
        ("/camera/camera/color/image_raw", "camera"),
        ("/image_raw", "camera"),
        ("/zed/left/image_rect_color", "zed/left"),
        ("/ada/rear/image_raw", "rear"),
    ],
)
def test_a_camera_is_called_as_its_topics_are(topic: str, name: str) -> None:
    assert name_camera(topic, namespace="/ada" if topic.startswith("/ada/") else "") == name
