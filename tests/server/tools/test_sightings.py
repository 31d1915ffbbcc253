"""What the laser met becomes part of a record; a robot without one, or a slow one, is as before."""

import math
from pathlib import Path

import anyio
import pytest
from mcp.client import Client

from fakes import START, FakeRobot, scan_of, two_rooms
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.memory import LaserFan, SemanticMapStore, Waypoint
from mapspeak.robot import RangeScan, RobotDescription
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

AHEAD_M = 5.75
"""From where the robot starts, through the door, to the wall behind the other room."""


def robot_with_laser() -> FakeRobot:
    robot = FakeRobot(two_rooms())
    robot.scan = scan_of(two_rooms(), START)
    return robot


async def write(client: Client, *things: object, **more: object) -> None:
    record = {"name": "west", "description": "A room.", "functional_landmarks": list(things)}
    report_of(await client.call_tool("write_semantic_data", {**record, **more}))


async def look(client: Client) -> str:
    return text_of(await client.call_tool("look_through_camera", {}))


def stored(folder: Path) -> Waypoint:
    (place,) = SemanticMapStore(folder / "semantic_map.yaml").read().waypoints
    return place


def met_at(fan: LaserFan | None, bearing_deg: float) -> float | None:
    assert fan is not None
    number = round((math.radians(bearing_deg) - fan.first_rad) / fan.step_rad)
    return fan.ranges_m[number]


async def test_what_the_laser_met_when_the_picture_was_taken_goes_with_its_columns(
    tmp_path: Path,
) -> None:
    robot = robot_with_laser()
    async with connect(robot, tmp_path) as client:
        await look(client)
        robot.pose = Pose(2.4, 1.2, 2.0)
        robot.scan = scan_of(two_rooms(), robot.pose)
        await write(client, {"label": "sink", "image_column_px": 32}, "rack")
    sink, rack = stored(tmp_path).landmarks
    assert met_at(sink.laser, 0.0) == pytest.approx(AHEAD_M, abs=0.1)
    assert rack.laser is None


async def test_a_direction_told_without_a_picture_is_met_by_the_laser_of_now(
    tmp_path: Path,
) -> None:
    async with connect(robot_with_laser(), tmp_path) as client:
        await write(client, {"label": "sink", "bearing_deg": 10})
    (sink,) = stored(tmp_path).landmarks
    assert met_at(sink.laser, 0.0) == pytest.approx(AHEAD_M, abs=0.1)
    assert sink.laser is not None
    assert math.degrees(sink.laser.first_rad) == pytest.approx(-12.0)


async def test_a_place_noted_with_another_heading_has_the_same_walls_around_it(
    tmp_path: Path,
) -> None:
    async with connect(robot_with_laser(), tmp_path) as client:
        await write(client, {"label": "sink", "bearing_deg": -90}, yaw_deg=90)
    (sink,) = stored(tmp_path).landmarks
    assert met_at(sink.laser, -90.0) == pytest.approx(AHEAD_M, abs=0.1)


async def test_a_place_that_the_robot_is_not_at_has_nothing_of_its_laser(tmp_path: Path) -> None:
    async with connect(robot_with_laser(), tmp_path) as client:
        await write(client, {"label": "sink", "bearing_deg": 10}, x=5.0, y=1.4)
    (sink,) = stored(tmp_path).landmarks
    assert sink.laser is None


async def test_a_scan_from_elsewhere_is_no_evidence_of_what_was_seen_here(tmp_path: Path) -> None:
    robot = robot_with_laser()
    robot.scan = scan_of(two_rooms(), Pose(2.2, 1.4, 0.0))
    async with connect(robot, tmp_path) as client:
        await look(client)
        await write(client, {"label": "sink", "bearing_deg": 10})
    (sink,) = stored(tmp_path).landmarks
    assert sink.laser is None


class StuckLaser(FakeRobot):
    """A robot that says it has a laser, which never answers."""

    @property
    def description(self) -> RobotDescription:
        bare = super().description
        return RobotDescription(
            name=bare.name,
            radius_m=bare.radius_m,
            map_name=bare.map_name,
            cameras=("front",),
            has_laser=True,
            detector=None,
        )

    async def fetch_scan(self) -> RangeScan | None:
        await anyio.sleep_forever()
        raise AssertionError


class LostLaser(StuckLaser):
    """One whose link is lost just then."""

    async def fetch_scan(self) -> RangeScan | None:
        raise LinkError("The connection was lost.", hint="Wait.")


@pytest.mark.parametrize("robot_of", [FakeRobot, StuckLaser, LostLaser])
async def test_without_a_laser_that_answers_pictures_and_writes_are_as_before(
    tmp_path: Path, robot_of: type[FakeRobot]
) -> None:
    async with connect(robot_of(two_rooms()), tmp_path) as client:
        assert "Picture P1" in await look(client)
        await write(client, {"label": "sink", "bearing_deg": 10})
    (sink,) = stored(tmp_path).landmarks
    assert math.degrees(sink.bearing_rad or 0.0) == pytest.approx(10.0)
    assert sink.laser is None


async def test_a_model_is_not_read_the_beams(tmp_path: Path) -> None:
    async with connect(robot_with_laser(), tmp_path) as client:
        await write(client, {"label": "sink", "bearing_deg": 10})
        recalled = await client.call_tool("get_semantic_data", {})
    assert "laser" not in text_of(recalled)
