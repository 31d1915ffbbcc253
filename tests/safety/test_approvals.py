"""A person's word: for one command, or for what one call drives and commands."""

from pathlib import Path

import pytest

from guarding import make_guard
from mapspeak.errors import ConfigError
from mapspeak.geometry import Pose
from mapspeak.places.goalcheck import GoalCheck, GoalVerdict
from mapspeak.safety import (
    Act,
    Approval,
    ApprovalNeededError,
    ApprovalScope,
    Call,
    Caller,
    Command,
    CommandKind,
    DriveCommand,
    Guard,
    Otherwise,
    Policy,
    Publish,
    WaitingRoom,
    calling,
    within_scope,
)

KINDS = frozenset({CommandKind.DRIVE, CommandKind.PUBLISH})
LAMP = Publish(topic="/lamp", type="std_msgs/msg/String", message={"data": "on"})
EXPLORE = ApprovalScope(what="explore", n_drives=2, duration_s=60.0, n_commands=1)


def drive(x: float = 1.0, *, yaw_rad: float = 2.0) -> DriveCommand:
    goal = Pose(x, 2.0, yaw_rad)
    check = GoalCheck(
        verdict=GoalVerdict.OK, goal=goal, radius_m=0.2, clearance_m=1.0, path_m=3.0, areas=()
    )
    return DriveCommand(goal=goal, check=check)


@pytest.fixture
def guard(tmp_path: Path) -> Guard:
    """A guard that lets every drive and message wait for a person's word."""
    policy = Policy(approval=Approval(kinds=KINDS, otherwise=Otherwise.QUEUE))
    return make_guard(tmp_path, policy)


def ask(guard: Guard, command: Command, *, robot_s: float = 0.0) -> str:
    """Gives the id under which a command now waits; it fails where the command is allowed."""
    with pytest.raises(ApprovalNeededError) as raised:
        guard.clear(command, robot_s=robot_s)
    return raised.value.request_id


def test_a_word_for_a_call_covers_its_drives_and_commands_and_no_more(guard: Guard) -> None:
    with within_scope(EXPLORE):
        word = ask(guard, drive())
        guard.approvals.room.approve(word)
        for command in (drive(1.0), LAMP, drive(5.0)):
            assert guard.clear(command, robot_s=1.0).by.startswith(word)
        ask(guard, drive(), robot_s=2.0)


def test_of_commands_a_word_for_a_call_covers_its_number_too(guard: Guard) -> None:
    with within_scope(EXPLORE):
        guard.approvals.room.approve(ask(guard, drive()))
        guard.clear(LAMP, robot_s=1.0)
        ask(guard, LAMP, robot_s=2.0)


@pytest.mark.parametrize(("robot_s", "is_covered"), [(159.0, True), (161.0, False), (90.0, False)])
def test_a_word_for_a_call_covers_its_time_by_the_robots_clock(
    guard: Guard, robot_s: float, *, is_covered: bool
) -> None:
    with within_scope(EXPLORE):
        guard.approvals.room.approve(ask(guard, drive()))
        guard.clear(drive(), robot_s=100.0)
        if is_covered:
            guard.clear(drive(), robot_s=robot_s)
        else:
            ask(guard, drive(), robot_s=robot_s)


def test_a_word_for_a_call_covers_neither_other_calls_nor_other_clients(guard: Guard) -> None:
    with within_scope(EXPLORE):
        guard.approvals.room.approve(ask(guard, drive()))
        with calling(Caller(client="another")):
            ask(guard, drive())
    with within_scope(ApprovalScope(what="search", n_drives=2, duration_s=60.0)):
        ask(guard, drive())
    ask(guard, drive())
    with within_scope(EXPLORE):
        guard.clear(drive(), robot_s=1.0)
        with calling(Caller(client="another")):
            ask(guard, drive(), robot_s=1.0)


@pytest.mark.parametrize("does_all", [True, False])
def test_after_a_stop_and_after_a_call_its_word_covers_nothing(
    guard: Guard, *, does_all: bool
) -> None:
    with within_scope(EXPLORE):
        guard.approvals.room.approve(ask(guard, drive()))
        guard.clear(drive(), robot_s=1.0)
        if does_all:
            guard.end_scopes()
        else:
            guard.end_scope(EXPLORE)
        ask(guard, drive(), robot_s=2.0)


@pytest.mark.parametrize(
    ("changed", "is_same"),
    [
        (drive(1.05), True),
        (drive(1.2), False),
        (drive(yaw_rad=2.1), True),
        (drive(yaw_rad=1.9), True),
        (drive(yaw_rad=2.3), False),
        (drive(yaw_rad=-2.0), False),
        (LAMP, False),
    ],
)
def test_a_word_for_a_drive_holds_while_its_goal_stays_nearly_where_it_was(
    guard: Guard, changed: Command, *, is_same: bool
) -> None:
    word = ask(guard, drive())
    guard.approvals.room.approve(word)
    if is_same:
        assert guard.clear(changed, robot_s=1.0).by == word
    else:
        assert ask(guard, changed) != word


def test_who_names_what_does_not_wait_is_told_what_does(tmp_path: Path) -> None:
    room = WaitingRoom(tmp_path)
    room.add("ab-1", "drive", server="ab")
    with pytest.raises(ConfigError) as raised:
        room.approve("ab-2")
    assert "ab-1" in raised.value.hint
    room.refuse("ab-1")
    assert room.list_waiting() == {}


@pytest.mark.parametrize(
    ("command", "carried"),
    [
        (LAMP, '{"data": "on"}'),
        (Call(service="/lamp/set", type="", arguments={"level": 3}), '{"level": 3}'),
        (Act(action="/arm/wave", type="a/action/Wave", goal={"times": 2}), '{"times": 2}'),
        (Publish(topic="/a", type="", message={"data": "x" * 2_000}), "(of 2,012 characters)"),
    ],
)
def test_a_person_is_told_what_a_command_carries(
    tmp_path: Path, command: Command, carried: str
) -> None:
    kinds = frozenset(CommandKind)
    policy = Policy(approval=Approval(kinds=kinds, otherwise=Otherwise.QUEUE))
    guard = make_guard(tmp_path, policy)
    with pytest.raises(ApprovalNeededError) as raised:
        guard.clear(command, robot_s=0.0)
    (waiting,) = guard.approvals.room.list_waiting().values()
    assert carried in raised.value.question
    assert carried in waiting


def test_a_word_for_an_earlier_server_is_no_word_for_this_one(tmp_path: Path) -> None:
    """Servers share a folder, and what was approved for one that has crashed stays there."""
    policy = Policy(approval=Approval(kinds=KINDS, otherwise=Otherwise.QUEUE))
    servers = [make_guard(tmp_path, policy) for _ in range(2)]
    for each in servers:
        each.approvals._server = f"ab12{each.approvals._server}"
    servers[0].approvals.room.approve(ask(servers[0], LAMP))
    ask(servers[1], drive())
    ask(servers[1], drive())
