"""The hold: while its file exists the robot stands, for every client and every server.

It is a file because a file is simple, is seen by every server at once, outlives them all, and can
be made and removed by a person with no program of ours at all.
"""

import json
import os
import re
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from mapspeak.atomic import replace_file
from mapspeak.errors import ConfigError

FRACTION = re.compile(r"(?<=:\d\d)\.\d+$")

HOLD = "hold"
ANSWERS = "standing"
SERVED = "served"


@dataclass(frozen=True, slots=True)
class Hold:
    """What keeps robots standing, in a folder that servers and operators share."""

    folder: Path

    @property
    def file(self) -> Path:
        """The file that is the hold."""
        return self.folder / HOLD

    def read(self) -> str | None:
        """Return why the robot is held; None where it is not. What cannot be read holds too."""
        try:
            return self.file.read_text(encoding="utf-8", errors="replace").strip() or "by hand"
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            return f"{self.file} cannot be read ({error.strerror or error})"

    def put(self, reason: str, *, at: datetime) -> None:
        """Hold every robot of this folder.

        Raises:
            ConfigError: The file cannot be written.
        """
        text = f"{reason}, at {at:%Y-%m-%d %H:%M:%S.%f}\n"
        self._do(lambda: replace_file(self.file, text.encode()))

    def lift(self) -> bool:
        """Let robots drive again, and return whether they were held.

        Raises:
            ConfigError: The file cannot be removed.
        """
        was_held = self.read() is not None
        self._do(lambda: self.file.unlink(missing_ok=True))
        return was_held

    def answer(self, robot: str, *, held_by: str, failure: str = "") -> None:
        """Tell what became of a robot because of this hold; never raises.

        A server that cannot answer has stopped its robot all the same.

        Args:
            held_by: What `read` gave.
            failure: Why it could not be stopped; empty when it was.
        """
        path = self.folder / ANSWERS / _file_of(robot)
        told = {"robot": robot, "held_by": held_by, "failure": failure}
        with suppress(OSError):
            replace_file(path, json.dumps(told).encode())

    def answers(self) -> tuple[str, ...]:
        """Return the robots that were stopped because of the present hold."""
        return tuple(robot for robot, failure in self._told() if not failure)

    def failures(self) -> tuple[tuple[str, str], ...]:
        """Return the robots that could not be stopped for the present hold, each with why."""
        return tuple((robot, failure) for robot, failure in self._told() if failure)

    def _told(self) -> Iterator[tuple[str, str]]:
        held_by = self.read()
        for path, told in _read_all(self.folder / ANSWERS):
            if told.get("held_by") == held_by:
                yield str(told.get("robot", path.stem)), str(told.get("failure") or "")

    def join(self, robot: str, *, address: str = "") -> None:
        """Tell that a robot is served from here, so that a stop knows whose answer it awaits.

        What servers of this machine have left that were killed is removed.

        Args:
            address: Where it is; empty for one that only this process has.
        """
        here = os.uname().nodename
        told = {"robot": robot, "process": os.getpid(), "host": here, "address": address}
        with suppress(OSError):
            replace_file(self.folder / SERVED / _file_of(robot), json.dumps(told).encode())
            for path, left in _read_all(self.folder / SERVED):
                # In another container of the same folder a process of that id may run.
                if left.get("host", here) == here and not is_running(left.get("process")):
                    path.unlink(missing_ok=True)

    def servers_of(self, address: str) -> tuple[int, ...]:
        """Return the other processes that serve the robot at an address."""
        # A simulated robot has none.
        served = _read_all(self.folder / SERVED) if address else ()
        found = {
            int(told["process"])
            for _, told in served
            if told.get("address") == address and is_running(told.get("process"))
        }
        return tuple(sorted(found - {os.getpid()}))

    def leave(self, robot: str) -> None:
        """Tell that it no longer is."""
        with suppress(OSError):
            (self.folder / SERVED / _file_of(robot)).unlink(missing_ok=True)

    def unanswered(self) -> tuple[str, ...]:
        """Return the robots that are served and have not answered to the present hold."""
        held_by = self.read()
        answered = {
            path.name
            for path, told in _read_all(self.folder / ANSWERS)
            if told.get("held_by") == held_by
        }
        return tuple(
            str(told.get("robot"))
            for path, told in _read_all(self.folder / SERVED)
            if path.name not in answered and is_running(told.get("process"))
        )

    def _do(self, work: Callable[[], object]) -> None:
        try:
            work()
        except OSError as error:
            raise ConfigError(
                f"{self.file} cannot be changed: {error.strerror or error}.",
                hint="Check who owns that folder; press the robot's own stop button meanwhile.",
            ) from error


def say_hold(held_by: str) -> str:
    """Return why a robot is held, to the second; the rest tells one hold from another."""
    return FRACTION.sub("", held_by)


def _file_of(robot: str) -> str:
    return f"{os.getpid()}-{zlib.crc32(robot.encode()):08x}.json"


def _read_all(folder: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Return what servers have written there; what cannot be read is left away."""
    for path in sorted(folder.glob("*.json")):
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if isinstance(told, dict):
            yield path, told


def is_running(process: object) -> bool:
    """Return True unless a process has ended for sure; one that hangs still has a robot."""
    try:
        os.kill(int(str(process)), 0)
    except (ProcessLookupError, ValueError, OverflowError):
        return False
    except OSError:
        return True
    return True
