"""The robot's laser over ROS: where it is mounted, how old a scan is, and none at all."""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import anyio
import numpy as np
import pytest

from mapspeak.geometry import Pose
from mapspeak.robot import RangeScan
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.poses import FrameTransform, write_transforms
from mapspeak.ros.messages.scans import LaserScan, write_scan
from mapspeak.ros.robot.sensors import Laser
from rosbridge_robot import ScriptedRobot, connect_scripted, eventually
from rosbridge_script import Operation

pytestmark = pytest.mark.anyio

QUICK = Patience(first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0)
PATIENT = replace(QUICK, settling_s=0.0)
NOW_S = 100.0
"""What the scripted robot answers when it is asked for the time."""
BASE = Pose(1.0, 2.0, 0.5)
FLAT = (0.0, 0.0, 0.0, 1.0)
ROLLED_OVER = (1.0, 0.0, 0.0, 0.0)
PITCHED_OVER = (0.0, 1.0, 0.0, 0.0)
ON_ITS_SIDE = (math.sin(math.pi / 4), 0.0, 0.0, math.cos(math.pi / 4))


def pitched(angle_rad: float) -> tuple[float, float, float, float]:
    return 0.0, math.sin(angle_rad / 2), 0.0, math.cos(angle_rad / 2)


def mounted(
    parent: str, child: str, pose: Pose, rotation: tuple[float, float, float, float] | None = None
) -> FrameTransform:
    return FrameTransform(
        parent_from_child=pose, parent=parent, child=child, stamp_s=0.0, rotation=rotation
    )


ON_THE_MIDDLE = (mounted("base_footprint", "laser", Pose(0.0, 0.0)),)


def scan_message(ranges_m: Mapping[int, float], *, stamp_s: float = NOW_S) -> dict[str, Any]:
    """A scan of one beam to ten degrees, from right behind round: 4 m but for some, by degrees."""
    beams = [ranges_m.get(degrees, 4.0) for degrees in range(-180, 180, 10)]
    scan = LaserScan(
        ranges_m=np.array(beams),
        first_angle_rad=-math.pi,
        angle_step_rad=math.radians(10),
        least_range_m=0.1,
        largest_range_m=12.0,
        frame_id="laser",
        stamp_s=stamp_s,
        met_nothing=np.isinf(beams),
    )
    return write_scan(scan, dialect=Dialect.ROS2)


def scripted_with(
    message: dict[str, Any] | None,
    mounting: tuple[FrameTransform, ...] = ON_THE_MIDDLE,
    *,
    topic: str = "/scan",
) -> ScriptedRobot:
    scripted = ScriptedRobot()
    scripted.topics[topic] = "sensor_msgs/msg/LaserScan"
    scripted.latched["/tf"] = scripted.transforms(BASE)
    scripted.latched["/tf_static"] = write_transforms(mounting, dialect=Dialect.ROS2)
    if message is not None:
        scripted.latched[topic] = message
    return scripted


connected = partial(connect_scripted, patience=PATIENT)


async def fetched(
    message: dict[str, Any], mounting: tuple[FrameTransform, ...] = ON_THE_MIDDLE
) -> RangeScan | None:
    async with connected(scripted_with(message, mounting)) as robot:
        return await robot.fetch_scan()


def nearest(scan: RangeScan | None) -> tuple[float, float]:
    """Gives the direction in degrees and the range of the nearest thing that was met."""
    assert scan is not None
    number = int(np.nanargmin(scan.ranges_m))
    return math.degrees(scan.angles_rad[number]), float(scan.ranges_m[number])


def subscriptions(scripted: ScriptedRobot, topic: str = "/scan") -> list[Operation]:
    return [each for each in scripted.server.asked("subscribe") if each["topic"] == topic]


async def test_a_scan_is_taken_only_when_asked_for_with_the_pose_it_came_at() -> None:
    scripted = scripted_with(scan_message({30: 1.5}))
    async with connected(scripted) as robot:
        assert robot.description.has_laser
        assert subscriptions(scripted) == []
        scan = await robot.fetch_scan()
    (begun,) = subscriptions(scripted)
    assert begun["compression"] == "cbor"
    assert begun["throttle_rate"] == 100
    assert nearest(scan) == pytest.approx((30.0, 1.5))
    assert scan is not None
    assert (scan.pose.x, scan.pose.y, scan.pose.yaw_rad) == pytest.approx((1.0, 2.0, 0.5))
    assert (scan.reach_m, scan.stamp_s) == (12.0, NOW_S)


async def test_what_met_nothing_is_told_from_what_is_not_known() -> None:
    scan = await fetched(scan_message({0: math.inf, 10: math.nan, 20: 0.05}))
    assert scan is not None
    assert scan.ranges_m[17:21] == pytest.approx([4.0, math.inf, math.nan, math.nan], nan_ok=True)


@pytest.mark.parametrize(
    ("mounting", "bearing_deg", "range_m"),
    [
        pytest.param((mounted("base_footprint", "laser", Pose(0.5, 0.0)),), 0.0, 2.0, id="ahead"),
        pytest.param(
            (mounted("base_footprint", "laser", Pose(0.0, 0.0, math.pi / 2)),), 90.0, 1.5, id="left"
        ),
        pytest.param(
            (
                mounted("base_footprint", "base_link", Pose(0.0, 0.0, 0.3)),
                mounted("base_link", "laser", Pose(0.0, 0.0, 0.2)),
            ),
            math.degrees(0.5),
            1.5,
            id="chained",
        ),
    ],
)
async def test_a_laser_that_is_mounted_elsewhere_or_turned_is_read_as_from_the_base(
    mounting: tuple[FrameTransform, ...], bearing_deg: float, range_m: float
) -> None:
    assert nearest(await fetched(scan_message({0: 1.5}), mounting)) == pytest.approx(
        (bearing_deg, range_m)
    )


@pytest.mark.parametrize(
    ("rotation", "bearing_deg"), [(FLAT, 30.0), (ROLLED_OVER, -30.0), (PITCHED_OVER, 150.0)]
)
async def test_a_laser_that_hangs_upside_down_sees_left_what_it_says_is_right(
    rotation: tuple[float, float, float, float], bearing_deg: float
) -> None:
    laser = mounted("base_footprint", "laser", Pose(0.0, 0.0), rotation)
    scan = await fetched(scan_message({30: 1.5}), (laser,))
    assert nearest(scan) == pytest.approx((bearing_deg, 1.5))


async def test_a_laser_upside_down_below_a_turned_plate_is_read_through_both() -> None:
    plate = mounted("base_footprint", "plate", Pose(0.2, 0.0), ROLLED_OVER)
    laser = mounted("plate", "laser", Pose(0.0, 0.1, math.pi / 2))
    bearing_deg, range_m = nearest(await fetched(scan_message({0: 1.5}), (plate, laser)))
    # From (0.2, -0.1) it looks to the right of the robot.
    assert bearing_deg == pytest.approx(math.degrees(math.atan2(-1.6, 0.2)))
    assert range_m == pytest.approx(math.hypot(0.2, 1.6))


async def test_a_laser_level_on_a_tilted_mast_is_level() -> None:
    mast = mounted("base_footprint", "mast", Pose(0.0, 0.0), pitched(0.5))
    laser = mounted("mast", "laser", Pose(0.0, 0.0), pitched(-0.5))
    scan = await fetched(scan_message({30: 1.5}), (mast, laser))
    assert nearest(scan) == pytest.approx((30.0, 1.5))


@pytest.mark.parametrize("rotation", [ON_ITS_SIDE, pitched(0.3)])
async def test_a_laser_that_looks_up_or_down_says_nothing_of_the_floor(
    rotation: tuple[float, float, float, float],
) -> None:
    laser = mounted("base_footprint", "laser", Pose(0.0, 0.0), rotation)
    assert await fetched(scan_message({}), (laser,)) is None


async def test_a_laser_whose_place_on_the_robot_is_not_known_says_nothing() -> None:
    elsewhere = mounted("other_robot", "laser", Pose(0.0, 0.0))
    assert await fetched(scan_message({}), (elsewhere,)) is None


@pytest.mark.parametrize("stamp_s", [NOW_S - 30.0, NOW_S + 30.0, 0.0])
async def test_a_scan_of_another_time_is_refused(stamp_s: float) -> None:
    assert await fetched(scan_message({}, stamp_s=stamp_s)) is None


async def test_without_the_robots_time_no_scan_is_old() -> None:
    scripted = scripted_with(scan_message({}, stamp_s=5.0))
    del scripted.services["/rosapi/get_time"]
    async with connected(scripted) as robot:
        assert await robot.fetch_scan() is not None


@pytest.mark.parametrize(
    "wrong",
    [
        {"ranges": "none"},
        {"angle_increment": 1e308},
        {"range_max": 1e308},
        {"header": {}},
        {"ranges": []},
    ],
)
async def test_a_scan_that_is_none_never_raises(wrong: dict[str, Any]) -> None:
    scan = await fetched(scan_message({0: math.inf}) | wrong)
    assert scan is None or np.isfinite(scan.angles_rad).all()


async def test_a_robot_without_a_laser_gives_none_at_once() -> None:
    async with connected(ScriptedRobot()) as robot:
        assert not robot.description.has_laser
        assert await robot.fetch_scan() is None


async def test_a_silent_laser_is_waited_for_but_once() -> None:
    scripted = scripted_with(None)
    async with connected(scripted, patience=replace(PATIENT, scan_s=0.01)) as robot:
        laser = Laser(robot.connection, robot.profile, frames=robot._frames, clock=robot._clock)
        assert await laser.fetch(robot._poses) is None
        assert await laser.fetch(robot._poses) is None
        await scripted.until(lambda: subscriptions(scripted))
    assert len(subscriptions(scripted)) == 1


async def test_a_laser_that_falls_silent_gives_none_and_may_speak_again() -> None:
    scripted = scripted_with(scan_message({}))
    async with connected(scripted) as robot:
        assert await robot.fetch_scan() is not None
        assert await robot.fetch_scan() is None
        found: list[RangeScan | None] = []

        async def speak_again() -> bool:
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(scripted.publish, "/scan", scan_message({30: 1.0}))
                found.append(await robot.fetch_scan())
            return found[-1] is not None

        await eventually(speak_again)
    assert nearest(found[-1]) == pytest.approx((30.0, 1.0))


async def test_robot_yaml_says_which_laser() -> None:
    scripted = scripted_with(scan_message({30: 1.5}), topic="/rear/scan")
    scripted.topics["/scan"] = "sensor_msgs/msg/LaserScan"
    async with connected(scripted, overrides=RobotOverrides(scan_topic="/rear/scan")) as robot:
        assert nearest(await robot.fetch_scan()) == pytest.approx((30.0, 1.5))
    assert subscriptions(scripted) == []
