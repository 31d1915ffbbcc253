"""Goals over rosbridge: Nav2's action on ROS 2, move_base's topics on ROS 1."""

from collections.abc import Callable
from typing import Any

import anyio
import pytest

from bridging import RawClient, SteppedRobot, bridge
from fakes import FakeRobot, two_rooms
from mapspeak.errors import GoalError, LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, GoalStatus
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.poses import FramedPose, read_pose_stamped, write_pose_stamped
from mapspeak.rosbridge_server.hub import Hub, Publication
from mapspeak.rosbridge_server.navigation import Drives, MoveBase, Nav2
from mapspeak.rosbridge_server.stack import topics_of

pytestmark = pytest.mark.anyio

ACTION = "/navigate_to_pose"
ACTION_TYPE = "nav2_msgs/action/NavigateToPose"
EXECUTING, SUCCEEDED, CANCELED, ABORTED = 2, 4, 5, 6
AHEAD = Pose(2.5, 1.4)


def target(pose: Pose = AHEAD, *, frame_id: str = "map", dialect: Dialect) -> dict[str, Any]:
    return write_pose_stamped(
        FramedPose(pose=pose, frame_id=frame_id, stamp_s=0.0), dialect=dialect
    )


async def send_goal(client: RawClient, goal_id: str, **changes: Any) -> None:  # noqa: ANN401
    goal = {
        "action": ACTION,
        "action_type": ACTION_TYPE,
        "args": {"pose": target(dialect=Dialect.ROS2)},
        "feedback": True,
    }
    await client.send(op="send_action_goal", id=goal_id, **{**goal, **changes})


async def statuses(watcher: RawClient, *, until: list[int]) -> None:
    """Waits until the action's goals stand so."""
    await watcher.until(
        lambda each: (
            each.get("topic") == f"{ACTION}/_action/status"
            and [goal["status"] for goal in each["msg"]["status_list"]] == until
        )
    )


async def watch(client: RawClient) -> None:
    await client.send(op="subscribe", topic=f"{ACTION}/_action/status")
    await statuses(client, until=[])


async def result_of(client: RawClient, goal_id: str) -> dict[str, Any]:
    return await client.until(
        lambda each: each.get("op") == "action_result" and each["id"] == goal_id
    )


# --- ROS 2 ---


async def test_a_goal_feeds_back_and_ends_as_succeeded() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client, connect() as watcher:
        await watch(watcher)
        await send_goal(client, "one")
        await statuses(watcher, until=[EXECUTING])
        await robot.let_pass(0.5)
        feedback = await client.until(lambda each: each["op"] == "action_feedback")
        await robot.let_pass(1.0)
        result = await result_of(client, "one")
        await statuses(watcher, until=[SUCCEEDED])
    assert feedback["id"] == "one"
    assert 0.0 < feedback["values"]["distance_remaining"] < 1.0
    assert read_pose_stamped(feedback["values"]["current_pose"]).frame_id == "map"
    assert (result["status"], result["result"]) == (SUCCEEDED, True)
    assert result["values"] == {"error_code": 0, "error_msg": ""}
    assert robot.pose == AHEAD


async def test_without_asking_for_it_there_is_no_feedback() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client, connect() as watcher:
        await watch(watcher)
        await send_goal(client, "one", feedback=False)
        await statuses(watcher, until=[EXECUTING])
        await robot.let_pass(1.5)
        assert (await client.receive())["op"] == "action_result"


async def test_a_goal_holds_its_own_socket_up_and_no_other() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client, connect() as watcher:
        await watch(watcher)
        await send_goal(client, "one")
        await client.send(op="cancel_action_goal", id="one", action=ACTION)
        await client.send(op="call_service", id="time", service="/rosapi/get_time")
        await statuses(watcher, until=[EXECUTING])
        await robot.let_pass(0.5)
        assert (await watcher.ask("get_time"))["time"]["nanosec"] == 500_000_000
        await robot.let_pass(1.0)
        assert (await result_of(client, "one"))["status"] == SUCCEEDED
        assert (await client.receive())["id"] == "time"


async def test_another_socket_cancels_every_goal_by_service() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client, connect() as urgent:
        await watch(urgent)
        await send_goal(client, "one")
        await statuses(urgent, until=[EXECUTING])
        await robot.let_pass(0.2)
        answer = await urgent.call(f"{ACTION}/_action/cancel_goal")
        result = await result_of(client, "one")
    assert answer["values"]["return_code"] == 0
    assert len(answer["values"]["goals_canceling"]) == 1
    assert (result["status"], result["result"]) == (CANCELED, True)
    assert robot.ended["fake-1"].state is GoalState.CANCELLED


async def test_another_socket_cancels_a_goal_by_its_id() -> None:
    async with bridge(Dialect.ROS2) as (_, connect), connect() as client, connect() as urgent:
        await watch(urgent)
        await send_goal(client, "one")
        await statuses(urgent, until=[EXECUTING])
        await urgent.send(op="cancel_action_goal", id="one", action=ACTION)
        assert (await result_of(client, "one"))["status"] == CANCELED


@pytest.mark.parametrize(("uuid", "code"), [([7] * 16, 2), ("BwcHBwcHBwcHBwcHBwcHBw==", 2)])
async def test_cancelling_a_goal_that_nobody_sent_says_so(uuid: object, code: int) -> None:
    async with bridge(Dialect.ROS2) as (_, connect), connect() as client:
        answer = await client.call(
            f"{ACTION}/_action/cancel_goal", goal_info={"goal_id": {"uuid": uuid}}
        )
    assert answer["values"]["return_code"] == code


async def test_with_a_thread_for_goals_their_socket_stays_free() -> None:
    async with (
        bridge(Dialect.ROS2, goals_in_new_thread=True) as (robot, connect),
        connect() as client,
    ):
        await send_goal(client, "one")
        await client.all_before()
        await robot.let_pass(0.2)
        await client.send(op="cancel_action_goal", id="one", action=ACTION)
        assert (await result_of(client, "one"))["status"] == CANCELED


async def test_a_newer_goal_aborts_the_one_before() -> None:
    async with (
        bridge(Dialect.ROS2, goals_in_new_thread=True) as (robot, connect),
        connect() as client,
    ):
        await send_goal(client, "one")
        await send_goal(client, "two")
        first = await result_of(client, "one")
        await robot.let_pass(1.5)
        second = await result_of(client, "two")
    assert (first["status"], second["status"]) == (ABORTED, SUCCEEDED)


async def test_a_blocked_drive_is_aborted_with_a_reason() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client, connect() as watcher:
        await watch(watcher)
        await send_goal(client, "one")
        await statuses(watcher, until=[EXECUTING])
        robot._end(GoalState.BLOCKED)
        await robot.let_pass(0.2)
        result = await result_of(client, "one")
    assert (result["status"], result["result"]) == (ABORTED, True)
    assert result["values"]["error_code"] != 0


async def test_a_goal_goes_on_when_its_client_is_gone() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as watcher:
        await watch(watcher)
        async with connect() as client:
            await send_goal(client, "one")
            await statuses(watcher, until=[EXECUTING])
        await robot.let_pass(1.5)
        await statuses(watcher, until=[SUCCEEDED])
    assert robot.pose == AHEAD


async def test_a_goal_may_be_given_from_the_robot() -> None:
    async with (
        bridge(Dialect.ROS2, goals_in_new_thread=True) as (robot, connect),
        connect() as client,
    ):
        pose = target(Pose(0.5, 0.0), frame_id="base_link", dialect=Dialect.ROS2)
        await send_goal(client, "one", args={"pose": pose})
        await client.all_before()
    assert robot.goals["fake-1"] == Pose(2.0, 1.4)


async def test_a_goal_in_a_frame_nobody_knows_is_aborted() -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client:
        pose = target(frame_id="atlantis", dialect=Dialect.ROS2)
        await send_goal(client, "one", args={"pose": pose})
        result = await result_of(client, "one")
    assert result["status"] == ABORTED
    assert "atlantis" in result["values"]["error_msg"]
    assert robot.goals == {}


@pytest.mark.parametrize(
    "args", [{"pose": 5}, {"place": {}}, {"pose": {"pose": {"orientation": {"w": 9.0}}}}, [1]]
)
async def test_a_goal_that_is_none_is_answered_as_an_error(args: object) -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client:
        await send_goal(client, "one", args=args)
        result = await result_of(client, "one")
    assert result["result"] is False
    assert isinstance(result["values"], str)
    assert robot.goals == {}


class ChoosyRobot(SteppedRobot):
    async def send_goal(self, _goal: Pose) -> str:
        raise GoalError("It stands in a wall.", hint="Choose another.")


async def test_a_rejected_goal_is_never_answered_and_blocks_its_socket() -> None:
    robot = ChoosyRobot(two_rooms())
    async with bridge(Dialect.ROS2, robot) as (_, connect), connect() as client:
        await send_goal(client, "one")
        await client.send(op="call_service", id="time", service="/rosapi/get_time")
        async with connect() as other:
            await other.all_before()
        await robot.let_pass(1.0)
        with pytest.raises(TimeoutError):
            await client.receive(patience_s=0.1)


async def test_a_newer_rosbridge_says_that_a_goal_is_rejected() -> None:
    robot = ChoosyRobot(two_rooms())
    async with (
        bridge(Dialect.ROS2, robot, goals_in_new_thread=True) as (_, connect),
        connect() as client,
    ):
        await send_goal(client, "one")
        result = await result_of(client, "one")
    assert (result["status"], result["result"]) == (0, False)


@pytest.mark.parametrize(
    ("dialect", "topic"), [(Dialect.ROS1, "/move_base_simple/goal"), (Dialect.ROS2, "/goal_pose")]
)
async def test_a_pose_published_as_a_goal_is_one(dialect: Dialect, topic: str) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await client.send(op="publish", topic=topic, msg=target(dialect=dialect))
        await client.all_before()
        await robot.let_pass(1.5)
    assert robot.pose == AHEAD


# --- ROS 1 ---


async def publish_goal(client: RawClient, goal_id: str, **changes: Any) -> None:  # noqa: ANN401
    goal = {"target_pose": target(dialect=Dialect.ROS1, **changes)}
    await client.send(
        op="publish",
        topic="/move_base/goal",
        type="move_base_msgs/MoveBaseActionGoal",
        msg={"goal_id": {"id": goal_id}, "goal": goal},
    )


async def listen(client: RawClient, *topics: str) -> None:
    for topic in topics:
        await client.send(op="subscribe", topic=f"/move_base/{topic}")


async def test_move_base_feeds_back_and_ends_with_a_result() -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await listen(client, "feedback", "status", "result")
        await publish_goal(client, "one")
        await client.all_before()
        await robot.let_pass(1.5)
        feedback = await client.next_on("/move_base/feedback")
        result = await client.next_on("/move_base/result")
        status = await client.next_on("/move_base/status")
    assert read_pose_stamped(feedback["feedback"]["base_position"]).frame_id == "map"
    assert feedback["status"]["status"] == 1
    assert (result["status"]["goal_id"]["id"], result["status"]["status"]) == ("one", 3)
    assert [each["status"] for each in status["status_list"]] == [3]
    assert robot.pose == AHEAD


@pytest.mark.parametrize("goal_id", ["one", ""])
async def test_move_base_is_cancelled_by_id_or_altogether(goal_id: str) -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await listen(client, "result")
        await publish_goal(client, "one")
        await client.all_before()
        await robot.let_pass(0.2)
        await client.send(op="publish", topic="/move_base/cancel", msg={"id": "other's"})
        await client.all_before()
        await robot.let_pass(0.2)
        assert robot.ended == {}
        await client.send(op="publish", topic="/move_base/cancel", msg={"id": goal_id})
        result = await client.next_on("/move_base/result")
    assert (result["status"]["goal_id"]["id"], result["status"]["status"]) == ("one", 2)
    assert len(robot.ended) == 1


@pytest.mark.parametrize(("second", "is_meant"), [(1, False), (3, True)])
async def test_goals_are_cancelled_that_were_begun_up_to_a_time(
    second: int, *, is_meant: bool
) -> None:
    """As actionlib's GoalID says it, and after it action_msgs/CancelGoal."""
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await robot.let_pass(2.0)
        await publish_goal(client, "one")
        await client.all_before()
        message = {"id": "", "stamp": {"secs": second, "nsecs": 0}}
        await client.send(op="publish", topic="/move_base/cancel", msg=message)
        await client.all_before()
        await robot.let_pass(0.2)
        assert bool(robot.ended) == is_meant
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client, connect() as urgent:
        await robot.let_pass(2.0)
        await watch(urgent)
        await send_goal(client, "one")
        await statuses(urgent, until=[EXECUTING])
        info = {"stamp": {"sec": second, "nanosec": 0}}
        answer = await urgent.call(f"{ACTION}/_action/cancel_goal", goal_info=info)
        assert bool(answer["values"]["goals_canceling"]) == bool(robot.ended) == is_meant


class Thoughtful(SteppedRobot):
    """A robot that takes a goal only when a test lets it."""

    def __init__(self) -> None:
        super().__init__(two_rooms())
        self.is_asked, self.may_take = anyio.Event(), anyio.Event()

    async def send_goal(self, goal: Pose) -> str:
        self.is_asked.set()
        await self.may_take.wait()
        return await super().send_goal(goal)


@pytest.mark.parametrize("dialect", Dialect)
async def test_a_goal_that_is_cancelled_while_the_robot_takes_it_is_ended(
    dialect: Dialect,
) -> None:
    robot = Thoughtful()
    async with (
        bridge(dialect, robot) as (_, connect),
        connect() as client,
        connect() as urgent,
        anyio.create_task_group() as tasks,
    ):
        if dialect is Dialect.ROS1:
            await publish_goal(client, "one")
            await robot.is_asked.wait()
            await urgent.send(op="publish", topic="/move_base/cancel", msg={"id": "one"})
            await urgent.all_before()
        else:
            await send_goal(client, "one")
            await robot.is_asked.wait()
            service = f"{ACTION}/_action/cancel_goal"
            await urgent.send(op="call_service", id="cancel", service=service)
            tasks.start_soon(urgent.until, lambda each: each.get("id") == "cancel")
            # The server has read the call by the time it answers another client's.
            async with connect() as third:
                await third.ask("get_time")
        robot.may_take.set()
        await robot.let_pass(0.2)
        assert robot.ended["fake-1"].state is GoalState.CANCELLED


async def test_a_newer_goal_of_move_base_first_ends_the_one_before() -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await listen(client, "result")
        await publish_goal(client, "one")
        await client.all_before()
        await publish_goal(client, "two")
        first = await client.next_on("/move_base/result")
        await robot.let_pass(1.5)
        second = await client.next_on("/move_base/result")
    assert (first["status"]["goal_id"]["id"], first["status"]["status"]) == ("one", 2)
    assert (second["status"]["goal_id"]["id"], second["status"]["status"]) == ("two", 3)


async def test_move_base_never_ends_a_goal_in_a_frame_it_does_not_know() -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await listen(client, "status", "result")
        await publish_goal(client, "one", frame_id="atlantis")
        await client.all_before()
        await robot.let_pass(2.0)
        came = await client.all_before()
        assert {each["topic"] for each in came} == {"/move_base/status"}
        assert came[-1]["msg"]["status_list"][0]["status"] == 1
        await client.send(op="publish", topic="/move_base/cancel", msg={})
        assert (await client.next_on("/move_base/result"))["status"]["status"] == 2
    assert robot.goals == {}


async def test_a_newer_goal_ends_one_in_a_frame_that_move_base_does_not_know() -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await listen(client, "result", "status")
        for goal_id in ("one", "two"):
            await publish_goal(client, goal_id, frame_id="atlantis")
            await client.all_before()
        await publish_goal(client, "three")
        await client.all_before()
        await robot.let_pass(0.3)
        status = [each for each in await client.all_before() if each["topic"].endswith("status")]
    stand = [each["status"] for each in status[-1]["msg"]["status_list"]]
    assert stand == [2, 2, 1]


async def test_move_base_refuses_a_quaternion_of_zeros() -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await listen(client, "result")
        goal = {"target_pose": {"header": {"frame_id": "map"}}}
        await client.send(op="publish", topic="/move_base/goal", msg={"goal": goal})
        result = await client.next_on("/move_base/result")
    assert result["status"]["status"] == 4
    assert "quaternion" in result["status"]["text"]
    assert robot.goals == {}


async def test_ros_1_has_no_operations_on_goals() -> None:
    async with bridge(Dialect.ROS1) as (robot, connect), connect() as client:
        await send_goal(client, "one")
        assert await client.all_before() == []
    assert robot.goals == {}


class GivingUp(SteppedRobot):
    """A robot whose client gives up while it takes a goal."""

    give_up: Callable[[], None]

    async def send_goal(self, goal: Pose) -> str:
        goal_id = await super().send_goal(goal)
        self.give_up()
        await anyio.lowlevel.checkpoint()
        return goal_id


async def test_a_goal_whose_client_goes_while_the_robot_takes_it_can_be_cancelled() -> None:
    robot = GivingUp(two_rooms())
    drives = Drives(robot)
    with anyio.CancelScope() as scope:
        robot.give_up = scope.cancel
        await drives.start(AHEAD)
    (drive,) = drives.under_way
    await drives.cancel(drive)
    assert robot.ended["fake-1"].state is GoalState.CANCELLED


class Unheard(SteppedRobot):
    """A robot that cannot be reached now and then."""

    is_away = False

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        self._answer()
        return await super().fetch_goal_status(robot_goal_id)

    async def cancel_goal(self, robot_goal_id: str) -> None:
        self._answer()
        await super().cancel_goal(robot_goal_id)

    def _answer(self) -> None:
        if self.is_away:
            raise LinkError("There is no connection.", hint="Wait.")


async def test_a_goal_of_a_robot_that_cannot_be_reached_for_a_while_can_be_cancelled() -> None:
    robot = Unheard(two_rooms())
    drives = Drives(robot)
    robot.is_away = True
    drive = await drives.start(AHEAD)
    with pytest.raises(LinkError):
        await drives.cancel(drive)
    await drives.look()
    assert not drive.is_cancelling
    assert drives.under_way == [drive]
    robot.is_away = False
    await drives.cancel(drive)
    assert robot.ended["fake-1"].state is GoalState.CANCELLED


@pytest.mark.parametrize("dialect", Dialect)
@pytest.mark.parametrize("state", [each for each in GoalState if each.is_final])
async def test_every_end_that_a_robot_can_tell_is_told_on(
    state: GoalState, dialect: Dialect
) -> None:
    robot = FakeRobot(two_rooms())
    hub, drives = Hub(topics_of(dialect, robot.description)), Drives(robot)
    told: list[Publication] = []
    topic = {Dialect.ROS1: "/move_base/status", Dialect.ROS2: f"{ACTION}/_action/status"}[dialect]
    hub.subscribe(topic, "actionlib_msgs/GoalStatusArray", told.append)
    _ = (MoveBase if dialect is Dialect.ROS1 else Nav2)(robot, hub, drives)
    await drives.start(AHEAD)
    robot.end_goal(state)
    await drives.look()
    assert not drives.under_way
    (ended,) = told[-1].message["status_list"]
    assert ended["status"] >= 2
