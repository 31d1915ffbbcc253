"""Commands and keys of the operator: approve, stop, release, and replay of the audit log."""

import os
import select
import sys
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mapspeak.cli.shared.options import CONTROL_OPTION, FILE, control_folder, wall_clock
from mapspeak.errors import ConfigError
from mapspeak.hold import Hold
from mapspeak.installation import shell_command

if TYPE_CHECKING:
    from mapspeak.safety import AuditLine, Hold


@click.command()
@click.argument("request_id", required=False)
@CONTROL_OPTION
def approve(request_id: str | None, control: Path | None) -> None:
    """Approve a command that waits, once; without an id it lists what waits."""
    from mapspeak.safety import WaitingRoom  # noqa: PLC0415 - heavy; help must be quick

    room = WaitingRoom(control_folder(control) / "approvals")
    if request_id is not None:
        click.echo(f"Approved: {room.approve(request_id)}.")
        return
    waiting = room.list_waiting()
    for waiting_id, what in waiting.items():
        click.echo(f"{waiting_id}  {what}")
    if not waiting:
        click.echo("Nothing waits for approval.")


POLL_S = 0.01


@click.command()
@CONTROL_OPTION
@click.option("--reason", default="mapspeak stop", show_default=True, help="Reason for the log.")
@click.option(
    "--wait-s", default=2.0, show_default=True, help="How long to wait for servers to answer."
)
def stop(control: Path | None, reason: str, wait_s: float) -> None:
    """Stop every robot that is served from here, and hold it until `mapspeak release`.

    Exit status: 1 if a robot has not answered, or none is served; the hold is set anyway.
    """
    hold = Hold(control_folder(control))
    stopped, unanswered = hold_robots(hold, reason=" ".join(reason.split()), wait_s=wait_s)
    if stopped:
        click.echo(
            f"Stopped and held: {', '.join(stopped)}. `{shell_command('release')}` lets them go on."
        )
    if stopped and not unanswered:
        return
    said = "no server has answered"
    if unanswered:
        said = f"NOT KNOWN TO STAND: {', '.join(unanswered)}; no answer that it stopped"
    click.echo(
        f"Held, but {said} within {wait_s:g} s. If a robot moves, press its own stop button.",
        err=True,
    )
    sys.exit(1)


@click.command()
@CONTROL_OPTION
def release(control: Path | None) -> None:
    """Let robots that were held by `mapspeak stop`, or by a client's stop, drive again."""
    was_held = Hold(control_folder(control)).lift()
    click.echo("Released." if was_held else "Nothing was held.")


def hold_robots(
    hold: Hold, *, reason: str, wait_s: float
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Hold every robot of a folder; return the robots that stopped, and those that did not answer.

    Args:
        reason: For the log.
        wait_s: How long to wait for answers, in wall time.

    Raises:
        ConfigError: The hold cannot be written.
    """
    hold.put(reason, at=wall_clock())
    _wait_for_answers(hold, wait_s=wait_s)
    failed = tuple(f"{robot} ({failure})" for robot, failure in hold.failures())
    return hold.answers(), (*failed, *hold.unanswered())


def _wait_for_answers(hold: Hold, *, wait_s: float) -> None:
    """Return when every served robot has stopped, or after a time limit."""
    deadline_s = time.monotonic() + wait_s
    while time.monotonic() < deadline_s:
        if hold.answers() and not hold.unanswered() and not hold.failures():
            return
        time.sleep(POLL_S)


@click.command()
@click.argument("file", type=FILE)
@click.option("--refused", "only_refused", is_flag=True, help="Only what was refused.")
def replay(file: Path, only_refused: bool) -> None:  # noqa: FBT001 - a flag
    """Show an audit log: who wanted what, what became of it, and why."""
    from mapspeak.memory.quoting import clean_line  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.safety import read_audit  # noqa: PLC0415 - heavy; help must be quick

    n_shown = n_refused = 0
    run = ""
    for line in read_audit(file):
        n_refused += line.verdict == "refused"
        if only_refused and line.verdict != "refused":
            continue
        if line.run != run:
            run = line.run
            click.echo(clean_line(f"--- server {run} {line.robot}"))
        click.echo(clean_line(_say(line)))
        n_shown += 1
    click.echo(f"{n_shown} lines shown; {n_refused} commands were refused.")


def _say(line: "AuditLine") -> str:
    robot_s = "-" if line.robot_s is None else f"{line.robot_s:.1f} s"
    who = " by ".join(filter(None, (line.tool, line.client))) or "mapspeak"
    what = f" {line.what}" if line.what and line.event == "decision" else ""
    verdict = line.verdict or line.event
    said = f": {line.said}" if line.said else ""
    return f"{line.wall_time[:23]}  {robot_s:>9}  #{line.number} {who}:{what} -> {verdict}{said}"


STOP = b" s"
RELEASE = b"r"
HELP = "Space or s stops the robot, r lets it go on."
WAIT_S = 2.0
LOOK_S = 0.05
MOST_BYTES = 64

Tell = Callable[[str], None]


class StopKeys:
    """The effects of the keys of one terminal."""

    def __init__(self, hold: "Hold", *, tell: Tell) -> None:
        self._hold = hold
        self._tell = tell
        self._is_over = threading.Event()

    def press(self, keys: bytes) -> None:
        """Carry out each key in order; ignore other keys."""
        for key in keys:
            try:
                if key in STOP:
                    self._stop()
                elif key in RELEASE:
                    self._tell("Released." if self._hold.lift() else "Nothing was held.")
            except ConfigError as error:
                self._tell(str(error))

    def wait_until_released(self) -> None:
        """Return at once, or when nothing is held any more; for a program that shall pause."""
        while self._hold.read() is not None and not self._is_over.wait(LOOK_S):
            pass

    def end(self) -> None:
        """Wake all waiters."""
        self._is_over.set()

    def _stop(self) -> None:
        stopped, unanswered = hold_robots(self._hold, reason="a key was pressed", wait_s=WAIT_S)
        if stopped and not unanswered:
            self._tell(f"STOPPED and held: {', '.join(stopped)}. Press r to let it go on.")
            return
        if not stopped and not unanswered:
            self._tell("Held: no robot is there yet. Press r to release.")
            return
        names = f" by {', '.join(unanswered)}" if unanswered else ""
        self._tell(f"Held, but not answered{names} within {WAIT_S:g} s. Press r to release.")


@contextmanager
def stop_keys(
    hold: "Hold", *, tell: Tell, terminal: int | None = None
) -> Generator[StopKeys | None]:
    """Listen for keys in a terminal; without one, return None and do nothing.

    The terminal gives each key at once meanwhile, and is set back afterwards. Ctrl-C stays.

    Args:
        terminal: Its file descriptor; standard input unless given.
    """
    terminal = _find_standard_input() if terminal is None else terminal
    if terminal is None or not os.isatty(terminal) or _is_in_background(terminal):
        yield None
        return
    import termios  # noqa: PLC0415 - not there on Windows, where there are no such terminals
    import tty  # noqa: PLC0415

    before = termios.tcgetattr(terminal)
    wake, waker = os.pipe()
    keys = StopKeys(hold, tell=tell)
    reader = threading.Thread(target=_listen, args=(terminal, wake, keys), daemon=True)
    try:
        tty.setcbreak(terminal, termios.TCSANOW)
        reader.start()
        tell(HELP)
        yield keys
    finally:
        keys.end()
        os.write(waker, b".")
        if reader.is_alive():
            reader.join()
        # A terminal that has gone away needs no setting back.
        with suppress(termios.error):
            termios.tcsetattr(terminal, termios.TCSADRAIN, before)
        os.close(wake)
        os.close(waker)


def _listen(terminal: int, wake: int, keys: StopKeys) -> None:
    """Hand on typed keys, until woken or the terminal is gone."""
    while True:
        ready, _, _ = select.select([terminal, wake], [], [])
        if wake in ready:
            return
        try:
            typed = os.read(terminal, MOST_BYTES)
        except OSError:
            return
        if not typed:
            return
        keys.press(typed)


def _find_standard_input() -> int | None:
    """Return its file descriptor; None where it is closed, or no file, as in tests."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):
        return None


def _is_in_background(terminal: int) -> bool:
    """Return True for a job in the background: changing the terminal would suspend it."""
    try:
        return os.tcgetpgrp(terminal) != os.getpgrp()
    except OSError:
        return False
