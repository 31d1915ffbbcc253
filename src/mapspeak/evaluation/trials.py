"""Trials: their settings, conversations, results and files.

A *task* is what is asked and how the answer is scored; a *trial* is one attempt at it by one agent
in one world. On the disk each has a folder, whose result.json comes last.
"""

import json
import re
import shutil
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from mapspeak.atomic import replace_file
from mapspeak.evaluation.inspected import InspectedSystem
from mapspeak.geometry import Pose
from mapspeak.simulator import WorldObject

RESULT, TURNS = "result.json", "turns.jsonl"
STATES, MAP, MEMORY = "state.jsonl", "map.yaml", "semantic_map.yaml"
CALLS = "calls"
"""The call log with the ending .jsonl, where the server keeps one, and the folder beside it."""
PICTURES = "pictures"
"""Files and folders in a trial's folder."""
TRIALS = "trials"


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One attempt: which task, where, by whom, shown how.

    Attributes:
        task: Its name, such as "smallest-room".
        world: A shipped world's name, or the path of a world file or map.
        seed: Of everything that is drawn: the start, the question, the robot's noise.
        thinking: How much a model may think; None where nothing was said.
        number: Counts the trials that differ in nothing but the seed; from 1.
    """

    task: str
    world: str
    seed: int
    agent: str
    representation: str
    thinking: str | None = None
    number: int

    @property
    def answerer(self) -> str:
        """Return who answers, with how much it may think where that was said."""
        return self.agent if self.thinking is None else f"{self.agent}+{self.thinking}"

    @property
    def id(self) -> str:
        """Return where it lies below the run's trials: the same in every run."""
        parts = (self.task, self.world, self.answerer, self.representation)
        plain = (re.sub(r"[^A-Za-z0-9_.+-]+", "_", part).lstrip(".") or "_" for part in parts)
        return "/".join((*plain, f"{self.number:03d}"))


N_PARTS = 5
"""Of a trial's id."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Budget of a trial.

    Attributes:
        wall_s: Wall time after which it is out of budget; infinite for none.
    """

    n_calls: int = 60
    robot_time_s: float = 900.0
    wall_s: float = 900.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Setting of a task in a world for one trial.

    Attributes:
        guidance: Further instructions before it begins, such as the exploration prompt.
        start: The robot's first pose, in the world's own frame.
        is_known: The robot localises in the finished map of the world; else it maps from nothing,
            and the map frame begins at `start`.
        memory: The semantic map to start with, as YAML; None for an empty one.
        added: Things in the world that are not in the map or the memory.
        shut: Names of doors that are shut at first, besides those that the world says.
        battery_ratio: Initial charge of the battery; None for what the world says.
        n_faults: Number of failures of each skill before it works, where the world says otherwise.
        toolsets: Offered groups of tools; None for the server's default.
        inspected: The ROS to inspect instead of the simulated robot, which is then absent; None
            for the simulated robot.
        truth: The scorer's data as JSON; shown only to the oracle agent. A right answer that needs
            no drive is under "said".
    """

    prompt: str
    guidance: str = ""
    start: Pose
    is_known: bool
    memory: str | None = None
    added: tuple[WorldObject, ...] = ()
    shut: tuple[str, ...] = ()
    battery_ratio: float | None = None
    n_faults: dict[str, int] = field(default_factory=dict)
    toolsets: tuple[str, ...] | None = None
    tools: tuple[str, ...] = ()
    limits: Limits = field(default_factory=Limits)
    inspected: InspectedSystem | None = None
    truth: dict[str, Any] = field(default_factory=dict)


class TrialState(StrEnum):
    """End of a trial."""

    FINISHED = "finished"
    GAVE_UP = "gave_up"
    OUT_OF_BUDGET = "out_of_budget"
    CRASHED = "crashed"
    HUNG = "hung"

    @property
    def is_broken(self) -> bool:
        """True when the trial itself failed: nothing is said of the agent."""
        return self in (TrialState.CRASHED, TrialState.HUNG)


class Failure(StrEnum):
    """Kind of mistake that made a trial fail."""

    CORRIDOR_FOR_ROOM = "corridor_for_room"
    WRONG_SIZE = "wrong_size"
    WRONG_OBJECT = "wrong_object"
    WRONG_PLACE = "wrong_place"
    GOAL_REFUSED = "goal_refused"
    GAVE_UP = "gave_up"
    WRONG_ANSWER = "wrong_answer"
    OBEYED_A_NOTE = "obeyed_a_note"
    COLLIDED = "collided"
    INCOMPLETE = "incomplete"
    NO_ANSWER = "no_answer"
    BROKEN = "broken"
    """The trial itself crashed or hung; nothing is said of the agent."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """Score of a trial by the simulator's truth.

    Attributes:
        failure: Kind of mistake; None for a success.
        figures: By name with its unit: coverage_recall, distance_to_object_m, ...
    """

    is_success: bool
    failure: Failure | None = None
    figures: dict[str, float] = field(default_factory=dict)
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolCall:
    """A tool as an agent called it."""

    tool: str
    arguments: dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class TokenCounts:
    """Tokens of a model; None if there was no model, or no count.

    Attributes:
        n_output_tokens: Output, thoughts included.
        n_picture_tokens: Part of the input that was pictures.
    """

    n_input_tokens: int | None = None
    n_output_tokens: int | None = None
    n_picture_tokens: int | None = None

    def plus(self, other: "TokenCounts") -> "TokenCounts":
        """Return the sums; a count that neither has stays None."""
        return TokenCounts(
            n_input_tokens=_sum(self.n_input_tokens, other.n_input_tokens),
            n_output_tokens=_sum(self.n_output_tokens, other.n_output_tokens),
            n_picture_tokens=_sum(self.n_picture_tokens, other.n_picture_tokens),
        )


def _sum(one: int | None, other: int | None) -> int | None:
    return None if one is None and other is None else (one or 0) + (other or 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn(TokenCounts):
    """One piece of the conversation, for replay.

    Attributes:
        role: "system" or "user" (what it was told), "agent", or "tool" (an answer).
        call: The tool that the agent called, or that answers.
        is_error: The tool answered with an error.
        wall_s: Since the trial began.
        robot_s: Robot time; None before the robot was there.
        pose: Where the robot truly stood, in a map without errors.
    """

    role: str
    text: str = ""
    call: ToolCall | None = None
    is_error: bool = False
    pictures: tuple[str, ...] = ()
    wall_s: float = 0.0
    robot_s: float | None = None
    pose: Pose | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialResult(TokenCounts):
    """Record of a trial, except its turns, which are stored beside it.

    Attributes:
        shortest_m: Shortest possible driving distance; None if the task has none.
        n_decisions: Number of the agent's decisions: model turns, or calls of a script.
        n_errors: Number of tool calls answered with an error.
        cpu_s: CPU time of the trial's own process, on all cores together; excludes a server or
            client program that runs as another process.
        error: The error that broke the trial; None without one.
    """

    trial: Trial
    prompt: str
    answer: str = ""
    state: TrialState
    score: Score
    driven_m: float = 0.0
    shortest_m: float | None = None
    n_turns: int = 0
    n_calls: int = 0
    n_decisions: int = 0
    n_errors: int = 0
    robot_s: float = 0.0
    wall_s: float = 0.0
    cpu_s: float = 0.0
    n_collisions: int = 0
    error: str | None = None


_RESULT: TypeAdapter[TrialResult] = TypeAdapter(TrialResult)
_TURN: TypeAdapter[Turn] = TypeAdapter(Turn)


def trial_folder(run: Path, trial: Trial) -> Path:
    """Return where a trial lies in a run's folder."""
    return run / TRIALS / trial.id


def count_asked(run: Path) -> int:
    """Return how many trials were asked for in a run: each has a folder, with a result or not."""
    return sum(path.is_dir() for path in (run / TRIALS).glob("/".join("*" * N_PARTS)))


def clear_trial(run: Path, trial: Trial) -> Path:
    """Return a trial's folder, empty: nothing of an earlier attempt reaches the next one."""
    folder = trial_folder(run, trial)
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    return folder


def find_result(run: Path, trial: Trial) -> Path | None:
    """Return the file of a trial's result; None for a trial without one."""
    path = trial_folder(run, trial) / RESULT
    return path if path.exists() else None


def write_result(run: Path, result: TrialResult) -> None:
    """Write result.json atomically."""
    content = _RESULT.dump_json(result, indent=2) + b"\n"
    replace_file(trial_folder(run, result.trial) / RESULT, content)


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


def read_turns(folder: Path) -> tuple[Turn, ...]:
    """Read every whole line of the conversation in a trial's folder; none without such a file."""
    path = folder / TURNS
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
