"""Who answers: the port that every agent implements, and what crosses it."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from mapspeak.evaluation.client import ToolClient
from mapspeak.evaluation.trials.trial import Limits, TrialState

__all__ = ["Agent", "AgentEnd", "Assignment", "ServerAccess"]


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
