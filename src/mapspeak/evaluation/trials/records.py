"""Who answers a trial, and trials on the disk: a folder each, whose result.json comes last."""

import json
import os
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from pydantic import TypeAdapter, ValidationError

from mapspeak.evaluation.client import ToolClient
from mapspeak.evaluation.trials.trial import Limits, Trial, TrialResult, TrialState, Turn


class ServerAccess(StrEnum):
    """How an agent reaches the robot's server."""

    MEMORY = "memory"
    """In the trial's own process: for scripts, which need no pipe."""
    STDIO = "stdio"
    """Over stdio to `mapspeak serve` in a process of its own, as any client does."""
    COMMAND = "command"
    """The agent starts `Assignment.server` itself, through a program of its own; its `ToolClient`
    has no client, and its calls are counted from the server's audit log."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """What an agent is given.

    Attributes:
        prompt: What it is asked.
        system: The server's instructions and the guidance of the task.
        limits: What it may cost.
        seed: Of anything it draws.
        server: The command line of its server, for agents that start it themselves.
        folder: The trial's; an agent may keep files of its own there.
    """

    prompt: str
    system: str
    limits: Limits
    seed: int
    server: tuple[str, ...]
    folder: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentEnd:
    """How an agent ended.

    Attributes:
        answer: Its last words; questions are scored by them.
        state: finished, gave_up or out_of_budget.
        n_decisions: Model turns; None counts the calls.
        n_input_tokens: Read by the model; None where there was none.
        n_output_tokens: Written by it.
        n_picture_tokens: What of the input pictures were.
    """

    answer: str
    state: TrialState = TrialState.FINISHED
    n_decisions: int | None = None
    n_input_tokens: int | None = None
    n_output_tokens: int | None = None
    n_picture_tokens: int | None = None


class Agent(Protocol):
    """Whoever carries out an assignment by calling tools."""

    @property
    def name(self) -> str:
        """Return its name, as in `Trial.agent`."""
        ...

    @property
    def connection(self) -> ServerAccess:
        """Say how it reaches the server."""
        ...

    async def run(self, task: Assignment, tools: ToolClient) -> AgentEnd:
        """Carry out the assignment.

        Raises:
            OutOfBudgetError: A call would have gone beyond the limits; let it pass through.
        """
        ...


RESULT = "result.json"
TURNS = "turns.jsonl"
TRIALS = "trials"


_RESULT: TypeAdapter[TrialResult] = TypeAdapter(TrialResult)
_TURN: TypeAdapter[Turn] = TypeAdapter(Turn)


def trial_folder(run: Path, trial: Trial) -> Path:
    """Return where a trial lies in a run's folder."""
    return run / TRIALS / trial.id


def find_result(run: Path, trial: Trial) -> Path | None:
    """Return the file of a trial's result; None for a trial without one."""
    path = trial_folder(run, trial) / RESULT
    return path if path.exists() else None


def write_result(run: Path, result: TrialResult) -> None:
    """Write result.json so that it is there whole or not at all."""
    folder = trial_folder(run, result.trial)
    folder.mkdir(parents=True, exist_ok=True)
    _write_at_once(folder / RESULT, _RESULT.dump_json(result, indent=2) + b"\n")


def read_result(path: Path) -> TrialResult:
    """Read a result.

    Raises:
        ValidationError: The file holds no result.
    """
    return _RESULT.validate_json(path.read_bytes())


def read_results(run: Path) -> tuple[TrialResult, ...]:
    """Read all results of a run's folder, by their names, but for broken files."""
    results = []
    for path in sorted((run / TRIALS).glob(f"**/{RESULT}")):
        with suppress(ValidationError):
            results.append(read_result(path))
    return tuple(results)


def turn_line(turn: Turn) -> bytes:
    """Return a turn as one line of turns.jsonl."""
    return _TURN.dump_json(turn, exclude_defaults=True) + b"\n"


def read_turns(run: Path, trial: Trial) -> tuple[Turn, ...]:
    """Read every whole line of a trial's conversation; none where there is no such file."""
    path = trial_folder(run, trial) / TURNS
    if not path.exists():
        return ()
    whole = path.read_bytes().rpartition(b"\n")[0].splitlines()
    return tuple(_TURN.validate_json(line) for line in whole)


def say_fault(error: Exception) -> str:
    """Say in a few words why a file cannot be read."""
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        return f"{where}: {first['msg']}" if where else first["msg"]
    if isinstance(error, json.JSONDecodeError):
        return error.msg
    lines = str(error).splitlines()
    return lines[0].rstrip(".") if lines else type(error).__name__


def _write_at_once(path: Path, data: bytes) -> None:
    """Put a file in its place whole, so that no reader and no crash ever sees half of it."""
    new = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with new.open("wb") as file:
            file.write(data)
            file.flush()
            # Else a machine that loses power may keep the name and lose what it stands for.
            os.fsync(file.fileno())
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)
