"""A stop ends what the ROS tools have started, whoever stops and whatever became of it."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import anyio
import pytest
from mcp.client import Client

from faulty import Faults
from faulty_bridge import NEXT_ROOM, FaultyBridge, open_faulty_bridge
from guarding import MONDAY_NOON, make_guard
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect
from mapspeak.safety import CommandKind, Guard, Patterns, Policy
from mapspeak.server.app import build_server
from mapspeak.session import Session
from rosbridge_robot import CANCELED, ScriptedRobot, connect_scripted
from rosbridge_script import PATIENCE_S, Operation, Visitor
from rosserved import QUICK, Caller

pytestmark = pytest.mark.anyio

RATE = 5.0
SHORT = replace(QUICK, acceptance_s=0.5, end_s=2.0, settling_s=0.0)
LONG = replace(QUICK, acceptance_s=PATIENCE_S, end_s=2.0, settling_s=0.0)
PATROL = "/patrol"
EXECUTING = 2
TYPE = "nav2_msgs/action/FollowWaypoints"
STILL_M = 0.2


@asynccontextmanager
async def serving(
    robot: object, folder: Path, *, guard: Guard | None = None
) -> AsyncGenerator[tuple[Session, Caller]]:
    memory = SemanticMapStore(folder / "map.yaml")
    session = Session(
        robot,  # type: ignore[arg-type]
        memory,
        lease_s=60.0,
        guard=guard,
        ros=robot.connection,  # type: ignore[attr-defined]
        find_model=lambda: None,
    )
    server = build_server(session, toolsets=("drive", "ros"))
    async with Client(server) as client:
        yield session, Caller(client)


class Patrol:
    """An action beside navigation, whose goals end only when they are cancelled."""

    def __init__(self, scripted: ScriptedRobot) -> None:
        self.cancelled: list[str] = []
        self._scripted = scripted
        scripted.services["/rosapi/action_type"] = lambda _: {"type": TYPE}
        scripted.server.answers["cancel_action_goal"] = self._cancel

    async def _cancel(self, _visitor: Visitor, operation: Operation) -> None:
        for number, (_, goal) in enumerate(self._scripted.goals):
            if goal["id"] == operation["id"]:
                self.cancelled.append(goal["action"])
                await self._scripted.end_goal(CANCELED, goal=number)


@pytest.mark.parametrize("stop", ["stop_robot", "lost client", "end of the server", "hold"])
async def test_a_stop_ends_goals_of_any_action(tmp_path: Path, stop: str) -> None:
    scripted = ScriptedRobot(actions=("/navigate_to_pose", PATROL))
    allowed = {CommandKind.ACT: Patterns(allow=("*", PATROL))}
    patrol, guard = Patrol(scripted), make_guard(tmp_path, Policy(patterns=allowed))
    async with (
        connect_scripted(scripted, patience=LONG) as robot,
        serving(robot, tmp_path, guard=guard) as (session, caller),
    ):
        running = await caller.ask("ros_send_goal", action=PATROL, fields={}, wait_s=0)
        if stop == "stop_robot":
            await caller.ask("stop_robot")
        elif stop == "lost client":
            await session.client_is_gone("")
        elif stop == "hold":
            guard.hold.put("smoke", at=MONDAY_NOON)
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(session.keep_watch)
                await scripted.until(lambda: patrol.cancelled)
                tasks.cancel_scope.cancel()
        else:
            await session.close()
        ended = await caller.ask("ros_goal_status", wait_s=5)
    assert "running" in running
    assert "cancelled after" in ended
    assert patrol.cancelled == [PATROL]


async def test_a_goal_to_navigation_that_a_ros_tool_sent_is_no_other_clients(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot()
    async with (
        connect_scripted(scripted, patience=LONG) as robot,
        serving(robot, tmp_path) as (_, caller),
    ):
        await caller.ask(
            "ros_send_goal",
            action="/navigate_to_pose",
            fields={"pose": {"header": {"frame_id": "map"}, "pose": {"orientation": {"w": 1.0}}}},
            wait_s=0,
        )
        await scripted.tell_status(bytes(range(16)), EXECUTING)
        assert await robot.fetch_foreign_goals() == ()


async def test_a_stop_that_cannot_end_a_goal_says_which(tmp_path: Path) -> None:
    scripted = ScriptedRobot(actions=("/navigate_to_pose", PATROL))
    scripted.services["/rosapi/action_type"] = lambda _: {"type": TYPE}
    brief = replace(QUICK, acceptance_s=PATIENCE_S, end_s=0.1, settling_s=0.0)
    async with (
        connect_scripted(scripted, patience=brief) as robot,
        serving(robot, tmp_path) as (_, caller),
    ):
        await caller.ask("ros_send_goal", action=PATROL, fields={}, wait_s=0)
        said = await caller.refuse("stop_robot")
    assert "NOT STOPPED" in said
    assert PATROL in said


@pytest.mark.parametrize("ros", [1, 2])
async def test_a_stop_that_nobody_hears_is_told_though_a_goal_was_sent_before(
    tmp_path: Path, ros: int
) -> None:
    scripted = ScriptedRobot(ros=ros, actions=(PATROL,))
    for topic in ("/move_base/status", "/move_base/feedback", "/move_base/result", "/cmd_vel"):
        scripted.topics.pop(topic, None)
    scripted.services["/rosapi/action_type"] = lambda _: {"type": TYPE}
    scripted.services["/rosapi/subscribers"] = lambda _: {"subscribers": []}
    async with (
        connect_scripted(scripted, patience=SHORT) as robot,
        serving(robot, tmp_path) as (_, caller),
    ):
        scripted.accepts_goals = False
        await caller.client.call_tool(
            "ros_send_goal", {"action": PATROL, "fields": {}, "wait_s": 0}
        )
        said = await caller.refuse("stop_robot")
    assert "NOT STOPPED: Nobody could be told" in said


async def test_a_stop_publishes_zero_velocity_wherever_a_velocity_was_published(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/arm/cmd_vel"] = "geometry_msgs/msg/Twist"
    async with (
        connect_scripted(scripted, patience=LONG) as robot,
        serving(robot, tmp_path) as (_, caller),
    ):
        message = {"linear": {"x": 0.2}}
        await caller.ask(
            "ros_publish", topic="/arm/cmd_vel", fields=message, duration_s=0.1, rate_hz=20
        )
        n_before = len(velocities(scripted, "/arm/cmd_vel"))
        await caller.ask("stop_robot")
        await scripted.until(lambda: len(velocities(scripted, "/arm/cmd_vel")) > n_before)
    assert velocities(scripted, "/arm/cmd_vel")[-1] == 0.0


def velocities(scripted: ScriptedRobot, topic: str) -> list[float]:
    sent = [each for each in scripted.server.asked("publish") if each["topic"] == topic]
    return [each["msg"]["linear"]["x"] for each in sent]


# --- a base that drives


@asynccontextmanager
async def driving(
    folder: Path, *, patience: Patience, faults: Faults
) -> AsyncGenerator[tuple[FaultyBridge, Caller]]:
    with anyio.fail_after(PATIENCE_S):
        async with (
            open_faulty_bridge(Dialect.ROS1, rate=RATE, faults=faults) as bridge,
            open_rosbridge_robot(bridge.url, patience=patience) as robot,
            serving(robot, folder) as (_, caller),
        ):
            yield bridge, caller


async def send(caller: Caller, tool: str) -> str:
    if tool == "navigate_to":
        return await caller.ask(tool, x=NEXT_ROOM.x, y=NEXT_ROOM.y, wait_s=0)
    pose = {"position": {"x": NEXT_ROOM.x, "y": NEXT_ROOM.y}, "orientation": {"w": 1.0}}
    target = {"header": {"frame_id": "map"}, "pose": pose}
    goal = {"target_pose": target}
    return await caller.ask(tool, action="/move_base", fields=goal, wait_s=0)


@pytest.mark.parametrize("tool", ["navigate_to", "ros_send_goal"])
async def test_a_goal_that_was_called_rejected_does_not_drive_the_robot_later(
    tmp_path: Path, tool: str
) -> None:
    async with driving(tmp_path, patience=SHORT, faults=Faults(acceptance_s=5.0)) as (
        bridge,
        caller,
    ):
        said = await send(caller, tool)
        before_m = bridge.robot.base.driven_m
        await until(lambda: bridge.robot.cancelled)
        await bridge.robot.sleep(3.0)
        after_m = bridge.robot.base.driven_m
    assert "rejected" in said
    assert after_m - before_m < STILL_M


async def test_the_base_is_stopped_when_navigation_dies_under_a_drive(tmp_path: Path) -> None:
    watchful = replace(QUICK, acceptance_s=PATIENCE_S, return_s=0.3, settling_s=0.0)
    faults = Faults(has_watchdog=False)
    async with driving(tmp_path, patience=watchful, faults=faults) as (bridge, caller):
        await send(caller, "navigate_to")
        await until(lambda: bridge.robot.base.velocity[0] > 0.2)
        bridge.ros.kill(bridge.ros.navigator)
        said = await caller.ask("wait_for_goal", wait_s=20)
        await until(lambda: bridge.robot.base.velocity == (0.0, 0.0))
        before_m = bridge.robot.base.driven_m
        await bridge.robot.sleep(3.0)
        after_m = bridge.robot.base.driven_m
    assert '"lost"' in said
    assert after_m == before_m


async def until(is_so: object) -> None:
    while not is_so():  # type: ignore[operator] # noqa: ASYNC110 - the robot tells nobody
        await anyio.sleep(0.01)


async def test_a_goal_that_is_still_being_prepared_at_a_stop_is_not_sent(tmp_path: Path) -> None:
    scripted = ScriptedRobot(actions=("/navigate_to_pose", PATROL))
    types = anyio.Event()
    async with (
        connect_scripted(scripted, patience=LONG) as robot,
        serving(robot, tmp_path) as (_, caller),
    ):
        said: list[str] = []

        def ask_for_type(_: Operation) -> None:
            types.set()

        scripted.services["/rosapi/action_type"] = ask_for_type
        async with anyio.create_task_group() as tasks:

            async def send_goal() -> None:
                said.append(await caller.refuse("ros_send_goal", action=PATROL, goal={}))

            tasks.start_soon(send_goal)
            await types.wait()
            await caller.ask("stop_robot")
            scripted.services["/rosapi/action_type"] = lambda _: {"type": TYPE}
            call = scripted.server.asked("call_service")
            question = next(each for each in call if each["service"] == "/rosapi/action_type")
            for visitor in scripted.server.present:
                await visitor.answer(question, {"type": TYPE})
    assert "was stopped before the goal was sent" in said[0]
    assert scripted.goals == []
