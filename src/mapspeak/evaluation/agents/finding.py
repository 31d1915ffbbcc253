"""Agents by their names: scripts, models and client programs, and what they need."""

from collections.abc import Iterable
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version

from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents.baselines import OracleAgent, RandomAgent
from mapspeak.evaluation.agents.command import CommandAgent, find_program
from mapspeak.evaluation.agents.exploring import NearestFrontierAgent, PaperLoopAgent
from mapspeak.evaluation.agents.models import MockMind, ModelAgent, Thinking
from mapspeak.evaluation.agents.models.throughinspect import find_client, open_mind
from mapspeak.evaluation.agents.scripted import ScriptedAgent
from mapspeak.evaluation.scores import GroundTruth
from mapspeak.evaluation.trials import Agent, Setting, Trial

_NAMES = ("scripted", "oracle", "random")
MORE = "PROVIDER/MODEL for a model, command:PROGRAM for a client program"


def agent_names() -> tuple[str, ...]:
    """Return the names of the agents that need nothing else."""
    return (*_NAMES, *OTHER_NAMES)


def check_agent(name: str, thinking: str | None = None) -> None:
    """Look whether there is an agent of a name, and all that it needs.

    Raises:
        ConfigError: There is none, or something is missing.
    """
    if name not in _NAMES and not check_other(name, thinking):
        raise _unknown(name)


def find_agent(trial: Trial, setting: Setting, site: GroundTruth) -> Agent:
    """Return who answers a trial.

    Args:
        trial: Names the agent, and how much it may think.
        setting: For the oracle alone.
        site: The world as it is set, for the oracle alone.

    Raises:
        ConfigError: There is no such agent.
    """
    if trial.agent == "oracle":
        return OracleAgent(setting, site)
    if trial.agent in _NAMES:
        return RandomAgent() if trial.agent == "random" else ScriptedAgent()
    other = find_other(trial.agent, trial.thinking)
    if other is None:
        raise _unknown(trial.agent)
    return other


def _unknown(name: str) -> ConfigError:
    return ConfigError(
        f"There is no agent {name[:80]!r}.",
        hint=f"There are: {', '.join(agent_names())}; {MORE}.",
    )


MOCK = "mock"
OTHER_NAMES = ("nearest-frontier", "paper-loop", MOCK)
COMMAND = "command:"
INSPECT = "inspect-ai"


def find_other(name: str, thinking: str | None) -> Agent | None:
    """Return an agent by its name; None where it is no name of one.

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
    """Return True for models, their mock and client programs, which take time to think.

    Args:
        name: An agent's, whether it is there or not.
    """
    return name == MOCK or "/" in name or name.startswith(COMMAND)


def check_other(name: str, thinking: str | None = None) -> bool:
    """Return True where there is an agent of a name, by what it needs; it is asked nothing.

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
    """Return the versions of what stands behind some agents, each by its own name.

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
    """Return how much a model may think; None where nothing was said.

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
