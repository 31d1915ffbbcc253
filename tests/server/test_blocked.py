"""The one answer to "is anything blocked?"."""

from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from mcp.client import Client

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from guarding import MONDAY_NOON, make_guard
from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, GoalStatus
from mapspeak.spatial import OccupancyGrid
from served import connect, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("places", "drive", "paper", "memory")
NARROW = """
##############################
#............#...............#
#............#...............#
#............#...............#
#............................#
#............................#
#............#...............#
#............#...............#
##############################
"""


async def _blocked(client: Client) -> str:
    return text_of(await client.call_tool("what_is_blocked", {}))


async def test_where_nothing_is_in_the_way_it_is_said(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        assert (await _blocked(client)).startswith("Nothing is known to be blocked")


async def test_a_border_with_too_little_to_see_is_not_told(tmp_path: Path) -> None:
    cells = np.zeros((100, 100), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = cells[40:60, 80] = 100
    cells[40:60, 81:87] = -1
    robot = FakeRobot(OccupancyGrid(cells=cells, resolution_m=0.05))
    async with connect(robot, tmp_path, toolsets=(*TOOLSETS, "look")) as client:
        seen = text_of(await client.call_tool("look_at_map", {}))
        text = await _blocked(client)
    assert "with little to see" in seen
    assert "not offered" not in text


async def test_a_closure_is_told_with_its_end_and_with_what_it_cuts_off(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=make_guard(tmp_path)) as client:
        far = {"name": "bench", "description": "", "x": 6.0, "y": 1.0}
        await client.call_tool("write_semantic_data", far)
        ends = (MONDAY_NOON + timedelta(hours=1)).isoformat()
        shut = {"text": "painters", "place": "D1", "effect": "closed", "ends": ends}
        assert not (await client.call_tool("note_event", shut)).is_error
        text = await _blocked(client)
    assert "events and closed areas (1), doors without a way (1), rooms without a way (1)" in text
    assert 'E1 "painters" (D1), closed to the robot, until 13:00.' in text
    assert "D1 (R1 R2, 0.69 m wide): closed by event E1 until 13:00." in text
    assert "R1: every known way" in text
    assert 'W1 "bench": every known way' in text


async def test_a_remembered_place_that_the_map_does_not_show_yet_is_not_in_the_way(
    tmp_path: Path,
) -> None:
    grid = two_rooms()
    robot = FakeRobot(grid)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        far = {"name": "attic", "description": "", "x": 6.0, "y": 1.0}
        await client.call_tool("write_semantic_data", far)
        cells = grid.cells.copy()
        cells[:, cells.shape[1] // 2 :] = -1
        robot.grid = OccupancyGrid(cells=cells, resolution_m=grid.resolution_m)
        text = await _blocked(client)
    assert text.startswith("Nothing is known to be blocked")
    assert "remembered place that the map shows. Else: remembered places that the map does" in text
    assert 'W1 "attic": (6.00, 1.00) lies in unexplored space' in text


async def test_a_gap_that_is_too_narrow_is_told(tmp_path: Path) -> None:
    robot = FakeRobot(grid_from_text(NARROW, resolution_m=0.15), pose=Pose(1.0, 0.6))
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        text = await _blocked(client)
    assert "rooms without a way (1)" in text
    assert "no known way as wide as the robot, 0.40 m" in text


async def test_a_drive_that_failed_is_told_until_a_later_one_arrives(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    robot.ended["fake-1"] = GoalStatus(state=GoalState.BLOCKED)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await client.call_tool("navigate_to", {"place": "R1"})
        failed = await _blocked(client)
        await client.call_tool("navigate_to", {"place": "R1"})
        arrived = await _blocked(client)
    assert failed.startswith("Nothing is known to be blocked: the robot gets to every room")
    assert "goals that failed (1)" in failed
    assert "G1 to R1 at " in failed
    assert ": blocked." in failed
    assert "Nothing is known to be blocked" in arrived


async def test_a_drive_to_a_frontier_that_failed_is_told_while_something_unknown_is_left_there(
    tmp_path: Path,
) -> None:
    cells = two_rooms().cells.copy()
    cells[4:7, -1] = -1
    robot = FakeRobot(OccupancyGrid(cells=cells, resolution_m=0.25))
    robot.ended["fake-1"] = GoalStatus(state=GoalState.BLOCKED)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await client.call_tool("navigate_to", {"place": "F1"})
        left = await _blocked(client)
        robot.grid = two_rooms()
        seen = await _blocked(client)
    assert "G1 to F1 at " in left
    assert seen == (
        "Nothing is known to be blocked: the robot gets to every room, door and remembered place."
    )


async def test_a_hold_comes_first(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    guard.hold.put("fire drill", at=MONDAY_NOON)
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        assert (await _blocked(client)).startswith("The robot is held")
