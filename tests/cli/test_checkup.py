import math
from dataclasses import replace

import pytest

from alignment_maps import HOUSE, fine
from fakes import START, FakeRobot, scan_of, two_rooms
from mapspeak.cli.checkup import Finding, Health, examine
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import RangeScan
from mapspeak.spatial import OccupancyGrid

pytestmark = pytest.mark.anyio


async def _examine(robot: FakeRobot) -> dict[str, Finding]:
    return {finding.what: finding for finding in await examine(robot)}


async def test_a_robot_that_gives_everything_is_fine() -> None:
    found = await _examine(FakeRobot(two_rooms()))
    assert {each.health for each in found.values()} == {Health.FINE}
    assert found.keys() == {"map", "pose", "place", "picture"}


async def test_a_robot_without_a_map_is_told_what_to_start() -> None:
    found = await _examine(FakeRobot(None))
    assert found["map"].health is Health.MISSING
    assert "SLAM" in found["map"].hint
    assert "place" not in found


async def test_a_robot_without_a_camera_is_not_asked_for_a_picture() -> None:
    assert "picture" not in await _examine(FakeRobot(two_rooms(), has_camera=False))


@pytest.mark.parametrize(
    ("pose", "said"),
    [
        (Pose(3.3, 0.3), "in a wall"),
        (Pose(90.0, 0.0), "off its map"),
    ],
)
async def test_a_robot_that_cannot_be_where_it_believes_is_doubted(pose: Pose, said: str) -> None:
    found = await _examine(FakeRobot(two_rooms(), pose=pose))
    assert found["place"].health is Health.DOUBTFUL
    assert said in found["place"].said
    assert "initial pose" in found["place"].hint


async def test_a_laser_that_meets_what_the_map_has_is_fine() -> None:
    robot = FakeRobot(two_rooms())
    robot.scan = scan_of(two_rooms(), START)
    laser = (await _examine(robot))["laser"]
    assert laser.health is Health.FINE
    assert "100 % of that is on the map" in laser.said


async def test_a_laser_that_meets_what_the_map_has_not_casts_doubt_on_pose_and_mounting() -> None:
    house, here = fine(HOUSE), Pose(8.0, 5.0, 0.0)
    robot = FakeRobot(house, pose=here)
    as_mounted = scan_of(house, here)
    robot.scan = replace(as_mounted, angles_rad=as_mounted.angles_rad + math.radians(60))
    laser = (await _examine(robot))["laser"]
    assert laser.health is Health.DOUBTFUL
    assert "initial pose" in laser.hint
    assert "mounted" in laser.hint


async def test_a_laser_that_gives_no_scan_is_doubted_and_no_more() -> None:
    class SilentRobot(FakeRobot):
        async def fetch_scan(self) -> RangeScan | None:
            return None

    robot = SilentRobot(two_rooms())
    robot.scan = scan_of(two_rooms(), START)
    laser = (await _examine(robot))["laser"]
    assert laser.health is Health.DOUBTFUL
    assert "all else works without" in laser.said


async def test_a_map_that_does_not_come_is_waited_for_once_and_is_not_the_lasers_fault() -> None:
    class MaplessRobot(FakeRobot):
        n_waits = 0

        async def fetch_map(self) -> OccupancyGrid:
            self.n_waits += 1
            raise LinkError("No map has come.", hint="Start SLAM.")

    robot = MaplessRobot(two_rooms())
    robot.scan = scan_of(two_rooms(), START)
    found = await _examine(robot)
    assert robot.n_waits == 1
    assert found["map"].health is Health.MISSING
    assert found["laser"].health is Health.FINE
    assert "no map to compare with" in found["laser"].said


async def test_picture_and_scan_tell_their_age() -> None:
    class LateRobot(FakeRobot):
        @property
        def now_s(self) -> float:
            return super().now_s + 3.0

    robot = LateRobot(two_rooms())
    robot.scan = scan_of(two_rooms(), START)
    found = await _examine(robot)
    assert "3.0 s old" in found["picture"].said
    assert "3.0 s old" in found["laser"].said


async def test_a_pose_that_is_old_is_doubted() -> None:
    class LateRobot(FakeRobot):
        @property
        def now_s(self) -> float:
            return super().now_s + 60.0

    found = await _examine(LateRobot(two_rooms()))
    assert found["pose"].health is Health.DOUBTFUL
    assert "60.0 s old" in found["pose"].said
