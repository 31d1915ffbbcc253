"""Goals of ROS 1 and of robots that only take a pose: told apart by what their topics say."""

from dataclasses import replace
from functools import partial
from typing import Any

import anyio
import pytest

from causes import code_of, quote_of
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import CauseCode, GoalState, GoalStatus
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect, write_stamp
from mapspeak.ros.messages.poses import FramedPose, write_pose_stamped
from mapspeak.ros.robot import RosRobot
from rosbridge_robot import STATUS_TOPIC, ScriptedRobot, connect_scripted, eventually
from rosbridge_script import PATIENCE_S, Operation

pytestmark = pytest.mark.anyio

QUICK = Patience(
    first_pause_s=0.001,
    longest_pause_s=0.01,
    linger_s=0.0,
    goodbye_s=1.0,
    frames_s=PATIENCE_S,
)
BRIEF = replace(QUICK, acceptance_s=0.1, end_s=0.05, return_s=0.1, settling_s=0.0)
LONG = replace(QUICK, acceptance_s=PATIENCE_S, end_s=0.05, settling_s=0.0)
PENDING, ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED = 0, 1, 2, 3, 4, 5
GOAL = Pose(4.0, 2.0)


EXECUTING = 2
connected = partial(connect_scripted, patience=LONG)


def published(scripted: ScriptedRobot, topic: str) -> list[Operation]:
    return [each for each in scripted.server.asked("publish") if each["topic"] == topic]


def status_of(goal_id: str, code: int, text: str = "") -> dict[str, Any]:
    stamp = write_stamp(1.0, dialect=Dialect.ROS1)
    return {"goal_id": {"stamp": stamp, "id": goal_id}, "status": code, "text": text}


async def tell(scripted: ScriptedRobot, *statuses: dict[str, Any]) -> None:
    await scripted.publish("/move_base/status", {"status_list": list(statuses)})


async def send(scripted: ScriptedRobot, robot: RosRobot, goal: Pose = GOAL) -> str:
    """Sends a goal that move_base takes; gives its id."""
    sent: list[str] = []

    async def drive() -> None:
        sent.append(await robot.send_goal(goal))

    n_before = len(published(scripted, "/move_base/goal"))
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(drive)
        await scripted.until(lambda: len(published(scripted, "/move_base/goal")) > n_before)
        await tell(scripted, *(status_of(each, ACTIVE) for each in ids_of(scripted)))
    return sent[0]


def ids_of(scripted: ScriptedRobot) -> list[str]:
    return [each["msg"]["goal_id"]["id"] for each in published(scripted, "/move_base/goal")]


async def until_state(robot: RosRobot, goal_id: str, state: GoalState) -> GoalStatus:
    async def is_so() -> bool:
        return (await robot.fetch_goal_status(goal_id)).state is state

    await eventually(is_so)
    return await robot.fetch_goal_status(goal_id)


async def test_a_goal_of_move_base_carries_our_id_and_ros_1_stamps() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await send(scripted, robot)
    message = published(scripted, "/move_base/goal")[0]["msg"]
    assert message["goal_id"]["id"] == goal_id
    assert set(message["goal_id"]["stamp"]) == {"secs", "nsecs"}
    assert message["goal"]["target_pose"]["header"]["frame_id"] == "map"


@pytest.mark.parametrize(
    ("code", "text", "state", "quote"),
    [
        (SUCCEEDED, "Goal reached.", GoalState.ARRIVED, ""),
        (ABORTED, "Failed to find a valid plan.", GoalState.BLOCKED, "Failed to find"),
        (REJECTED, "no", GoalState.REJECTED, "no"),
        (PREEMPTED, "", GoalState.CANCELLED, ""),
        (PREEMPTED, "another goal was received by the server", GoalState.PREEMPTED, "another"),
        (9, "", GoalState.LOST, ""),
    ],
)
async def test_the_ways_a_goal_of_move_base_ends_are_told_apart(
    code: int, text: str, state: GoalState, quote: str
) -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await send(scripted, robot)
        result = {"status": status_of(goal_id, code, text), "result": {}}
        await scripted.publish("/move_base/result", result)
        status = await until_state(robot, goal_id, state)
    assert quote_of(status).startswith(quote)


async def test_the_result_of_an_older_goal_is_not_taken_for_that_of_the_newer() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        first = await send(scripted, robot)
        second = await send(scripted, robot)
        result = {"status": status_of(first, PREEMPTED), "result": {}}
        await scripted.publish("/move_base/result", result)
        await until_state(robot, first, GoalState.PREEMPTED)
        assert (await robot.fetch_goal_status(second)).state is GoalState.DRIVING


async def test_feedback_tells_the_least_way_that_is_left() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await send(scripted, robot)
        here = FramedPose(pose=Pose(1.0, 2.0), frame_id="map", stamp_s=1.0)
        feedback = {"base_position": write_pose_stamped(here, dialect=Dialect.ROS1)}
        message = {"status": status_of(goal_id, ACTIVE), "feedback": feedback}
        await scripted.publish("/move_base/feedback", message)

        async def is_told() -> bool:
            return (await robot.fetch_goal_status(goal_id)).distance_left_m == 3.0

        await eventually(is_told)


async def test_a_move_base_that_forgets_a_goal_has_lost_it() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await send(scripted, robot)
        await tell(scripted)
        status = await until_state(robot, goal_id, GoalState.LOST)
    assert code_of(status) is CauseCode.NAVIGATION_LOST


async def test_a_goal_that_ended_while_the_connection_was_lost_is_told_after_it() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await send(scripted, robot)
        scripted.latched["/move_base/status"] = {"status_list": [status_of(goal_id, SUCCEEDED)]}
        await scripted.server.drop_all()
        await until_state(robot, goal_id, GoalState.ARRIVED)


async def test_a_goal_that_move_base_does_not_take_is_rejected() -> None:
    async with connected(ScriptedRobot(ros=1), patience=BRIEF) as robot:
        goal_id = await robot.send_goal(GOAL)
        status = await robot.fetch_goal_status(goal_id)
    assert status.state is GoalState.REJECTED
    assert code_of(status) is CauseCode.NOT_TAKEN


async def test_a_goal_whose_sender_gave_up_waiting_does_not_drive_on() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(robot.send_goal, GOAL)
            await scripted.until(lambda: published(scripted, "/move_base/goal"))
            tasks.cancel_scope.cancel()
        await scripted.until(lambda: published(scripted, "/move_base/cancel"))
    cancel = published(scripted, "/move_base/cancel")[0]["msg"]
    assert cancel["id"] == published(scripted, "/move_base/goal")[0]["msg"]["goal_id"]["id"]


async def test_cancelling_names_the_goal_and_stopping_names_all() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await send(scripted, robot)
        for end in (partial(robot.cancel_goal, goal_id), robot.stop):
            with pytest.raises(LinkError, match="was told to end its goal, but has not"):
                await end()
        # The channels are two: what was sent first need not come first.
        await scripted.until(lambda: published(scripted, "/cmd_vel"))
    cancels = published(scripted, "/move_base/cancel")
    assert cancels[0]["msg"]["id"] == goal_id
    assert "" in [each["msg"]["id"] for each in cancels]
    assert all(each["msg"]["stamp"] == {"secs": 0, "nsecs": 0} for each in cancels)


async def test_a_goal_that_another_client_has_sent_to_move_base_is_seen() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await send(scripted, robot)
        await tell(scripted, status_of(goal_id, 1), status_of("theirs", 1))

        async def is_seen() -> bool:
            return await robot.fetch_foreign_goals() == (GoalState.DRIVING,)

        await eventually(is_seen)


async def test_a_goal_of_another_client_is_seen_by_who_asks_at_once() -> None:
    scripted = ScriptedRobot()
    uuid = {"uuid": list(range(16))}
    statuses = [{"goal_info": {"goal_id": uuid}, "status": EXECUTING}]
    scripted.latched[STATUS_TOPIC] = {"status_list": statuses}
    async with connected(scripted) as robot:
        assert await robot.fetch_foreign_goals() == (GoalState.DRIVING,)


async def test_odd_messages_of_move_base_are_left_away() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await send(scripted, robot)
        for odd in ({}, {"status_list": 3}, {"status_list": [3, {}, {"goal_id": 1}]}):
            await scripted.publish("/move_base/feedback", odd)
            await scripted.publish("/move_base/result", odd)
        await tell(scripted, status_of(goal_id, SUCCEEDED))
        await until_state(robot, goal_id, GoalState.ARRIVED)


def goal_topic_robot() -> ScriptedRobot:
    scripted = ScriptedRobot(actions=())
    scripted.topics["/goal_pose"] = "geometry_msgs/msg/PoseStamped"
    scripted.topics["/clock"] = "rosgraph_msgs/msg/Clock"
    scripted.latched["/clock"] = clock(0)
    return scripted


def clock(second: int) -> dict[str, Any]:
    return {"clock": {"sec": second, "nanosec": 0}}


async def be_at(scripted: ScriptedRobot, robot: RosRobot, pose: Pose, second: int) -> None:
    """Puts the robot somewhere at some time, as far as it says."""
    await scripted.publish("/tf", scripted.transforms(pose))
    await scripted.publish("/clock", clock(second))

    async def is_there() -> bool:
        return robot.now_s == second and (await robot.fetch_pose()).pose.x == pose.x

    await eventually(is_there)


async def test_a_robot_that_only_takes_poses_has_arrived_when_it_stands_at_the_goal() -> None:
    scripted = goal_topic_robot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        before = await robot.fetch_goal_status(goal_id)
        await be_at(scripted, robot, GOAL, second=3)
        passing = await robot.fetch_goal_status(goal_id)
        await be_at(scripted, robot, GOAL, second=4)
        after = await robot.fetch_goal_status(goal_id)
    assert before.state is passing.state is GoalState.DRIVING
    assert before.distance_left_m == pytest.approx(3.0)
    assert after.state is GoalState.ARRIVED


async def test_a_robot_that_only_takes_poses_is_blocked_when_it_stands_elsewhere() -> None:
    scripted = goal_topic_robot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await robot.fetch_goal_status(goal_id)
        await be_at(scripted, robot, Pose(1.0, 2.0, 0.5), second=30)
        status = await robot.fetch_goal_status(goal_id)
        await scripted.until(lambda: len(published(scripted, "/goal_pose")) == 2)
    # It must not drive on to the goal that was given up.
    here = published(scripted, "/goal_pose")[1]["msg"]["pose"]["position"]
    assert (here["x"], here["y"]) == (1.0, 2.0)
    assert status.state is GoalState.BLOCKED
    assert status.cause is not None
    assert status.cause.code is CauseCode.STOOD_STILL
    assert status.cause.distance_m == pytest.approx(3.0)


async def test_a_robot_that_only_takes_poses_is_stopped_by_its_own_pose() -> None:
    scripted = goal_topic_robot()
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await robot.stop()
        assert (await robot.fetch_goal_status(goal_id)).state is GoalState.CANCELLED
        await scripted.until(lambda: len(published(scripted, "/goal_pose")) == 2)
    here = published(scripted, "/goal_pose")[1]["msg"]["pose"]["position"]
    assert (here["x"], here["y"]) == (1.0, 2.0)


async def test_a_robot_that_only_takes_poses_is_stopped_also_where_its_pose_is_not_known() -> None:
    scripted = goal_topic_robot()
    async with connected(scripted, patience=replace(LONG, pose_silence_s=-1.0)) as robot:
        await robot.stop()
        await scripted.until(lambda: published(scripted, "/goal_pose"))
    (here,) = [each["msg"] for each in published(scripted, "/goal_pose")]
    assert here["header"]["frame_id"] == "base_footprint"
    assert here["pose"]["position"] == {"x": 0.0, "y": 0.0, "z": 0.0}


async def test_a_robot_without_navigation_says_so() -> None:
    async with connected(ScriptedRobot(actions=())) as robot:
        with pytest.raises(LinkError, match="no navigation") as raised:
            await robot.send_goal(GOAL)
    assert "Nav2" in raised.value.hint
