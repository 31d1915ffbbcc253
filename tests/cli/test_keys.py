"""Keys in a terminal, by a pseudo-terminal: what is written to one end is typed at the other."""

import os
import queue
import termios
from collections.abc import Generator
from pathlib import Path

import anyio
import anyio.to_thread
import pytest

from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.cli.operating import HELP, StopKeys, stop_keys
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Hold
from mapspeak.session import Session

WITHIN_S = 60.0


@pytest.fixture
def terminal() -> Generator[tuple[int, int]]:
    """Gives the end that a person types at, and the end that a program reads."""
    person, program = os.openpty()
    yield person, program
    os.close(person)
    os.close(program)


@pytest.mark.anyio
async def test_a_key_stops_the_robot_and_another_one_lets_it_go_on(
    tmp_path: Path, terminal: tuple[int, int]
) -> None:
    person, program = terminal
    robot, said = FakeRobot(two_rooms()), queue.Queue[str]()
    guard = make_guard(tmp_path)
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0, guard=guard)
    with session.drives.preparing() as ticket:
        await session.drives.start(Pose(6.0, 1.4), place="there", ticket=ticket)

    async def type_key(key: bytes) -> str:
        os.write(person, key)
        return await anyio.to_thread.run_sync(lambda: said.get(timeout=WITHIN_S))

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(session.keep_watch)
        with stop_keys(guard.hold, tell=said.put, terminal=program):
            assert said.get(timeout=WITHIN_S) == HELP
            assert await type_key(b"x ") == (
                "STOPPED and held: fake robot. Press r to let it go on."
            )
            assert robot.n_stops == 1
            assert "a key was pressed" in (guard.hold.read() or "")
            assert await type_key(b"r") == "Released."
            assert guard.hold.read() is None
            assert "STOPPED" in await type_key(b"s")
        tasks.cancel_scope.cancel()
    assert said.empty()


def test_the_terminal_is_set_back_also_after_an_error(
    tmp_path: Path, terminal: tuple[int, int]
) -> None:
    _, program = terminal
    before = termios.tcgetattr(program)

    def fail() -> None:
        with stop_keys(Hold(tmp_path), tell=lambda _: None, terminal=program):
            assert termios.tcgetattr(program) != before
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert termios.tcgetattr(program) == before


def test_what_is_no_terminal_is_left_alone(tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.write(writing, b" ")
    said: list[str] = []
    with stop_keys(Hold(tmp_path), tell=said.append, terminal=reading) as keys:
        assert keys is None
    assert os.read(reading, 1) == b" "
    assert said == []
    os.close(reading)
    os.close(writing)


def test_a_person_who_hangs_up_ends_the_listening(tmp_path: Path) -> None:
    person, program = os.openpty()
    with stop_keys(Hold(tmp_path), tell=lambda _: None, terminal=program):
        os.close(person)
    os.close(program)


def test_a_program_that_pauses_goes_on_after_the_release_or_at_the_end(tmp_path: Path) -> None:
    keys = StopKeys(Hold(tmp_path), tell=lambda _: None)
    keys.wait_until_released()
    (tmp_path / "hold").touch()
    keys.end()
    keys.wait_until_released()


def test_a_stop_before_any_robot_is_there_holds_and_says_so(tmp_path: Path) -> None:
    said: list[str] = []
    StopKeys(Hold(tmp_path), tell=said.append).press(b" ")
    assert said == ["Held: no robot is there yet. Press r to release."]
    assert Hold(tmp_path).read() is not None


def test_a_hold_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    said: list[str] = []
    StopKeys(Hold(tmp_path / "file" / "control"), tell=said.append).press(b" ")
    assert "cannot be changed" in said[0]
