"""Keys in a terminal that stop a robot and let it go on, while something is shown there."""

import os
import select
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from mapspeak.cli.operating import hold_robots
from mapspeak.errors import ConfigError

if TYPE_CHECKING:
    from mapspeak.safety import Hold

STOP = b" s"
RELEASE = b"r"
HELP = "Space or s stops the robot, r lets it go on."
WAIT_S = 2.0
LOOK_S = 0.05
MOST_BYTES = 64

Tell = Callable[[str], None]


class StopKeys:
    """What the keys of one terminal do.

    Args:
        hold: Keeps the robot standing.
        tell: Shows a line to the person.
    """

    def __init__(self, hold: "Hold", *, tell: Tell) -> None:
        self._hold = hold
        self._tell = tell
        self._is_over = threading.Event()

    def press(self, keys: bytes) -> None:
        """Do what each key says, in their order; other keys do nothing."""
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
        """Let whoever waits go on."""
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
    """Listen for keys in a terminal; return None, and do nothing, where there is none.

    The terminal gives each key at once meanwhile, and is set back afterwards. Ctrl-C stays.

    Args:
        hold: Keeps the robot standing.
        tell: Shows a line to the person.
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
    """Hand on what is typed, until woken or the terminal is gone."""
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
