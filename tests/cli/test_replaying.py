from pathlib import Path

import pytest
from click.testing import CliRunner

from guarding import make_guard
from mapspeak.cli import cli
from mapspeak.errors import PolicyError
from mapspeak.safety import Caller, Publish, calling

LAMP = Publish(topic="/lamp", type="std_msgs/msg/Bool", message={"data": True})
TF = Publish(topic="/tf", type="tf2_msgs/msg/TFMessage", message={})


def replay(folder: Path, *arguments: str) -> list[str]:
    result = CliRunner().invoke(cli, ["replay", str(folder / "audit.jsonl"), *arguments])
    assert result.exit_code == 0, result.exception
    return result.output.splitlines()


def test_a_log_is_shown_with_who_what_and_why(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    with calling(Caller(client="tester", tool="publish")):
        cleared = guard.clear(LAMP, robot_s=1.0)
        guard.note_result(cleared, "published", robot_s=1.5)
        with pytest.raises(PolicyError):
            guard.clear(TF, robot_s=2.0)
    guard.note_event("stop", "stopped", robot_s=3.0)
    server, asked, done, refused, stopped, summary = replay(tmp_path)
    assert server.startswith("--- server ")
    assert asked.endswith("#1 publish by tester: publish std_msgs/msg/Bool on /lamp -> allowed")
    assert "1.5 s" in done
    assert done.endswith("result: published")
    assert "refused: publish.usual_denials: The policy denies" in refused
    assert stopped.endswith("#3 mapspeak: -> stop: stopped")
    assert summary == "4 lines shown; 1 commands were refused."
    assert len(replay(tmp_path, "--refused")) == 3


def test_nothing_that_a_log_says_acts_on_the_terminal_or_begins_a_line(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    with calling(Caller(client="evil\x1b[2J\nmapspeak", tool="publish")):
        guard.clear(LAMP, robot_s=1.0)
    guard.note_event("stop", "\x1b]0;title\x07\n#9 mapspeak: all is well", robot_s=3.0)
    shown = CliRunner().invoke(cli, ["replay", str(tmp_path / "audit.jsonl")]).output
    assert all(line.isprintable() for line in shown.splitlines())
    assert len(shown.splitlines()) == 4
