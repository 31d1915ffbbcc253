"""Goals of actions with the ROS tools: sent, told apart by how they end, asked about later."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import anyio
import pytest

from fakes import FakeRobot, two_rooms
from guarding import audit_of, make_guard
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import RobotAddress, RosbridgeClient, open_client
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.activity import ActionGoal, ActionState
from mapspeak.ros.messages.fields import Dialect, Message, write_header
from mapspeak.ros.messages.poses import write_pose
from mapspeak.safety import CommandKind, Policy
from mapspeak.server.tools.ros.goals import RosAccess, TrackedGoal
from mapspeak.session import Session
from rosbridge_robot import ABORTED, CANCELED, SUCCEEDED, ScriptedRobot
from rosbridge_script import PATIENCE_S, Operation, running
from rosserved import QUICK, Caller, on_our_server, on_script, time_passing

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)
ACTION = "/navigate_to_pose"
POSE = {"header": {"frame_id": "map"}, "pose": {"position": {"x": 1.0}, "orientation": {"w": 1.0}}}
GOAL = {"pose": POSE}
BRIEF = replace(QUICK, acceptance_s=0.3, listing_s=0.05, end_s=0.1, result_s=0.0, return_s=0.05)
OURS, OTHERS = bytes(range(16)), bytes(range(16, 32))


def with_types(scripted: ScriptedRobot) -> ScriptedRobot:
    kind = {"type": "nav2_msgs/action/NavigateToPose"}
    scripted.services["/rosapi/action_type"] = lambda _: kind
    return scripted


async def send(caller: Caller, **arguments: Any) -> str:  # noqa: ANN401
    return await caller.ask("ros_send_goal", action=ACTION, fields=GOAL, **arguments)


# --- over our own server


@both
async def test_a_goal_is_sent_and_its_end_is_told(dialect: Dialect, tmp_path: Path) -> None:
    action = ACTION if dialect is Dialect.ROS2 else "/move_base"
    goal = GOAL if dialect is Dialect.ROS2 else {"target_pose": POSE}
    async with on_our_server(dialect, tmp_path) as (robot, caller):
        assert action in await caller.ask("ros_actions")
        fields = await caller.ask("ros_action", action=action)
        async with time_passing(robot):
            text = await caller.ask("ros_send_goal", action=action, fields=goal, wait_s=20)
    assert "goal:\n  pose: " in fields or "goal:\n  target_pose: " in fields
    assert "A1" in text
    assert "succeeded" in text
    assert "result:" in text
    assert robot.pose.x == pytest.approx(1.0)


@both
async def test_a_goal_is_cancelled_by_its_handle(dialect: Dialect, tmp_path: Path) -> None:
    action = ACTION if dialect is Dialect.ROS2 else "/move_base"
    goal = GOAL if dialect is Dialect.ROS2 else {"target_pose": POSE}
    async with on_our_server(dialect, tmp_path) as (robot, caller), time_passing(robot):
        far = {"pose": {"position": {"x": 6.0, "y": 1.4}, "orientation": {"w": 1.0}}}
        goal = {name: {**POSE, **far} for name in goal}
        text = await caller.ask("ros_send_goal", action=action, fields=goal, wait_s=0)
        cancelled = await caller.ask("ros_cancel_goal", goal_id="a1")
        again = await caller.ask("ros_cancel_goal", goal_id="A1")
    assert "It goes on" in text
    assert "A1" in cancelled
    assert "cancelled after" in cancelled
    assert "was over already, nothing was cancelled" in again


@both
async def test_an_action_that_is_not_there_is_answered_with_the_nearest(
    dialect: Dialect, tmp_path: Path
) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        text = await caller.refuse("ros_send_goal", action="/navigate", fields={})
    assert "The robot has no action '/navigate'" in text


@both
async def test_a_goal_in_a_frame_that_tf_does_not_have_is_refused(
    dialect: Dialect, tmp_path: Path
) -> None:
    lost = {**POSE, "header": {"frame_id": "nix"}}
    goal = {"pose": lost} if dialect is Dialect.ROS2 else {"target_pose": lost}
    action = ACTION if dialect is Dialect.ROS2 else "/move_base"
    kind = dialect.type_name("geometry_msgs/PoseStamped")
    async with on_our_server(dialect, tmp_path) as (robot, caller), time_passing(robot):
        sent = await caller.refuse("ros_send_goal", action=action, fields=goal)
        published = await caller.refuse("ros_publish", topic="/goal", type=kind, fields=lost)
        await caller.ask("ros_publish", topic="/goal", type=kind, fields=POSE)
    assert "TF has no frame 'nix'" in sent
    assert "map" in sent
    assert "TF has no frame 'nix'" in published


@both
async def test_siblings_take_the_names_that_their_arguments_had_before(
    dialect: Dialect, tmp_path: Path
) -> None:
    action = ACTION if dialect is Dialect.ROS2 else "/move_base"
    goal = GOAL if dialect is Dialect.ROS2 else {"target_pose": POSE}
    kind = dialect.type_name("std_msgs/String")
    async with on_our_server(dialect, tmp_path) as (_, caller):
        await caller.ask("ros_send_goal", action=action, goal=goal, wait_s=0)
        await caller.ask("ros_publish", topic="/chat", type=kind, message={"data": "a"})
        await caller.ask("ros_call", service="/rosapi/topic_type", arguments={"topic": "/map"})
        text = await caller.refuse(
            "ros_call", service="/rosapi/topic_type", fields={"topic": "/map"}, arguments={}
        )
    assert "ros_call has no argument arguments; it has: fields, service, timeout_s." in text


async def test_a_path_in_a_result_is_told_by_its_length(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    kind = {"type": "nav2_msgs/action/ComputePathToPose"}
    scripted.services["/rosapi/action_type"] = lambda _: kind
    header = write_header("map", 0.0, dialect=Dialect.ROS2)
    pose = write_pose(Pose(0.0, 0.0, 0.0))
    poses = [
        {"header": header, "pose": {**pose, "position": {"x": float(x), "y": 0.0, "z": 0.0}}}
        for x in range(200)
    ]
    path = {"header": header, "poses": poses}
    async with on_script(scripted, tmp_path) as caller:
        await caller.ask("ros_send_goal", action=ACTION, fields={}, wait_s=0)
        await scripted.end_goal(SUCCEEDED, values={"path": path, "error_code": 0})
        text = await caller.ask("ros_goal_status", wait_s=20)
    assert "path: Path in frame map: 200 poses, 199.00 m long" in text
    assert "error_code: 0" in text


# --- told apart


@pytest.mark.parametrize(
    ("status", "error", "said"),
    [
        (SUCCEEDED, "", "succeeded"),
        (ABORTED, "no valid path", "aborted"),
        (CANCELED, "", "cancelled"),
    ],
)
async def test_how_a_goal_ended_is_told_as_it_ended(
    tmp_path: Path, status: int, error: str, said: str
) -> None:
    scripted = with_types(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        await send(caller, wait_s=0)
        await scripted.end_goal(status, error=error)
        text = await caller.ask("ros_goal_status", wait_s=20)
    assert f"A1 ({ACTION}): {said} after" in text
    assert error in text


async def test_a_rejected_goal_is_told_as_rejected(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    scripted.accepts_goals = False
    said: list[str] = []
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:

        async def ask() -> None:
            said.append(await send(caller, wait_s=20))

        tasks.start_soon(ask)
        await scripted.until(lambda: scripted.goals)
        visitor, sent = scripted.goals[0]
        refused = {"status": 0, "result": False, "values": "out of the map"}
        end = {"op": "action_result", "action": ACTION, "id": sent["id"]}
        await visitor.send({**end, **refused})
    assert "rejected" in said[0]
    assert "out of the map. It was not taken" in said[0]


async def test_a_result_can_be_fetched_long_after_the_end(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        await send(caller, wait_s=0)
        await send(caller, wait_s=0)
        await scripted.end_goal(ABORTED, goal=0, error="blocked by a chair")
        await scripted.end_goal(SUCCEEDED, goal=1)
        await caller.ask("ros_goal_status", goal_id="A2", wait_s=20)
        first = await caller.ask("ros_goal_status", goal_id="A1", wait_s=20)
        once_more = await caller.ask("ros_goal_status", goal_id="A1")
    assert 'error_msg: "blocked by a chair"' in first
    assert once_more == first


async def test_everything_else_is_answered_while_a_goal_is_waited_for(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    said: dict[str, str] = {}
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:

        async def wait_for(name: str) -> None:
            said[name] = await send(caller, wait_s=20)

        tasks.start_soon(wait_for, "first")
        await scripted.until(lambda: len(scripted.goals) == 1)
        tasks.start_soon(wait_for, "second")
        await scripted.until(lambda: len(scripted.goals) == 2)
        status = await caller.ask("ros_goal_status", goal_id="A1")
        assert "running" in status
        assert "/map" in await caller.ask("ros_topics")
        await scripted.end_goal(ABORTED, goal=1, error="second")
        await scripted.end_goal(SUCCEEDED, goal=0)
    assert "A1" in said["first"]
    assert "succeeded" in said["first"]
    assert "aborted" in said["second"]


async def test_feedback_is_told_while_the_goal_goes_on(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        text = await send(caller, wait_s=0)
    assert "running" in text
    assert "distance_remaining: 3" in text


# --- made up


async def test_a_longer_wait_than_the_schema_allows_is_cut_as_by_the_other_tools(
    tmp_path: Path,
) -> None:
    scripted = with_types(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        offered = {tool.name: tool for tool in (await caller.client.list_tools()).tools}
        for name in ("ros_send_goal", "ros_goal_status"):
            assert offered[name].input_schema["properties"]["wait_s"]["maximum"] == 25.0
        asked = await caller.refuse("ros_goal_status", wait_s=60)
        too_short = await caller.refuse("ros_goal_status", wait_s=-1)
    assert "No goal has been sent" in asked
    assert "wait_s" in too_short


async def test_a_made_up_goal_is_not_cancelled(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        none = await caller.refuse("ros_cancel_goal", goal_id="A7")
        await send(caller, wait_s=0)
        other = await caller.refuse("ros_cancel_goal", goal_id="A7")
        neither = await caller.refuse("ros_cancel_goal")
        await caller.ask("ros_topics")
    assert "There is no goal 'A7'" in none
    assert "The latest are A1" in other
    assert "Give either goal_id or action" in neither
    assert scripted.server.asked("cancel_action_goal") == []


async def test_every_goal_of_an_action_can_be_cancelled_whoever_sent_it(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    await scripted.tell_status(OTHERS, 2)
    calls: list[Operation] = []
    service = f"{ACTION}/_action/cancel_goal"

    def cancel(call: Operation) -> object:
        calls.append(call)
        return {"return_code": 0, "goals_canceling": [{}]}

    scripted.services[service] = cancel
    async with on_script(scripted, tmp_path) as caller:
        listed = await caller.ask("ros_goal_status", action=ACTION)
        text = await caller.ask("ros_cancel_goal", action=ACTION)
        scripted.services[service] = lambda _: {"return_code": 1}
        refused = await caller.refuse("ros_cancel_goal", action=ACTION)
    assert f"{OTHERS.hex()}: running" in listed
    assert "1 goal being cancelled" in text
    assert calls[0]["args"] == {}
    assert "refused to cancel" in refused


async def test_a_held_robot_lets_goals_be_cancelled_by_their_service(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    service = f"{ACTION}/_action/cancel_goal"
    scripted.services[service] = lambda _: {"return_code": 0, "goals_canceling": []}
    scripted.services["/rosapi/service_type"] = lambda _: {"type": "action_msgs/srv/CancelGoal"}
    guard = make_guard(tmp_path, Policy(rates=dict.fromkeys(CommandKind, 0)))
    guard.hold.put("a test", at=guard.wall_clock())
    async with on_script(scripted, tmp_path, guard=guard) as caller:
        by_tool = await caller.ask("ros_cancel_goal", action=ACTION)
        by_service = await caller.ask("ros_call", service=service)
    assert "0 goals being cancelled" in by_tool
    assert "answered" in by_service
    stops = [line.said for line in audit_of(tmp_path) if line.event == "stop"]
    assert len([said for said in stops if service in said]) == 2


async def test_a_goal_that_does_not_fit_is_not_sent(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        goal = {"pose": {"pose": {"position": {"x": "here"}}}}
        text = await caller.refuse("ros_send_goal", action=ACTION, fields=goal)
    assert "pose.pose.position.x wants a number (float64), not 'here'" in text
    assert scripted.goals == []


# --- lost, and without a sign


@asynccontextmanager
async def sending(
    scripted: ScriptedRobot, folder: Path
) -> AsyncGenerator[tuple[RosbridgeClient, RosAccess]]:
    """Gives what sends goals with little patience, and its connection."""
    with anyio.fail_after(PATIENCE_S):
        async with (
            running(scripted.server) as server,
            open_client(RobotAddress(url=server.url), patience=BRIEF) as client,
        ):
            memory = SemanticMapStore(folder / "map.yaml")
            session = Session(FakeRobot(two_rooms()), memory, lease_s=60.0, ros=client)
            yield client, RosAccess(session)


async def send_by(ros: RosAccess, action: str, goal: Message, type_name: str) -> TrackedGoal:
    described = await ros.inquiry.describe(type_name, kind="action")
    return await ros.goals.send(action, goal, described=described)


async def lose(scripted: ScriptedRobot, client: RosbridgeClient, *, status: int | None) -> None:
    """Cuts the connection; when it is back the list of goals gives ours that status, or none."""
    await scripted.tell_status(OURS, 2)
    await client.call_service("/rosapi/get_time")
    scripted.statuses.clear()
    await scripted.server.drop_all()
    await scripted.tell_status(OURS if status else OTHERS, status or 2)
    await client.wait_until_connected()


async def test_a_goal_without_a_sign_of_life_is_rejected_and_cancelled(tmp_path: Path) -> None:
    scripted = with_types(ScriptedRobot())
    scripted.accepts_goals = False
    async with sending(scripted, tmp_path) as (_, ros):
        job = await send_by(ros, ACTION, GOAL, "nav2_msgs/NavigateToPose")
        await scripted.until(lambda: scripted.server.asked("cancel_action_goal"))
    assert job.goal.state is ActionState.REJECTED
    assert "gave no sign of taking the goal" in job.goal.reason


@pytest.mark.parametrize(
    ("status", "state", "said"),
    [
        (None, ActionState.LOST, "does not know the goal any more"),
        (ABORTED, ActionState.ABORTED, "Its result went with the connection"),
        (SUCCEEDED, ActionState.SUCCEEDED, "Its result went with the connection"),
    ],
)
async def test_a_goal_is_found_again_after_a_reconnection_or_told_as_lost(
    tmp_path: Path, status: int | None, state: ActionState, said: str
) -> None:
    scripted = with_types(ScriptedRobot())
    async with sending(scripted, tmp_path) as (client, ros):
        job = await send_by(ros, ACTION, GOAL, "nav2_msgs/NavigateToPose")
        await lose(scripted, client, status=status)
        await ros.goals.wait(job, wait_s=PATIENCE_S)
    assert job.goal.state is state
    assert said in job.goal.reason


# --- ROS 1, on the wire


MOVE_BASE = "/move_base"


def goals_on_ros1(scripted: ScriptedRobot) -> list[str]:
    """The ids of the goals that came over the topic."""
    sent = [each for each in scripted.server.asked("publish") if each["topic"] == "/move_base/goal"]
    return [each["msg"]["goal_id"]["id"] for each in sent]


def status_of(goal_id: str, status: int, text: str = "") -> dict[str, Any]:
    stamp = {"secs": 0, "nsecs": 0}
    return {"goal_id": {"id": goal_id, "stamp": stamp}, "status": status, "text": text}


@pytest.mark.parametrize(
    ("status", "state", "said"),
    [
        (None, ActionState.LOST, "does not know the goal any more"),
        (3, ActionState.SUCCEEDED, "Its result has not come"),
        (4, ActionState.ABORTED, "stuck. Its result has not come"),
        (5, ActionState.REJECTED, "stuck."),
        (8, ActionState.CANCELLED, "stuck"),
    ],
)
async def test_on_ros_1_the_list_of_goals_tells_the_end_when_no_result_does(
    tmp_path: Path, status: int | None, state: ActionState, said: str
) -> None:
    scripted = ScriptedRobot(ros=1)
    kind = {"type": "move_base_msgs/MoveBaseActionGoal"}
    scripted.services["/rosapi/topic_type"] = lambda _: kind
    jobs: list[ActionGoal] = []
    async with sending(scripted, tmp_path) as (_, ros), anyio.create_task_group() as tasks:

        async def pursue() -> None:
            goal = {"target_pose": POSE}
            job = await send_by(ros, MOVE_BASE, goal, "move_base_msgs/MoveBase")
            await ros.goals.wait(job, wait_s=PATIENCE_S)
            jobs.append(job.goal)

        tasks.start_soon(pursue)
        await scripted.until(lambda: goals_on_ros1(scripted))
        (goal_id,) = goals_on_ros1(scripted)
        topic = "/move_base/status"
        await scripted.publish(topic, {"status_list": [status_of(goal_id, 1)]})
        while not jobs:
            last = [] if status is None else [status_of(goal_id, status, "stuck")]
            await scripted.publish(topic, {"status_list": last})
            await anyio.lowlevel.checkpoint()
    assert jobs[0].state is state
    assert said in jobs[0].reason


async def test_on_ros_1_replies_are_matched_by_the_goals_id(tmp_path: Path) -> None:
    scripted = ScriptedRobot(ros=1)
    kind = {"type": "move_base_msgs/MoveBaseActionGoal"}
    scripted.services["/rosapi/topic_type"] = lambda _: kind
    said: list[str] = []

    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:

        async def ask() -> None:
            goal = {"target_pose": POSE}
            text = await caller.ask("ros_send_goal", action="/move_base", fields=goal, wait_s=20)
            said.append(text)

        tasks.start_soon(ask)
        await scripted.until(lambda: goals_on_ros1(scripted))
        (goal_id,) = goals_on_ros1(scripted)
        for status in (status_of("somebody", 3), status_of(goal_id, 4, "no way through")):
            await scripted.publish("/move_base/result", {"status": status, "result": {}})
    assert "aborted" in said[0]
    assert "no way through" in said[0]


async def test_where_the_robot_does_not_tell_an_actions_type_its_name_or_the_model_does(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot(actions=(ACTION, "/robot1/spin", "/grasp"))
    async with on_script(scripted, tmp_path) as caller:
        listed = await caller.ask("ros_actions")
        unknown = await caller.refuse("ros_action", action="/grasp")
        given = await caller.ask("ros_action", action="/grasp", type="nav2_msgs/action/Wait")
        sent = await send(caller, wait_s=0)
    assert listed.splitlines()[1:] == [
        "/grasp (its type is not told)",
        f"{ACTION} nav2_msgs/action/NavigateToPose",
        "/robot1/spin nav2_msgs/action/Spin",
    ]
    assert "Give it as type" in unknown
    assert given.startswith("/grasp nav2_msgs/action/Wait\ngoal:\n  time: ")
    assert "running" in sent
    (_, operation) = scripted.goals[0]
    assert operation["action_type"] == "nav2_msgs/action/NavigateToPose"
