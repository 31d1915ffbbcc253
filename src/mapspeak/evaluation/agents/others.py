"""Agents that need no truth, by their names: scripts to compare with, models, client programs."""

from collections.abc import Iterable
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version

from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents.agent import Agent
from mapspeak.evaluation.agents.command import CommandAgent, find_program
from mapspeak.evaluation.agents.exploring import NearestFrontierAgent, PaperLoopAgent
from mapspeak.evaluation.agents.models import MockMind, ModelAgent, Thinking
from mapspeak.evaluation.agents.models.throughinspect import find_client, open_mind

__all__ = [
    "OTHER_NAMES",
    "can_think",
    "check_other",
    "find_other",
    "find_versions",
    "read_thinking",
]

MOCK = "mock"
OTHER_NAMES = ("nearest-frontier", "paper-loop", MOCK)
COMMAND = "command:"
INSPECT = "inspect-ai"


def find_other(name: str, thinking: str | None) -> Agent | None:
    """Gives an agent by its name; None where it is no name of one.

    Args:
        name: "nearest-frontier", "paper-loop", "mock", "PROVIDER/MODEL" or "command:PROGRAM".
        thinking: How much a model may think, as `Thinking`; None where nothing was said.

    Raises:
        ConfigError: The model or program cannot be had, or there is no such way to think.
    """
    amount = read_thinking(thinking)
    if name == "nearest-frontier":
        return NearestFrontierAgent()
    if name == "paper-loop":
        return PaperLoopAgent()
    if name == MOCK:
        return ModelAgent(MockMind(), name)
    if name.startswith(COMMAND):
        return CommandAgent(find_program(name.removeprefix(COMMAND)), name, amount)
    return ModelAgent(open_mind(name, amount), name) if "/" in name else None


def can_think(name: str) -> bool:
    """True for models, their mock and client programs; scripts think as much as they are made to.

    Args:
        name: An agent's, whether it is there or not.
    """
    return name == MOCK or "/" in name or name.startswith(COMMAND)


def check_other(name: str, thinking: str | None = None) -> bool:
    """True where there is an agent of a name; looks for what it needs, and asks it nothing.

    Raises:
        ConfigError: There is one, but something that it needs is missing.
    """
    if "/" in name and not name.startswith(COMMAND):
        open_mind(name, read_thinking(thinking)).check()
        return True
    agent = find_other(name, thinking)
    if isinstance(agent, CommandAgent):
        agent.check()
    return agent is not None


def find_versions(names: Iterable[str]) -> dict[str, str]:
    """Gives the versions of what stands behind some agents, each by its own name.

    It is `inspect-ai` and the provider's own package behind models, and a client program behind
    "command:PROGRAM"; what does not say its version is left out.
    """
    versions: dict[str, str] = {}
    for name in names:
        if name.startswith(COMMAND):
            said = find_program(name.removeprefix(COMMAND)).find_version()
            if said is not None:
                versions[name] = said
        elif "/" in name:
            for package in (INSPECT, find_client(name)):
                with suppress(PackageNotFoundError):
                    versions[package] = version(package)
    return versions


def read_thinking(thinking: str | None) -> Thinking | None:
    """Gives how much a model may think; None where nothing was said.

    Raises:
        ConfigError: There is no such way to think.
    """
    if thinking is None:
        return None
    if thinking not in set(Thinking):
        raise ConfigError(
            f"A model cannot think {thinking[:40]!r}.", hint=f"Choose {', '.join(Thinking)}."
        )
    return Thinking(thinking)
