"""`mapspeak doctor`: what it says of other servers; and what they are told of each other."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import anyio
import pytest

from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.cli.checkup import find_servers
from mapspeak.cli.shared.options import control_folder
from mapspeak.cli.shared.robots import RobotChoice
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Hold
from mapspeak.session import Session
from rosbridge_robot import ScriptedRobot
from rosserved import on_script
from served import connect, text_of

SERVES = """
import sys
from pathlib import Path
from mapspeak.hold import Hold
Hold(Path(sys.argv[1])).join("robot", address=sys.argv[2])
print("serves", flush=True)
sys.stdin.read()
"""
ADDRESS = "ws://127.0.0.1:9090"
TWIST = {"linear": {"x": 0.1}}


@contextmanager
def another_server(control: Path, address: str = ADDRESS) -> Iterator[int]:
    """Let another process serve a robot; give its number."""
    with subprocess.Popen(  # noqa: S603 - this very Python
        [sys.executable, "-c", SERVES, str(control), address],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline()
        yield process.pid
        process.communicate()


@pytest.mark.anyio
async def test_a_server_is_told_of_another_for_its_robot(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    guard = make_guard(tmp_path)
    guard.address = ADDRESS
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, guard=guard) as client:
        with another_server(guard.hold.folder) as process:
            together = text_of(await client.call_tool("look_at_map", {}))
            session = Session(robot, SemanticMapStore(tmp_path / "m"), lease_s=60.0, guard=guard)
            with anyio.move_on_after(0):
                await session.keep_watch()
        alone = text_of(await client.call_tool("look_at_map", {}))
    assert f"Another mapspeak server, process {process}, drives this robot too" in together
    assert f"process {process}, drives this robot too" in caplog.text
    assert "Another mapspeak server" not in alone


@pytest.mark.anyio
async def test_a_velocity_says_that_another_server_may_publish_too(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    guard.address = ADDRESS
    async with on_script(ScriptedRobot(), tmp_path, guard=guard) as caller:
        with another_server(guard.hold.folder):
            said = await caller.ask("ros_publish", topic="/cmd_vel", fields=TWIST, duration_s=0.1)
    assert "their velocities alternate" in said


def test_servers_of_other_robots_and_of_simulated_ones_are_none(tmp_path: Path) -> None:
    hold = Hold(tmp_path)
    hold.join("mine", address=ADDRESS)
    with another_server(tmp_path, "ws://127.0.0.1:9091"), another_server(tmp_path, ""):
        assert hold.servers_of(ADDRESS) == ()
        assert hold.servers_of("") == ()
    assert RobotChoice(robot="sim:warehouse").address == ""
    assert RobotChoice(robot="ws://bob:secret@host:9090").address == "ws://host:9090"


def test_doctor_names_the_servers_of_a_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    control, choice = control_folder(None), RobotChoice(robot=ADDRESS)
    assert find_servers(choice) == []
    with another_server(control) as one:
        (alone,) = find_servers(choice)
        with another_server(control) as other:
            (together,) = find_servers(choice)
    assert (alone.health, alone.said) == ("fine", f"1 serves this robot: process {one}")
    assert together.health == "doubtful"
    assert str(other) in together.said
    assert "end all but one" in together.hint
