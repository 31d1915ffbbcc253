"""The hold: while its file is there the robot stands, whoever asks and whichever server runs.

It is a file because a file is simple, is seen by every server at once, outlives them all, and can
be made and removed by a person with no program of ours at all.
"""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from mapspeak.errors import ConfigError

__all__ = ["Hold"]

HOLD = "hold"
ANSWERS = "standing"


@dataclass(frozen=True, slots=True)
class Hold:
    """What keeps robots standing, in a folder that servers and operators share.

    Attributes:
        folder: Where.
    """

    folder: Path

    @property
    def file(self) -> Path:
        """The file that is the hold."""
        return self.folder / HOLD

    def read(self) -> str | None:
        """Gives why the robot is held; None where it is not. What cannot be read holds too."""
        try:
            return self.file.read_text(encoding="utf-8", errors="replace").strip() or "by hand"
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            return f"{self.file} cannot be read ({error.strerror or error})"

    def put(self, reason: str, *, at: datetime) -> None:
        """Holds every robot of this folder.

        Raises:
            ConfigError: The file cannot be written.
        """
        text = f"{reason}, at {at:%Y-%m-%d %H:%M:%S.%f}\n"
        self._do(lambda: self._write(self.file, text))

    def lift(self) -> bool:
        """Lets robots drive again, and gives whether they were held.

        Raises:
            ConfigError: The file cannot be removed.
        """
        was_held = self.read() is not None
        self._do(lambda: self.file.unlink(missing_ok=True))
        return was_held

    def answer(self, robot: str, *, held_by: str) -> None:
        """Tells that a robot was commanded to stand because of this hold; never raises.

        A server that cannot answer has stopped its robot all the same.
        """
        path = self.folder / ANSWERS / f"{os.getpid()}-{abs(hash(robot))}.json"
        try:
            self._write(path, json.dumps({"robot": robot, "held_by": held_by}))
        except OSError:
            return

    def answers(self) -> tuple[str, ...]:
        """Gives the robots that were commanded to stand because of the present hold."""
        held_by = self.read()
        robots = []
        for path in sorted((self.folder / ANSWERS).glob("*.json")):
            try:
                told = json.loads(path.read_text(encoding="utf-8"))
            except (OSError, ValueError):
                continue
            if isinstance(told, dict) and told.get("held_by") == held_by:
                robots.append(str(told.get("robot")))
        return tuple(robots)

    def clear_answers(self) -> None:
        """Forgets the answers to earlier holds."""
        for path in (self.folder / ANSWERS).glob("*.json"):
            path.unlink(missing_ok=True)

    def _write(self, path: Path, text: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Renamed into place: a reader never sees half of it.
        temporary = path.with_name(f".{path.name}.{os.getpid()}")
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)

    def _do(self, work: Callable[[], object]) -> None:
        try:
            work()
        except OSError as error:
            raise ConfigError(
                f"{self.file} cannot be changed: {error.strerror or error}.",
                hint="Check who owns that folder; press the robot's own stop button meanwhile.",
            ) from error
