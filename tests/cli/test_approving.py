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


def request(guard: Guard) -> str:
    with pytest.raises(ApprovalNeededError) as raised:
        guard.clear(LAMP, robot_s=0.0)
    return raised.value.request_id


def approve(folder: Path, *arguments: str) -> str:
    options = ["--control", str(folder / "control")]
    result = CliRunner().invoke(cli, ["approve", *arguments, *options])
    return result.output if result.exit_code == 0 else str(result.exception)


def test_what_waits_is_listed_and_approved_by_its_id(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, QUEUED)
    assert "Nothing waits" in approve(tmp_path)
    request_id = request(guard)
    assert approve(tmp_path) == (
        f'{request_id}  publish std_msgs/msg/Bool on /lamp: {{"data": true}}\n'
    )
    assert "Approved: publish" in approve(tmp_path, request_id)
    assert "Nothing waits" in approve(tmp_path)
    guard.clear(LAMP, robot_s=0.0)
    assert request(guard) != request_id


def test_the_same_request_waits_once(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, QUEUED)
    assert request(guard) == request(guard)


def test_a_word_that_nobody_used_is_forgotten_in_the_end(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, QUEUED)
    request_id = request(guard)
    approve(tmp_path, request_id)
    now_s = guard.approvals.now_s()
    guard.approvals.now_s = lambda: now_s + 601.0
    assert request(guard) != request_id


def test_an_id_that_nothing_waits_under_is_answered_with_what_does(tmp_path: Path) -> None:
    request_id = request(make_guard(tmp_path, QUEUED))
    assert request_id in approve(tmp_path, "7-7")
    assert request_id in approve(tmp_path, "../../hold")


def test_what_waits_is_listed_on_one_printable_line_each(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, QUEUED)
    evil = "drive, asked by x\n9-9  stop\x1b[2K\x1b[1G\u202eevil"
    guard.approvals.room.add("1-1", evil, server="1")
    output = approve(tmp_path)
    assert output.count("\n") == 1
    assert output.rstrip("\n").isprintable()
    assert output.startswith("1-1  drive, asked by x 9-9 stop")
