import json
import stat
from pathlib import Path

import pytest

from guarding import WallClock, audit_of, make_guard
from mapspeak.errors import ConfigError, PolicyError
from mapspeak.safety import (
    NOBODY,
    AuditLog,
    Publish,
    Refused,
    SetParameter,
    decide,
    read_audit,
)


def publish(message: object) -> Publish:
    return Publish(topic="/lamp", type="std_msgs/msg/String", message={"data": message})


def test_a_log_grows_and_is_never_begun_anew(tmp_path: Path) -> None:
    for _ in range(2):
        guard = make_guard(tmp_path)
        guard.clear(publish("on"), robot_s=1.0)
    assert len(audit_of(tmp_path)) == 2


def test_a_log_that_has_grown_large_is_set_aside_in_place_of_the_one_before(
    tmp_path: Path,
) -> None:
    log = AuditLog(tmp_path / "audit.jsonl", wall_clock=WallClock(), most_bytes=1_000)
    for number in range(20):
        log.write("stop", number=number, caller=NOBODY, robot_s=1.0, said="x" * 100)
    files = [tmp_path / "audit.jsonl.1", tmp_path / "audit.jsonl"]
    kept = [line.number for file in files if file.exists() for line in read_audit(file)]
    assert kept == list(range(kept[0], 20))
    assert 0 < kept[0] <= 19
    assert all(file.stat().st_size < 2_000 for file in tmp_path.iterdir())


def test_a_log_is_for_its_owner_alone(tmp_path: Path) -> None:
    make_guard(tmp_path).clear(publish("on"), robot_s=1.0)
    mode = stat.S_IMODE((tmp_path / "audit.jsonl").stat().st_mode)
    assert mode == 0o600


@pytest.mark.parametrize(
    "message",
    ["\n{}\n", "\x00", "\ud800", "x" * 100_000, float("nan"), {1, 2}, b"\xff", ["\u2028"] * 9],
)
def test_whatever_is_published_is_one_line_of_json(tmp_path: Path, message: object) -> None:
    make_guard(tmp_path).clear(publish(message), robot_s=1.0)
    text = (tmp_path / "audit.jsonl").read_bytes()
    assert text.count(b"\n") == 1
    assert len(text) < 10_000
    json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert len(audit_of(tmp_path)) == 1


def test_why_something_was_refused_is_noted_with_the_rule(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    command = SetParameter(node="/base", name="max_vel_x", value=9)
    with pytest.raises(PolicyError):
        guard.clear(command, robot_s=1.0)
    (line,) = audit_of(tmp_path)
    assert line.verdict == "refused"
    assert line.said.startswith("set_parameter.usual_denials: ")


def test_a_last_line_that_a_crash_cut_off_is_left_out(tmp_path: Path) -> None:
    make_guard(tmp_path).clear(publish("on"), robot_s=1.0)
    with (tmp_path / "audit.jsonl").open("a") as file:
        file.write('{"number": 2, "ru')
    assert len(audit_of(tmp_path)) == 1


def test_a_line_that_was_cut_off_costs_none_of_those_before_and_after_it(tmp_path: Path) -> None:
    make_guard(tmp_path).clear(publish("on"), robot_s=1.0)
    with (tmp_path / "audit.jsonl").open("a", errors="surrogateescape") as file:
        file.write('{"number": 2, "said": "gr\udcc3')
    make_guard(tmp_path).clear(publish("off"), robot_s=2.0)
    assert [line.robot_s for line in audit_of(tmp_path)] == [1.0, 2.0]


@pytest.mark.parametrize("text", ["hello\nworld\n", "[]\n{}\n", '{"a": 1}\n{"b": 2}\n'])
def test_a_file_that_is_no_log_is_named_with_its_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "other.txt"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"other\.txt, line 1"):
        list(read_audit(path))


def test_a_log_that_cannot_be_written_allows_nothing(tmp_path: Path) -> None:
    (tmp_path / "audit.jsonl").mkdir()
    guard = make_guard(tmp_path)
    assert not isinstance(
        decide(publish("on"), policy=guard.policy, situation=guard._situation(publish(""), 0.0)),
        Refused,
    )
    with pytest.raises(PolicyError, match="audit log"):
        guard.clear(publish("on"), robot_s=1.0)


def test_a_log_whose_folder_went_away_makes_it_again(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "deep" / "er" / "audit.jsonl", wall_clock=WallClock())
    log.write("stop", number=1, caller=NOBODY, robot_s=0.0)
    assert len(list(read_audit(log.path))) == 1


def test_a_line_tells_the_kind_of_its_command_and_what_it_does(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    guard.clear(publish("on"), robot_s=1.23456)
    guard.note_event("stop", "by the client", robot_s=float("nan"))
    command, stop = audit_of(tmp_path)
    assert (command.kind, command.what, command.robot_s) == (
        "publish",
        "publish std_msgs/msg/String on /lamp",
        1.235,
    )
    assert (stop.kind, stop.what, stop.robot_s) == ("", "", None)
