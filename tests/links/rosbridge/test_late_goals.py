"""Goals that navigation takes after we said that they were over: they are ended for certain."""

from dataclasses import replace
from functools import partial
from typing import Any

import anyio
import pytest

from causes import code_of
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import CauseCode, GoalState
from mapspeak.ros.actions import ActionClient
from mapspeak.ros.activity import ActionGoal
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect, write_stamp
from mapspeak.ros.robot import RosRobot
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
from rosbridge_script import PATIENCE_S, Operation, Visitor

pytestmark = pytest.mark.anyio

QUICK = Patience(
    first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0, frames_s=PATIENCE_S
)
BRIEF = replace(
    QUICK, acceptance_s=0.2, listing_s=0.0, end_s=5.0, result_s=0.0, return_s=0.1, settling_s=0.0
)
LONG = replace(QUICK, acceptance_s=PATIENCE_S, end_s=5.0, result_s=0.0, settling_s=0.0)
GOAL = Pose(4.0, 2.0)
OURS, OTHERS, NEWER = bytes(range(16)), bytes(range(16, 32)), bytes(range(32, 48))
EXECUTING = 2

connected = partial(connect_scripted, patience=BRIEF)


class SlowNav2:
    """Navigation that takes a goal when the test says so, and rosbridge 2.1 before it.

    rosbridge forgets to cancel what navigation has not taken yet.
    """

    def __init__(self, scripted: ScriptedRobot) -> None:
        scripted.accepts_goals = False
        scripted.services[CANCEL_SERVICE] = self._cancel
        scripted.server.answers["cancel_action_goal"] = self._cancel_operation
        self.scripted = scripted
        self.taken: dict[str, bytes] = {}
        self.cancelled: list[bytes] = []

    async def take(self, ros_id: bytes, *, goal: int | None = -1) -> None:
        """Takes one of the goals that came, or one that another client has sent."""
        if goal is not None:
            self.taken[self.scripted.goals[goal][1]["id"]] = ros_id
        await self.scripted.tell_status(ros_id, EXECUTING)

    async def _cancel_operation(self, _visitor: Visitor, operation: Operation) -> None:
        ros_id = self.taken.get(operation["id"])
        if ros_id is not None:
            await self._end(ros_id)

    def _cancel(self, call: Operation) -> object:
        info = call["args"].get("goal_info")
        if info is not None:
            self.cancelled.append(bytes(info["goal_id"]["uuid"]))
        return {"return_code": 0, "goals_canceling": [{}]}

    async def _end(self, ros_id: bytes) -> None:
        self.cancelled.append(ros_id)
        await self.scripted.tell_status(ros_id, CANCELED)


@pytest.mark.parametrize("is_stopped", [False, True])
async def test_a_goal_that_is_taken_too_late_over_rosbridge_is_cancelled_at_once(
    *, is_stopped: bool
) -> None:
    scripted = ScriptedRobot()
    nav2 = SlowNav2(scripted)
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        before = await robot.fetch_goal_status(goal_id)
        if is_stopped:
            await robot.stop()
        await nav2.take(OURS)
        await eventually_so(lambda: OURS in nav2.cancelled)
        await eventually_says(robot, goal_id, "cancelled at once")
        after = await robot.fetch_goal_status(goal_id)
    assert (before.state, code_of(before)) == (GoalState.REJECTED, CauseCode.NOT_TAKEN)
    assert after.state is GoalState.REJECTED
    assert nav2.cancelled[0] == OURS


async def test_a_goal_that_was_stopped_before_it_was_taken_is_cancelled_when_it_is() -> None:
    scripted = ScriptedRobot()
    nav2 = SlowNav2(scripted)
    sent: list[str] = []
    async with connected(scripted, patience=LONG) as robot:
        async with anyio.create_task_group() as tasks:

            async def drive() -> None:
                sent.append(await robot.send_goal(GOAL))

            tasks.start_soon(drive)
            await scripted.until(lambda: scripted.goals)
            await robot.stop()
        assert (await robot.fetch_goal_status(sent[0])).state is GoalState.CANCELLED
        await nav2.take(OURS)
        await eventually_so(lambda: OURS in nav2.cancelled)
        await eventually_says(robot, sent[0], "cancelled at once")


async def test_a_late_goal_is_cancelled_by_its_id_where_rosbridge_has_forgotten_it() -> None:
    scripted = ScriptedRobot()
    nav2 = SlowNav2(scripted)
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.server.drop_all()
        await robot.connection.wait_until_connected()
        await scripted.until(lambda: len(scripted.server.present) == 2)
        await robot.fetch_pose()
        await nav2.take(OURS, goal=None)
        await eventually_so(lambda: OURS in nav2.cancelled)
        await eventually_says(robot, goal_id, "cancelled at once")


async def test_another_clients_goal_is_left_alone_though_ours_may_still_be_taken() -> None:
    scripted = ScriptedRobot()
    nav2 = SlowNav2(scripted)
    async with connected(scripted) as robot:
        await robot.send_goal(GOAL)
        await nav2.take(OTHERS, goal=None)

        async def is_seen() -> bool:
            return await robot.fetch_foreign_goals() == (GoalState.DRIVING,)

        await eventually(is_seen)
        assert nav2.cancelled == []
        await nav2.take(OURS)
        await eventually_so(lambda: OURS in nav2.cancelled)
    assert OTHERS not in nav2.cancelled


async def test_the_goal_that_is_wanted_is_not_taken_for_the_one_that_was_withdrawn() -> None:
    scripted = ScriptedRobot()
    nav2 = SlowNav2(scripted)
    async with connected(scripted) as robot:
        await robot.send_goal(GOAL)
        await robot.stop()
        scripted.accepts_goals = True
        wanted = await robot.send_goal(GOAL)
        await nav2.take(NEWER)
        await nav2.take(OURS, goal=0)
        await eventually_so(lambda: OURS in nav2.cancelled)
        assert (await robot.fetch_goal_status(wanted)).state is GoalState.DRIVING
    assert NEWER not in nav2.cancelled


# --- a newer goal is not told as the older one ends


async def rejected(scripted: ScriptedRobot, robot: RosRobot) -> str:
    """Send a goal that rosbridge tells as rejected."""
    sent: list[str] = []

    async def drive() -> None:
        sent.append(await robot.send_goal(GOAL))

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(drive)
        await scripted.until(lambda: scripted.goals)
        await scripted.end_goal(0, is_result=False)
    assert (await robot.fetch_goal_status(sent[0])).state is GoalState.REJECTED
    return sent[0]


async def list_is_heard(scripted: ScriptedRobot, robot: RosRobot) -> None:
    """Return when all that was published until now has been taken in."""
    await robot.connection.call_service("/rosapi/get_time")
    heard = robot.connection.subscribe(STATUS_TOPIC).latest
    assert heard is not None
    assert len(heard["status_list"]) == len(scripted.statuses)


@pytest.mark.parametrize("last", [SUCCEEDED, ABORTED, CANCELED])
@pytest.mark.parametrize("is_refused", [False, True])
async def test_how_a_rejected_goal_ends_late_is_not_told_of_the_goal_after_it(
    *, is_refused: bool, last: int
) -> None:
    scripted = ScriptedRobot()
    SlowNav2(scripted)
    async with connected(scripted, patience=LONG if is_refused else BRIEF) as robot:
        older = await (rejected(scripted, robot) if is_refused else robot.send_goal(GOAL))
        scripted.accepts_goals = True
        newer = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, EXECUTING)
        # As long as it takes to find out whose goal that is.
        await anyio.sleep(0.5)
        await scripted.tell_status(OURS, last)
        await list_is_heard(scripted, robot)
        states = [(await robot.fetch_goal_status(each)).state for each in (older, newer)]
        await scripted.end_goal(SUCCEEDED)
        await until_state(robot, newer, GoalState.ARRIVED)
    assert states == [GoalState.REJECTED, GoalState.DRIVING]


@pytest.mark.parametrize("last", [SUCCEEDED, ABORTED, CANCELED])
async def test_a_goal_that_is_not_taken_yet_does_not_end_as_the_rejected_one_before_it(
    last: int,
) -> None:
    scripted = ScriptedRobot()
    SlowNav2(scripted)
    async with connected(scripted, patience=LONG) as robot, anyio.create_task_group() as tasks:
        await rejected(scripted, robot)
        tasks.start_soon(robot.send_goal, GOAL)
        await scripted.until(lambda: len(scripted.goals) == 2)
        await scripted.tell_status(OURS, last)
        await list_is_heard(scripted, robot)
        client_of(robot).look()
        assert [goal.is_over for goal in goals_of(robot)] == [True, False]
        tasks.cancel_scope.cancel()


async def test_a_goal_whose_result_came_first_does_not_end_the_one_after_it() -> None:
    scripted = ScriptedRobot()
    async with connected(scripted, patience=LONG) as robot:
        older = await robot.send_goal(GOAL)
        await scripted.end_goal(SUCCEEDED)
        await until_state(robot, older, GoalState.ARRIVED)
        newer = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, SUCCEEDED)
        await list_is_heard(scripted, robot)
        assert (await robot.fetch_goal_status(newer)).state is GoalState.DRIVING
        await scripted.tell_status(NEWER, EXECUTING)
        await list_is_heard(scripted, robot)
        assert [goal.server_id for goal in goals_of(robot)] == [OURS.hex(), NEWER.hex()]


@pytest.mark.parametrize("is_known", [False, True])
async def test_a_goal_that_another_client_had_before_does_not_end_ours(*, is_known: bool) -> None:
    scripted = ScriptedRobot()
    async with connected(scripted, patience=LONG) as robot:
        if is_known:
            await scripted.tell_status(OTHERS, EXECUTING)
            del scripted.statuses[OTHERS.hex()]
            await scripted.tell_status(OURS, SUCCEEDED)
        goal_id = await robot.send_goal(GOAL)
        await scripted.tell_status(OTHERS, SUCCEEDED)
        await list_is_heard(scripted, robot)
        assert (await robot.fetch_goal_status(goal_id)).state is GoalState.DRIVING


async def test_the_goal_that_is_wanted_is_known_by_its_id_once_the_withdrawn_one_is() -> None:
    scripted = ScriptedRobot()
    nav2 = SlowNav2(scripted)
    async with connected(scripted) as robot:
        await robot.send_goal(GOAL)
        scripted.accepts_goals = True
        await robot.send_goal(GOAL)
        await nav2.take(NEWER)
        await nav2.take(OURS, goal=0)
        await eventually_so(
            lambda: [goal.server_id for goal in goals_of(robot)] == [OURS.hex(), NEWER.hex()]
        )
    assert NEWER not in nav2.cancelled


async def test_a_goal_that_cannot_be_known_by_its_id_is_ended_once_it_is_told_as_lost() -> None:
    scripted = ScriptedRobot()
    nav2 = SlowNav2(scripted)
    async with connected(scripted) as robot:
        await robot.send_goal(GOAL)
        scripted.accepts_goals = True
        wanted = await robot.send_goal(GOAL)
        await nav2.take(NEWER, goal=None)
        await list_is_heard(scripted, robot)
        await scripted.server.drop_all()
        await until_state(robot, wanted, GoalState.LOST)
        await eventually_so(lambda: NEWER in nav2.cancelled)


def goals_of(robot: RosRobot) -> list[ActionGoal]:
    return client_of(robot).goals


def client_of(robot: RosRobot) -> ActionClient:
    client = robot.connection.started.actions["/navigate_to_pose"]
    assert isinstance(client, ActionClient)
    return client


# --- ROS 1


def status_of(goal_id: str, code: int) -> dict[str, Any]:
    stamp = write_stamp(1.0, dialect=Dialect.ROS1)
    return {"goal_id": {"stamp": stamp, "id": goal_id}, "status": code, "text": ""}


def published(scripted: ScriptedRobot, topic: str) -> list[Operation]:
    return [each for each in scripted.server.asked("publish") if each["topic"] == topic]


def cancels_of(scripted: ScriptedRobot, goal_id: str) -> int:
    cancels = published(scripted, "/move_base/cancel")
    return sum(each["msg"]["id"] == goal_id for each in cancels)


async def list_goal(scripted: ScriptedRobot, goal_id: str, code: int) -> None:
    await scripted.publish("/move_base/status", {"status_list": [status_of(goal_id, code)]})


@pytest.mark.parametrize("is_stopped", [False, True])
async def test_a_goal_that_move_base_takes_too_late_is_cancelled_until_it_ends(
    *, is_stopped: bool
) -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted) as robot:
        goal_id = await robot.send_goal(GOAL)
        if is_stopped:
            await robot.stop()
        # Behind what was published before.
        await robot.connection.call_service("/rosapi/get_time")
        n_before = cancels_of(scripted, goal_id)
        await list_goal(scripted, goal_id, 1)
        await scripted.until(lambda: cancels_of(scripted, goal_id) > n_before + 2)
        await list_goal(scripted, goal_id, 2)
        await eventually_says(robot, goal_id, "cancelled at once")
        assert (await robot.fetch_goal_status(goal_id)).state is GoalState.REJECTED


async def test_a_move_base_that_fell_silent_and_comes_back_does_not_drive_on() -> None:
    scripted = ScriptedRobot(ros=1)
    async with connected(scripted, patience=LONG_BUT_WATCHFUL) as robot:
        goal_id = await taken_by_move_base(scripted, robot)
        await until_state(robot, goal_id, GoalState.LOST)
        n_before = cancels_of(scripted, goal_id)
        await scripted.until(lambda: len(published(scripted, "/cmd_vel")) > 3)
        await list_goal(scripted, goal_id, 1)
        await scripted.until(lambda: cancels_of(scripted, goal_id) > n_before)
    stand = published(scripted, "/cmd_vel")[-1]["msg"]
    assert stand["linear"]["x"] == stand["angular"]["z"] == 0.0


LONG_BUT_WATCHFUL = replace(
    QUICK, acceptance_s=PATIENCE_S, end_s=0.05, return_s=0.2, settling_s=0.0
)


async def taken_by_move_base(scripted: ScriptedRobot, robot: RosRobot) -> str:
    sent: list[str] = []

    async def drive() -> None:
        sent.append(await robot.send_goal(GOAL))

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(drive)
        await scripted.until(lambda: published(scripted, "/move_base/goal"))
        own_id = published(scripted, "/move_base/goal")[-1]["msg"]["goal_id"]["id"]
        await list_goal(scripted, own_id, 1)
    return sent[0]


# --- what is said when it cannot be done


async def test_a_goal_that_navigation_refuses_to_cancel_is_said_to_go_on() -> None:
    scripted = ScriptedRobot()
    scripted.services[CANCEL_SERVICE] = lambda _: {"return_code": 1, "goals_canceling": []}
    async with connected(scripted, patience=LONG_BUT_WATCHFUL) as robot:
        goal_id = await robot.send_goal(GOAL)
        await scripted.tell_status(OURS, EXECUTING)

        async def is_refused() -> bool:
            with pytest.raises(LinkError) as raised:
                await robot.cancel_goal(goal_id)
            # Before rosbridge tells of the list, it can only be seen that the goal goes on.
            return "refused to cancel" in raised.value.message

        await eventually(is_refused)
        assert (await robot.fetch_goal_status(goal_id)).state is GoalState.DRIVING


async def test_a_stop_that_reaches_nobody_says_so() -> None:
    scripted = ScriptedRobot(actions=())
    del scripted.topics["/cmd_vel"]
    async with connected(scripted) as robot:
        with pytest.raises(LinkError, match="Nobody could be told"):
            await robot.stop()


async def until_state(robot: RosRobot, goal_id: str, state: GoalState) -> None:
    async def is_so() -> bool:
        return (await robot.fetch_goal_status(goal_id)).state is state

    await eventually(is_so)


async def eventually_says(robot: RosRobot, goal_id: str, said: str) -> None:
    async def is_said() -> bool:
        return said in (await robot.fetch_goal_status(goal_id)).afterwards

    await eventually(is_said)


async def eventually_so(is_so: Any) -> None:  # noqa: ANN401
    async def look() -> bool:
        return bool(is_so())

    await eventually(look)


async def test_a_cancellation_is_not_lost_while_its_socket_is_being_replaced() -> None:
    scripted = ScriptedRobot()
    scripted.services["/slow"] = lambda _: None
    async with connected(scripted, patience=LONG) as robot, anyio.create_task_group() as tasks:
        goal_id = await robot.send_goal(GOAL)
        tasks.start_soon(ask_in_vain, robot)
        await scripted.until(lambda: "/slow" in str(scripted.server.asked("call_service")))
        robot.connection.clear_the_way()
        tasks.start_soon(robot.cancel_goal, goal_id)
        await scripted.until(lambda: scripted.server.asked("cancel_action_goal"))
        await scripted.end_goal(CANCELED)
        await until_state(robot, goal_id, GoalState.CANCELLED)
        tasks.cancel_scope.cancel()


async def ask_in_vain(robot: RosRobot) -> None:
    await robot.connection.call_service("/slow", timeout_s=PATIENCE_S)
