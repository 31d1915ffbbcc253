import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

import trialworks
from mapspeak.errors import ConfigError
from mapspeak.evaluation.runs import Job, run_jobs
from mapspeak.evaluation.trials import (
    Failure,
    TrialResult,
    TrialState,
    is_done,
    read_result,
    trial_folder,
)
from trialworks import make_trial

LONG_S = 60.0

GOOD, CRASHING, KILLED, HANGING, LAST = (make_trial(number) for number in range(1, 6))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of five trials, of which one crashes, one is killed and one hangs."""
    run = tmp_path_factory.mktemp("run")
    jobs = [
        Job(trial=GOOD, work=partial(trialworks.succeed, run, GOOD), wall_s=LONG_S),
        Job(trial=CRASHING, work=trialworks.raise_error, wall_s=LONG_S),
        Job(trial=KILLED, work=trialworks.kill_itself, wall_s=LONG_S),
        Job(trial=HANGING, work=trialworks.wait_for_ever, wall_s=0.5),
        Job(trial=LAST, work=partial(trialworks.succeed, run, LAST), wall_s=LONG_S),
    ]
    run_jobs(run, jobs, n_jobs=2, on_done=trialworks.ignore)
    return run


def test_a_crash_is_written_down_with_its_trace(run: Path) -> None:
    result = read_result(run, CRASHING)
    assert result.state is TrialState.CRASHED
    assert "a bug on purpose" in (result.error or "")
    assert result.score.failure is Failure.BROKEN


def test_a_process_that_was_killed_counts_as_crashed_and_names_the_signal(run: Path) -> None:
    result = read_result(run, KILLED)
    assert result.state is TrialState.CRASHED
    assert f"signal {signal.SIGKILL}" in (result.error or "")


def test_a_trial_that_hangs_is_killed_and_says_so(run: Path) -> None:
    assert read_result(run, HANGING).state is TrialState.HUNG


def test_broken_trials_cost_the_others_nothing(run: Path) -> None:
    assert read_result(run, GOOD).score.is_success
    assert read_result(run, LAST).score.is_success


def test_a_run_that_was_killed_goes_on_without_repeating_what_is_done(tmp_path: Path) -> None:
    here = str(Path(trialworks.__file__).parent)
    command = [sys.executable, str(Path(trialworks.__file__)), str(tmp_path)]
    done = subprocess.run(  # noqa: S603 - our own program
        command, check=False, env={"PYTHONPATH": here}, capture_output=True, timeout=60
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert not is_done(tmp_path, make_trial(4))

    trialworks.run_some(tmp_path, 0)

    written = (tmp_path / trialworks.LOG).read_text().splitlines()
    assert sorted(written) == [make_trial(number).id for number in range(1, 7)]


def test_results_that_are_there_are_told_again(tmp_path: Path) -> None:
    trialworks.succeed(tmp_path, GOOD)
    told: list[TrialResult] = []
    job = Job(trial=GOOD, work=trialworks.raise_error, wall_s=LONG_S)
    run_jobs(tmp_path, [job], n_jobs=1, on_done=told.append)
    assert [result.score.is_success for result in told] == [True]


def test_a_trial_waits_for_the_one_it_starts_from(tmp_path: Path) -> None:
    jobs = [
        Job(
            trial=LAST, work=partial(trialworks.succeed, tmp_path, LAST), after=GOOD, wall_s=LONG_S
        ),
        Job(trial=GOOD, work=partial(trialworks.succeed, tmp_path, GOOD), wall_s=LONG_S),
    ]
    run_jobs(tmp_path, jobs, n_jobs=2, on_done=trialworks.ignore)
    assert (tmp_path / trialworks.LOG).read_text().splitlines() == [GOOD.id, LAST.id]


def test_a_trial_whose_preparation_broke_is_broken_too(tmp_path: Path) -> None:
    jobs = [
        Job(trial=GOOD, work=trialworks.raise_error, wall_s=LONG_S),
        Job(
            trial=LAST, work=partial(trialworks.succeed, tmp_path, LAST), after=GOOD, wall_s=LONG_S
        ),
    ]
    run_jobs(tmp_path, jobs, n_jobs=2, on_done=trialworks.ignore)
    assert read_result(tmp_path, LAST).score.failure is Failure.BROKEN


def test_a_full_disk_ends_the_run_and_is_nobodys_result(tmp_path: Path) -> None:
    jobs = [Job(trial=GOOD, work=trialworks.fill_the_disk, wall_s=LONG_S)]
    with pytest.raises(ConfigError, match="the disk is full"):
        run_jobs(tmp_path, jobs, n_jobs=1, on_done=trialworks.ignore)
    assert not is_done(tmp_path, GOOD)


def test_an_interrupt_is_for_the_run_and_not_for_its_trials(tmp_path: Path) -> None:
    work = partial(trialworks.succeed_after_an_interrupt, tmp_path, GOOD)
    jobs = [Job(trial=GOOD, work=work, wall_s=LONG_S)]
    run_jobs(tmp_path, jobs, n_jobs=1, on_done=trialworks.ignore)
    assert read_result(tmp_path, GOOD).score.is_success


def test_a_trials_folder_is_named_so_that_any_system_can_hold_it(tmp_path: Path) -> None:
    folder = trial_folder(tmp_path, make_trial(7)).relative_to(tmp_path)
    assert folder.as_posix() == "trials/count/none/nobody/plain/007"
