"""What the drive tools tell while rosbridge is away, navigation hangs, or speaks too late."""

import json
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import anyio
import pytest
from mcp.client import Client

from faulty import Faults
from faulty_bridge import NEXT_ROOM, FaultyBridge, open_faulty_bridge
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect
from mapspeak.server.app import build_server
from mapspeak.session import Session
from rosbridge_script import PATIENCE_S
from rosserved import Caller

pytestmark = pytest.mark.anyio

RATE = 5.0
STILL_M = 0.2
QUICK = Patience(
    first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0, answer_s=0.5
)
SHORT = replace(QUICK, acceptance_s=0.5, end_s=2.0, settling_s=0.0)
LONG = replace(QUICK, acceptance_s=PATIENCE_S, end_s=0.5, settling_s=0.0)
BOTH = pytest.mark.parametrize("dialect", list(Dialect))


@asynccontextmanager
async def driving(
    folder: Path,
    dialect: Dialect,
    *,
    patience: Patience = LONG,
    faults: Faults,
    speed_mps: float = 0.5,
) -> AsyncGenerator[tuple[FaultyBridge, Caller]]:
    with anyio.fail_after(2 * PATIENCE_S):
        async with (
            open_faulty_bridge(dialect, rate=RATE, faults=faults, speed_mps=speed_mps) as bridge,
            open_rosbridge_robot(bridge.url, patience=patience) as robot,
        ):
            session = Session(
                robot,
                SemanticMapStore(folder / "map.yaml"),
                lease_s=60.0,
                ros=robot.connection,
                find_model=lambda: None,
            )
            async with Client(build_server(session, toolsets=("drive",))) as client:
                caller = Caller(client)
                await caller.ask("navigate_to", x=NEXT_ROOM.x, y=NEXT_ROOM.y, wait_s=0)
                yield bridge, caller


async def until(is_so: Callable[[], bool]) -> None:
    while not is_so():  # noqa: ASYNC110 - the robot tells nobody
        await anyio.sleep(0.01)


@BOTH
async def test_waiting_for_a_drive_while_rosbridge_is_away_answers_with_its_goal_id(
    tmp_path: Path, dialect: Dialect
) -> None:
    # So slow that it drives on for longer than feedback may stay away.
    driven = driving(tmp_path, dialect, faults=Faults(), speed_mps=0.1)
    async with driven as (bridge, caller):
        await until(lambda: bridge.robot.base.driven_m > 0.1)
        await caller.ask("wait_for_goal", wait_s=0)
        await bridge.close()
        away = json.loads(await caller.ask("wait_for_goal", wait_s=0.5))
        await bridge.open()
        back = away
        while back["state"] == "driving":
            back = json.loads(await caller.ask("wait_for_goal", wait_s=25))
    assert (away["goal_id"], away["state"]) == ("G1", "driving")
    assert "does not answer" in away["pose_uncertain"]
    assert (back["goal_id"], back["state"]) == ("G1", "arrived")


@BOTH
async def test_navigation_that_hangs_under_a_drive_is_told_as_lost_and_the_robot_stands(
    tmp_path: Path, dialect: Dialect
) -> None:
    async with driving(tmp_path, dialect, faults=Faults(has_watchdog=False)) as (bridge, caller):
        faults = bridge.robot.faults
        await until(lambda: bridge.robot.base.velocity[0] > 0.2)
        await caller.ask("wait_for_goal", wait_s=1)
        faults.hangs = faults.ignores_cancels = True
        faults.feeds_back = False
        told = {"state": "driving"}
        while told["state"] == "driving":
            told = json.loads(await caller.ask("wait_for_goal", wait_s=25))
        await until(lambda: bridge.robot.base.velocity == (0.0, 0.0))
        before_m = bridge.robot.base.driven_m
        await bridge.robot.sleep(3.0)
        after_m = bridge.robot.base.driven_m
    assert told["state"] == "lost"
    assert "no progress" in told["reason"]
    assert after_m - before_m < STILL_M


async def test_feedback_that_pauses_for_a_moment_does_not_end_a_drive(tmp_path: Path) -> None:
    async with driving(tmp_path, Dialect.ROS2, faults=Faults()) as (bridge, caller):
        await until(lambda: bridge.robot.base.driven_m > 0.1)
        await caller.ask("wait_for_goal", wait_s=0)
        bridge.robot.faults.feeds_back = False
        await bridge.robot.sleep(3.0)
        bridge.robot.faults.feeds_back = True
        told = json.loads(await caller.ask("wait_for_goal", wait_s=25))
    assert told["state"] == "arrived"


async def test_that_a_rejected_drive_was_taken_late_is_told_by_waiting_for_it(
    tmp_path: Path,
) -> None:
    faults = Faults(acceptance_s=8.0)
    async with driving(tmp_path, Dialect.ROS1, patience=SHORT, faults=faults) as (bridge, caller):
        before = json.loads(await caller.ask("wait_for_goal", wait_s=0))
        await until(lambda: bool(bridge.robot.cancelled))
        said = ""
        while "cancelled at once" not in said:
            after = json.loads(await caller.ask("wait_for_goal", wait_s=0))
            said = after["reason"]
    assert (before["state"], after["state"]) == ("rejected", "rejected")
    assert "cancelled at once" not in before["reason"]
