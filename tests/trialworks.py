"""What trials do in tests of the scheduler; importable, as other processes have to find it."""

import errno
import os
import signal
import sys
import threading
import time
from functools import partial
from pathlib import Path

from mapspeak.evaluation.runs.runner import TrialJob, run_jobs
from mapspeak.evaluation.trials import (
    TURNS,
    Score,
    Trial,
    TrialResult,
    TrialState,
    find_result,
    trial_folder,
    write_result,
)

LOG = "log.txt"
KILLED = "killed.txt"
FOR_EVER_S = 60.0


def make_trial(number: int) -> Trial:
    """Gives a trial that differs from others in its number alone."""
    return Trial(
        task="count", world="none", seed=0, agent="nobody", representation="plain", number=number
    )


def succeed(run: Path, trial: Trial) -> None:
    """Notes that it was run and writes a result."""
    with (run / LOG).open("a") as log:
        log.write(f"{trial.id}\n")
    score = Score(is_success=True, reason="It is done.")
    write_result(run, TrialResult(trial=trial, prompt="", state=TrialState.FINISHED, score=score))


def raise_error() -> None:
    """Fails as a bug does."""
    raise RuntimeError("a bug on purpose")


def kill_itself() -> None:
    """Dies as for want of memory."""
    os.kill(os.getpid(), signal.SIGKILL)


def fill_the_disk() -> None:
    """Fails as a trial does that finds no room for what it writes, deep inside its tasks."""
    error = OSError(errno.ENOSPC, "No space left on device")
    raise ExceptionGroup("tasks", [ExceptionGroup("a task", [error])])


def succeed_after_an_interrupt(run: Path, trial: Trial) -> None:
    """Is interrupted as by Ctrl-C in a terminal, which reaches every process of it."""
    os.kill(os.getpid(), signal.SIGINT)
    succeed(run, trial)


def wait_for_ever() -> None:
    """Hangs."""
    threading.Event().wait(FOR_EVER_S)


def talk_until_over(run: Path, trial: Trial, other: Trial) -> None:
    """Writes turns, the last a while from now, until another trial is over; then succeeds."""
    turns = trial_folder(run, trial) / TURNS
    turns.touch()
    later_s = time.time() + FOR_EVER_S
    os.utime(turns, (later_s, later_s))
    while find_result(run, other) is None:
        os.sched_yield()
    succeed(run, trial)


def kill_run_once(run: Path, trial: Trial, run_pid: int) -> None:
    """Kills the run's process the first time, and succeeds the second."""
    if not (run / KILLED).exists():
        (run / KILLED).touch()
        os.kill(run_pid, signal.SIGKILL)
        wait_for_ever()
    succeed(run, trial)


def ignore(_result: TrialResult) -> None:
    """Listens to no result."""


def run_some(run: Path, run_pid: int) -> None:
    """Runs six trials, the third of which kills the run."""
    trials = [make_trial(number) for number in range(1, 7)]
    works = [partial(succeed, run, trial) for trial in trials]
    works[2] = partial(kill_run_once, run, trials[2], run_pid)
    jobs = [
        TrialJob(trial=trial, work=work, silent_s=FOR_EVER_S)
        for trial, work in zip(trials, works, strict=True)
    ]
    run_jobs(run, jobs, n_jobs=1, on_done=ignore)


if __name__ == "__main__":
    # By its own name, so that other processes find the functions too.
    import trialworks

    trialworks.run_some(Path(sys.argv[1]), os.getpid())
