"""What is gone is forgotten wherever it was noted, and can be remembered again."""

import math
from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio
TOOLSETS = ("look", "places", "memory", "paper")
STANDS = (Pose(1.0, 1.0, 0.6), Pose(1.4, 0.8, 1.0), Pose(0.8, 1.6, 0.2))
BIN_X, BIN_Y = 2.2, 2.0


async def note_bin(client: Client, robot: FakeRobot) -> None:
    """Notes one trash bin from three places, under three names."""
    for number, stand in enumerate(STANDS):
        robot.pose = stand
        off_rad = math.atan2(BIN_Y - stand.y, BIN_X - stand.x) - stand.yaw_rad
        seen = {"label": "trash bin", "bearing_deg": math.degrees(off_rad)}
        await client.call_tool(
            "write_semantic_data",
            {
                "name": f"stand {number}",
                "description": "A room.",
                "functional_landmarks": [
                    {**seen, "range_m": math.hypot(BIN_X - stand.x, BIN_Y - stand.y)}
                ],
            },
        )


async def find(client: Client, words: str) -> dict[str, Any]:
    return report_of(await client.call_tool("find_place", {"query": words}))


async def test_what_is_gone_is_so_in_every_record_that_names_it(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await note_bin(client, robot)
        before = await find(client, "trash bin")
        robot.pose = Pose(1.2, 1.2, 0.8)
        written = report_of(
            await client.call_tool(
                "write_semantic_data",
                {"name": "look", "description": "An empty corner.", "gone": ["trash bin"]},
            )
        )
        after = await find(client, "trash bin")
    assert before["verdict"] in ("found", "likely")
    assert "is forgotten, as noted at stand 0, stand 1, stand 2 too" in str(written["warnings"])
    assert after["verdict"] == "not_remembered"


async def test_a_place_stays_where_it_is_when_only_what_is_gone_is_told_of_it(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await note_bin(client, robot)
        robot.pose = Pose(3.4, 2.4, -2.5)
        gone = {"name": "stand 0", "description": "A room.", "gone": ["trash bin"]}
        await client.call_tool("write_semantic_data", gone)
    pose = SemanticMapStore(tmp_path / "semantic_map.yaml").read().waypoints[0].pose
    assert (pose.x, pose.y) == pytest.approx((STANDS[0].x, STANDS[0].y), abs=0.01)


async def test_what_is_forgotten_is_remembered_again_when_that_is_undone(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await note_bin(client, robot)
        told = text_of(await client.call_tool("forget", {"what": "T1"}))
        gone = await find(client, "trash bin")
        undone = text_of(await client.call_tool("forget", {"what": "trash bin", "undo": True}))
        back = await find(client, "trash bin")
    assert told.startswith('Forgotten: 3 views of it, noted at "stand 0", "stand 1", "stand 2".')
    assert gone["verdict"] == "not_remembered"
    assert undone.startswith("Remembered again: 3 views of it")
    assert back["verdict"] in ("found", "likely")


async def test_a_place_is_forgotten_as_a_whole_and_stays_in_the_file(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await note_bin(client, robot)
        told = text_of(await client.call_tool("forget", {"what": "stand 1"}))
        left = report_of(await client.call_tool("get_semantic_data", {}))
        await client.call_tool("forget", {"what": "stand 1", "undo": True})
        back = report_of(await client.call_tool("get_semantic_data", {}))
        nothing = await client.call_tool("forget", {"what": "unicorn"})
    kept = SemanticMapStore(tmp_path / "semantic_map.yaml").read().waypoints
    assert told.startswith('Forgotten: the place "stand 1".')
    assert [each["name"] for each in left["waypoints"]] == ["stand 0", "stand 2"]
    assert len(back["waypoints"]) == len(kept) == 3
    assert nothing.is_error


async def test_what_is_seen_again_is_there_again(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await note_bin(client, robot)
        await client.call_tool("forget", {"what": "T1"})
        await note_bin(client, robot)
        found = await find(client, "trash bin")
    assert found["verdict"] in ("found", "likely")


async def test_gone_that_may_mean_several_things_asks_for_an_id(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await note_bin(client, robot)
        robot.pose = Pose(1.0, 1.0, 0.0)
        other = {"label": "trash bin", "bearing_deg": -60.0, "range_m": 0.8}
        second = {"name": "a", "description": "b", "functional_landmarks": [other]}
        await client.call_tool("write_semantic_data", second)
        wanted = {"name": "b", "description": "c", "gone": ["trash bin", "fridge"]}
        written = report_of(await client.call_tool("write_semantic_data", wanted))
    first, other_told = written["warnings"]
    assert first == '"trash bin" may be T1, T2: forget takes the id.'
    assert other_told == 'Nothing near by is remembered as "fridge".'
