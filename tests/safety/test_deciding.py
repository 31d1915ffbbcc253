import dataclasses
import math
from collections.abc import Callable
from datetime import datetime, time, timedelta
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from guarding import MONDAY_NOON
from mapspeak.geometry import Point, Pose
from mapspeak.installation import shell_command
from mapspeak.places.goalcheck import GoalCheck, GoalVerdict, say_check
from mapspeak.safety import (
    Act,
    Allowed,
    Approval,
    Call,
    Command,
    CommandKind,
    DriveCommand,
    Hours,
    NeedsApproval,
    Patterns,
    Policy,
    Publish,
    Refused,
    SetParameter,
    Situation,
    decide,
)
from mapspeak.worldmodel.keepout import ClosedArea

NOW = Situation()
STAIRS = ClosedArea(name="stairs", outline=(Point(1, 1), Point(2, 1), Point(2, 2)))


def drive(verdict: GoalVerdict = GoalVerdict.OK, *, path_m: float | None = 3.0) -> DriveCommand:
    goal = Pose(1.0, 2.0)
    check = GoalCheck(
        verdict=verdict,
        goal=goal,
        radius_m=0.2,
        clearance_m=1.0,
        path_m=path_m,
        areas=(STAIRS,) if verdict is GoalVerdict.CLOSED else (),
    )
    return DriveCommand(goal=goal, check=check)


def twist(linear: float, angular: float = 0.0) -> dict[str, Any]:
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    return {"linear": {**zero, "x": linear}, "angular": {**zero, "z": angular}}


def velocity(message: dict[str, Any], topic: str = "/cmd_vel") -> Publish:
    return Publish(topic=topic, type="geometry_msgs/msg/Twist", message=message)


COMMANDS: tuple[Command, ...] = (
    drive(),
    velocity(twist(0.1)),
    Call(service="/lights/on", type="std_srvs/srv/Trigger", arguments={}),
    Act(action="/wave", type="demo_msgs/action/Wave", goal={}),
    SetParameter(node="/camera", name="exposure", value=3),
)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: each.kind)
def test_what_no_rule_is_against_is_allowed(command: Command) -> None:
    assert decide(command, policy=Policy(), situation=NOW) == Allowed()


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: each.kind)
def test_a_read_only_policy_refuses_everything(command: Command) -> None:
    decision = decide(command, policy=Policy(is_read_only=True), situation=NOW)
    assert isinstance(decision, Refused)
    assert decision.rule == "read_only"


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: each.kind)
def test_a_hold_refuses_everything_and_names_how_it_is_lifted(command: Command) -> None:
    decision = decide(command, policy=Policy(), situation=Situation(held_by="a person"))
    assert isinstance(decision, Refused)
    assert "a person" in decision.error.message
    assert shell_command("release") in decision.error.hint


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: each.kind)
def test_more_commands_in_a_minute_than_allowed_are_refused_with_both_numbers(
    command: Command,
) -> None:
    policy = Policy(rates={command.kind: 7})
    assert decide(command, policy=policy, situation=Situation(n_in_last_minute=6)) == Allowed()
    decision = decide(command, policy=policy, situation=Situation(n_in_last_minute=7))
    assert isinstance(decision, Refused)
    assert "7" in decision.error.message


@pytest.mark.parametrize("command", COMMANDS, ids=lambda each: each.kind)
def test_what_needs_a_persons_word_needs_it_until_it_is_given(command: Command) -> None:
    policy = Policy(approval=Approval(kinds=frozenset(CommandKind)))
    assert isinstance(decide(command, policy=policy, situation=NOW), NeedsApproval)
    assert decide(command, policy=policy, situation=Situation(is_approved=True)) == Allowed()


def test_a_persons_word_does_not_lift_other_rules() -> None:
    policy = Policy(approval=Approval(kinds=frozenset(CommandKind)), farthest_m=1.0)
    decision = decide(drive(), policy=policy, situation=Situation(is_approved=True))
    assert isinstance(decision, Refused)


@pytest.mark.parametrize(
    "verdict", [verdict for verdict in GoalVerdict if verdict is not GoalVerdict.OK]
)
def test_a_goal_that_is_no_goal_is_refused(verdict: GoalVerdict) -> None:
    command = drive(verdict, path_m=None)
    decision = decide(command, policy=Policy(), situation=NOW)
    assert isinstance(decision, Refused)
    assert decision.error.message == say_check(command.check)


def test_the_time_of_a_hold_is_told_to_the_second() -> None:
    held = Situation(held_by="`mapspeak stop`, at 2026-11-22 10:00:01.123456")
    decision = decide(drive(), policy=Policy(), situation=held)
    assert isinstance(decision, Refused)
    assert decision.error.message == "The robot is held: `mapspeak stop`, at 2026-11-22 10:00:01."


def test_goals_without_a_known_way_can_be_allowed_but_never_closed_ones() -> None:
    policy = Policy(needs_known_way=False)
    unknown = drive(GoalVerdict.UNKNOWN, path_m=None)
    assert decide(unknown, policy=policy, situation=NOW) == Allowed()
    for verdict in (GoalVerdict.CLOSED, GoalVerdict.NOT_FINITE):
        closed = drive(verdict, path_m=None)
        assert isinstance(decide(closed, policy=policy, situation=NOW), Refused)


def test_a_goal_that_is_too_far_is_refused_with_both_lengths() -> None:
    decision = decide(drive(path_m=30.0), policy=Policy(farthest_m=20.0), situation=NOW)
    assert isinstance(decision, Refused)
    assert "30.0 m" in decision.error.message
    assert "20.0 m" in decision.error.message


@pytest.mark.parametrize(
    ("message", "says"),
    [
        (twist(0.6), "0.6 m/s"),
        (twist(-0.6), "0.6 m/s"),
        (twist(0.1, 1.2), "An angular speed of 1.2 rad/s"),
        (twist(math.nan), "nan"),
        (twist(math.inf), "inf"),
        ({"linear": {"x": 0.4, "y": 0.4}}, "0.565"),
        ({"linear": {"x": "0.1"}}, "nan"),
        ({"linear": {"x": 10**400}}, "inf"),
        ({"header": {}, "twist": twist(0.6)}, "0.6 m/s"),
        ({"drive": {"speed": 0.6, "steering_angle": 0.0}}, "A speed of 0.6 m/s"),
        ({"markers": [{"twist": twist(0.6)}]}, "0.6 m/s"),
    ],
)
def test_a_velocity_above_the_limit_is_refused_with_number_and_unit(
    message: dict[str, Any], says: str
) -> None:
    decision = decide(velocity(message), policy=Policy(), situation=NOW)
    assert isinstance(decision, Refused)
    assert says in decision.error.message


def test_a_velocity_hidden_deep_in_a_message_is_refused_unread() -> None:
    message: dict[str, Any] = twist(9.0)
    for _ in range(50):
        message = {"inner": message}
    assert isinstance(decide(velocity(message), policy=Policy(), situation=NOW), Refused)


@given(x=st.floats(-0.5, 0.5), y=st.floats(-0.5, 0.5), turn=st.floats(-2, 2))
def test_exactly_the_velocities_within_the_limits_pass(x: float, y: float, turn: float) -> None:
    message = {"linear": {"x": x, "y": y, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": turn}}
    decision = decide(velocity(message), policy=Policy(), situation=NOW)
    is_slow = math.sqrt(x**2 + y**2) <= 0.5 and abs(turn) <= 1.0
    assert isinstance(decision, Allowed) == is_slow


@pytest.mark.parametrize(
    "command",
    [
        velocity({}, topic="/goal_pose"),
        velocity({}, topic="robot1/initialpose/"),
        velocity({}, topic="/navigate_to_pose/_action/feedback"),
        Call(service="/nav2/set_parameters", type="rcl_interfaces/srv/SetParameters", arguments={}),
        Call(service="/rosapi/set_param", type="rosapi_msgs/srv/SetParam", arguments={}),
        Call(service="/navigate_to_pose/_action/send_goal", type="x/srv/Y", arguments={}),
        Act(action="/Navigate_To_Pose", type="nav2_msgs/action/NavigateToPose", goal={}),
        Act(action="/r1/move_base", type="move_base_msgs/MoveBase", goal={}),
        SetParameter(node="/controller_server", name="FollowPath.max_vel_x", value=9),
    ],
    ids=lambda each: str(each.kind),
)
def test_what_would_go_around_the_policy_is_denied_by_default(command: Command) -> None:
    decision = decide(command, policy=Policy(), situation=NOW)
    assert isinstance(decision, Refused)
    assert "denies" in decision.error.message


DENIED: dict[CommandKind, tuple[str, ...]] = {
    CommandKind.CALL: (
        "/set_initial_pose",
        "/reinitialize_global_localization",
        "/map_server/load_map",
        "/slam_toolbox/deserialize_map",
        "/keepout_filter/toggle_filter",
        "/collision_monitor/toggle",
        "/gazebo/set_model_state",
        "/rosout_kill",
        "/killall",
        "/robot_skills/dock",
    ),
    CommandKind.PUBLISH: (
        "/odometry/filtered",
        "/base_scan",
        "/map_updates",
        "/speed_limit",
        "/keepout_filter_mask",
        "/costmap_filter_info",
        "/goal_update",
    ),
    CommandKind.SET_PARAMETER: (
        "/controller_server:FollowPath.vx_max",
        "/controller_server:FollowPath.wz_max",
        "/controller_server:FollowPath.ax_max",
        "/controller_server:FollowPath.v_linear_max",
        "/collision_monitor:PolygonStop.enabled",
        "/planner_server:GridBased.allow_unknown",
        "/velocity_smoother:max_accel",
    ),
    CommandKind.ACT: (
        "/follow_gps_waypoints",
        "/follow_object",
        "/navigate_complete_coverage",
        "/move_base_flex/exe_path",
        "/undock_robot",
    ),
}


def named(kind: CommandKind, name: str, type_name: str = "") -> Command:
    match kind:
        case CommandKind.PUBLISH:
            return Publish(topic=name, type=type_name, message={})
        case CommandKind.CALL:
            return Call(service=name, type=type_name, arguments={})
        case CommandKind.ACT:
            return Act(action=name, type=type_name, goal={})
        case _:
            node, _, parameter = name.partition(":")
            return SetParameter(node=node, name=parameter, value=1)


def refusal_of(command: Command, policy: Policy) -> Refused | None:
    decision = decide(command, policy=policy, situation=NOW)
    return decision if isinstance(decision, Refused) else None


@pytest.mark.parametrize(
    ("kind", "name"), [(kind, name) for kind, names in DENIED.items() for name in names]
)
def test_the_usual_denials_know_what_stock_robots_call_it(kind: CommandKind, name: str) -> None:
    refused = refusal_of(named(kind, name), Policy())
    assert refused is not None
    assert refused.rule == f"{kind}.usual_denials"
    assert "()" not in refused.error.message


@pytest.mark.parametrize(
    ("kind", "type_name"),
    [
        (CommandKind.ACT, "nav2_msgs/action/NavigateToPose"),
        (CommandKind.ACT, "nav2_msgs/action/NavigateThroughPoses"),
        (CommandKind.ACT, "nav2_msgs/action/FollowWaypoints"),
        (CommandKind.ACT, "nav2_msgs/action/FollowGPSWaypoints"),
        (CommandKind.ACT, "nav2_msgs/action/FollowPath"),
        (CommandKind.ACT, "nav2_msgs/action/Spin"),
        (CommandKind.ACT, "nav2_msgs/action/BackUp"),
        (CommandKind.ACT, "nav2_msgs/action/DriveOnHeading"),
        (CommandKind.ACT, "nav2_msgs/action/ComputeAndTrackRoute"),
        (CommandKind.ACT, "nav2_msgs/action/FollowObject"),
        (CommandKind.ACT, "nav2_msgs/action/DockRobot"),
        (CommandKind.ACT, "opennav_docking_msgs/action/UndockRobot"),
        (CommandKind.ACT, "opennav_coverage_msgs/action/NavigateCompleteCoverage"),
        (CommandKind.ACT, "move_base_msgs/MoveBase"),
        (CommandKind.ACT, "mbf_msgs/ExePath"),
        (CommandKind.ACT, "irobot_create_msgs/action/DriveDistance"),
        (CommandKind.CALL, "nav2_msgs/srv/SetInitialPose"),
        (CommandKind.CALL, "nav2_msgs/srv/Toggle"),
        (CommandKind.CALL, "rcl_interfaces/srv/SetParametersAtomically"),
        (CommandKind.PUBLISH, "nav_msgs/msg/Odometry"),
        (CommandKind.PUBLISH, "sensor_msgs/LaserScan"),
        (CommandKind.PUBLISH, "geometry_msgs/msg/PoseWithCovarianceStamped"),
    ],
)
def test_a_type_is_denied_whatever_its_name(kind: CommandKind, type_name: str) -> None:
    refused = refusal_of(named(kind, "/patrol", type_name), Policy())
    assert refused is not None
    assert refused.rule == f"{kind}.usual_denials"


def test_a_skill_is_not_taken_for_what_kills() -> None:
    assert refusal_of(named(CommandKind.CALL, "/robot_skills/speak"), Policy()) is None


@pytest.mark.parametrize(
    "type_name",
    ["nav2_msgs/action/ComputePathToPose", "control_msgs/action/FollowJointTrajectory"],
)
def test_an_action_that_does_not_drive_the_base_is_allowed(type_name: str) -> None:
    assert refusal_of(named(CommandKind.ACT, "/plan", type_name), Policy()) is None


def test_a_refusal_says_its_key_and_how_this_one_name_is_opened() -> None:
    refused = refusal_of(named(CommandKind.ACT, "/spin"), Policy())
    assert refused is not None
    assert refused.error.message == (
        "The policy denies this: send a goal to /spin (act.usual_denials: *spin*)."
    )
    assert '`act: {allow: ["*", "/spin"]}`' in refused.error.hint
    assert "--policy" in refused.error.hint


def test_a_name_that_is_allowed_in_full_is_free_of_the_usual_denials() -> None:
    name = "/move_base/DWAPlannerROS/set_parameters"
    command = named(CommandKind.CALL, name, "dynamic_reconfigure/Reconfigure")
    usual = Policy().patterns[CommandKind.CALL]

    def is_allowed(*allow: str, deny: tuple[str, ...] = ()) -> bool:
        patterns = dataclasses.replace(usual, allow=allow, deny=deny)
        return refusal_of(command, Policy(patterns={CommandKind.CALL: patterns})) is None

    assert is_allowed(name)
    assert is_allowed("*", name)
    assert not is_allowed("*")
    assert not is_allowed("/move_base/*")
    assert not is_allowed("*", "/other")
    assert not is_allowed("*", name, deny=("*set_parameters",))


@pytest.mark.parametrize(
    ("patterns", "key"),
    [(Patterns(deny=("/lamp",)), "publish.deny"), (Patterns(allow=("/a", "/b")), "publish.allow")],
)
def test_a_denial_of_ones_own_says_its_key(patterns: Patterns, key: str) -> None:
    policy = Policy(patterns={CommandKind.PUBLISH: patterns})
    refused = refusal_of(velocity({}, topic="/lamp"), policy)
    assert refused is not None
    assert refused.rule == key
    assert f"({key}: " in refused.error.message
    assert f"change {key}" in refused.error.hint


def test_only_what_is_allowed_passes_and_a_denial_is_stronger() -> None:
    patterns = {CommandKind.PUBLISH: Patterns(allow=("/lamp/*",), deny=("/lamp/laser",))}
    policy = Policy(patterns=patterns)

    def is_allowed(topic: str) -> bool:
        return decide(velocity({}, topic=topic), policy=policy, situation=NOW) == Allowed()

    assert is_allowed("/lamp/red")
    assert not is_allowed("/lamp/laser")
    assert not is_allowed("/cmd_vel")


@pytest.mark.parametrize(
    ("hours", "closed_at", "open_at"),
    [
        (Hours(begins=time(8), ends=time(14)), "08:00 12:00 13:59", "07:59 14:00 23:00"),
        (Hours(begins=time(22), ends=time(6)), "22:00 23:59 00:00 05:59", "06:00 12:00 21:59"),
        (Hours(ends=time(14)), "00:00 13:59", "14:00"),
        (Hours(begins=time(8)), "08:00 23:59", "00:00 07:59"),
        (Hours(), "00:00 12:00 23:59", ""),
        (Hours(begins=time(8), ends=time(14), days=frozenset({1})), "", "08:00 12:00"),
        (Hours(begins=time(22), ends=time(6), days=frozenset({6})), "05:59", "06:00 22:00"),
    ],
)
def test_hours_close_by_the_operators_clock(hours: Hours, closed_at: str, open_at: str) -> None:
    def on_monday(text: str) -> datetime:
        return datetime.combine(MONDAY_NOON.date(), time.fromisoformat(text), MONDAY_NOON.tzinfo)

    assert [text for text in closed_at.split() if hours.end_of(on_monday(text)) is None] == []
    assert [text for text in open_at.split() if hours.end_of(on_monday(text))] == []


def test_hours_say_when_they_end() -> None:
    over_night = Hours(begins=time(22), ends=time(6))
    late = MONDAY_NOON.replace(hour=23)
    assert over_night.end_of(late) == MONDAY_NOON.replace(hour=6) + timedelta(days=1)


@pytest.mark.parametrize("wrap", [lambda inner: [inner], lambda inner: {"inner": inner}])
@pytest.mark.parametrize(("depth", "is_read"), [(5, True), (50, False)])
def test_a_slow_velocity_passes_where_it_is_not_nested_too_deep(
    wrap: Callable[[object], object], depth: int, *, is_read: bool
) -> None:
    nested: object = twist(0.1)
    for _ in range(depth):
        nested = wrap(nested)
    decision = decide(velocity({"deep": nested}), policy=Policy(), situation=NOW)
    assert isinstance(decision, Allowed) == is_read
