"""The robot behind rosbridge: map, pose, picture, goals and stop, through the port."""

import io
import random
from dataclasses import replace
from functools import partial
from typing import Any

import anyio
import numpy as np
import orjson
import pytest
from PIL import Image

from causes import code_of, quote_of
from drawing import grid_from_text, text_from_grid
from mapspeak.errors import GoalError, LinkError, MapError
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import RosbridgeClient, open_rosbridge_robot
from mapspeak.robot import CauseCode, GoalState, GoalStatus
from mapspeak.ros.actions import open_action
from mapspeak.ros.discovery.overrides import RobotOverrides, RosSettings
from mapspeak.ros.discovery.profile import PoseSource
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect, write_header
from mapspeak.ros.messages.poses import write_pose
from mapspeak.ros.robot import RosRobot
from mapspeak.ros.robot.maps import MapSubscriber
from mapspeak.ros.robot.poses import PoseKeeper, RobotClock
from rosbridge_robot import (
    ABORTED,
    CANCEL_SERVICE,
    CANCELED,
    STATUS_TOPIC,
    SUCCEEDED,
    ScriptedRobot,
    connect_scripted,
    eventually,
)
from rosbridge_script import PATIENCE_S, Operation, running

pytestmark = pytest.mark.anyio

QUICK = Patience(
    first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0, frames_s=PATIENCE_S
)
BRIEF = replace(QUICK, acceptance_s=0.4, end_s=0.05, result_s=0.0, return_s=0.1, settling_s=0.0)
LONG = replace(QUICK, acceptance_s=PATIENCE_S, end_s=0.05, settling_s=0.0)
SILENT_AT_ONCE = replace(LONG, pose_silence_s=0.0)
GOAL = Pose(3.0, 4.0, 1.0)
OURS, OTHERS = bytes(range(16)), bytes(range(16, 32))
ROOM = """
    ####
    #..#
    ####
    """


connected = partial(connect_scripted, patience=LONG)


def waiting(*first_map_s: float) -> Patience:
    return replace(LONG, first_map_s=first_map_s)


def waits_after(n_silent: int) -> tuple[float, ...]:
    return (*(0.02 for _ in range(n_silent)), PATIENCE_S)


async def until_state(robot: RosRobot, goal_id: str, state: GoalState) -> GoalStatus:
    async def is_so() -> bool:
        return (await robot.fetch_goal_status(goal_id)).state is state

    await eventually(is_so)
    return await robot.fetch_goal_status(goal_id)


# --- the map


async def test_the_map_is_read() -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(ROOM))
    async with connected(scripted) as robot:
        grid = await robot.fetch_map()
        assert text_from_grid(grid) == "####\n#..#\n####"
        assert await robot.fetch_map() is grid


@pytest.mark.parametrize("n_silent", [0, 1, 2])
async def test_a_map_that_does_not_come_is_asked_for_again_and_at_last_as_json(
    n_silent: int,
) -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(ROOM))
    scripted.n_silent["/map"] = n_silent
    async with connected(scripted, patience=waiting(*waits_after(n_silent))) as robot:
        maps = MapSubscriber(robot.connection, robot.profile)
        assert (await maps.fetch()).n_cols == 4
    encodings = [each["compression"] for each in subscriptions(scripted, "/map")]
    assert encodings == ["cbor", "cbor", "none"][: n_silent + 1]


async def test_a_map_that_never_comes_is_said_and_may_come_later() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted, patience=waiting(0.01)) as robot:
        maps = MapSubscriber(robot.connection, robot.profile)
        with pytest.raises(LinkError, match="No map has come on /map yet"):
            await maps.fetch()
        await scripted.publish("/map", scripted.map_message(grid_from_text(ROOM)))

        async def is_there() -> bool:
            try:
                return bool(await maps.fetch())
            except LinkError:
                return False

        await eventually(is_there)


async def test_asking_again_for_a_map_that_takes_long_does_not_begin_it_anew() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted, patience=waiting(0.01, 0.01, 0.01)) as robot:
        maps = MapSubscriber(robot.connection, robot.profile)
        for _ in range(3):
            with pytest.raises(LinkError, match="ask again"):
                await maps.fetch()
        await scripted.until(lambda: len(subscriptions(scripted, "/map")) == 3)
        await robot.connection.call_service("/rosapi/get_time")
    assert [each["compression"] for each in subscriptions(scripted, "/map")][-1] == "none"
    assert len(subscriptions(scripted, "/map")) == 3


async def test_an_update_changes_its_part_of_the_map() -> None:
    scripted = ScriptedRobot()
    scripted.topics["/map_updates"] = "map_msgs/msg/OccupancyGridUpdate"
    scripted.latched["/map"] = scripted.map_message(grid_from_text(ROOM))
    update = {
        "header": write_header("map", 9.0, dialect=Dialect.ROS2),
        "x": 2,
        "y": 1,
        "width": 1,
        "height": 1,
        "data": [100],
    }
    async with connected(scripted) as robot:
        before = await robot.fetch_map()
        await scripted.publish("/map_updates", {**update, "x": 99})
        await scripted.publish("/map_updates", update)

        async def has_changed() -> bool:
            return await robot.fetch_map() is not before

        await eventually(has_changed)
        assert text_from_grid(await robot.fetch_map()) == "####\n#.##\n####"


async def test_a_map_that_grows_and_moves_replaces_the_old_one() -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(ROOM))
    async with connected(scripted) as robot:
        await robot.fetch_map()
        grown = grid_from_text("......", origin=Pose(-2.0, 1.0))
        await scripted.publish("/map", scripted.map_message(grown))

        async def has_grown() -> bool:
            return (await robot.fetch_map()).n_cols == 6

        await eventually(has_grown)
        assert (await robot.fetch_map()).origin == Pose(-2.0, 1.0)


async def test_a_map_that_cannot_be_one_is_told_the_same_as_long_as_it_is_the_latest() -> None:
    scripted = ScriptedRobot()
    good = scripted.map_message(grid_from_text(ROOM))
    scripted.latched["/map"] = {**good, "info": {**good["info"], "width": 7}}
    async with connected(scripted) as robot:
        for _ in range(2):
            with pytest.raises(MapError, match="says 7x"):
                await robot.fetch_map()


@pytest.mark.parametrize(("width", "height"), [(0, 0), (100_000, 100_000), (4, 4)])
async def test_a_map_that_cannot_be_one_is_an_error_and_the_next_is_read(
    width: int, height: int
) -> None:
    scripted = ScriptedRobot()
    good = scripted.map_message(grid_from_text(ROOM))
    info = {**good["info"], "width": width, "height": height}
    scripted.latched["/map"] = {**good, "info": info}
    async with connected(scripted) as robot:
        with pytest.raises(MapError):
            await robot.fetch_map()
        await scripted.publish("/map", good)

        async def is_read() -> bool:
            try:
                return bool(await robot.fetch_map())
            except MapError:
                return False

        await eventually(is_read)


async def test_a_message_of_another_type_on_the_map_topic_is_an_error() -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = {"data": "I am a string"}
    async with connected(scripted) as robot:
        with pytest.raises(LinkError, match="no field"):
            await robot.fetch_map()


async def test_a_robot_without_a_map_says_how_to_start_one() -> None:
    scripted = ScriptedRobot()
    del scripted.topics["/map"]
    async with connected(scripted) as robot:
        with pytest.raises(LinkError, match="publishes no map") as raised:
            await robot.fetch_map()
    assert "slam_toolbox" in raised.value.hint


# --- the pose


async def test_the_pose_is_read_from_the_frames() -> None:
    async with connected(ScriptedRobot()) as robot:
        found = await robot.fetch_pose()
    assert found.pose.x == pytest.approx(1.0)
    assert found.pose.y == pytest.approx(2.0)
    assert found.pose.yaw_rad == pytest.approx(0.5)
    assert found.stamp_s == pytest.approx(7.0)


async def test_a_pose_of_frames_that_have_fallen_silent_is_not_told_as_the_present_one() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted, patience=SILENT_AT_ONCE) as robot:
        poses = PoseKeeper(robot.connection, robot.profile, robot._frames)
        with pytest.raises(LinkError, match="pose is old") as raised:
            _ = poses.latest
    assert "localisation" in raised.value.hint


async def test_without_frames_the_pose_comes_from_odometry() -> None:
    scripted = ScriptedRobot()
    scripted.latched = {
        "/odom": {
            "header": write_header("odom", 3.0, dialect=Dialect.ROS2),
            "pose": {"pose": write_pose(Pose(1.0, 0.0))},
        }
    }
    scripted.topics["/odom"] = "nav_msgs/msg/Odometry"
    async with connected(scripted, patience=replace(LONG, frames_s=0.01)) as robot:
        found = await robot.fetch_pose()
        assert found.pose == Pose(1.0, 0.0, 0.0)
        assert found.is_odometry
        assert robot.profile.pose_topic == "/odom"


async def test_odometry_that_has_fallen_silent_is_not_told_as_the_present_pose() -> None:
    scripted = ScriptedRobot()
    scripted.latched = {
        "/odom": {
            "header": write_header("odom", 3.0, dialect=Dialect.ROS2),
            "pose": {"pose": write_pose(Pose(1.0, 0.0))},
        }
    }
    scripted.topics["/odom"] = "nav_msgs/msg/Odometry"
    patience = replace(SILENT_AT_ONCE, frames_s=0.01)
    async with connected(scripted, patience=patience) as robot:
        poses = PoseKeeper(robot.connection, robot.profile, robot._frames)
        await robot.connection.call_service("/rosapi/get_time")
        with pytest.raises(LinkError, match="no odometry has come"):
            _ = poses.latest


@pytest.mark.parametrize(("frame", "is_on_map"), [("map", True), ("", True), ("world", False)])
async def test_a_localised_pose_counts_only_in_a_frame_that_leads_to_the_map(
    frame: str, *, is_on_map: bool
) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/amcl_pose"] = "geometry_msgs/msg/PoseWithCovarianceStamped"
    scripted.latched = {
        "/amcl_pose": {
            "header": write_header(frame, 3.0, dialect=Dialect.ROS2),
            "pose": {"pose": write_pose(Pose(1.0, 0.0))},
        }
    }
    async with connected(scripted, patience=replace(LONG, frames_s=0.01)) as robot:
        assert robot.profile.pose_topic == "/amcl_pose"
        if is_on_map:
            assert (await robot.fetch_pose()).pose == Pose(1.0, 0.0)
            return
        with pytest.raises(LinkError, match="frame 'world'"):
            await robot.fetch_pose()


async def test_transforms_that_are_none_are_left_away() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        await scripted.publish("/tf", {"transforms": [{"header": 1}]})
        await scripted.publish("/tf", {"transforms": "no list"})
        await scripted.publish("/tf", scripted.transforms(Pose(5.0, 5.0)))

        async def has_moved() -> bool:
            return (await robot.fetch_pose()).pose.x == 5.0

        await eventually(has_moved)


async def test_a_transform_that_is_none_costs_none_of_those_beside_it() -> None:
    """As in tf2: the driver of one joint may err, and its publisher sends all joints at once."""
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        message = scripted.transforms(Pose(5.0, 5.0))
        rotation = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}
        transform = {"translation": {"x": 0.0, "y": 0.0, "z": 0.0}, "rotation": rotation}
        broken = {**message["transforms"][0], "child_frame_id": "wheel", "transform": transform}
        await scripted.publish("/tf", {"transforms": [broken, *message["transforms"]]})

        async def has_moved() -> bool:
            return (await robot.fetch_pose()).pose.x == 5.0

        await eventually(has_moved)


# --- the camera


async def test_a_picture_is_taken_only_when_asked_for_and_is_new() -> None:
    scripted = ScriptedRobot()
    topic = "/camera/image_raw/compressed"
    scripted.topics[topic] = "sensor_msgs/msg/CompressedImage"
    encoded = io.BytesIO()
    Image.new("RGB", (8, 6)).save(encoded, format="JPEG")
    scripted.latched[topic] = {
        "header": write_header("camera", 5.0, dialect=Dialect.ROS2),
        "format": "jpeg",
        "data": encoded.getvalue(),
    }
    async with connected(scripted) as robot:
        assert subscriptions(scripted, topic) == []
        picture = await robot.fetch_picture()
    assert (picture.width_px, picture.height_px) == (8, 6)
    assert picture.media_type == "image/jpeg"
    assert picture.stamp_s == 5.0
    assert picture.pose.x == pytest.approx(1.0)


async def test_a_robot_without_a_camera_says_so() -> None:
    async with connected(ScriptedRobot()) as robot:
        assert not robot.description.has_camera
        with pytest.raises(LinkError, match="no camera"):
            await robot.fetch_picture()


# --- goals of Nav2


async def test_a_goal_is_driven_with_the_distance_left() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        status = await robot.fetch_goal_status(goal_id)
        await scripted.end_goal(SUCCEEDED)
        await until_state(robot, goal_id, GoalState.ARRIVED)
    assert status == GoalStatus(state=GoalState.DRIVING, distance_left_m=3.0, n_recoveries=1)
    pose = scripted.goals[0][1]["args"]["pose"]
    assert pose["header"] == {"frame_id": "map", "stamp": {"sec": 0, "nanosec": 0}}
    assert pose["pose"]["position"] == {"x": 3.0, "y": 4.0, "z": 0.0}


async def test_an_aborted_goal_is_blocked_with_the_reason() -> None:
    # Fault 2 of the field: an aborted action counted as success.
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.end_goal(ABORTED, error="no valid path found")
        status = await until_state(robot, goal_id, GoalState.BLOCKED)
    assert quote_of(status) == "no valid path found"


async def test_a_cancelled_goal_is_cancelled_though_its_result_says_true() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.end_goal(CANCELED)
        await until_state(robot, goal_id, GoalState.CANCELLED)


async def test_a_goal_that_is_refused_is_rejected() -> None:
    scripted = ScriptedRobot()
    scripted.accepts_goals = False
    async with connected(scripted) as robot, anyio.create_task_group() as tasks:
        tasks.start_soon(refuse_next_goal, scripted)
        goal_id = await robot.send_goal(GOAL)
        assert (await robot.fetch_goal_status(goal_id)).state is GoalState.REJECTED


async def refuse_next_goal(scripted: ScriptedRobot) -> None:
    await scripted.until(lambda: scripted.goals)
    await scripted.end_goal(0, is_result=False)


async def test_a_goal_met_with_silence_is_rejected_and_blocks_nothing() -> None:
    scripted = ScriptedRobot()
    scripted.accepts_goals = False
    async with connected(scripted, patience=BRIEF) as robot:
        goal_id = await robot.send_goal(GOAL)
        status = await robot.fetch_goal_status(goal_id)
        scripted.accepts_goals = True
        second = await robot.send_goal(GOAL)
        assert (await robot.fetch_goal_status(second)).state is GoalState.DRIVING
    assert status.state is GoalState.REJECTED
    assert code_of(status) is CauseCode.NOT_TAKEN
    first_visitor, second_visitor = (visitor for visitor, _ in scripted.goals)
    assert first_visitor is not second_visitor


async def test_a_result_is_there_however_late_it_is_asked_for() -> None:
    # Fault 3 of the field: a result was lost after five seconds.
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        ids = []
        for number in range(20):
            ids.append(await robot.send_goal(GOAL))
            await scripted.end_goal(SUCCEEDED if number % 2 else ABORTED)
            state = GoalState.ARRIVED if number % 2 else GoalState.BLOCKED
            await until_state(robot, ids[-1], state)
        states = [(await robot.fetch_goal_status(goal_id)).state for goal_id in ids]
    assert states == [GoalState.BLOCKED, GoalState.ARRIVED] * 10


async def test_a_goal_under_way_holds_up_nothing_else() -> None:
    # Fault 4 of the field: one action blocked every other tool, and a parallel question took its
    # feedback away.
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(ROOM))
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        async with anyio.create_task_group() as tasks:
            for _ in range(10):
                tasks.start_soon(robot.fetch_map)
                tasks.start_soon(robot.fetch_pose)
                tasks.start_soon(robot.fetch_goal_status, goal_id)
        await scripted.feed_back(1.0)

        async def is_near() -> bool:
            return (await robot.fetch_goal_status(goal_id)).distance_left_m == 1.0

        await eventually(is_near)
        carrier = scripted.goals[0][0]
        later = [each for each in carrier.operations if each["op"] == "subscribe"]
    assert "/map" not in [each["topic"] for each in later]


async def test_two_goals_keep_their_results_apart() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        first = await robot.send_goal(GOAL)
        second = await robot.send_goal(Pose(1.0, 1.0))
        await scripted.end_goal(SUCCEEDED, goal=1)
        await scripted.end_goal(ABORTED, goal=0)
        await until_state(robot, second, GoalState.ARRIVED)
        status = await until_state(robot, first, GoalState.PREEMPTED)
    assert code_of(status) is CauseCode.REPLACED


async def test_a_goal_that_replaces_another_does_not_wait_behind_it() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        await robot.send_goal(GOAL)
        await robot.send_goal(Pose(1.0, 1.0))
    assert scripted.goals[0][0] is not scripted.goals[1][0]
    assert len(scripted.server.visitors) == 2


async def test_a_goal_goes_on_where_the_one_that_was_to_replace_it_is_refused() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot, anyio.create_task_group() as tasks:
        first = await robot.send_goal(GOAL)
        scripted.accepts_goals = False

        async def refuse() -> None:
            await scripted.until(lambda: len(scripted.goals) == 2)
            await scripted.end_goal(0, is_result=False)

        tasks.start_soon(refuse)
        second = await robot.send_goal(Pose(1.0, 1.0))
        await until_state(robot, second, GoalState.REJECTED)
        await scripted.end_goal(ABORTED, goal=0, error="no valid path found")
        status = await until_state(robot, first, GoalState.BLOCKED)
    assert quote_of(status) == "no valid path found"


async def test_a_goal_whose_sender_gave_up_before_the_one_before_it_ended_does_not_drive_on() -> (
    None
):
    scripted = ScriptedRobot()
    async with connected(scripted, patience=replace(LONG, end_s=PATIENCE_S)) as robot:
        await robot.send_goal(GOAL)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(robot.send_goal, Pose(1.0, 1.0))
            await scripted.until(lambda: len(scripted.goals) == 2)
            await robot.connection.call_service("/rosapi/get_time")
            tasks.cancel_scope.cancel()
        ours = scripted.goals[1][1]["id"]
        await scripted.until(
            lambda: ours in [each["id"] for each in scripted.server.asked("cancel_action_goal")]
        )


async def test_goals_are_given_in_the_frame_that_the_map_was_found_to_have_during_a_drive() -> None:
    scripted = ScriptedRobot()
    transforms = scripted.latched.pop("/tf")
    scripted.topics["/odom"] = "nav_msgs/msg/Odometry"
    odometry = {"pose": {"pose": write_pose(Pose(1.0, 0.0))}}
    odometry["header"] = write_header("odom", 3.0, dialect=Dialect.ROS2)
    scripted.latched["/odom"] = odometry
    async with connected(scripted, patience=replace(LONG, frames_s=0.01)) as robot:
        first = await robot.send_goal(GOAL)
        prefixed = orjson.dumps(transforms).replace(b'"map"', b'"robot1/map"')
        await scripted.publish("/tf", orjson.loads(prefixed))

        async def is_found() -> bool:
            return robot.profile.map_frame == "robot1/map"

        await eventually(is_found)
        await scripted.end_goal(SUCCEEDED)
        await until_state(robot, first, GoalState.ARRIVED)
        await robot.send_goal(GOAL)
    header = scripted.goals[1][1]["args"]["pose"]["header"]
    assert header["frame_id"] == "robot1/map"


async def test_a_goal_that_another_client_has_sent_is_seen_until_it_ends() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        await scripted.tell_status(OTHERS, 2)

        async def is_seen() -> bool:
            return await robot.fetch_foreign_goals() == (GoalState.DRIVING,)

        await eventually(is_seen)
        await scripted.tell_status(OTHERS, SUCCEEDED)

        async def is_gone() -> bool:
            return await robot.fetch_foreign_goals() == ()

        await eventually(is_gone)


async def test_our_own_goal_is_not_taken_for_another_clients() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, 2)
        await until_state(robot, goal_id, GoalState.DRIVING)
        assert await robot.fetch_foreign_goals() == ()


async def test_a_goal_of_another_client_that_replaces_ours_is_told_as_that() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, 2)
        await scripted.tell_status(OTHERS, 2)
        await scripted.tell_status(OURS, ABORTED)
        await scripted.end_goal(ABORTED)
        status = await until_state(robot, goal_id, GoalState.PREEMPTED)
    assert code_of(status) is CauseCode.REPLACED_BY_OTHERS


async def test_a_result_that_overtakes_the_list_of_goals_is_understood_by_it() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted, patience=LONG) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, 2)
        await scripted.end_goal(ABORTED)
        await scripted.tell_status(OTHERS, 2)
        await scripted.tell_status(OURS, ABORTED)
        status = await until_state(robot, goal_id, GoalState.PREEMPTED)
    assert code_of(status) is CauseCode.REPLACED_BY_OTHERS


async def test_a_drive_goes_on_through_a_lost_connection_and_its_end_is_told() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, 2)
        await scripted.server.drop_all()
        await scripted.until(lambda: len(subscriptions(scripted, STATUS_TOPIC)) == 2)
        assert (await robot.fetch_goal_status(goal_id)).state is GoalState.DRIVING
        await scripted.tell_status(OURS, SUCCEEDED)
        await until_state(robot, goal_id, GoalState.ARRIVED)


async def test_a_drive_that_ended_while_the_connection_was_lost_is_told_after_it() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, 2)
        scripted.server.hangs_up = True
        await scripted.server.drop_all()
        await scripted.tell_status(OURS, ABORTED)
        scripted.server.hangs_up = False
        await until_state(robot, goal_id, GoalState.BLOCKED)


async def test_a_robot_restarted_in_the_middle_of_a_goal_has_lost_it() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, 2)
        scripted.statuses.clear()
        await scripted.server.drop_all()
        await scripted.until(lambda: len(subscriptions(scripted, STATUS_TOPIC)) == 2)
        await scripted.tell_status(OTHERS, 2)
        status = await until_state(robot, goal_id, GoalState.LOST)
    assert code_of(status) is CauseCode.NAVIGATION_LOST


async def test_a_goal_of_which_nothing_is_heard_after_a_loss_is_lost() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted, patience=BRIEF) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.server.drop_all()
        await until_state(robot, goal_id, GoalState.LOST)


async def test_a_goal_is_cancelled_over_the_socket_it_does_not_block() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot, anyio.create_task_group() as tasks:
        goal_id = await robot.send_goal(GOAL)
        tasks.start_soon(robot.cancel_goal, goal_id)
        await scripted.until(lambda: scripted.server.asked("cancel_action_goal"))
        await scripted.end_goal(CANCELED)
        await until_state(robot, goal_id, GoalState.CANCELLED)
    carrier, sent = scripted.goals[0]
    assert carrier.asked("cancel_action_goal") == []
    assert scripted.server.asked("cancel_action_goal")[0]["id"] == sent["id"]


async def test_a_goal_that_nobody_sent_can_be_neither_seen_nor_cancelled() -> None:
    # Fault 10 of the field: cancelling a made-up goal succeeded.
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        with pytest.raises(GoalError, match="made-up"):
            await robot.cancel_goal("made-up")
        with pytest.raises(GoalError, match="made-up"):
            await robot.fetch_goal_status("made-up")
    assert scripted.server.asked("cancel_action_goal") == []


async def test_a_result_that_does_not_say_how_it_ended_is_no_success() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.end_goal(0)
        status = await until_state(robot, goal_id, GoalState.LOST)
    assert "without saying how" in quote_of(status)


async def test_a_goal_whose_sender_gave_up_waiting_does_not_drive_on() -> None:
    scripted = ScriptedRobot()
    scripted.accepts_goals = False
    async with connected(scripted) as robot:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(robot.send_goal, GOAL)
            await scripted.until(lambda: scripted.goals)
            tasks.cancel_scope.cancel()
        await scripted.until(lambda: scripted.server.asked("cancel_action_goal"))
    assert scripted.server.asked("cancel_action_goal")[0]["id"] == scripted.goals[0][1]["id"]


# --- stop


async def test_a_stop_cancels_the_goals_of_all_and_commands_a_stand() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        await robot.stop()
        await scripted.until(lambda: scripted.server.asked("publish"))
    assert called(scripted, CANCEL_SERVICE)[0]["args"] == {}
    stand = scripted.server.asked("publish")[0]
    assert stand["topic"] == "/cmd_vel"
    assert stand["msg"]["linear"] == {"x": 0.0, "y": 0.0, "z": 0.0}
    assert stand["msg"]["angular"] == {"x": 0.0, "y": 0.0, "z": 0.0}


async def test_a_stop_gets_past_a_service_that_is_stuck() -> None:
    scripted = ScriptedRobot()
    scripted.services["/slow"] = lambda _: None
    stops: list[Operation] = []

    def cancel(call: Operation) -> dict[str, int] | None:
        # As rosbridge 2.1: behind a call without an answer, nothing on its socket is handled.
        visitor = next(each for each in scripted.server.visitors if call in each.operations)
        if any(each["service"] == "/slow" for each in visitor.asked("call_service")):
            return None
        stops.append(call)
        return {"return_code": 0}

    scripted.services[CANCEL_SERVICE] = cancel
    patience = replace(LONG, end_s=PATIENCE_S)
    async with (
        connected(scripted, patience=patience) as robot,
        anyio.create_task_group() as tasks,
    ):
        tasks.start_soon(ask_in_vain, robot)
        await scripted.until(lambda: called(scripted, "/slow"))
        await robot.stop()
        tasks.cancel_scope.cancel()
    assert len(stops) == 1


async def ask_in_vain(robot: RosRobot) -> None:
    await robot.connection.call_service("/slow", timeout_s=PATIENCE_S)


async def test_a_stop_ends_our_goals_though_the_robot_does_not_tell_what_it_offers() -> None:
    scripted = ScriptedRobot(actions=())
    patience = replace(LONG, answer_s=PATIENCE_S)
    async with connected(scripted, patience=patience) as robot:
        dock = open_action(
            robot.connection, "/dock", dialect=Dialect.ROS2, type_name="a/action/Dock"
        )
        await dock.wait_until_taken(await dock.send({}, through=robot.connection))
        scripted.services["/rosapi/topics"] = lambda _: None
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(robot.stop)
            await scripted.until(lambda: scripted.server.asked("cancel_action_goal"))
            tasks.cancel_scope.cancel()


async def test_a_stop_that_navigation_refuses_is_an_error() -> None:
    scripted = ScriptedRobot()
    scripted.services[CANCEL_SERVICE] = lambda _: {"return_code": 1}
    async with connected(scripted) as robot:
        with pytest.raises(LinkError, match="refused to cancel"):
            await robot.stop()


async def test_a_robot_with_stamped_velocities_is_stopped_by_a_stamped_one() -> None:
    scripted = ScriptedRobot()
    scripted.topics["/cmd_vel"] = "geometry_msgs/msg/TwistStamped"
    async with connected(scripted) as robot:
        await robot.stop()
        await scripted.until(lambda: scripted.server.asked("publish"))
    message = scripted.server.asked("publish")[0]["msg"]
    assert message["header"]["frame_id"] == "base_footprint"
    assert message["twist"]["linear"]["x"] == 0.0


# --- the whole robot


async def test_a_robot_without_rosapi_says_how_to_start_it() -> None:
    # Fault 5 of the field: what was not there read as "no topics found".
    scripted = ScriptedRobot()
    scripted.services.clear()
    async with running(scripted.server) as server:
        with pytest.raises(LinkError, match="does not list its topics") as raised:
            async with open_rosbridge_robot(server.url, patience=BRIEF):
                pass
    assert "rosapi" in raised.value.hint


async def test_what_is_started_after_we_connected_is_found_when_it_is_needed() -> None:
    scripted = ScriptedRobot(actions=())
    del scripted.topics["/map"]
    async with connected(scripted) as robot:
        for ask in (robot.fetch_map, robot.fetch_picture):
            with pytest.raises(LinkError):
                await ask()
        with pytest.raises(LinkError, match="no navigation"):
            await robot.send_goal(GOAL)
        scripted.topics["/map"] = "nav_msgs/msg/OccupancyGrid"
        scripted.latched["/map"] = scripted.map_message(grid_from_text(ROOM))
        scripted.services["/rosapi/action_servers"] = lambda _: {
            "action_servers": ["/navigate_to_pose"]
        }
        assert (await robot.fetch_map()).n_cols == 4
        goal_id = await robot.send_goal(GOAL)
        assert (await robot.fetch_goal_status(goal_id)).state is GoalState.DRIVING


async def test_a_pose_from_odometry_gives_way_to_the_map_once_slam_runs() -> None:
    scripted = ScriptedRobot()
    scripted.latched = {
        "/odom": {
            "header": write_header("odom", 3.0, dialect=Dialect.ROS2),
            "pose": {"pose": write_pose(Pose(9.0, 9.0))},
        }
    }
    scripted.topics["/odom"] = "nav_msgs/msg/Odometry"
    async with connected(scripted, patience=replace(LONG, frames_s=0.01)) as robot:
        assert robot.profile.pose_topic == "/odom"
        await scripted.publish("/tf", scripted.transforms(Pose(1.0, 2.0)))

        async def is_in_the_map() -> bool:
            return (await robot.fetch_pose()).pose == Pose(1.0, 2.0)

        await eventually(is_in_the_map)
        assert robot.profile.pose_source is PoseSource.TF


async def test_topics_are_subscribed_to_with_their_types_so_that_they_may_appear_later() -> None:
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(ROOM))
    async with connected(scripted) as robot:
        await robot.fetch_map()
    types = {each["topic"]: each.get("type") for each in scripted.server.asked("subscribe")}
    assert types["/map"] == "nav_msgs/msg/OccupancyGrid"
    assert types["/tf"] == "tf2_msgs/msg/TFMessage"
    assert types[STATUS_TOPIC] == "action_msgs/msg/GoalStatusArray"
    assert None not in types.values()


async def test_a_robot_that_does_not_tell_who_publishes_is_not_asked_for_every_topic() -> None:
    scripted = ScriptedRobot()
    for topic in ("/scan", "/camera/image_raw", "/left/image_raw", "/right/image_raw"):
        kind = "LaserScan" if topic == "/scan" else "Image"
        scripted.topics[topic] = f"sensor_msgs/msg/{kind}"
    scripted.services["/rosapi/publishers"] = lambda _: None
    async with connected(scripted, patience=replace(LONG, answer_s=0.1)) as robot:
        assert robot.profile.map_topic == "/map"
        n_asked = len(called(scripted, "/rosapi/publishers"))
        n_looks = len(called(scripted, "/rosapi/topics"))
    assert n_asked <= 2 * n_looks


async def test_without_rosapi_robot_yaml_is_enough() -> None:
    scripted = ScriptedRobot()
    scripted.services.clear()
    scripted.latched["/floor"] = scripted.map_message(grid_from_text(ROOM))
    overrides = RobotOverrides(
        ros=RosSettings(version=2), map_topic="/floor", pose_topic="tf", navigation="nav2"
    )
    async with connected(scripted, overrides=overrides) as robot:
        assert (await robot.fetch_map()).n_cols == 4
        assert (await robot.fetch_pose()).pose.x == pytest.approx(1.0)
        goal_id = await robot.send_goal(GOAL)
        assert (await robot.fetch_goal_status(goal_id)).state is GoalState.DRIVING


async def test_a_robot_that_has_gone_is_not_reported_from_memory() -> None:
    # Fault 10 of the field: a dead host went on giving the old robot's answers.
    scripted = ScriptedRobot()
    with anyio.fail_after(PATIENCE_S):
        async with (
            running(scripted.server) as server,
            open_rosbridge_robot(
                server.url, patience=Patience(answer_s=0.5, linger_s=0.0, goodbye_s=0.01)
            ) as robot,
        ):
            await robot.fetch_pose()
            server.hangs_up = True
            await server.drop_all()
            with pytest.raises(LinkError, match="has been lost for"):
                await until_it_fails(robot)


async def until_it_fails(robot: RosRobot) -> None:
    while True:
        await robot.fetch_pose()
        await anyio.lowlevel.checkpoint()


async def test_odd_messages_on_every_topic_cost_nothing_but_themselves(
    caplog: pytest.LogCaptureFixture,
) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/clock"] = "rosgraph_msgs/msg/Clock"
    scripted.topics["/map_updates"] = "map_msgs/msg/OccupancyGridUpdate"
    scripted.latched["/clock"] = {"clock": {"sec": 1, "nanosec": 0}}
    good = scripted.map_message(grid_from_text(ROOM))
    scripted.latched["/map"] = good
    whole = [
        ("/map", good),
        ("/tf", scripted.transforms(Pose(1.0, 1.0))),
        ("/tf_static", scripted.transforms(Pose(1.0, 1.0))),
        ("/clock", {"clock": {"sec": 1, "nanosec": 0}}),
        (STATUS_TOPIC, {"status_list": [{"goal_info": {"goal_id": {"uuid": [1]}}, "status": 2}]}),
        ("/map_updates", {**good["info"], "x": 0, "y": 0, "header": good["header"], "data": [1]}),
    ]
    chance = random.Random(1)  # noqa: S311 - no secret
    async with connected(scripted) as robot:
        await robot.fetch_map()
        goal_id = await robot.send_goal(GOAL)
        for _ in range(300):
            topic, message = chance.choice(whole)
            await scripted.publish(topic, spoil(message, chance))
            visitor, goal = scripted.goals[0]
            values = spoil({"distance_remaining": 1.0, "number_of_recoveries": 0}, chance)
            await visitor.send({"op": "action_feedback", "id": goal["id"], "values": values})
        await scripted.publish("/tf", scripted.transforms(Pose(5.0, 5.0)))
        await scripted.publish("/map", good)
        await scripted.end_goal(SUCCEEDED)
        await until_state(robot, goal_id, GoalState.ARRIVED)
        assert (await robot.fetch_map()).n_cols == 4
        assert isinstance(robot.connection, RosbridgeClient)
        assert robot.connection.n_connections == 1
    assert [each for each in caplog.records if each.levelname == "ERROR"] == []


def spoil(message: Any, chance: random.Random) -> Any:  # noqa: ANN401 - ROS JSON
    """Replaces one part of a message, somewhere, by something odd."""
    odd: list[Any] = [None, True, -1, 2.5, 1e300, 10**18, "", "no", [], [[]], {}, {"sec": "x"}]
    if isinstance(message, np.ndarray):
        message = message.tolist()
    if not message or not isinstance(message, dict | list) or chance.random() < 0.2:
        return chance.choice(odd)
    place = chance.choice(list(message) if isinstance(message, dict) else range(len(message)))
    changed = message.copy()
    changed[place] = spoil(message[place], chance)
    return changed


async def test_robot_time_is_that_of_the_robot() -> None:
    async with connected(ScriptedRobot()) as robot:
        assert robot.now_s == pytest.approx(100.0, abs=PATIENCE_S)


async def test_a_simulations_clock_decides_how_long_a_sleep_takes() -> None:
    scripted = ScriptedRobot()
    scripted.topics["/clock"] = "rosgraph_msgs/msg/Clock"
    scripted.latched["/clock"] = {"clock": {"sec": 50, "nanosec": 0}}
    async with connected(scripted) as robot, anyio.create_task_group() as tasks:
        assert robot.now_s == 50.0
        tasks.start_soon(robot.sleep, 10.0)
        for second in (55, 3, 6, 9):
            # Set back in between, as by a simulation begun anew.
            await scripted.publish("/clock", {"clock": {"sec": second, "nanosec": 0}})
    assert robot.now_s == 9.0


async def test_a_clock_that_is_told_and_does_not_move_on_is_not_waited_for_without_end() -> None:
    scripted = ScriptedRobot()
    scripted.topics["/clock"] = "rosgraph_msgs/msg/Clock"
    paused = {"clock": {"sec": 50, "nanosec": 0}}
    scripted.latched["/clock"] = paused
    async with connected(scripted, patience=replace(LONG, standstill_s=0.2)) as robot:
        clock = RobotClock(robot.connection)
        ticks = robot.connection.subscribe("/clock")

        async def go_on_telling() -> None:
            while True:
                n_before = ticks.n_received
                await scripted.publish("/clock", paused)
                await ticks.wait_for_more_than(n_before, timeout_s=PATIENCE_S)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(go_on_telling)
            await clock.start("/clock")
            with pytest.raises(LinkError, match="has stood still"):
                await clock.sleep(1.0)
            tasks.cancel_scope.cancel()


async def test_the_cost_of_a_robot_is_two_sockets() -> None:
    # Fault 6 of the field: publishing once opened three connections.
    scripted = ScriptedRobot()
    scripted.latched["/map"] = scripted.map_message(grid_from_text(ROOM))
    async with connected(scripted) as robot:
        for _ in range(3):
            await robot.fetch_map()
            await robot.fetch_pose()
            await robot.stop()
    assert len(scripted.server.visitors) == 2


async def test_a_long_map_stays_an_array_and_never_becomes_text() -> None:
    # Fault 8 of the field: a map of 384x384 cells became 380 kB of text.
    scripted = ScriptedRobot()
    cells = "\n".join("." * 384 for _ in range(384))
    scripted.latched["/map"] = scripted.map_message(grid_from_text(cells))
    async with connected(scripted) as robot:
        grid = await robot.fetch_map()
    assert grid.cells.dtype == np.int8
    assert subscriptions(scripted, "/map")[0]["compression"] == "cbor"


def subscriptions(scripted: ScriptedRobot, topic: str) -> list[Operation]:
    return [each for each in scripted.server.asked("subscribe") if each["topic"] == topic]


def called(scripted: ScriptedRobot, service: str) -> list[Operation]:
    return [each for each in scripted.server.asked("call_service") if each["service"] == service]


async def test_a_topic_that_is_looked_at_now_and_then_is_heard_whole_by_who_asks_for_all() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted) as robot:
        robot.connection.subscribe("/scan", throttle_ms=100)
        robot.connection.subscribe("/scan")
        await scripted.until(lambda: len(subscriptions(scripted, "/scan")) == 2)
        ended = [each["id"] for each in scripted.server.asked("unsubscribe")]
    first, second = subscriptions(scripted, "/scan")
    assert first["throttle_rate"] == 100
    assert "throttle_rate" not in second
    assert ended == [first["id"]]
