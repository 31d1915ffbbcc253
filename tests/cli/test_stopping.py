import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import anyio
import anyio.to_thread
import pytest
from click.testing import CliRunner, Result

from causes import quote_of
from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.cli import cli
from mapspeak.cli.operating import hold_robots
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.session import Session


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, arguments)


@pytest.mark.anyio
async def test_a_stop_reaches_a_server_that_watches_and_says_which_robot_stands(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    guard = make_guard(tmp_path)
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0, guard=guard)
    with session.drives.preparing() as ticket:
        drive = await session.drives.start(Pose(6.0, 1.4), place="there", ticket=ticket)
    control = str(tmp_path / "control")
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(session.keep_watch)
        result = await anyio.to_thread.run_sync(
            lambda: run("stop", "--control", control, "--reason", "smoke", "--wait-s", "20")
        )
        tasks.cancel_scope.cancel()
    assert result.exit_code == 0, result.output
    assert "Stopped and held: fake robot" in result.output
    assert robot.n_stops == 1
    report = await session.drives.report(drive.goal_id)
    assert "smoke" in quote_of(report.status)


@pytest.mark.anyio
async def test_a_stop_names_each_robot_that_stands_and_each_that_has_not_answered(
    tmp_path: Path,
) -> None:
    control = str(tmp_path / "control")
    hall = replace(make_guard(tmp_path), robot="hall")
    yard = replace(make_guard(tmp_path), robot="yard")
    hall.hold.join("frozen")
    sessions = [
        Session(FakeRobot(two_rooms()), SemanticMapStore(tmp_path / "m"), lease_s=60.0, guard=each)
        for each in (hall, yard)
    ]
    async with anyio.create_task_group() as tasks:
        for session in sessions:
            tasks.start_soon(session.keep_watch)
        result = await anyio.to_thread.run_sync(
            lambda: run("stop", "--control", control, "--wait-s", "1")
        )
        tasks.cancel_scope.cancel()
    assert result.exit_code == 1
    assert "Stopped and held: hall, yard" in result.output or "yard, hall" in result.output
    assert "NOT KNOWN TO STAND: frozen; no answer" in result.output


def test_a_robot_whose_stop_failed_is_no_success(tmp_path: Path) -> None:
    control = tmp_path / "control"
    hold = make_guard(tmp_path).hold
    stopped, failing = hold_robots(hold, reason="smoke", wait_s=0.0)
    held_by = hold.read()
    assert held_by is not None
    hold.answer("hall", held_by=held_by, failure="The line is dead.")
    assert (stopped, failing, hold.answers()) == ((), (), ())
    assert hold.failures() == (("hall", "The line is dead."),)
    assert control.exists()


@pytest.mark.anyio
async def test_a_stop_that_fails_is_told_with_why(tmp_path: Path) -> None:
    class DeafRobot(FakeRobot):
        async def stop(self) -> None:
            raise LinkError("The line is dead.", hint="Wait.")

    guard = make_guard(tmp_path)
    memory = SemanticMapStore(tmp_path / "m.yaml")
    session = Session(DeafRobot(two_rooms()), memory, lease_s=60.0, guard=guard)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(session.keep_watch)
        result = await anyio.to_thread.run_sync(
            lambda: run("stop", "--control", str(tmp_path / "control"), "--wait-s", "1")
        )
        tasks.cancel_scope.cancel()
    assert result.exit_code == 1
    assert "Stopped and held" not in result.output
    assert "NOT KNOWN TO STAND: fake robot" in result.output


def test_a_stop_loads_nothing_heavy(tmp_path: Path) -> None:
    program = (
        "import sys; from mapspeak.cli import cli\n"
        f"try: cli(['stop', '--control', {str(tmp_path)!r}, '--wait-s', '0'])\n"
        "except SystemExit: pass\n"
        "print(sorted({'cv2', 'numpy', 'pydantic', 'mcp'} & set(sys.modules)))"
    )
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    assert done.stdout.strip() == "[]"
    assert (tmp_path / "hold").exists()


def test_a_server_that_was_killed_is_waited_for_no_more(tmp_path: Path) -> None:
    hold = make_guard(tmp_path).hold
    hold.join("gone")
    for path in (tmp_path / "control" / "served").iterdir():
        path.write_text(path.read_text().replace(str(os.getpid()), "999999999"))
    assert hold.unanswered() == ()


def test_what_a_killed_server_left_goes_when_the_next_one_starts(tmp_path: Path) -> None:
    hold, served = make_guard(tmp_path).hold, tmp_path / "control" / "served"
    hold.join("gone")
    [left] = served.iterdir()
    told = left.read_text().replace(str(os.getpid()), "999999999")
    left.rename(served / "999999999-0.json").write_text(told)
    elsewhere = served / "999999999-1.json"
    elsewhere.write_text(told.replace(os.uname().nodename, "another container"))
    hold.join("mine")
    assert set(served.iterdir()) == {elsewhere, *served.glob(f"{os.getpid()}-*")}


def test_a_stop_that_no_server_hears_says_so_and_holds_all_the_same(tmp_path: Path) -> None:
    control = str(tmp_path / "control")
    result = run("stop", "--control", control, "--wait-s", "0")
    assert result.exit_code == 1
    assert "no server has answered" in result.output
    assert make_guard(tmp_path).hold.read()
    assert "Released." in run("release", "--control", control).output
    assert make_guard(tmp_path).hold.read() is None
    assert "Nothing was held." in run("release", "--control", control).output


def test_a_stop_that_cannot_be_written_points_to_the_robots_own_button(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = run("stop", "--control", str(tmp_path / "file" / "control"))
    assert result.exit_code != 0
    assert "stop button" in str(result.exception)


def test_a_hold_can_be_made_and_lifted_with_no_program_of_ours(tmp_path: Path) -> None:
    hold = make_guard(tmp_path).hold
    hold.folder.mkdir()
    hold.file.touch()
    assert hold.read() == "by hand"
    hold.file.unlink()
    assert hold.read() is None


def test_a_hold_that_cannot_be_read_holds(tmp_path: Path) -> None:
    hold = make_guard(tmp_path).hold
    hold.file.mkdir(parents=True)
    assert "cannot be read" in str(hold.read())
