"""A whole evaluation: which trials, what each has to wait for, and going on where one left off."""

import platform
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from mapspeak import __version__
from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents.others import can_think, find_versions, read_thinking
from mapspeak.evaluation.runs.attempt import attempt
from mapspeak.evaluation.runs.folder import alone_in, check_folder, take_up, writing_to
from mapspeak.evaluation.runs.schedule import Job, run_jobs
from mapspeak.evaluation.scores import Site
from mapspeak.evaluation.tasks import EXPLORE, Task, choose_tasks
from mapspeak.evaluation.trials import RunPlan, Trial, TrialResult, write_plan
from mapspeak.server import Representation
from mapspeak.simulator import World, load_world, world_names

__all__ = [
    "ALL_WORLDS",
    "PLAIN",
    "SCRIPTED",
    "RunOptions",
    "make_jobs",
    "plan_run",
    "run_evaluation",
]

ALL_WORLDS = "all"
PLAIN = str(Representation.PICTURE_TABLE)
"""How the server shows the map unless told otherwise."""
SCRIPTED = "scripted"
"""Who prepares maps and memories."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """What an evaluation was asked for.

    Attributes:
        agents: Who answers.
        tasks: Names of tasks or of their groups.
        worlds: Names, paths, or "all" for those that are shipped.
        n_trials: Of each task in each world; a world is explored once.
        seed: The first trial's; each further one has the next.
        folder: Where everything goes.
        representations: How the server shows the map.
        thinking: How much models may think; None where nothing was said. Scripts are asked once.
        n_jobs: Trials at a time.
        hang_s: Wall time after which a trial's process is killed.
        has_retry: Trials that crashed or hung before are run again.

    Raises:
        ConfigError: There is no such representation or way to think, or nothing was chosen.
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
        _check_chosen(self)
        _check_thinking(self)
        for name in self.representations:
            if name not in set(Representation):
                raise ConfigError(
                    f"There is no representation {name[:40]!r}.",
                    hint=f"There are: {', '.join(Representation)}.",
                )

    def load_worlds(self) -> dict[str, World]:
        """Gives the worlds by the names they were asked for.

        Raises:
            ConfigError: There is no such world.
        """
        names: Iterator[str] = (
            each
            for name in self.worlds
            for each in (world_names() if name == ALL_WORLDS else [name])
        )
        return {name: load_world(name) for name in dict.fromkeys(names)}


def _check_chosen(options: RunOptions) -> None:
    chosen = {
        "--agent": options.agents,
        "--task": options.tasks,
        "--worlds": options.worlds,
        "--representation": options.representations,
    }
    for flag, names in chosen.items():
        if not names:
            raise ConfigError(f"{flag} names nothing.", hint="Leave it away for the default.")


def _check_thinking(options: RunOptions) -> None:
    for amount in options.thinking:
        read_thinking(amount)
    if any(options.thinking) and not any(map(can_think, options.agents)):
        raise ConfigError(
            f"--thinking is for models and client programs, not for {', '.join(options.agents)}.",
            hint="Leave it away, or name a model with --agent.",
        )


def plan_run(options: RunOptions, worlds: Mapping[str, World]) -> RunPlan:
    """Gives all trials of an evaluation, world by world, and what has to go before them.

    Raises:
        ConfigError: There is no such task, or it is not offered in any of the worlds.
    """
    tasks = choose_tasks(options.tasks)
    sites = {name: Site(world) for name, world in worlds.items()}
    trials = tuple(
        trial
        for name, site in sites.items()
        for task in tasks
        if task.is_offered(site)
        for trial in _trials_of(options, task, name)
    )
    if not trials:
        asked = ", ".join(task.name for task in tasks)
        raise ConfigError(f"No world has what {asked} asks about.", hint="Choose other worlds.")
    needed = {
        trial.world: _preparation(options, trial.world)
        for trial in trials
        if any(task.name == trial.task and task.needs_map for task in tasks)
    }
    return RunPlan(
        trials=trials,
        preparations=tuple(each for each in needed.values() if each not in trials),
        versions={
            "mapspeak": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            **find_versions(options.agents),
        },
        options={
            "agents": list(options.agents),
            "tasks": list(options.tasks),
            "worlds": list(worlds),
            "n_trials": options.n_trials,
            "seed": options.seed,
            "representations": list(options.representations),
            "thinking": list(options.thinking),
            "n_jobs": options.n_jobs,
            "hang_s": options.hang_s,
        },
    )


def _trials_of(options: RunOptions, task: Task, world: str) -> Iterator[Trial]:
    n_trials = 1 if task.name == EXPLORE else options.n_trials
    for number in range(1, n_trials + 1):
        for agent in dict.fromkeys(options.agents):
            amounts = options.thinking if can_think(agent) else (None,)
            for representation in dict.fromkeys(options.representations):
                for thinking in dict.fromkeys(amounts):
                    yield Trial(
                        task=task.name,
                        world=world,
                        seed=options.seed + number - 1,
                        agent=agent,
                        representation=representation,
                        thinking=thinking,
                        number=number,
                    )


def _preparation(options: RunOptions, world: str) -> Trial:
    """Gives the exploration whose map and memory all trials of a world start from."""
    return Trial(
        task=EXPLORE,
        world=world,
        seed=options.seed,
        agent=SCRIPTED,
        representation=PLAIN,
        number=1,
    )


def run_evaluation(
    options: RunOptions,
    *,
    on_plan: Callable[[RunPlan], None],
    on_done: Callable[[TrialResult], None],
    tell: Callable[[str], None],
) -> RunPlan:
    """Runs every trial that has no result yet, and gives the plan of what was asked for.

    Args:
        options: What is asked for.
        on_plan: Told of all trials before the first one.
        on_done: Told of every result of it, also of those that were there already.
        tell: Told in sentences what became of an earlier sitting in the same folder.

    Raises:
        ConfigError: Something asked for does not exist, the folder holds something else or cannot
            be written to, or another run is at work in it.
    """
    worlds = options.load_worlds()
    plan = plan_run(options, worlds)
    folder = options.folder
    check_folder(folder)
    with writing_to(folder), alone_in(folder):
        found = take_up(folder, plan, has_retry=options.has_retry)
        write_plan(folder, found.plan)
        for note in found.notes:
            tell(note)
        on_plan(plan)
        jobs = make_jobs(options, plan, worlds)
        run_jobs(folder, jobs, n_jobs=options.n_jobs, on_done=on_done)
    return plan


def _floor_m2(world: World) -> float:
    """Gives about how large a world is: the box around its walls."""
    ends = [end for wall in world.walls for end in (wall.start, wall.end)]
    xs, ys = [end.x for end in ends], [end.y for end in ends]
    return (max(xs) - min(xs)) * (max(ys) - min(ys)) if ends else 0.0


def make_jobs(options: RunOptions, plan: RunPlan, worlds: Mapping[str, World]) -> Iterable[Job]:
    """Gives what is to be done: first all that others wait for, the largest world first.

    Exploring takes longest, and longest in the largest world: begun last, it would keep one
    process busy while the others have nothing left to do.
    """
    tasks = {task.name: task for task in choose_tasks((*options.tasks, EXPLORE))}
    first = [trial for trial in plan.trials if trial.task == EXPLORE]
    others = [trial for trial in plan.trials if trial.task != EXPLORE]
    exploring = sorted(
        (*plan.preparations, *first), key=lambda trial: -_floor_m2(worlds[trial.world])
    )
    for trial in (*exploring, *others):
        before = _preparation(options, trial.world) if tasks[trial.task].needs_map else None
        work = partial(attempt, options.folder, trial, worlds[trial.world], before)
        yield Job(trial=trial, work=work, after=before, wall_s=options.hang_s)
