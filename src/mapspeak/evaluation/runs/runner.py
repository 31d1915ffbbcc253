"""The runner: a process for each trial, some at a time, and going on after a stop.

A trial that crashes, hangs or runs out of memory is written down as broken, and the others go on. A
trial that has a result is not run again.
"""

import errno
import gc
import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout
from pydantic import ValidationError

from mapspeak.errors import ConfigError, MapspeakError
from mapspeak.evaluation.runs.attempt import attempt
from mapspeak.evaluation.runs.plan import RunOptions, RunPlan, plan_run, prepare_world
from mapspeak.evaluation.tasks.catalogue import EXPLORE, find_task
from mapspeak.evaluation.trials import (
    TURNS,
    Failure,
    Score,
    Trial,
    TrialResult,
    TrialState,
    clear_trial,
    find_result,
    read_result,
    say_fault,
    trial_folder,
    write_result,
)
from mapspeak.simulator import World

ERRORS = "errors.txt"
LOCK = ".run.lock"
PRELOAD = (
    *("mapspeak.evaluation.runs.runner", "mapspeak.cli", "PIL.Image", "anyio._backends._asyncio"),
    *("jsonschema", "mcp.client.stdio", "numpy.fft", "numpy.ma", "rich.logging", "ruamel.yaml"),
)
"""Modules that every trial needs, even those imported lazily elsewhere: imported once, before
processes are forked."""
LAST_WORDS = 2000
"""Characters of a crash that its result keeps."""
FULL_DISK = 74
"""Exit status of a trial that could not write; it gets no result."""
NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS})
CANNOT_WRITE = NO_ROOM | {errno.EACCES, errno.EPERM, errno.ENOTDIR, errno.ENAMETOOLONG}


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialJob:
    """A trial to be run.

    Attributes:
        work: Carries it out and writes its result; called in its own process.
        after: A trial that must finish before; None for none.
        silent_s: Wall time after its last turn, or its start, at which its process is killed.
    """

    trial: Trial
    work: Callable[[], object]
    after: Trial | None = None
    silent_s: float


def make_jobs(
    options: RunOptions, plan: RunPlan, worlds: Mapping[str, World]
) -> Iterator[TrialJob]:
    """Yield all jobs: first those that others wait for, the largest world first.

    Exploring takes longest, and longest in the largest world: begun last, it would keep one
    process busy while the others have nothing left to do.
    """
    trials = (*plan.preparations, *plan.trials)
    exploring = [trial for trial in trials if trial.task == EXPLORE]
    exploring.sort(key=lambda trial: -_floor_m2(worlds[trial.world]))
    for trial in (*exploring, *(trial for trial in trials if trial.task != EXPLORE)):
        needs_map = find_task(trial.task).needs_map
        before = prepare_world(options, trial.world, trial.agent) if needs_map else None
        work = partial(attempt, options.folder, trial, worlds[trial.world], before)
        yield TrialJob(trial=trial, work=work, after=before, silent_s=options.hang_s)


def _floor_m2(world: World) -> float:
    """Return about how large a world is: the box around its walls."""
    ends = [(end.x, end.y) for wall in world.walls for end in (wall.start, wall.end)]
    return float(np.prod(np.ptp(ends, axis=0))) if ends else 0.0


# --- running it ----------------------------------------------------------------------------------


def run_evaluation(
    options: RunOptions,
    *,
    on_plan: Callable[[RunPlan], None],
    on_done: Callable[[TrialResult], None],
) -> RunPlan:
    """Run every trial that has no result yet, and return the plan.

    Args:
        on_done: Told of every result, also of those that were there already.

    Raises:
        ConfigError: Something asked for does not exist, the folder holds something else or cannot
            be written to, or another run is at work in it.
    """
    worlds = options.load_worlds()
    plan = plan_run(options, worlds)
    folder = options.folder
    with writing_to(folder):
        folder.mkdir(parents=True, exist_ok=True)
        there = {path.name for path in folder.iterdir() if not path.name.startswith(".")}
        if there and "trials" not in there:
            raise ConfigError(
                f"{folder} holds other things, such as {min(there)}, and no evaluation.",
                hint="Choose a new or an empty folder with --out.",
            )
        with _lock(folder):
            on_plan(plan)
            jobs, has_retry = make_jobs(options, plan, worlds), options.has_retry
            run_jobs(folder, jobs, n_jobs=options.n_jobs, on_done=on_done, has_retry=has_retry)
    return plan


@contextmanager
def writing_to(folder: Path) -> Generator[None]:
    """Turn the errors of a folder that cannot be written to into ours.

    Raises:
        ConfigError: The disk is full, or the place is not ours to write to.
    """
    try:
        yield
    except OSError as error:
        if folder.is_dir() and error.errno not in CANNOT_WRITE:
            raise
        raise ConfigError(
            f"{folder} cannot be written to: {error.strerror or error}.",
            hint="Make room or choose another --out; started again, finished trials are kept.",
        ) from error


def _lock(folder: Path) -> AbstractContextManager[object]:
    """Keep other runs out of a folder; the lock of a killed run is free."""
    try:
        return FileLock(folder / LOCK).acquire(timeout=0)
    except Timeout as error:
        raise ConfigError(
            f"Another run is at work in {folder}.", hint="Wait for it, or choose another --out."
        ) from error


@dataclass(slots=True)
class _Running:
    job: TrialJob
    process: BaseProcess
    begun_s: float

    def left_s(self, run: Path) -> float:
        """Return the wall time left until it has been silent for too long."""
        turns = trial_folder(run, self.job.trial) / TURNS
        heard_s = turns.stat().st_mtime if turns.exists() else self.begun_s
        return max(heard_s, self.begun_s) + self.job.silent_s - time.time()


def run_jobs(
    run: Path,
    jobs: Iterable[TrialJob],
    *,
    n_jobs: int,
    on_done: Callable[[TrialResult], None],
    has_retry: bool = False,
) -> None:
    """Run all jobs that have no result yet, in their order where nothing has to wait.

    Args:
        jobs: What to do. A job's predecessor must be among them, or be done.
        n_jobs: Processes at a time.
        on_done: Told of each result, also of those that were there already.

    Raises:
        ConfigError: The disk is full, or a result in the folder is of another trial or not
            understood; what is done is kept.
    """
    done: dict[Trial, TrialResult] = {}
    waiting: list[TrialJob] = []
    running: list[_Running] = []

    def settle(result: TrialResult) -> None:
        done[result.trial] = result
        on_done(result)

    for each, earlier in [(each, _find_earlier(run, each.trial)) for each in jobs]:
        if earlier is None or (has_retry and earlier.state.is_broken):
            waiting.append(each)
            trial_folder(run, each.trial).mkdir(parents=True, exist_ok=True)
        else:
            settle(earlier)
    processes = _processes()
    try:
        while waiting or running:
            while len(running) < n_jobs and (job := _take_next(waiting, done)) is not None:
                before = None if job.after is None else done[job.after]
                if before is not None and before.state.is_broken:
                    said = f"{before.trial.id} came to no result."
                    settle(_write_broken(run, job, TrialState.CRASHED, said))
                else:
                    running.append(_start(run, job, processes))
            if waiting and not running:
                raise AssertionError("a job waits for one that is not there")
            for result in _await_some(run, running):
                settle(result)
    finally:
        _kill(running)


def _kill(running: Iterable[_Running]) -> None:
    # All are killed before the first is waited for: a second Ctrl-C may end the waiting.
    for each in running:
        each.process.kill()
    for each in running:
        each.process.join()


def _take_next(waiting: list[TrialJob], done: Mapping[Trial, TrialResult]) -> TrialJob | None:
    """Take the first job whose predecessor is done; None while all others have to wait."""
    for job in waiting:
        if job.after is None or job.after in done:
            waiting.remove(job)
            return job
    return None


def _find_earlier(run: Path, trial: Trial) -> TrialResult | None:
    """Return the result that an earlier run left; None for none, or for one that was cut off."""
    path = find_result(run, trial)
    if path is None:
        return None
    try:
        result = read_result(path)
    except ValidationError as error:
        if error.errors(include_url=False)[0]["type"] == "json_invalid":
            return None
        raise ConfigError(
            f"{path} is no result: {say_fault(error)}.",
            hint="Use the mapspeak that wrote it, or delete it to run that trial again.",
        ) from error
    if result.trial != trial:
        found = result.trial
        raise ConfigError(
            f"{path.parent} holds another trial, with the seed {found.seed}, "
            f"of {found.agent} in {found.world}.",
            hint="Go on with the options of that evaluation, or choose another folder with --out.",
        )
    return result


def _processes() -> BaseContext:
    """Return the way to start processes: forked from one that has imported all, if can be."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(PRELOAD))
    return context


def _start(run: Path, job: TrialJob, processes: BaseContext) -> _Running:
    folder = clear_trial(run, job.trial)
    process = processes.Process(  # type: ignore[attr-defined]  # contexts have it
        target=_work_apart, args=(job.work, folder / ERRORS), daemon=False
    )
    process.start()
    return _Running(job, process, time.time())


def _await_some(run: Path, running: list[_Running]) -> Iterator[TrialResult]:
    """Wait until a process has ended or has to be ended, and yield what became of it."""
    if not running:
        return
    next_s = min(each.left_s(run) for each in running)
    wait([each.process.sentinel for each in running], timeout=max(next_s, 0.0))
    for each in list(running):
        if not each.process.is_alive():
            each.process.join()
            running.remove(each)
            yield _settle(run, each)
        elif each.left_s(run) <= 0.0:
            _kill([each])
            running.remove(each)
            said = f"It was killed after {each.job.silent_s:.0f} s without a turn."
            yield _write_broken(run, each.job, TrialState.HUNG, said)


def _settle(run: Path, ended: _Running) -> TrialResult:
    if (path := find_result(run, ended.job.trial)) is not None:
        return read_result(path)
    code = ended.process.exitcode
    if code == FULL_DISK:
        raise ConfigError(
            f"{run} cannot be written to: the disk is full.",
            hint="Make room and start again; finished trials are kept.",
        )
    errors = trial_folder(run, ended.job.trial) / ERRORS
    said = errors.read_text("utf-8", "replace")[-LAST_WORDS:] if errors.exists() else ""
    how = f"killed by signal {-code}" if code is not None and code < 0 else f"exit code {code}"
    return _write_broken(run, ended.job, TrialState.CRASHED, f"{said.strip()} ({how})".strip())


def _write_broken(run: Path, job: TrialJob, state: TrialState, error: str) -> TrialResult:
    score = Score(is_success=False, failure=Failure.BROKEN, reason="The trial came to no result.")
    result = TrialResult(trial=job.trial, prompt="", state=state, score=score, error=error)
    write_result(run, result)
    return result


# --- in the trial's own process ----------------------------------------------------------------


def _work_apart(work: Callable[[], object], errors: Path) -> None:
    """Do the work; its output goes to a file, and it ends when the run does."""
    # Loaded objects stay: the garbage collector need not visit them and copy their pages.
    gc.freeze()
    if (parent := multiprocessing.parent_process()) is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()
    # Ctrl-C in a terminal reaches all processes; what becomes of a trial is the run's to say.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with errors.open("w", encoding="utf-8") as said:
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
    status = 0
    try:
        work()
    except BaseException as error:  # noqa: BLE001 - the process's last words, for the result
        leaves = _leaves(error)
        is_full = any(isinstance(leaf, OSError) and leaf.errno in NO_ROOM for leaf in leaves)
        status = FULL_DISK if is_full else 1
        # What we raise on purpose says what to do; anything else is a bug, and needs its trace.
        is_ours = all(isinstance(leaf, MapspeakError) for leaf in leaves)
        sys.stderr.write("\n".join(map(str, leaves)) if is_ours else traceback.format_exc())
    with suppress(OSError):
        sys.stderr.flush()
    # No orderly end is needed, and threads may wait for ever.
    os._exit(status)


def _end_with(parent: int) -> None:
    """End this process when the run's process is gone, as its result would not be read."""
    wait([parent])
    os._exit(1)


def _leaves(error: BaseException) -> list[BaseException]:
    """Return all errors of a group of groups."""
    if not isinstance(error, BaseExceptionGroup):
        return [error]
    return [leaf for each in error.exceptions for leaf in _leaves(each)]
