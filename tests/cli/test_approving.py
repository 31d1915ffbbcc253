from pathlib import Path

import pytest
from click.testing import CliRunner

from guarding import make_guard
from mapspeak.cli import cli
from mapspeak.safety import (
    Approval,
    ApprovalNeededError,
    CommandKind,
    Guard,
    Otherwise,
    Policy,
    Publish,
)

LAMP = Publish(topic="/lamp", type="std_msgs/msg/Bool", message={"data": True})
QUEUED = Policy(
    approval=Approval(kinds=frozenset({CommandKind.PUBLISH}), otherwise=Otherwise.QUEUE)
)


def wish(guard: Guard) -> str:
    with pytest.raises(ApprovalNeededError) as raised:
        guard.clear(LAMP, robot_s=0.0)
    return raised.value.wish_id


def approve(folder: Path, *arguments: str) -> str:
    options = ["--control", str(folder / "control")]
    result = CliRunner().invoke(cli, ["approve", *arguments, *options])
    return result.output if result.exit_code == 0 else str(result.exception)


def test_what_waits_is_listed_and_approved_by_its_id(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, QUEUED)
    assert "Nothing waits" in approve(tmp_path)
    wish_id = wish(guard)
    assert approve(tmp_path) == f"{wish_id}  publish std_msgs/msg/Bool on /lamp\n"
    assert "Approved: publish" in approve(tmp_path, wish_id)
    assert "Nothing waits" in approve(tmp_path)
    guard.clear(LAMP, robot_s=0.0)
    assert wish(guard) != wish_id


def test_the_same_wish_waits_once(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, QUEUED)
    assert wish(guard) == wish(guard)


def test_a_word_that_nobody_used_is_forgotten_in_the_end(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, QUEUED)
    wish_id = wish(guard)
    approve(tmp_path, wish_id)
    now_s = guard.approvals.now_s()
    guard.approvals.now_s = lambda: now_s + 601.0
    assert wish(guard) != wish_id


def test_an_id_that_nothing_waits_under_is_answered_with_what_does(tmp_path: Path) -> None:
    wish_id = wish(make_guard(tmp_path, QUEUED))
    assert wish_id in approve(tmp_path, "7-7")
    assert wish_id in approve(tmp_path, "../../hold")


def test_what_waits_is_listed_on_one_printable_line_each(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, QUEUED)
    guard.approvals.room.add("1-1", "drive, asked by x\n9-9  stop\x1b[2K\x1b[1G\u202eevil")
    output = approve(tmp_path)
    assert output.count("\n") == 1
    assert output.rstrip("\n").isprintable()
    assert output.startswith("1-1  drive, asked by x 9-9 stop")
