"""Drives to rooms and frontiers end facing walls that no picture has shown."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import anyio
import pytest
from mcp.client import Client

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalState
from mapspeak.spatial import OccupancyGrid
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

CORRIDOR = grid_from_text(
    """
    ########################################
    #......................................#
    #......................................#
    #......................................#
    #......................................#
    #......................................#
    ########################################
    """,
    resolution_m=0.25,
)


CELL_BEFORE_UNKNOWN = grid_from_text(
    """
    #########???????????
    #.......#???????????
    #.......#...????????
    #.......#....???????
    #............???????
    #............???????
    #.......#....???????
    #.......#...????????
    #.......#???????????
    #########???????????
    """,
    resolution_m=0.25,
)


LEG_S = 0.5


async def drive(client: Client, **arguments: str | float) -> dict[str, Any]:
    return report_of(await client.call_tool("navigate_to", arguments))


async def test_a_second_drive_to_a_place_faces_what_the_first_picture_left_out(
    tmp_path: Path,
) -> None:
    async with connect(FakeRobot(CORRIDOR), tmp_path) as client:
        first = await drive(client, place="C1")
        await client.call_tool("look_through_camera", {})
        second = await drive(client, place="C1")
    apart_deg = abs(second["robot"]["yaw_deg"] - first["robot"]["yaw_deg"]) % 360
    assert min(apart_deg, 360 - apart_deg) >= 60


async def test_a_drive_to_a_room_faces_into_it_and_not_out_of_its_door(tmp_path: Path) -> None:
    robot = FakeRobot(CELL_BEFORE_UNKNOWN, pose=Pose(1.0, 1.25, 0.0))
    async with connect(robot, tmp_path) as client:
        await client.call_tool("look_around", {})
        arrived = await drive(client, place="R1")
    assert abs(arrived["robot"]["yaw_deg"]) >= 60


async def test_a_heading_that_is_asked_for_is_kept(tmp_path: Path) -> None:
    async with connect(FakeRobot(CORRIDOR), tmp_path) as client:
        for _ in range(2):
            arrived = await drive(client, place="C1", yaw_deg=45)
            await client.call_tool("look_through_camera", {})
            assert arrived["robot"]["yaw_deg"] == pytest.approx(45)


async def test_a_drive_to_coordinates_is_not_turned_on_arrival(tmp_path: Path) -> None:
    robot = FakeRobot(CORRIDOR)
    async with connect(robot, tmp_path) as client:
        await drive(client, x=3.0, y=1.0)
        await client.call_tool("look_through_camera", {})
        await drive(client, x=4.0, y=1.0)
    assert len(robot.goals) == 2


async def test_a_robot_that_maps_more_on_the_way_turns_to_it_on_arrival(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        sent = await drive(client, place="R2", wait_s=0)
        robot.end_goal(GoalState.ARRIVED, pose=_backwards(sent))
        told = report_of(await client.call_tool("wait_for_goal", {}))
        again = report_of(await client.call_tool("wait_for_goal", {}))
    assert told["state"] == "arrived"
    assert told["goal_id"] == sent["goal_id"]
    assert [again[each] for each in ("goal_id", "place")] == [sent["goal_id"], sent["place"]]
    assert (again["state"], again["goal"]) == ("arrived", None)
    assert math.degrees(robot.goals["fake-2"].yaw_rad) == pytest.approx(
        told["robot"]["yaw_deg"], abs=1
    )
    assert len(robot.goals) == 2


async def test_who_only_asks_how_a_drive_stands_moves_nothing(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        sent = await drive(client, place="R2", wait_s=0)
        robot.end_goal(GoalState.ARRIVED, pose=_backwards(sent))
        await client.call_tool("wait_for_goal", {"wait_s": 0})
    assert len(robot.goals) == 1


async def test_a_goal_that_proves_too_tight_is_moved_to_where_the_robot_fits(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(CORRIDOR)
    async with connect(robot, tmp_path) as client:
        sent = await drive(client, place="C1", wait_s=0)
        await robot.sleep(LEG_S)
        robot.grid = _with_post_at_goal(sent)
        robot.end_goal(GoalState.BLOCKED)
        told = report_of(await client.call_tool("wait_for_goal", {}))
        again = report_of(await client.call_tool("wait_for_goal", {"goal_id": sent["goal_id"]}))
    for each in (told, again):
        assert (each["goal_id"], each["state"]) == (sent["goal_id"], "arrived")
        assert each["elapsed_s"] >= LEG_S
    assert told["place"] == "C1"
    at = told["robot"]["x"], told["robot"]["y"]
    assert 0.2 <= math.dist(at, _point(sent)) <= 1.0


async def test_a_drive_that_is_blocked_though_the_goal_is_roomy_stays_blocked(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(CORRIDOR)
    async with connect(robot, tmp_path) as client:
        await drive(client, place="C1", wait_s=0)
        robot.end_goal(GoalState.BLOCKED)
        told = report_of(await client.call_tool("wait_for_goal", {}))
    assert told["state"] == "blocked"
    assert len(robot.goals) == 1


async def test_a_robot_that_was_stopped_after_it_arrived_is_not_turned(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        sent = await drive(client, place="R2", wait_s=0)
        robot.end_goal(GoalState.ARRIVED, pose=_backwards(sent))
        await client.call_tool("stop_robot", {})
        await client.call_tool("wait_for_goal", {})
    assert len(robot.goals) == 1


async def test_a_stop_during_the_turn_on_arrival_ends_it(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        sent = await drive(client, place="R2", wait_s=0)
        robot.end_goal(GoalState.ARRIVED, pose=_backwards(sent))
        robot.map_was_asked_for, robot.may_give_map = anyio.Event(), anyio.Event()
        async with anyio.create_task_group() as tasks:

            async def stop_when_asked_for_the_map() -> None:
                await robot.map_was_asked_for.wait()
                await client.call_tool("stop_robot", {})
                robot.may_give_map.set()

            tasks.start_soon(stop_when_asked_for_the_map)
            told = report_of(await client.call_tool("wait_for_goal", {}))
    assert told["state"] == "arrived"
    assert len(robot.goals) == 1


@pytest.mark.parametrize(
    ("tool", "arguments"), [("look_around", {"n_pictures": 2}), ("turn", {"by_deg": 90})]
)
async def test_turning_while_a_drive_runs_stops_first_and_says_what_it_ended(
    tmp_path: Path, tool: str, arguments: dict[str, int]
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=("drive",)) as client:
        sent = await drive(client, x=6.0, y=1.5, wait_s=0)
        answer = await client.call_tool(tool, arguments)
        told = report_of(await client.call_tool("wait_for_goal", {"goal_id": "G1"}))
    assert sent["state"] in ("accepted", "driving")
    assert "G1 to (6.00, 1.50) was ended first" in text_of(answer)
    assert told["state"] == "cancelled"


def _point(report: dict[str, Any]) -> tuple[float, float]:
    return report["goal"]["x"], report["goal"]["y"]


def _backwards(sent: dict[str, Any]) -> Pose:
    return Pose(*_point(sent), yaw_rad=math.radians(sent["goal"]["yaw_deg"]) + math.pi)


def _with_post_at_goal(sent: dict[str, Any]) -> OccupancyGrid:
    cells = CORRIDOR.cells.copy()
    cell = CORRIDOR.cell_at(Point(*_point(sent)))
    cells[cell.row, cell.col] = 100
    return replace(CORRIDOR, cells=cells)
