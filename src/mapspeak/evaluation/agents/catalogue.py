"""Agents by their names: scripts, models and client programs, and what they need."""

from collections.abc import Iterable
from contextlib import suppress
from functools import partial
from importlib.metadata import PackageNotFoundError, version

from mapspeak.errors import ConfigError, say_nearest
from mapspeak.evaluation.agent import Agent, ServerAccess, Work
from mapspeak.evaluation.agents.baselines import (
    answer_at_random,
    answer_by_truth,
    explore_nearest_frontiers,
    follow_paper,
)
from mapspeak.evaluation.agents.command.agent import run_program
from mapspeak.evaluation.agents.command.program import find_program
from mapspeak.evaluation.agents.models.chat import Begin, Thinking, work_with_model
from mapspeak.evaluation.agents.models.mock import MockModel
from mapspeak.evaluation.agents.scripted import follow_script
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.trials import Setting
from mapspeak.installation import say_install

ORACLE, MOCK = "oracle", "mock"
NEAR_SIGHTED, BLIND, BEARINGS = LESS_SIGHTED = ("near-sighted", "blind", "bearings")
"""Scripts that note less than the script sees: they start from their own memories."""
COMMAND = "command:"
NEAR_SIGHT_M = 2.0
"""Range of sight of the near-sighted script; things are visible from three times as far."""
CLIENT = "openai"
"""The default package for inspect-ai's requests; the extra installs it."""
CLIENTS = {"anthropic": "anthropic", "google": "google-genai"}
"""Packages for requests to other providers."""
SCRIPTS: dict[str, Work] = {
    "scripted": follow_script,
    NEAR_SIGHTED: partial(follow_script, sight_m=NEAR_SIGHT_M),
    BLIND: partial(follow_script, sight_m=0.0),
    BEARINGS: partial(follow_script, tells_ranges=False),
    "random": answer_at_random,
    "nearest-frontier": explore_nearest_frontiers,
    "paper-loop": follow_paper,
}


def agent_names() -> tuple[str, ...]:
    """Return the names of the agents that need nothing else."""
    return (*SCRIPTS, ORACLE, MOCK)


def is_script(answerer: str) -> bool:
    """Return True for an agent behind which no model stands, with or without a way to think."""
    name = answerer.partition("+")[0]
    return name in agent_names() or name.startswith("mockllm/")


def check_agent(name: str, thinking: str | None = None) -> None:
    """Check that an agent exists and has all requirements, without asking it anything.

    Raises:
        ConfigError: There is no such agent, or a requirement is missing.
    """
    if name != ORACLE:
        find_agent(name, thinking)


def find_agent(
    name: str, thinking: str | None = None, truth: tuple[Setting, GroundTruth] | None = None
) -> Agent:
    """Return an agent by its name.

    Args:
        name: One of `agent_names`, "PROVIDER/MODEL" or "command:PROGRAM".
        thinking: Level of thinking of a model, as `Thinking`; None if not set.
        truth: For the oracle alone: the trial's setting and its world.

    Raises:
        ConfigError: There is no such agent or level of thinking, or the model or program is
            unavailable.
    """
    amount = read_thinking(thinking)
    if name == ORACLE and truth is not None:
        return Agent(name, partial(answer_by_truth, *truth))
    if name in SCRIPTS:
        return Agent(name, SCRIPTS[name])
    if name == MOCK:
        return Agent(name, partial(work_with_model, MockModel), ServerAccess.STDIO)
    if name.startswith(COMMAND):
        program = find_program(name.removeprefix(COMMAND))
        program.check(amount)
        return Agent(name, partial(run_program, program, amount), ServerAccess.COMMAND)
    if _is_model(name):
        begin = _begin_with(name, amount)
        return Agent(name, partial(work_with_model, begin), ServerAccess.STDIO)
    raise ConfigError(
        f"There is no agent {name[:80]!r}.",
        hint=f"{say_nearest(name, agent_names())}There are: {', '.join(agent_names())}; "
        "PROVIDER/MODEL for a model, command:PROGRAM for a client program.",
    )


def can_think(name: str) -> bool:
    """Return True for models, their mock and client programs, which take time to think."""
    return name == MOCK or "/" in name or name.startswith(COMMAND)


def _is_model(name: str) -> bool:
    return "/" in name and not name.startswith(COMMAND)


def _begin_with(name: str, thinking: Thinking | None) -> Begin:
    try:
        from mapspeak.evaluation.agents.models.throughinspect import (  # noqa: PLC0415 - an extra
            InspectConversation,
            open_model,
        )
    except ImportError as error:
        client = _find_client(name)
        install = say_install("eval", *([] if client == CLIENT else [client]))
        raise ConfigError(
            f"{name} is asked through inspect-ai, which is not installed.",
            hint=f"{install}, or take the agent mock.",
        ) from error
    open_model(name)
    return partial(InspectConversation, name, thinking)


def _find_client(name: str) -> str:
    """Return the package that inspect-ai speaks through to a model's provider."""
    return CLIENTS.get(name.partition("/")[0], CLIENT)


def find_versions(names: Iterable[str]) -> dict[str, str]:
    """Return the versions of the software behind some agents, by name.

    For models these are `inspect-ai` and the provider's package, for "command:PROGRAM" the client
    program; software without a version is left out.
    """
    versions: dict[str, str] = {}
    for name in names:
        if name.startswith(COMMAND):
            said = find_program(name.removeprefix(COMMAND)).find_version()
            if said is not None:
                versions[name] = said
        elif _is_model(name):
            for package in ("inspect-ai", _find_client(name)):
                with suppress(PackageNotFoundError):
                    versions[package] = version(package)
    return versions


def read_thinking(thinking: str | None) -> Thinking | None:
    """Return the level of thinking of a model; None if not set.

    Raises:
        ConfigError: There is no such level.
    """
    if thinking is None:
        return None
    if thinking not in set(Thinking):
        raise ConfigError(
            f"A model cannot think {thinking[:40]!r}.", hint=f"Choose {', '.join(Thinking)}."
        )
    return Thinking(thinking)
