"""Plan of an evaluation: its options, its trials and their preparations."""

import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, product
from pathlib import Path

import numpy as np

from mapspeak import __version__
from mapspeak.errors import ConfigError, say_nearest
from mapspeak.evaluation.agents.catalogue import (
    LESS_SIGHTED,
    can_think,
    find_versions,
    read_thinking,
)
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.tasks.catalogue import EXPLORE, choose_tasks, find_task
from mapspeak.evaluation.tasks.task import Task
from mapspeak.evaluation.trials import Trial
from mapspeak.server.reports.representations import Representation
from mapspeak.simulator import World, load_world, world_names

ALL_WORLDS = "all"
PLAIN = str(Representation.PICTURE_TABLE)
SCRIPTED = "scripted"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """Options of an evaluation.

    Attributes:
        worlds: Names, paths, or "all" for the shipped ones.
        n_trials: Per task and world; a world is explored once.
        seed: Of the first trial; each further one has the next.
        thinking: Level of thinking of models; None if not set. Scripts run once.
        hang_s: Wall time without a turn after which a trial's process is killed.
        has_retry: Run trials again that crashed or hung.

    Raises:
        ConfigError: There is no such representation or level of thinking, or nothing was chosen.
    """

    agents: tuple[str, ...] = (SCRIPTED,)
    tasks: tuple[str, ...] = ("paper",)
    worlds: tuple[str, ...] = (ALL_WORLDS,)
    n_trials: int = 30
    seed: int = 0
    folder: Path
    representations: tuple[str, ...] = (PLAIN,)
    thinking: tuple[str | None, ...] = (None,)
    n_jobs: int = 2
    hang_s: float = 1200.0
    has_retry: bool = False

    def __post_init__(self) -> None:
        chosen = {
            "--agent": self.agents,
            "--task": self.tasks,
            "--worlds": self.worlds,
            "--representation": self.representations,
        }
        for flag, names in chosen.items():
            if not names:
                raise ConfigError(f"{flag} names nothing.", hint="Leave it away for the default.")
        for amount in self.thinking:
            read_thinking(amount)
        if any(self.thinking) and not any(map(can_think, self.agents)):
            raise ConfigError(
                f"--thinking is for models and client programs, not for {', '.join(self.agents)}.",
                hint="Leave it away, or name a model with --agent.",
            )
        for name in self.representations:
            if name not in set(Representation):
                raise ConfigError(
                    f"There is no representation {name[:40]!r}.",
                    hint=f"{say_nearest(name, Representation)}There are: "
                    f"{', '.join(Representation)}.",
                )

    def load_worlds(self) -> dict[str, World]:
        """Return the worlds by their requested names.

        Raises:
            ConfigError: There is no such world.
        """
        groups = (world_names() if name == ALL_WORLDS else (name,) for name in self.worlds)
        return {name: load_world(name) for name in dict.fromkeys(chain.from_iterable(groups))}


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPlan:
    """The trials of an evaluation.

    Attributes:
        trials: The requested trials in order.
        preparations: Scripted explorations that others start from, not requested themselves.
        versions: Of mapspeak, Python, numpy and the agents' software, by name.
    """

    trials: tuple[Trial, ...]
    preparations: tuple[Trial, ...] = ()
    versions: dict[str, str]


def plan_run(options: RunOptions, worlds: Mapping[str, World]) -> RunPlan:
    """Plan all trials of an evaluation, world by world, and their preparations.

    Raises:
        ConfigError: There is no such task, no world offers it, or two trials would share a folder.
    """
    tasks = choose_tasks(options.tasks)
    trials: list[Trial] = []
    for name, world in worlds.items():
        site = GroundTruth(world)
        for task in tasks:
            if task.is_offered(site):
                trials += _trials_of(options, task, name)
    if not trials:
        asked = ", ".join(task.name for task in tasks)
        raise ConfigError(f"No world has what {asked} asks about.", hint="Choose other worlds.")
    on_maps = (each for each in trials if find_task(each.task).needs_map)
    needed = dict.fromkeys(prepare_world(options, each.world, each.agent) for each in on_maps)
    preparations = tuple(each for each in needed if each not in trials)
    _check_ids((*preparations, *trials))
    versions = {
        "mapspeak": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        **find_versions(options.agents),
    }
    return RunPlan(trials=tuple(trials), preparations=preparations, versions=versions)


def _trials_of(options: RunOptions, task: Task, world: str) -> Iterator[Trial]:
    n_trials = 1 if task.name == EXPLORE else options.n_trials
    agents, representations = dict.fromkeys(options.agents), dict.fromkeys(options.representations)
    for number, agent, representation in product(range(n_trials), agents, representations):
        for thinking in dict.fromkeys(options.thinking if can_think(agent) else (None,)):
            yield Trial(
                task=task.name,
                world=world,
                seed=options.seed + number,
                agent=agent,
                representation=representation,
                thinking=thinking,
                number=number + 1,
            )


def prepare_world(options: RunOptions, world: str, agent: str) -> Trial:
    """Return the exploration whose map and memory an agent's trials of a world start from.

    The script does it, but no agent that sees less starts from what the script has seen.
    """
    return Trial(
        task=EXPLORE,
        world=world,
        seed=options.seed,
        agent=agent if agent in LESS_SIGHTED else SCRIPTED,
        representation=PLAIN,
        number=1,
    )


def _check_ids(trials: Iterable[Trial]) -> None:
    """Check that no two trials would write over each other."""
    known: dict[str, Trial] = {}
    for trial in trials:
        other = known.setdefault(trial.id.casefold(), trial)
        if other != trial:
            pairs = ((other.world, trial.world), (other.agent, trial.agent))
            named = next((pair for pair in pairs if pair[0] != pair[1]), (other.id, trial.id))
            raise ConfigError(
                f"{named[0]} and {named[1]} would lie in the same folder, {trial.id}.",
                hint="Run one of them in a folder of its own, with --out, or give it another name.",
            )
