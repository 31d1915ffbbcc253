"""The steps of missions on disk: one JSON line a step, so that a killed server leaves a record."""

import json
import logging
import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from mapspeak.hold import is_running

logger = logging.getLogger(__name__)

MOST_BYTES = 5_000_000
"""A file that has grown larger is renamed to "NAME.1", in place of the one before."""
MOST_TOLD = 5


@dataclass(slots=True)
class Interrupted:
    """A mission that a server began and did not live to end.

    Attributes:
        begun: ISO 8601, by the operator's clock.
        steps: The steps it had done.
    """

    name: str
    begun: str
    steps: tuple[str, ...] = ()


@dataclass(eq=False)
class MissionRecord:
    """Writes one file, and finds in it the missions that an earlier server left unfinished.

    Attributes:
        path: The file.
        wall_clock: The operator's; without one no times are written.
    """

    path: Path
    _: KW_ONLY
    wall_clock: Callable[[], datetime | None]
    _run: str = ""

    def begin(self, name: str) -> None:
        """Note that a mission begins; the following steps are its own."""
        self._run = secrets.token_hex(4)
        self._write("begun", name)

    def note(self, said: str) -> None:
        """Note a step."""
        self._write("step", said)

    def end(self, said: str) -> None:
        """Note how the mission has ended."""
        self._write("ended", said)

    def take_interrupted(self) -> tuple[Interrupted, ...]:
        """Return the missions that no server will end any more, once: they are noted as ended."""
        found: dict[str, Interrupted] = {}
        for line in self._read():
            run, event, said = str(line.get("run")), line.get("event"), str(line.get("said"))
            process = line.get("process")
            # Another server goes on; this one has begun nothing before it looks.
            if event == "begun" and (process == os.getpid() or not is_running(process)):
                found[run] = Interrupted(said, str(line.get("at")))
            elif event == "step" and run in found:
                found[run].steps += (said,)
            elif event == "ended":
                found.pop(run, None)
        if found:
            # The last line of a server that was killed may be half a line.
            with suppress(OSError), self.path.open("a", encoding="utf-8") as file:
                file.write("\n")
        for run in found:
            self._run = run
            self.end("interrupted: its server ended")
        return tuple(found.values())[-MOST_TOLD:]

    def _read(self) -> Iterator[dict[str, Any]]:
        lines: list[str] = []
        with suppress(OSError):
            lines = self.path.read_text(encoding="utf-8").splitlines()
        for line in lines:
            with suppress(ValueError):
                if isinstance(read := json.loads(line), dict):
                    yield read

    def _write(self, event: str, said: str) -> None:
        """Append a line; that it cannot be is told, and ends no mission."""
        at = self.wall_clock()
        line = {
            "at": None if at is None else at.isoformat(timespec="seconds"),
            "run": self._run,
            "process": os.getpid(),
            "event": event,
            "said": said,
        }
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if self.path.exists() and self.path.stat().st_size > MOST_BYTES:
                self.path.replace(self.path.with_name(f"{self.path.name}.1"))
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
        except OSError as error:
            logger.warning("What missions do could not be noted: %s", error.strerror)
