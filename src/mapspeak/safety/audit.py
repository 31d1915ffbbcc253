"""The audit log: append-only JSON lines for each decision and result, with the caller."""

import itertools
import json
import math
import os
import secrets
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from mapspeak.atomic import append_line
from mapspeak.errors import ConfigError, PolicyError, say_cause
from mapspeak.safety.commands import Command, DriveCommand, say_command


@dataclass(frozen=True, slots=True, kw_only=True)
class Caller:
    """Whose call is being carried out.

    Attributes:
        client: The client's session; empty where mapspeak acts by itself.
        session: The client's HTTP session; empty on stdio and for clients without one.
        mission: The mission that acts for it; empty where it acts by itself.
    """

    client: str = ""
    tool: str = ""
    session: str = ""
    mission: str = ""

    @property
    def owner(self) -> str:
        """Whose the drives and goals are: a mission goes on when its client is gone."""
        return f"mission {self.mission}" if self.mission else self.session


NOBODY = Caller()

# State of a task, not of the module: each call sees its own, also in the threads it starts.
_CALLER: ContextVar[Caller] = ContextVar("caller", default=NOBODY)


def current_caller() -> Caller:
    """Return whose call this is; empty when mapspeak acts by itself."""
    return _CALLER.get()


@contextmanager
def calling(caller: Caller) -> Generator[None]:
    """Mark what is done in the `with` block as done for a caller."""
    token = _CALLER.set(caller)
    try:
        yield
    finally:
        _CALLER.reset(token)


BEGIN = '{"number": '
"""How each line begins."""
MOST_CHARACTERS = 2_000
"""The most characters kept of one argument; a cut is marked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditLine:
    """One line of the log.

    Attributes:
        number: Of the command that it is about, within one run of a server.
        run: Which run of which server wrote it.
        robot: Which one it is about, where a server has several.
        wall_time: ISO 8601, by the operator's clock.
        event: "decision", "result", "leg", "ended", "stop", "release", "approval" or "memory".
        verdict: "allowed", "refused" or "needs approval"; empty if nothing was decided.
        said: Why, or with what result.
    """

    number: int
    run: str
    robot: str
    wall_time: str
    robot_s: float | None
    event: str
    client: str
    tool: str
    kind: str
    what: str
    verdict: str
    said: str
    details: Mapping[str, Any]


class AuditLog:
    """Writes one file; each line is on its way to the disk when a call returns.

    Args:
        path: The file; its folder is made.
        wall_clock: The operator's.
        robot: What the robot is called in the lines.
        most_bytes: A file that has grown larger is renamed to "NAME.1", in place of the one before.
    """

    def __init__(
        self,
        path: Path,
        *,
        wall_clock: Callable[[], datetime],
        robot: str = "",
        most_bytes: int = 20_000_000,
    ) -> None:
        self.path = path
        self._most_bytes = most_bytes
        self._robot = robot
        self._wall_clock = wall_clock
        self._run = f"{wall_clock():%Y%m%dT%H%M%S}-{os.getpid()}-{secrets.token_hex(2)}"
        self._numbers = itertools.count(1)
        self.tell: Callable[[Mapping[str, Any]], None] = lambda _: None
        """Is called with each line that is written; it must not raise."""

    def next_number(self) -> int:
        """Return the number of another command."""
        return next(self._numbers)

    def write(
        self,
        event: str,
        *,
        number: int,
        caller: Caller,
        robot_s: float,
        command: Command | None = None,
        verdict: str = "",
        said: str = "",
    ) -> None:
        """Append one line.

        Raises:
            PolicyError: The line could not be written.
        """
        line = {
            "number": number,
            "run": self._run,
            "robot": self._robot,
            "wall_time": self._wall_clock().isoformat(timespec="milliseconds"),
            "robot_s": round(robot_s, 3) if math.isfinite(robot_s) else None,
            "event": event,
            "client": caller.client,
            "tool": caller.tool,
            "kind": "" if command is None else str(command.kind),
            "what": "" if command is None else say_command(command),
            "verdict": verdict,
            "said": said[:MOST_CHARACTERS],
            "details": {} if command is None else _details(command),
        }
        text = json.dumps(line, ensure_ascii=False, default=lambda value: str(value)[:200])
        try:
            append_line(self.path, text.encode(errors="replace"), most_bytes=self._most_bytes)
        except OSError as error:
            raise self._broken(error.strerror or str(error)) from error
        self.tell(line)

    def _broken(self, reason: str) -> PolicyError:
        return PolicyError(
            f"The audit log {self.path} cannot be written: {reason}. Without it nothing may move.",
            hint="Tell the person at the robot: make room, or name another file with --audit.",
        )


def read_audit(path: Path) -> Iterator[AuditLine]:
    """Read a log, line by line; lines that a crash or a full disk has cut off are left out.

    Raises:
        ConfigError: The file cannot be read, or is not an audit log.
    """
    try:
        # Only a line feed ends a line here; what people publish may hold other signs for it.
        lines = path.read_text(encoding="utf-8", errors="replace").removesuffix("\n").split("\n")
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be read: {say_cause(error)}.", hint="Give the file of an audit log."
        ) from error
    for number, line in enumerate(lines, start=1):
        try:
            yield AuditLine(**json.loads(line))
        except (TypeError, ValueError) as error:
            if isinstance(error, ValueError) and line[: len(BEGIN)] == BEGIN[: len(line)]:
                continue
            raise ConfigError(
                f"{path}, line {number} is not a line of an audit log.",
                hint="Give the file that was named with --audit.",
            ) from error


def _details(command: Command) -> dict[str, Any]:
    if isinstance(command, DriveCommand):
        goal = command.goal
        return {
            "x": _as_json(goal.x),
            "y": _as_json(goal.y),
            "yaw_rad": _as_json(goal.yaw_rad),
            "verdict": str(command.check.verdict),
            "path_m": command.check.path_m,
        }
    fields = {name: getattr(command, name) for name in command.__dataclass_fields__}
    return {name: _shorten(value) for name, value in fields.items()}


def _as_json(number: float) -> float | str:
    return number if math.isfinite(number) else str(number)


def _shorten(value: object) -> object:
    text = json.dumps(value, default=str)
    if len(text) <= MOST_CHARACTERS and "NaN" not in text and "Infinity" not in text:
        return value
    return f"{text[:MOST_CHARACTERS]} (of {len(text)} characters)"
