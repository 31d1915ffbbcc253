import inspect
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

from fakes import FakeRobot, two_rooms
from guarding import audit_of, make_guard
from mapspeak.errors import LinkError, PolicyError
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.port import RosConnection
from mapspeak.safety import (
    Approval,
    CommandKind,
    GuardedConnection,
    GuardedRobot,
    MapReviser,
    Policy,
)
from mapspeak.safety.connection import HARMLESS
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

ZERO = {"x": 0.0, "y": 0.0, "z": 0.0}
STAND = {"linear": ZERO, "angular": ZERO}
CREEP = {"linear": {**ZERO, "x": 0.2}, "angular": ZERO}
RUSH = {"linear": {**ZERO, "x": 2.0}, "angular": ZERO}


class FakeRos:
    """Notes what reaches it; the rest of the port is not used here."""

    def __init__(self) -> None:
        self.heard: list[tuple[Any, ...]] = []
        self.is_dead = False
        self.action_types: dict[str, str] = {}
        self.advertised: list[str] = []

    def advertise(self, topic: str, *, type_name: str, is_latched: bool = False) -> None:
        assert not is_latched
        assert type_name
        self.advertised.append(topic)

    async def publish(self, topic: str, message: object) -> None:
        if self.is_dead:
            raise LinkError("The line is dead.", hint="Wait.")
        self.heard.append((topic, message))

    def publish_everywhere(self, topic: str, message: object) -> int:
        self.heard.append((topic, message))
        return 2

    async def call_service(self, service: str, *_: object, **__: object) -> dict[str, Any]:
        if self.is_dead:
            raise LinkError("The line is dead.", hint="Wait.")
        self.heard.append((service,))
        return {"success": True}

    async def send_goal(self, action: str, *_: object, **__: object) -> str:
        self.heard.append((action,))
        return "goal"

    async def fetch_action_type(self, action: str) -> str:
        if action not in self.action_types:
            raise LinkError("The robot does not tell.", hint="Give the type.")
        return self.action_types[action]

    async def set_parameter(self, node: str, name: str, value: object) -> None:
        self.heard.append((node, name, value))


def guarded(ros: FakeRos, folder: Path, policy: Policy | None = None) -> GuardedConnection:
    guard = make_guard(folder, policy)
    reviser = MapReviser((), wall_clock=guard.wall_clock)
    robot = GuardedRobot(FakeRobot(two_rooms()), guard=guard, reviser=reviser)
    connection = GuardedConnection(
        ros,  # type: ignore[arg-type]
        guard=guard,
        now_s=lambda: 1.0,
        teleop=robot.teleop,
        planner=robot.planner,
    )
    connection.advertise("/cmd_vel", type_name="geometry_msgs/msg/Twist")
    return connection


async def try_everything(connection: GuardedConnection) -> list[str]:
    refused = []
    for kind, attempt in (
        ("publish", lambda: connection.publish("/cmd_vel", CREEP)),
        ("call", lambda: connection.call_service("/lamp/on")),
        ("act", lambda: connection.send_goal("/wave", {}, type_name="a/action/Wave")),
        ("set_parameter", lambda: connection.set_parameter("/camera", "gain", 3)),
    ):
        try:
            await attempt()
        except PolicyError:
            refused.append(kind)
    return refused


async def test_what_is_allowed_reaches_ros_and_the_log(tmp_path: Path) -> None:
    ros = FakeRos()
    assert await try_everything(guarded(ros, tmp_path)) == []
    assert len(ros.heard) == 4
    events = [line.event for line in audit_of(tmp_path)]
    assert events == ["decision", "result"] * 4
    assert audit_of(tmp_path)[0].details["type"] == "geometry_msgs/msg/Twist"


@pytest.mark.parametrize(
    "policy",
    [
        Policy(is_read_only=True),
        Policy(rates=dict.fromkeys(CommandKind, 0)),
        Policy(approval=Approval(kinds=frozenset(CommandKind))),
    ],
    ids=["read-only", "rates", "approval"],
)
async def test_what_is_not_allowed_never_reaches_ros(tmp_path: Path, policy: Policy) -> None:
    ros = FakeRos()
    refused = await try_everything(guarded(ros, tmp_path, policy))
    assert refused == ["publish", "call", "act", "set_parameter"]
    assert ros.heard == []
    assert len(audit_of(tmp_path)) == 4


async def test_a_hold_and_a_broken_log_let_nothing_through_either(tmp_path: Path) -> None:
    ros = FakeRos()
    guard = make_guard(tmp_path)
    guard.hold.put("a test", at=guard.wall_clock())
    assert len(await try_everything(guarded(ros, tmp_path))) == 4
    guard.hold.lift()
    (tmp_path / "audit.jsonl").unlink()
    (tmp_path / "audit.jsonl").mkdir()
    assert len(await try_everything(guarded(ros, tmp_path))) == 4
    assert ros.heard == []


async def test_a_velocity_above_the_limit_is_refused_by_every_way(tmp_path: Path) -> None:
    ros = FakeRos()
    connection = guarded(ros, tmp_path)
    with pytest.raises(PolicyError, match="2 m/s"):
        await connection.publish("/cmd_vel", RUSH)
    with pytest.raises(PolicyError, match="2 m/s"):
        connection.publish_everywhere("/cmd_vel", RUSH)
    assert ros.heard == []


async def test_standing_and_cancelling_always_pass(tmp_path: Path) -> None:
    ros = FakeRos()
    policy = Policy(is_read_only=True, rates=dict.fromkeys(CommandKind, 0))
    connection = guarded(ros, tmp_path, policy)
    connection.advertise("/move_base/cancel", type_name="actionlib_msgs/GoalID")
    await connection.publish("/cmd_vel", STAND)
    assert connection.publish_everywhere("/cmd_vel", STAND) == 2
    assert connection.publish_everywhere("/move_base/cancel", {"id": ""}) == 2
    assert len(ros.heard) == 3
    assert [line.event for line in audit_of(tmp_path)] == ["stop"] * 3


@pytest.mark.parametrize(
    "type_name", ["action_msgs/srv/CancelGoal", "action_msgs/CancelGoal", None]
)
async def test_cancelling_by_the_service_of_an_action_always_passes(
    tmp_path: Path, type_name: str | None
) -> None:
    ros = FakeRos()
    policy = Policy(is_read_only=True, rates=dict.fromkeys(CommandKind, 0))
    guard = make_guard(tmp_path)
    guard.hold.put("a test", at=guard.wall_clock())
    connection = guarded(ros, tmp_path, policy)
    service = "/navigate_to_pose/_action/cancel_goal"
    assert await connection.call_service(service, {}, type_name=type_name) == {"success": True}
    assert ros.heard == [(service,)]
    assert [line.event for line in audit_of(tmp_path)] == ["stop"]


async def test_a_cancellation_is_noted_also_when_nobody_answers(tmp_path: Path) -> None:
    ros = FakeRos()
    connection = guarded(ros, tmp_path)
    ros.is_dead = True
    with pytest.raises(LinkError):
        await connection.call_service("/wave/_action/cancel_goal", {})
    assert [line.event for line in audit_of(tmp_path)] == ["stop"]


@pytest.mark.parametrize(
    ("service", "type_name"),
    [
        ("/lamp/on", "action_msgs/srv/CancelGoal"),
        ("/wave/_action/cancel_goal", "std_srvs/srv/Trigger"),
        ("/wave/_action/send_goal", "action_msgs/srv/CancelGoal"),
        ("/cancel_goal", "action_msgs/srv/CancelGoal"),
    ],
)
async def test_a_call_that_only_looks_like_a_cancellation_is_no_stop(
    tmp_path: Path, service: str, type_name: str
) -> None:
    ros = FakeRos()
    connection = guarded(ros, tmp_path, Policy(is_read_only=True))
    with pytest.raises(PolicyError, match="read-only"):
        await connection.call_service(service, {}, type_name=type_name)
    assert ros.heard == []


async def test_a_message_without_a_velocity_is_no_stop(tmp_path: Path) -> None:
    ros = FakeRos()
    connection = guarded(ros, tmp_path, Policy(is_read_only=True))
    for message in ({}, {"data": 0}, {"linear": {}, "angular": {"z": 0.1}}):
        with pytest.raises(PolicyError):
            connection.publish_everywhere("/cmd_vel", message)


async def test_a_message_that_holds_more_than_a_velocity_is_no_stop(tmp_path: Path) -> None:
    ros = FakeRos()
    connection = guarded(ros, tmp_path)
    with pytest.raises(PolicyError, match="denies"):
        connection.advertise("/odom", type_name="nav_msgs/msg/Odometry")
    with pytest.raises(PolicyError, match="denies"):
        connection.publish_everywhere("/odom", {"twist": {"twist": STAND}, "pose": {}})
    assert ros.heard == []


@pytest.mark.parametrize(
    ("type_name", "message"),
    [
        ("geometry_msgs/msg/Twist", {"linear": ZERO, "angular": {**ZERO, "x": 0.1}}),
        ("geometry_msgs/msg/Twist", {"linear": {**ZERO, "z": -0.1}, "angular": ZERO}),
        ("geometry_msgs/msg/TwistStamped", {"header": {}, "twist": CREEP}),
        ("ackermann_msgs/msg/AckermannDrive", {"speed": 0.0, "steering_angle": 1.0}),
        ("ackermann_msgs/msg/AckermannDrive", {"speed": 0.0, "steering_angle_velocity": 5.0}),
        ("ackermann_msgs/msg/AckermannDrive", {"speed": 0.0, "acceleration": 9.0, "jerk": 5.0}),
        ("ackermann_msgs/msg/AckermannDriveStamped", {"drive": {"speed": 0.0, "jerk": 5.0}}),
        ("geometry_msgs/msg/Twist", {"linear": ZERO, "angular": ZERO, "on": True}),
    ],
)
async def test_a_speed_of_zero_beside_anything_else_is_no_stop(
    tmp_path: Path, type_name: str, message: dict[str, Any]
) -> None:
    ros = FakeRos()
    guard = make_guard(tmp_path)
    guard.hold.put("a test", at=guard.wall_clock())
    connection = guarded(ros, tmp_path)
    connection.advertise("/drive", type_name=type_name)
    with pytest.raises(PolicyError, match="held"):
        await connection.publish("/drive", message)
    with pytest.raises(PolicyError, match="held"):
        connection.publish_everywhere("/drive", message)
    assert ros.heard == []


async def test_zero_velocities_of_every_kind_pass_a_hold(tmp_path: Path) -> None:
    ros = FakeRos()
    guard = make_guard(tmp_path)
    guard.hold.put("a test", at=guard.wall_clock())
    connection = guarded(ros, tmp_path)
    for type_name, message in (
        ("geometry_msgs/msg/Twist", STAND),
        ("geometry_msgs/msg/TwistStamped", {"header": {"stamp": {"sec": 7}}, "twist": STAND}),
        ("ackermann_msgs/AckermannDrive", {"speed": 0.0, "steering_angle": 0.0, "jerk": 0}),
    ):
        connection.advertise("/drive", type_name=type_name)
        await connection.publish("/drive", message)
    assert len(ros.heard) == 3


async def test_an_action_is_judged_by_the_type_that_the_robot_tells(tmp_path: Path) -> None:
    ros = FakeRos()
    ros.action_types["/patrol"] = "nav2_msgs/action/FollowWaypoints"
    connection = guarded(ros, tmp_path)
    with pytest.raises(PolicyError, match=r"act\.usual_denials: \*/FollowWaypoints"):
        await connection.send_goal("/patrol", {}, type_name="demo_msgs/action/Wave")
    with pytest.raises(PolicyError, match="NavigateToPose"):
        await connection.send_goal("/scope", {}, type_name="nav2_msgs/action/NavigateToPose")
    assert ros.heard == []
    await connection.send_goal("/wave", {}, type_name="demo_msgs/action/Wave")
    assert ros.heard == [("/wave",)]


async def test_a_goal_that_ros_1_sends_by_a_topic_is_held_to_the_rules_of_actions(
    tmp_path: Path,
) -> None:
    ros = FakeRos()
    connection = guarded(ros, tmp_path)
    with pytest.raises(PolicyError, match=r"act\.usual_denials"):
        connection.advertise("/drive_on/goal", type_name="move_base_msgs/MoveBaseActionGoal")
    connection.advertise("/wave/goal", type_name="demo_msgs/WaveActionGoal")
    await connection.publish("/wave/goal", {"goal_id": {"id": "7"}, "goal": {"times": 3}})
    assert [name for name, _ in ros.heard] == ["/wave/goal"]
    decided = audit_of(tmp_path)[-2]
    assert (decided.kind, decided.details["action"]) == ("act", "/wave")
    assert decided.details["goal"] == {"times": 3}


async def test_what_failed_is_noted_as_given_up(tmp_path: Path) -> None:
    ros = FakeRos()
    connection = guarded(ros, tmp_path)
    ros.is_dead = True
    with pytest.raises(LinkError):
        await connection.publish("/cmd_vel", CREEP)
    assert [line.said for line in audit_of(tmp_path)] == ["", "given up"]


def test_every_member_of_the_port_is_guarded_or_named_as_harmless(tmp_path: Path) -> None:
    members = [(*vars(part), *inspect.get_annotations(part)) for part in RosConnection.__mro__]
    port = {name for name in chain(*members) if not name.startswith("_")}
    guarded_ones = {name for name in vars(GuardedConnection) if not name.startswith("_")} & port
    assert guarded_ones | HARMLESS == port
    assert guarded_ones & HARMLESS == set()
    assert not hasattr(guarded(FakeRos(), tmp_path), "fetch_what_is_new")


def test_a_guarded_session_gives_its_tools_the_guarded_connection(tmp_path: Path) -> None:
    session = Session(
        FakeRobot(two_rooms()),
        SemanticMapStore(tmp_path / "m.yaml"),
        lease_s=60.0,
        guard=make_guard(tmp_path),
        ros=FakeRos(),  # type: ignore[arg-type]
    )
    assert isinstance(session.ros, GuardedConnection)


async def test_a_forbidden_topic_is_not_even_advertised(tmp_path: Path) -> None:
    ros = FakeRos()
    connection = guarded(ros, tmp_path)
    with pytest.raises(PolicyError, match="denies"):
        connection.advertise("/goal_pose", type_name="geometry_msgs/msg/PoseStamped")
    connection.advertise("/move_base/cancel", type_name="actionlib_msgs/GoalID")
    assert ros.advertised == ["/cmd_vel", "/move_base/cancel"]
    assert audit_of(tmp_path)[-1].verdict == "refused"
