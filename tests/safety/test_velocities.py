"""Velocities that are published know the closed areas: before they are sent, and underway."""

import math
from pathlib import Path
from typing import Any

import pytest

from drawing import grid_from_text
from fakes import FakeRobot
from guarding import WallClock, audit_of, make_guard, rectangle
from mapspeak.errors import LinkError, PolicyError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import StampedPose
from mapspeak.ros.port import RosConnection
from mapspeak.safety import AreaRule, Hours, Policy, publishing_for
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

HALL = grid_from_text("\n".join("." * 120 for _ in range(80)), resolution_m=0.1)
START = Pose(2.0, 4.0)
PIT = rectangle("pit", (5.0, 3.0), (7.0, 5.0))
RADIUS_M = 0.2


def twist(forward: float = 0.0, left: float = 0.0, turn: float = 0.0) -> dict[str, Any]:
    return {
        "linear": {"x": forward, "y": left, "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": turn},
    }


class WheeledRobot(FakeRobot):
    """Drives as it was told last, until it is told otherwise."""

    def __init__(self, pose: Pose = START) -> None:
        super().__init__(HALL, pose=pose)
        self.velocity = twist()
        self.is_lost = False

    async def fetch_pose(self) -> StampedPose:
        if self.is_lost:
            raise LinkError("No pose has arrived.", hint="Start localisation.")
        return await super().fetch_pose()

    async def stop(self) -> None:
        await super().stop()
        self.velocity = twist()

    async def sleep(self, duration_s: float) -> None:
        await super().sleep(duration_s)
        forward_m = self.velocity["linear"]["x"] * duration_s
        yaw_rad = self.pose.yaw_rad + self.velocity["angular"]["z"] * duration_s
        self.pose = Pose(
            self.pose.x + forward_m * math.cos(yaw_rad),
            self.pose.y + forward_m * math.sin(yaw_rad),
            yaw_rad,
        )


class Wheels:
    """The connection on which that robot hears its velocities."""

    def __init__(self, robot: WheeledRobot) -> None:
        self.robot = robot
        self.heard: list[Any] = []
        self.is_closed = False

    def advertise(self, topic: str, *, type_name: str, is_latched: bool = False) -> None:
        assert not is_latched
        assert topic
        assert type_name

    async def publish(self, topic: str, message: Any) -> None:  # noqa: ANN401
        self.publish_everywhere(topic, message)

    def publish_everywhere(self, topic: str, message: Any) -> int:  # noqa: ANN401
        assert topic
        if self.is_closed:
            raise LinkError("It was not advertised.", hint="Advertise it first.")
        self.heard.append(message)
        if "linear" in message:
            self.robot.velocity = message
        return 1


class Stand:
    """A guarded session over such a robot."""

    def __init__(
        self,
        folder: Path,
        *areas: AreaRule,
        pose: Pose = START,
        clock: WallClock | None = None,
        type_name: str = "geometry_msgs/msg/Twist",
    ) -> None:
        self.folder = folder
        self.robot = WheeledRobot(pose)
        self.wheels = Wheels(self.robot)
        self.session = Session(
            self.robot,
            SemanticMapStore(folder / "m.yaml"),
            lease_s=60.0,
            guard=make_guard(folder, Policy(areas=areas), clock=clock),
            ros=self.wheels,  # type: ignore[arg-type]
        )
        self.ros.advertise("/cmd_vel", type_name=type_name)

    @property
    def ros(self) -> RosConnection:
        assert self.session.ros is not None
        return self.session.ros

    async def publish(self, message: dict[str, Any], *, for_s: float = 0.0) -> None:
        with publishing_for(for_s):
            await self.ros.publish("/cmd_vel", message)


async def test_a_velocity_that_leads_into_an_area_is_refused_before_it_is_sent(
    tmp_path: Path,
) -> None:
    stand = Stand(tmp_path, PIT)
    with pytest.raises(PolicyError) as raised:
        await stand.publish(twist(0.4), for_s=10.0)
    assert "into the keep-out area 'pit', 2.80 m from its edge, within" in str(raised.value)
    assert stand.wheels.heard == []
    assert audit_of(tmp_path)[-1].said.startswith("keep_out: ")


@pytest.mark.parametrize(
    ("message", "for_s"),
    [
        (twist(0.4), 3.0),
        (twist(-0.4), 20.0),
        (twist(0.0, 0.0, 1.0), 20.0),
        (twist(0.4, 0.0, 0.5), 20.0),
        (twist(0.0, 0.4), 20.0),
    ],
    ids=["stops before it", "backs off", "turns in place", "goes in a circle", "goes sideways"],
)
async def test_a_velocity_that_leads_elsewhere_is_published(
    tmp_path: Path, message: dict[str, Any], for_s: float
) -> None:
    stand = Stand(tmp_path, PIT)
    await stand.publish(message, for_s=for_s)
    assert stand.wheels.heard == [message]


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (Pose(8.0, 4.0), twist(-0.4)),
        (Pose(2.0, 4.0, math.pi), twist(-0.4)),
        (Pose(6.0, 2.0), twist(0.0, 0.4)),
        (Pose(4.0, 2.0, math.pi / 2), twist(0.4, 0.0, -0.4)),
    ],
    ids=["backwards", "backwards turned round", "sideways", "in a bow"],
)
async def test_the_way_is_foreseen_in_every_direction(
    tmp_path: Path, pose: Pose, message: dict[str, Any]
) -> None:
    stand = Stand(tmp_path, PIT, pose=pose)
    with pytest.raises(PolicyError, match="into the keep-out area 'pit'"):
        await stand.publish(message, for_s=10.0)


async def test_stamped_velocities_and_cars_are_held_to_the_areas_too(tmp_path: Path) -> None:
    near = Pose(4.5, 4.0)
    stamped = Stand(tmp_path, PIT, pose=near, type_name="geometry_msgs/msg/TwistStamped")
    with pytest.raises(PolicyError, match="pit"):
        await stamped.publish({"header": {}, "twist": twist(0.4)})
    car = Stand(tmp_path, PIT, pose=near, type_name="ackermann_msgs/msg/AckermannDrive")
    with pytest.raises(PolicyError, match="pit"):
        await car.publish({"speed": 0.4, "steering_angle": 0.1})
    strange = Stand(tmp_path, PIT, pose=near)
    with pytest.raises(PolicyError, match="pit"):
        await strange.publish({**twist(), "next": twist(0.4)})


async def test_a_velocity_that_is_no_number_is_refused_for_that(tmp_path: Path) -> None:
    for speed in (math.inf, math.nan, "fast", None):
        with pytest.raises(PolicyError, match="above the limit"):
            await Stand(tmp_path, PIT).publish(twist(speed))  # type: ignore[arg-type]


async def test_where_the_pose_is_unknown_no_velocity_is_published_but_a_stand_is(
    tmp_path: Path,
) -> None:
    stand = Stand(tmp_path, PIT)
    stand.robot.is_lost = True
    with pytest.raises(PolicyError) as raised:
        await stand.publish(twist(0.1))
    assert "where the robot is cannot be known now: No pose has arrived." in str(raised.value)
    await stand.publish(twist())
    assert stand.wheels.heard == [twist()]


async def test_without_areas_nobody_asks_where_the_robot_is(tmp_path: Path) -> None:
    stand = Stand(tmp_path)
    stand.robot.is_lost = True
    await stand.publish(twist(0.1))
    assert stand.wheels.heard == [twist(0.1)]


async def test_an_area_holds_for_velocities_during_its_hours_only(tmp_path: Path) -> None:
    clock = WallClock()
    rule = AreaRule(name="lab", outline=PIT.outline, hours=Hours(begins=clock.now.time()))
    stand = Stand(tmp_path, rule, clock=clock)
    with pytest.raises(PolicyError, match="'lab', closed until 00:00"):
        await stand.publish(twist(0.4), for_s=10.0)
    clock.now = clock.now.replace(hour=6)
    await stand.robot.sleep(2.0)
    await stand.publish(twist(0.4), for_s=10.0)
    assert stand.wheels.heard == [twist(0.4)]


async def test_a_robot_that_goes_on_by_itself_is_stopped_before_the_area(tmp_path: Path) -> None:
    """Its driver does not stop when no more messages come."""
    stand = Stand(tmp_path, PIT)
    await stand.publish(twist(0.5))
    await stand.session.robot.sleep(20.0)
    assert stand.robot.n_stops == 1
    assert stand.robot.velocity == twist()
    edge_m = PIT.outline[0].x - stand.robot.pose.x - RADIUS_M
    assert 0.05 <= edge_m <= 0.5
    said = audit_of(tmp_path)[-1].said
    assert "velocity_at_area" in said


async def test_a_robot_that_others_drive_is_stopped_before_the_area_too(tmp_path: Path) -> None:
    stand = Stand(tmp_path, PIT)
    await stand.session.robot.fetch_pose()
    stand.robot.velocity = twist(0.4)
    await stand.session.robot.sleep(20.0)
    assert stand.robot.n_stops == 1
    edge_m = PIT.outline[0].x - stand.robot.pose.x - RADIUS_M
    assert 0.05 <= edge_m <= 0.5
    assert "others_at_area" in audit_of(tmp_path)[-1].said


async def test_a_velocity_by_all_ways_at_once_is_for_standing_only(tmp_path: Path) -> None:
    stand = Stand(tmp_path, PIT)
    with pytest.raises(PolicyError, match="only when it is zero"):
        stand.ros.publish_everywhere("/cmd_vel", twist(0.1))
    assert stand.ros.publish_everywhere("/cmd_vel", twist()) == 1


async def test_what_is_no_velocity_is_none_of_the_areas_business(tmp_path: Path) -> None:
    stand = Stand(tmp_path, rectangle("everywhere", (-50.0, -50.0), (50.0, 50.0)))
    stand.robot.is_lost = True
    await stand.publish({"data": "hello"})
    assert stand.wheels.heard == [{"data": "hello"}]


async def test_a_velocity_that_was_refused_does_not_count_as_moving_the_robot(
    tmp_path: Path,
) -> None:
    stand = Stand(tmp_path, PIT)
    with pytest.raises(PolicyError, match="above the limit"):
        await stand.publish(twist(-2.0))
    stand.robot.velocity = twist(0.4)
    await stand.session.robot.sleep(20.0)
    assert "others_at_area" in audit_of(tmp_path)[-1].said


async def test_a_robot_is_stopped_though_a_topic_of_velocities_takes_nothing_any_more(
    tmp_path: Path,
) -> None:
    stand = Stand(tmp_path, PIT)
    await stand.publish(twist(0.1))
    stand.wheels.is_closed = True
    await stand.session.robot.stop()
    assert stand.robot.n_stops == 1


async def test_a_robot_that_goes_on_by_a_velocity_and_is_lost_is_stopped(tmp_path: Path) -> None:
    stand = Stand(tmp_path, PIT)
    await stand.publish(twist(0.1))
    stand.robot.is_lost = True
    await stand.session.robot.sleep(1.0)
    assert stand.robot.n_stops
    assert "pose_unknown" in audit_of(tmp_path)[-1].said


@pytest.mark.parametrize("speed", [1e200, -1e308, 10**400])
async def test_a_velocity_beyond_all_numbers_is_above_the_limit(
    tmp_path: Path, speed: float
) -> None:
    with pytest.raises(PolicyError, match="above the limit"):
        await Stand(tmp_path, PIT).publish(twist(speed))
