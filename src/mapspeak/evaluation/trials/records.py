"""Trials on the disk: one folder each, whose result.json is written last and at once.

OUT/run.json                      what was asked for
OUT/trials/TRIAL_ID/turns.jsonl   the conversation, as it happens
                    pictures/     what the agent saw
                    state.jsonl   the simulator's truth (`simulator.read_state_log`)
                    map.yaml, map.pgm, semantic_map.yaml
                    result.json   its presence means that the trial is done
"""

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from mapspeak.evaluation.trials.trial import Trial, TrialResult, Turn

__all__ = [
    "RunPlan",
    "Sitting",
    "is_done",
    "read_plan",
    "read_result",
    "read_results",
    "read_turns",
    "say_fault",
    "trial_folder",
    "turn_line",
    "write_plan",
    "write_result",
]

RESULT = "result.json"
TURNS = "turns.jsonl"
PLAN = "run.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sitting:
    """A time that a run was started, before it was taken up with other versions or options.

    Attributes:
        versions: As in `RunPlan`.
        options: As in `RunPlan`.
        n_done: Trials that had a result when it ended, those of earlier sittings among them.
    """

    versions: dict[str, str]
    options: dict[str, Any]
    n_done: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPlan:
    """What a run was asked for, and with what.

    Attributes:
        trials: All of them, in their order; preparations are not among them. Trials that were
            asked for once and have a result stay.
        preparations: Trials that were not asked for but that others start from: the scripted
            exploration whose map and memory they are given.
        versions: Of mapspeak, Python and numpy, of `inspect-ai` behind models and of client
            programs, by name.
        options: As on the command line.
        earlier: Sittings before, with other versions or options.
    """

    trials: tuple[Trial, ...]
    preparations: tuple[Trial, ...] = ()
    versions: dict[str, str]
    options: dict[str, Any]
    earlier: tuple[Sitting, ...] = ()


_PLAN: TypeAdapter[RunPlan] = TypeAdapter(RunPlan)
_RESULT: TypeAdapter[TrialResult] = TypeAdapter(TrialResult)
_TURN: TypeAdapter[Turn] = TypeAdapter(Turn)


def trial_folder(run: Path, trial: Trial) -> Path:
    """Gives where a trial lies in a run's folder."""
    return run / "trials" / trial.id


def is_done(run: Path, trial: Trial) -> bool:
    """True when a trial has a result, whatever it is."""
    return (trial_folder(run, trial) / RESULT).exists()


def write_plan(run: Path, plan: RunPlan) -> None:
    """Writes run.json."""
    run.mkdir(parents=True, exist_ok=True)
    _write_at_once(run / PLAN, _PLAN.dump_json(plan, indent=2) + b"\n")


def read_plan(run: Path) -> RunPlan:
    """Reads run.json."""
    return _PLAN.validate_json((run / PLAN).read_bytes())


def write_result(run: Path, result: TrialResult) -> None:
    """Writes result.json so that it is there whole or not at all."""
    folder = trial_folder(run, result.trial)
    folder.mkdir(parents=True, exist_ok=True)
    _write_at_once(folder / RESULT, _RESULT.dump_json(result, indent=2) + b"\n")


def read_result(run: Path, trial: Trial) -> TrialResult:
    """Reads the result of a trial that is done."""
    return _RESULT.validate_json((trial_folder(run, trial) / RESULT).read_bytes())


def read_results(run: Path) -> Iterator[TrialResult]:
    """Reads the results of all trials that were asked for and are done, in their order."""
    for trial in read_plan(run).trials:
        if is_done(run, trial):
            yield read_result(run, trial)


def turn_line(turn: Turn) -> bytes:
    """Gives a turn as one line of turns.jsonl."""
    return _TURN.dump_json(turn, exclude_defaults=True) + b"\n"


def read_turns(run: Path, trial: Trial) -> tuple[Turn, ...]:
    """Reads every whole line of a trial's conversation; none where there is no such file."""
    path = trial_folder(run, trial) / TURNS
    if not path.exists():
        return ()
    whole = path.read_bytes().rpartition(b"\n")[0].splitlines()
    return tuple(_TURN.validate_json(line) for line in whole)


def say_fault(error: Exception) -> str:
    """Says in a few words why a file cannot be read."""
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        return f"{where}: {first['msg']}" if where else first["msg"]
    if isinstance(error, json.JSONDecodeError):
        return error.msg
    lines = str(error).splitlines()
    return lines[0].rstrip(".") if lines else type(error).__name__


def _write_at_once(path: Path, data: bytes) -> None:
    """Puts a file in its place whole, so that no reader and no crash ever sees half of it."""
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
