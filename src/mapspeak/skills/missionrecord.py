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

from mapspeak.atomic import append_line
from mapspeak.hold import is_running

logger = logging.getLogger(__name__)

MOST_BYTES = 5_000_000
MOST_TOLD = 5


@dataclass(slots=True)
class Interrupted:
    """A mission that a server began and did not live to end.

    Attributes:
        begun: ISO 8601, by the operator's clock.
    """

    name: str
    begun: str
    steps: tuple[str, ...] = ()


@dataclass(eq=False)
class MissionRecord:
    """Writes one file, and finds in it the missions that an earlier server left unfinished.

    Attributes:
        wall_clock: The operator's; without one no times are written.
    """

    path: Path
    _: KW_ONLY
    wall_clock: Callable[[], datetime | None]
    _run: str = ""

    def begin(self, name: str) -> None:
        """Note that a mission begins; the following steps are its own."""
        self._run = secrets.token_hex(4)
        self.note(name, event="begun")

    def note(self, said: str, *, event: str = "step") -> None:
        """Note a step, or how the mission has "ended"; no fault of the disk ends a mission."""
        at = self.wall_clock()
        line = {
            "at": None if at is None else at.isoformat(timespec="seconds"),
            "run": self._run,
            "process": os.getpid(),
            "event": event,
            "said": said,
        }
        try:
            append_line(self.path, json.dumps(line).encode(), most_bytes=MOST_BYTES)
        except OSError as error:
            logger.warning("What missions do could not be noted: %s", error.strerror)

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
        for run in found:
            self._run = run
            self.note("interrupted: its server ended", event="ended")
        return tuple(found.values())[-MOST_TOLD:]

    def _read(self) -> Iterator[dict[str, Any]]:
        lines: list[str] = []
        with suppress(OSError):
            lines = self.path.read_text(encoding="utf-8").splitlines()
        for line in lines:
            with suppress(ValueError):
                if isinstance(read := json.loads(line), dict):
                    yield read
