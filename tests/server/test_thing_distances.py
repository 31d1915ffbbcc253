"""How far a remembered thing is: its own distance, and that of the pose to look at it from."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from mapspeak.geometry import Point, Pose
from mapspeak.robot import Detection, GoalState
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

FRIDGE = Point(7.4, 1.4)


async def note(client: Client, *seen: object) -> None:
    record = {"name": "kitchenette", "description": "A room.", "functional_landmarks": list(seen)}
    assert not (await client.call_tool("write_semantic_data", record)).is_error


def seeing(label: str, bearings_deg: tuple[float, ...]) -> FakeRobot:
    """A robot whose detector reports things 2 m away in some directions."""
    robot = FakeRobot(two_rooms())
    robot.detections = tuple(
        Detection(label=label, bearing_rad=math.radians(each), range_m=2.0, confidence_ratio=0.6)
        for each in bearings_deg
    )
    return robot


async def note_fridge(client: Client) -> None:
    """Notes it through the door, 5.9 m ahead."""
    await note(client, {"label": "fridge", "bearing_deg": 0, "range_m": FRIDGE.x - 1.5})


async def test_who_arrives_for_a_thing_is_told_how_far_it_is(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        await note_fridge(client)
        arrived = report_of(await client.call_tool("navigate_to", {"place": "T1"}))
        passed = report_of(await client.call_tool("navigate_to", {"place": "R2"}))
    assert arrived["state"] == passed["state"] == "arrived"
    off_m = math.dist((arrived["robot"]["x"], arrived["robot"]["y"]), (FRIDGE.x, FRIDGE.y))
    told_m = float(arrived["reason"].split("T1 is ")[1].split(" m")[0])
    assert told_m == pytest.approx(off_m, abs=0.4)
    assert passed["reason"] == ""


async def test_a_thing_is_measured_to_itself_and_its_way_to_where_one_looks(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        await note_fridge(client)
        await client.call_tool("navigate_to", {"place": "T1"})
        off_m = math.dist((robot.pose.x, robot.pose.y), (FRIDGE.x, FRIDGE.y))
        text = text_of(await client.call_tool("measure", {"places": ["T1", "R2"]}))
        described = text_of(await client.call_tool("describe_place", {"place": "T1"}))
        checked = report_of(await client.call_tool("check_goal", {"place": "T1"}))
    rows = [line.split(" | ") for line in text.splitlines()]
    _, _, path_m, straight_m, *_ = next(row for row in rows if row[0] == "T1")
    assert float(path_m) < 0.3
    assert float(straight_m) == pytest.approx(off_m, abs=0.4)
    assert f"From the robot: {straight_m} m straight, ahead" in described
    assert f"T1 is {straight_m} m from the robot" in checked["reason"]


async def test_a_thing_noted_without_a_direction_is_nowhere_and_is_to_be_looked_for(
    tmp_path: Path,
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        await note(client, "fridge")
        arrived = report_of(await client.call_tool("navigate_to", {"place": "fridge"}))
        text = text_of(await client.call_tool("measure", {"places": ["T1"]}))
        described = text_of(await client.call_tool("describe_place", {"place": "T1"}))
    assert "nobody noted where T1 is" in arrived["reason"]
    assert "look_around" in arrived["next_step"]
    (row,) = (line.split(" | ") for line in text.splitlines() if line.startswith("T1 | "))
    assert row[3] == "-"
    assert "stands there" not in described
    assert "where it was seen from" in described


async def test_what_the_detector_reported_in_the_same_look_places_a_label(tmp_path: Path) -> None:
    robot = seeing("fridge", (-15.0,))
    async with connect(robot, tmp_path) as client:
        await client.call_tool("look_through_camera", {})
        await note(client, "fridge")
        described = text_of(await client.call_tool("describe_place", {"place": "T1"}))
    told_m = float(described.split("From the robot: ")[1].split(" m straight")[0])
    assert told_m == pytest.approx(2.0, abs=0.3)


async def test_a_point_names_the_things_near_it(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        await note_fridge(client)
        near = text_of(await client.call_tool("describe_place", {"place": "6.0, 1.4"}))
        far = text_of(await client.call_tool("describe_place", {"place": "0.6, 1.4"}))
    assert 'T1 "fridge" at' in near
    assert "T1" not in far
    assert "W1 at" in far


async def test_of_two_alike_in_a_picture_a_label_means_neither(tmp_path: Path) -> None:
    robot = seeing("chair", (10.0, -10.0))
    async with connect(robot, tmp_path) as client:
        await client.call_tool("look_through_camera", {})
        await note(client, "chair")
        described = text_of(await client.call_tool("describe_place", {"place": "T1"}))
    assert "was not noted" in described


async def test_a_route_tells_from_how_far_its_things_are_seen(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=("routes", "drive", "paper")) as client:
        await note_fridge(client)
        stop = {"stops": ["T1", "R1"], "look": True}
        at = report_of(await client.call_tool("follow_route", stop))
        drive = report_of(await client.call_tool("wait_for_goal", {}))
    off_m = math.dist((at["robot"]["x"], at["robot"]["y"]), (FRIDGE.x, FRIDGE.y))
    assert at["state"] == "at_stop"
    for told in (at["reason"].split("T1 is ")[1], drive["reason"].split("T1 is ")[1]):
        assert float(told.split(" m")[0]) == pytest.approx(off_m, abs=0.4)
    (done,) = at["done"]
    assert float(done.split("from ")[1].split(" m")[0]) == pytest.approx(off_m, abs=0.4)
    assert "from" not in at["next"]


async def test_a_mission_tells_how_far_the_thing_is_that_it_drove_to(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=("drive", "missions", "paper")) as client:
        await note_fridge(client)
        tree = "- {drive: T1, as: there}\n- {drive: R1}"
        ran = text_of(await client.call_tool("run_mission", {"tree": tree, "wait_s": 25}))
    there, back = (line for line in ran.splitlines() if " drive: " in line)
    assert float(there.split("away_m=")[1].split(",")[0]) > 0.3
    assert "away_m" not in back


async def test_a_look_that_does_not_show_the_thing_tells_how_far_it_is(tmp_path: Path) -> None:
    class TurnsAway(FakeRobot):
        async def send_goal(self, goal: Pose) -> str:
            goal_id = await super().send_goal(goal)
            self.end_goal(GoalState.ARRIVED, pose=replace(goal, yaw_rad=goal.yaw_rad + math.pi))
            return goal_id

    robot = TurnsAway(two_rooms())
    async with connect(robot, tmp_path) as client:
        await note_fridge(client)
        told = text_of(await client.call_tool("look_at", {"place": "T1"}))
    off_m = math.dist((robot.pose.x, robot.pose.y), (FRIDGE.x, FRIDGE.y))
    assert "- T1" not in told
    assert float(told.split("T1 is ")[1].split(" m")[0]) == pytest.approx(off_m, abs=0.4)
