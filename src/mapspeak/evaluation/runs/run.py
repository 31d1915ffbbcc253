"""A whole evaluation: which trials, what each has to wait for, and going on where one left off."""

import platform
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout

from mapspeak import __version__
from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents.others import find_versions
from mapspeak.evaluation.runs.attempt import attempt
from mapspeak.evaluation.runs.schedule import Job, run_jobs
from mapspeak.evaluation.scores import Site
from mapspeak.evaluation.tasks import EXPLORE, Task, choose_tasks
from mapspeak.evaluation.trials import RunPlan, Trial, TrialResult, read_plan, write_plan
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
        thinking: How much models may think; None where nothing was said.
        n_jobs: Trials at a time.
        hang_s: Wall time after which a trial's process is killed.

    Raises:
        ConfigError: There is no such representation.
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

    def __post_init__(self) -> None:
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
        },
    )


def _trials_of(options: RunOptions, task: Task, world: str) -> Iterator[Trial]:
    n_trials = 1 if task.name == EXPLORE else options.n_trials
    for number in range(1, n_trials + 1):
        for agent in options.agents:
            for representation in options.representations:
                for thinking in options.thinking:
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
) -> RunPlan:
    """Runs every trial that has no result yet, and gives the plan.

    Args:
        options: What is asked for.
        on_plan: Told of all trials before the first one.
        on_done: Told of every result, also of those that were there already.

    Raises:
        ConfigError: Something asked for does not exist, the folder holds another evaluation, or
            another run is at work in it.
    """
    worlds = options.load_worlds()
    plan = plan_run(options, worlds)
    _check_folder(options)
    with _alone_in(options.folder):
        write_plan(options.folder, plan)
        on_plan(plan)
        jobs = make_jobs(options, plan, worlds)
        run_jobs(options.folder, jobs, n_jobs=options.n_jobs, on_done=on_done)
    return plan


@contextmanager
def _alone_in(folder: Path) -> Generator[None]:
    """Keeps other runs out of a folder; a run that was killed keeps nobody out."""
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / ".run.lock")
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise ConfigError(
            f"Another run is at work in {folder}.", hint="Wait for it, or choose another --out."
        ) from error
    try:
        yield
    finally:
        lock.release()


def _floor_m2(world: World) -> float:
    """Gives about how large a world is: the box around its walls."""
    ends = [end for wall in world.walls for end in (wall.start, wall.end)]
    xs, ys = [end.x for end in ends], [end.y for end in ends]
    return (max(xs) - min(xs)) * (max(ys) - min(ys)) if ends else 0.0


def _check_folder(options: RunOptions) -> None:
    if not (options.folder / "run.json").exists():
        return
    seed = read_plan(options.folder).options["seed"]
    if seed != options.seed:
        raise ConfigError(
            f"{options.folder} holds an evaluation with the seed {seed}, not {options.seed}.",
            hint="Go on with that seed, or choose another folder with --out.",
        )


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
