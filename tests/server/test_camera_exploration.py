"""Exploring for the camera: until pictures show all walls, not until the map alone is complete."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from mapspeak.geometry import Pose
from mapspeak.robot import Detection, GoalState
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("look", "drive", "explore")
MOST_CALLS = 40
FRIDGE_X_M = 5.0
FRIDGE = Detection(label="fridge", confidence_ratio=0.9, bearing_rad=0.0, range_m=2.0)


async def explore(client: Client, **arguments: str) -> dict[str, Any]:
    for _ in range(MOST_CALLS):
        report = report_of(await client.call_tool("explore", arguments))
        if report["state"] not in ("driving", "at_goal"):
            return report
    raise AssertionError("the exploration does not end")


async def test_with_a_whole_map_the_camera_still_has_all_walls_to_see(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        for_map = await explore(client)
        assert for_map["state"] == "nothing_left"
        assert not robot.goals
        report = await explore(client, cover="camera")
    assert report["state"] == "nothing_left"
    assert report["walls_pictured_percent"] >= 95
    assert any(goal.x > 3.5 for goal in robot.goals.values())


async def test_what_pictures_show_already_is_not_driven_to_again(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await explore(client, cover="camera")
        n_goals = len(robot.goals)
        report = await explore(client, cover="camera")
    assert report["state"] == "nothing_left"
    assert len(robot.goals) == n_goals


async def test_an_exploration_of_the_map_says_nothing_of_pictures(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        report = await explore(client)
    assert report["walls_pictured_percent"] is None


async def test_places_that_cannot_be_driven_to_end_it_and_are_not_tried_for_ever(
    tmp_path: Path,
) -> None:
    class Blocked(FakeRobot):
        async def send_goal(self, goal: Pose) -> str:
            goal_id = await super().send_goal(goal)
            self.end_goal(GoalState.BLOCKED)
            return goal_id

    robot = Blocked(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        report = await explore(client, cover="camera")
    assert report["n_blocked"] >= 1
    assert any("Nothing is left there" in each for each in report["cannot_reach"])
    assert f"Pictures show {report['walls_pictured_percent']:.1f}% of the walls" in report["reason"]
    assert report["walls_pictured_percent"] < 95


async def test_what_the_detector_reports_on_the_way_alone_is_told_once(tmp_path: Path) -> None:
    class Passing(FakeRobot):
        """Its detector sees a fridge while the robot drives to the other room, and no more."""

        async def fetch_detections(self) -> tuple[Detection, ...]:
            is_passing = 1.6 < self.pose.x < 4.4
            return (replace(FRIDGE, range_m=FRIDGE_X_M - self.pose.x),) if is_passing else ()

    robot = Passing(two_rooms())
    robot.detections = (FRIDGE,)
    told: list[str] = []
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        state = "driving"
        while state in ("driving", "at_goal"):
            arguments = {"cover": "camera", "stops_at_goals": True}
            answer = await client.call_tool("explore", arguments)
            assert "fridge" not in "".join(text_of(answer).partition("Picture ")[1:])
            report = report_of(answer)
            state, told = report["state"], [*told, *report["on_the_way"]]
    (line,) = told
    assert re.fullmatch(r"P\d+ at x [23].\d+, y 1.\d+, yaw -?0 deg: fridge, \+0 deg, \d.\d m", line)


async def test_a_robot_without_a_camera_is_told_so(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms(), has_camera=False)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("explore", {"cover": "camera"})
    assert result.is_error
    assert "no camera" in text_of(result)
