"""Looking at a place: a drive to where it is in view, a picture, and what should be in it."""

import math
import re
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from mcp.client import Client

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.robot import Detection, GoalState
from served import connect, pictures_of, report_of, text_of

pytestmark = pytest.mark.anyio

SIGN = Point(7.4, 1.4)
"""At the east wall of the east room."""
WITH_SCREEN = grid_from_text(
    """
    ##############################
    #............................#
    #............................#
    #.............##.............#
    #.............##.............#
    #.............##.............#
    #.............##.............#
    #............................#
    #............................#
    #............................#
    ##############################
    """,
    resolution_m=0.25,
)


def off_rad(robot: FakeRobot, target: Point) -> float:
    return abs(wrap_angle(robot.pose.point.bearing_to(target) - robot.pose.yaw_rad))


def columns(told: str) -> dict[str, tuple[int, float]]:
    found = re.findall(r"^- (\w+)\b.*at column (-?\d+), ([\d.]+) m away", told, re.MULTILINE)
    return {name: (int(column), float(away)) for name, column, away in found}


async def test_a_door_is_looked_at_from_some_way_off_and_straight_on(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        result = await client.call_tool("look_at", {"place": "D1"})
    told = text_of(result)
    assert "D1 is in view." in told
    (column, away_m) = columns(told)["D1"]
    assert abs(column - 32) <= 12
    assert 1.0 <= away_m <= 4.0
    assert len(pictures_of(result)) == 1


async def test_of_a_room_most_of_its_floor_is_in_view(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        told = text_of(await client.call_tool("look_at", {"place": "R2"}))
    (percent,) = re.findall(r"(\d+)% of the floor of R2 is in view", told)
    assert int(percent) >= 60


async def test_a_point_behind_a_screen_is_looked_at_from_where_it_is_in_view(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(WITH_SCREEN, pose=Pose(2.5, 1.4))
    async with connect(robot, tmp_path) as client:
        told = text_of(await client.call_tool("look_at", {"place": "4.3, 1.3"}))
    assert "The point is in view." in told
    assert robot.pose.x > 4.0 or robot.pose.y < 1.0
    assert off_rad(robot, Point(4.3, 1.3)) < math.radians(5)


async def note_fridge(client: Client) -> None:
    await client.call_tool("look_through_camera", {})
    noted = {
        "name": "by the wall",
        "description": "a corner",
        "functional_landmarks": [{"label": "fridge", "bearing_deg": 60, "range_m": 1.0}],
    }
    assert not (await client.call_tool("write_semantic_data", noted)).is_error


async def test_a_remembered_thing_is_faced_and_its_column_is_told(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        await note_fridge(client)
        told = text_of(await client.call_tool("look_at", {"place": "fridge"}))
    assert "All of where T1 may be is in view." in told
    assert 10 <= columns(told)["T1"][0] <= 54
    assert "write_semantic_data notes it from this picture" in told


async def test_who_has_driven_to_a_thing_is_told_how_to_check_it(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        await note_fridge(client)
        arrived = report_of(await client.call_tool("navigate_to", {"place": "fridge"}))
    assert "look_at tells whether the thing is in view" in arrived["next_step"]


async def test_who_asks_again_from_where_the_robot_stands_gets_the_picture_without_a_drive(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        for _ in range(2):
            result = await client.call_tool("look_at", {"place": "R2"})
            assert len(pictures_of(result)) == 1
    assert len(robot.goals) == 1


async def test_a_thing_in_view_from_near_is_looked_at_from_where_the_robot_stands(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        await note_fridge(client)
        await client.call_tool("navigate_to", {"place": "T1"})
        beside = robot.pose.transform(Point(-0.1, 0.3))
        robot.pose = Pose(beside.x, beside.y, robot.pose.yaw_rad - 0.2)
        before, n_goals = robot.pose, len(robot.goals)
        told = text_of(await client.call_tool("look_at", {"place": "T1"}))
    assert robot.pose == before
    assert len(robot.goals) == n_goals
    assert "T1" in columns(told)


@asynccontextmanager
async def seeing_a_sign(folder: Path, seen_m: float) -> AsyncGenerator[tuple[FakeRobot, Client]]:
    """A robot that noted a sign at the east wall from so far, and its client."""
    robot = FakeRobot(two_rooms(), pose=Pose(SIGN.x - seen_m, SIGN.y))
    async with connect(robot, folder) as client:
        await client.call_tool("look_through_camera", {})
        sign = {"label": "exit sign", "bearing_deg": 0, "range_m": seen_m}
        noted = {"name": "w", "description": "a wall", "safety_landmarks": [sign]}
        await client.call_tool("write_semantic_data", noted)
        yield robot, client


@pytest.mark.parametrize(("seen_m", "least_m", "most_m"), [(1.0, 0.7, 1.5), (3.5, 1.5, 2.5)])
async def test_a_thing_is_not_looked_at_from_much_nearer_than_it_was_seen(
    tmp_path: Path, seen_m: float, least_m: float, most_m: float
) -> None:
    async with seeing_a_sign(tmp_path, seen_m) as (robot, client):
        await client.call_tool("look_at", {"place": "exit sign"})
    assert least_m <= SIGN.distance_to(robot.pose.point) <= most_m


async def test_what_no_picture_from_before_it_shows_is_looked_at_again_from_farther(
    tmp_path: Path,
) -> None:
    async with seeing_a_sign(tmp_path, 2.2) as (robot, client):
        await client.call_tool("navigate_to", {"place": "exit sign"})
        arrived = robot.pose
        robot.detections = (
            Detection(label="tap", bearing_rad=0.0, range_m=0.5, confidence_ratio=0.9),
        )
        first = text_of(await client.call_tool("look_at", {"place": "exit sign"}))
        assert robot.pose == arrived
        await client.call_tool("look_at", {"place": "exit sign"})
    assert "look_at again looks from farther off" in first
    assert 1.5 <= SIGN.distance_to(robot.pose.point) <= 2.5


async def test_what_the_latest_picture_from_before_it_shows_is_looked_at_from_there(
    tmp_path: Path,
) -> None:
    def detect(label: str) -> tuple[Detection, ...]:
        return (Detection(label=label, bearing_rad=0.0, range_m=1.0, confidence_ratio=0.9),)

    async with seeing_a_sign(tmp_path, 2.2) as (robot, client):
        await client.call_tool("navigate_to", {"place": "exit sign"})
        arrived = robot.pose
        for label in ("tap", "exit sign"):
            robot.detections = detect(label)
            await client.call_tool("look_through_camera", {})
        await client.call_tool("look_at", {"place": "exit sign"})
    assert robot.pose == arrived


async def test_a_drive_that_takes_longer_is_waited_for_by_asking_again(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        result = await client.call_tool("look_at", {"place": "R2", "wait_s": 0.5})
        assert "No picture yet: G1 to a view of R2 is driving" in text_of(result)
        assert not pictures_of(result)
        result = await client.call_tool("look_at", {"place": "R2"})
    assert len(pictures_of(result)) == 1


async def test_who_waits_for_a_view_is_told_how_far_it_is_and_how_long_it_takes(
    tmp_path: Path,
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        told = text_of(await client.call_tool("look_at", {"place": "R1", "wait_s": 1.0}))
    ((left_m, left_s),) = re.findall(r"driving, ([\d.]+) m left, about (\d+) s at its pace", told)
    assert float(left_m) > 0.3
    assert int(left_s) == pytest.approx(float(left_m), abs=1.0)


async def test_a_drive_that_ends_blocked_gives_no_picture_and_says_why(tmp_path: Path) -> None:
    class Blocked(FakeRobot):
        async def send_goal(self, goal: Pose) -> str:
            goal_id = await super().send_goal(goal)
            self.end_goal(GoalState.BLOCKED)
            return goal_id

    async with connect(Blocked(two_rooms()), tmp_path) as client:
        result = await client.call_tool("look_at", {"place": "R2"})
    assert "G1 to a view of R2 is blocked" in text_of(result)
    assert not pictures_of(result)


async def test_a_place_that_nobody_knows_is_an_error(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        result = await client.call_tool("look_at", {"place": "R77"})
    assert result.is_error
    assert "There is no place called 'R77'" in text_of(result)


async def test_a_thing_on_the_other_side_of_a_wall_is_not_in_view(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms(), pose=Pose(4.6, 2.2, math.pi))
    async with connect(robot, tmp_path) as client:
        await client.call_tool("look_through_camera", {})
        noted = {
            "name": "in R2",
            "description": "its wall",
            "functional_landmarks": [{"label": "fridge", "bearing_deg": 0, "range_m": 0.9}],
        }
        assert not (await client.call_tool("write_semantic_data", noted)).is_error
        robot.pose = Pose(0.6, 2.2, 0.0)
        told = text_of(await client.call_tool("look_at", {"place": "2.6, 2.2"}))
    assert "The point is in view." in told
    assert "T1" not in columns(told)
