"""Agents by their names."""

from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents.agent import Agent
from mapspeak.evaluation.agents.oracle import OracleAgent
from mapspeak.evaluation.agents.others import OTHER_NAMES, check_other, find_other
from mapspeak.evaluation.agents.random import RandomAgent
from mapspeak.evaluation.agents.scripted import ScriptedAgent
from mapspeak.evaluation.scores import GroundTruth
from mapspeak.evaluation.trials import Setting, Trial

__all__ = ["agent_names", "check_agent", "find_agent"]

_NAMES = ("scripted", "oracle", "random")
MORE = "PROVIDER/MODEL for a model, command:PROGRAM for a client program"


def agent_names() -> tuple[str, ...]:
    """Gives the names of the agents that need nothing else."""
    return (*_NAMES, *OTHER_NAMES)


def check_agent(name: str, thinking: str | None = None) -> None:
    """Looks whether there is an agent of a name, and all that it needs.

    Raises:
        ConfigError: There is none, or something is missing.
    """
    if name not in _NAMES and not check_other(name, thinking):
        raise _unknown(name)


def find_agent(trial: Trial, setting: Setting, site: GroundTruth) -> Agent:
    """Gives who answers a trial.

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
