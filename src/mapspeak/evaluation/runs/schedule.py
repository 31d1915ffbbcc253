"""Runs many trials, each in a process of its own, some at a time, and goes on where it left off.

What one process does to itself - crash, hang, run out of memory - is written down as that trial's
result, and the others never notice. A trial with a result is not run again.
"""

import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from mapspeak.errors import ConfigError, MapspeakError
from mapspeak.evaluation.runs.folder import NO_ROOM
from mapspeak.evaluation.trials import (
    Failure,
    Score,
    Trial,
    TrialResult,
    TrialState,
    is_done,
    read_result,
    trial_folder,
    write_result,
)

__all__ = ["Job", "run_jobs"]

ERRORS = "errors.txt"
PRELOAD = ("mapspeak.evaluation.runs", "mapspeak.evaluation.runs.preload", "mapspeak.cli")
"""What every trial needs; imported once, before processes are forked."""
LAST_WORDS = 2000
"""Characters of a crash that its result keeps."""
FULL_DISK = 74
"""Exit status of a trial that could not write: no fault of it, and so none of its results."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """A trial to be run.

    Attributes:
        trial: Which one.
        work: Carries it out and writes its result; called in a process of its own.
        after: A trial that has to be finished before; None for none.
        wall_s: A process that takes longer is killed.
    """

    trial: Trial
    work: Callable[[], None]
    after: Trial | None = None
    wall_s: float


@dataclass(slots=True)
class _Running:
    job: Job
    process: BaseProcess
    ends_s: float


@dataclass(slots=True)
class _Desk:
    """What is still to do, and what is under way."""

    run: Path
    n_jobs: int
    on_done: Callable[[TrialResult], None]
    waiting: list[Job]
    running: list[_Running] = field(default_factory=list)

    def take_next(self) -> Job | None:
        """Gives the first job whose predecessor is done."""
        for job in self.waiting:
            if job.after is None or is_done(self.run, job.after):
                self.waiting.remove(job)
                return job
        return None


def run_jobs(
    run: Path,
    jobs: Iterable[Job],
    *,
    n_jobs: int,
    on_done: Callable[[TrialResult], None],
) -> None:
    """Runs all jobs that have no result yet, in their order where nothing has to wait.

    Args:
        run: The run's folder.
        jobs: What to do. A job's predecessor must be among them, or be done.
        n_jobs: Processes at a time.
        on_done: Told of each result, also of those that were there already.

    Raises:
        ConfigError: The disk is full; what is done is kept.
    """
    jobs = list(jobs)
    for job in jobs:
        if is_done(run, job.trial):
            on_done(read_result(run, job.trial))
    desk = _Desk(run, n_jobs, on_done, [job for job in jobs if not is_done(run, job.trial)])
    processes = _processes()
    try:
        while desk.waiting or desk.running:
            _start_more(desk, processes)
            _await_one(desk)
    finally:
        # All are told before one is waited for: a second Ctrl-C may end the waiting.
        for running in desk.running:
            running.process.kill()
        for running in desk.running:
            running.process.join()


def _processes() -> multiprocessing.context.BaseContext:
    """Gives the way to start processes: forked from one that has imported everything, if can be."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(PRELOAD))
    return context


def _start_more(desk: _Desk, processes: multiprocessing.context.BaseContext) -> None:
    while len(desk.running) < desk.n_jobs and (job := desk.take_next()) is not None:
        if job.after is not None and _is_broken(desk.run, job.after):
            _write_broken(desk, job, TrialState.CRASHED, f"{job.after.id} came to no result.")
            continue
        folder = trial_folder(desk.run, job.trial)
        folder.mkdir(parents=True, exist_ok=True)
        process = processes.Process(  # type: ignore[attr-defined]  # contexts have it
            target=_work_apart, args=(job.work, folder / ERRORS), daemon=False
        )
        process.start()
        desk.running.append(_Running(job, process, time.monotonic() + job.wall_s))


def _await_one(desk: _Desk) -> None:
    """Waits until a process has ended or has to be ended, and settles what became of it."""
    if not desk.running:
        if desk.waiting:
            raise AssertionError("a job waits for one that is not there")
        return
    next_s = min(running.ends_s for running in desk.running)
    wait(
        [running.process.sentinel for running in desk.running],
        timeout=max(next_s - time.monotonic(), 0.0),
    )
    for running in list(desk.running):
        if not running.process.is_alive():
            _settle(desk, running)
        elif time.monotonic() >= running.ends_s:
            running.process.kill()
            running.process.join()
            desk.running.remove(running)
            said = f"It was killed after {running.job.wall_s:.0f} s of wall time."
            _write_broken(desk, running.job, TrialState.HUNG, said)


def _settle(desk: _Desk, running: _Running) -> None:
    running.process.join()
    desk.running.remove(running)
    if is_done(desk.run, running.job.trial):
        desk.on_done(read_result(desk.run, running.job.trial))
        return
    code = running.process.exitcode
    if code == FULL_DISK:
        raise ConfigError(
            f"{desk.run} cannot be written to: the disk is full.",
            hint="Make room and start again; finished trials are kept.",
        )
    errors = trial_folder(desk.run, running.job.trial) / ERRORS
    said = errors.read_text("utf-8", "replace")[-LAST_WORDS:] if errors.exists() else ""
    how = f"killed by signal {-code}" if code is not None and code < 0 else f"exit code {code}"
    _write_broken(desk, running.job, TrialState.CRASHED, f"{said.strip()} ({how})".strip())


def _write_broken(desk: _Desk, job: Job, state: TrialState, error: str) -> None:
    result = TrialResult(
        trial=job.trial,
        prompt="",
        state=state,
        score=Score(
            is_success=False, failure=Failure.BROKEN, reason="The trial came to no result."
        ),
        error=error,
    )
    write_result(desk.run, result)
    desk.on_done(result)


def _is_broken(run: Path, trial: Trial) -> bool:
    return read_result(run, trial).state in (TrialState.CRASHED, TrialState.HUNG)


# --- in the trial's own process ----------------------------------------------------------------


def _work_apart(work: Callable[[], None], errors: Path) -> None:
    """Does the work; what it says goes to a file, and it ends when the run does."""
    _end_with_parent()
    # Ctrl-C in a terminal reaches all processes; what becomes of a trial is the run's to say.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with errors.open("w", encoding="utf-8") as said:
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
    try:
        work()
    except BaseException as error:  # noqa: BLE001 - the process's last words, for the result
        leaves = list(_leaves(error))
        if any(isinstance(leaf, OSError) and leaf.errno in NO_ROOM for leaf in leaves):
            os._exit(FULL_DISK)
        # What we raise on purpose says what to do; anything else is a bug, and needs its trace.
        is_ours = all(isinstance(leaf, MapspeakError) for leaf in leaves)
        sys.stderr.write("\n".join(map(str, leaves)) if is_ours else traceback.format_exc())
        sys.stderr.flush()
        os._exit(1)
    sys.stderr.flush()
    # Nothing here is worth an orderly end: threads may wait for what never comes.
    os._exit(0)


def _leaves(error: BaseException) -> Iterator[BaseException]:
    """Gives all errors of a group of groups."""
    if isinstance(error, BaseExceptionGroup):
        for each in error.exceptions:
            yield from _leaves(each)
    else:
        yield error


def _end_with_parent() -> None:
    """Ends this process when the run's process is gone: nobody would read its result."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
