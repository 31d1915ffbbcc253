"""Hears the calls of another program as they happen, from the log that the server writes."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import anyio

from mapspeak.evaluation.client import Picture, ToolAnswer, Witness

__all__ = ["Listener"]

EVERY_S = 0.1


@dataclass(slots=True)
class Listener:
    """Reads a growing call log, and tells a witness of each call in it.

    Attributes:
        log: The file; it may not be there yet.
        witness: Who is told; None for nobody.
        n_heard: Calls so far.
    """

    log: Path
    witness: Witness | None
    n_heard: int = field(default=0, init=False)
    _n_read: int = field(default=0, init=False)

    async def listen(self) -> None:
        """Listen until it is cancelled.

        Raises:
            OutOfBudgetError: The witness has heard more than may be.
        """
        while True:
            self.hear_new()
            # A file has no event that every system would tell us of.
            await anyio.sleep(EVERY_S)

    def hear_new(self) -> None:
        """Tell of every whole line that was not there before.

        Raises:
            OutOfBudgetError: The witness has heard more than may be.
        """
        if not self.log.exists():
            return
        with self.log.open("rb") as file:
            file.seek(self._n_read)
            lines = file.read().rpartition(b"\n")[0]
        for line in lines.split(b"\n") if lines else ():
            self._n_read += len(line) + 1
            self.n_heard += 1
            self._tell(json.loads(line))

    def _tell(self, line: dict[str, Any]) -> None:
        if self.witness is None:
            return
        answer = ToolAnswer(
            text=line["text"],
            pictures=tuple(self._read_picture(name) for name in line["pictures"]),
            report=line["report"],
            is_error=line["is_error"],
        )
        self.witness.hear_call(line["tool"], line["arguments"])
        self.witness.hear_answer(line["tool"], line["arguments"], answer)

    def _read_picture(self, name: str) -> Picture:
        path = self.log.with_suffix("") / name
        return Picture(path.read_bytes(), "image/jpeg" if path.suffix == ".jpg" else "image/png")
