import errno
import signal
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import pytest

import trialworks
from mapspeak.errors import ConfigError
from mapspeak.evaluation.runs.plan import RunOptions
from mapspeak.evaluation.runs.runner import TrialJob, run_evaluation, run_jobs, writing_to
from mapspeak.evaluation.trials import (
    Failure,
    Trial,
    TrialResult,
    TrialState,
    find_result,
    trial_folder,
    write_result,
)
from mapspeak.evaluation.trials import read_result as read_file
from mapspeak.hold import Hold
from reportmaking import make_result
from trialworks import make_trial

LONG_S = 60.0

GOOD, CRASHING, KILLED, HANGING, LAST = (make_trial(number) for number in range(1, 6))


def read_result(run: Path, trial: Trial) -> TrialResult:
    """Reads the result that a trial has left."""
    return read_file(trial_folder(run, trial) / "result.json")


def run_again(run: Path, trial: Trial, *, has_retry: bool = False) -> None:
    """Runs a trial of which there may be a result, and which succeeds."""
    job = TrialJob(trial=trial, work=partial(trialworks.succeed, run, trial), silent_s=LONG_S)
    run_jobs(run, [job], n_jobs=1, on_done=trialworks.ignore, has_retry=has_retry)


def n_runs(run: Path) -> int:
    """Gives how many trials were run in a folder."""
    log = run / trialworks.LOG
    return len(log.read_text().splitlines()) if log.exists() else 0


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of five trials, of which one crashes, one is killed and one hangs."""
    run = tmp_path_factory.mktemp("run")
    jobs = [
        TrialJob(trial=GOOD, work=partial(trialworks.succeed, run, GOOD), silent_s=LONG_S),
        TrialJob(trial=CRASHING, work=trialworks.raise_error, silent_s=LONG_S),
        TrialJob(trial=KILLED, work=trialworks.kill_itself, silent_s=LONG_S),
        TrialJob(trial=HANGING, work=trialworks.wait_for_ever, silent_s=0.5),
        TrialJob(trial=LAST, work=partial(trialworks.succeed, run, LAST), silent_s=LONG_S),
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


def test_a_trial_whose_agent_still_calls_is_not_killed(
    tmp_path: Path,
) -> None:
    talking = partial(trialworks.talk_until_over, tmp_path, GOOD, HANGING)
    jobs = [
        TrialJob(trial=GOOD, work=talking, silent_s=0.5),
        TrialJob(trial=HANGING, work=trialworks.wait_for_ever, silent_s=0.5),
    ]
    run_jobs(tmp_path, jobs, n_jobs=2, on_done=trialworks.ignore)
    assert read_result(tmp_path, GOOD).state is TrialState.FINISHED
    assert read_result(tmp_path, HANGING).state is TrialState.HUNG


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
    assert find_result(tmp_path, make_trial(4)) is None

    trialworks.run_some(tmp_path, 0)

    written = (tmp_path / trialworks.LOG).read_text().splitlines()
    assert sorted(written) == [make_trial(number).id for number in range(1, 7)]


def test_results_that_are_there_are_told_again(tmp_path: Path) -> None:
    trialworks.succeed(tmp_path, GOOD)
    told: list[TrialResult] = []
    job = TrialJob(trial=GOOD, work=trialworks.raise_error, silent_s=LONG_S)
    run_jobs(tmp_path, [job], n_jobs=1, on_done=told.append)
    assert [result.score.is_success for result in told] == [True]


def test_a_trial_waits_for_the_one_it_starts_from(tmp_path: Path) -> None:
    jobs = [
        TrialJob(
            trial=LAST,
            work=partial(trialworks.succeed, tmp_path, LAST),
            after=GOOD,
            silent_s=LONG_S,
        ),
        TrialJob(trial=GOOD, work=partial(trialworks.succeed, tmp_path, GOOD), silent_s=LONG_S),
    ]
    run_jobs(tmp_path, jobs, n_jobs=2, on_done=trialworks.ignore)
    assert (tmp_path / trialworks.LOG).read_text().splitlines() == [GOOD.id, LAST.id]


def test_a_trial_whose_preparation_broke_is_broken_too(tmp_path: Path) -> None:
    jobs = [
        TrialJob(trial=GOOD, work=trialworks.raise_error, silent_s=LONG_S),
        TrialJob(
            trial=LAST,
            work=partial(trialworks.succeed, tmp_path, LAST),
            after=GOOD,
            silent_s=LONG_S,
        ),
    ]
    run_jobs(tmp_path, jobs, n_jobs=2, on_done=trialworks.ignore)
    assert read_result(tmp_path, LAST).score.failure is Failure.BROKEN


def test_a_full_disk_ends_the_run_and_is_nobodys_result(tmp_path: Path) -> None:
    jobs = [TrialJob(trial=GOOD, work=trialworks.fill_the_disk, silent_s=LONG_S)]
    with pytest.raises(ConfigError, match="the disk is full"):
        run_jobs(tmp_path, jobs, n_jobs=1, on_done=trialworks.ignore)
    assert find_result(tmp_path, GOOD) is None


def test_an_interrupt_is_for_the_run_and_not_for_its_trials(tmp_path: Path) -> None:
    work = partial(trialworks.succeed_after_an_interrupt, tmp_path, GOOD)
    jobs = [TrialJob(trial=GOOD, work=work, silent_s=LONG_S)]
    run_jobs(tmp_path, jobs, n_jobs=1, on_done=trialworks.ignore)
    assert read_result(tmp_path, GOOD).score.is_success


def test_a_trials_folder_is_named_so_that_any_system_can_hold_it(tmp_path: Path) -> None:
    folder = trial_folder(tmp_path, make_trial(7)).relative_to(tmp_path)
    assert folder.as_posix() == "trials/count/none/nobody/plain/007"


@pytest.mark.parametrize("text", ["", '{"trial": {"task": "smal'])
def test_a_result_that_was_cut_off_is_run_again(tmp_path: Path, text: str) -> None:
    write_result(tmp_path, make_result(GOOD))
    (trial_folder(tmp_path, GOOD) / "result.json").write_text(text)
    run_again(tmp_path, GOOD)
    assert read_result(tmp_path, GOOD).score.is_success
    assert n_runs(tmp_path) == 1


def test_a_whole_result_that_is_not_understood_is_never_thrown_away(tmp_path: Path) -> None:
    write_result(tmp_path, make_result(GOOD))
    path = trial_folder(tmp_path, GOOD) / "result.json"
    path.write_text('{"trial": "of the future"}')
    with pytest.raises(ConfigError, match=r"001/result\.json is no result: trial"):
        run_again(tmp_path, GOOD)
    assert "of the future" in path.read_text()


def test_a_result_of_another_trial_is_not_taken_for_this_one(tmp_path: Path) -> None:
    write_result(tmp_path, make_result(replace(GOOD, seed=7)))
    with pytest.raises(ConfigError, match="holds another trial, with the seed 7"):
        run_again(tmp_path, GOOD)


@pytest.mark.parametrize("state", [TrialState.CRASHED, TrialState.HUNG])
def test_what_broke_is_run_again_only_where_that_is_asked_for(
    tmp_path: Path, state: TrialState
) -> None:
    write_result(tmp_path, make_result(GOOD, state=state))
    run_again(tmp_path, GOOD)
    assert read_result(tmp_path, GOOD).state is state
    run_again(tmp_path, GOOD, has_retry=True)
    assert read_result(tmp_path, GOOD).state is TrialState.FINISHED
    assert n_runs(tmp_path) == 1


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").touch()
    options = RunOptions(worlds=("flat_1",), folder=tmp_path)
    with pytest.raises(ConfigError, match=r"holds other things, such as letter\.txt"):
        run_evaluation(options, on_plan=lambda _: None, on_done=trialworks.ignore)


def test_what_a_system_leaves_in_a_folder_by_itself_does_not_make_it_something_else(
    tmp_path: Path,
) -> None:
    (tmp_path / ".DS_Store").touch()
    options = RunOptions(worlds=("flat_1",), folder=tmp_path)
    with pytest.raises(InterruptedError, match="as far as the plan"):
        run_evaluation(options, on_plan=_interrupt, on_done=trialworks.ignore)


def _interrupt(_plan: object) -> None:
    raise InterruptedError("as far as the plan")


def test_a_place_that_cannot_be_written_to_is_told_without_a_trace(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="No space left"), writing_to(tmp_path):
        raise OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(ConnectionResetError), writing_to(tmp_path):
        raise ConnectionResetError


def test_what_an_interrupted_trial_has_left_is_gone_when_it_is_run_again(tmp_path: Path) -> None:
    control = trial_folder(tmp_path, GOOD) / "control"
    control.mkdir(parents=True)
    Hold(control).put("stop_robot", at=datetime.now(UTC))
    run_again(tmp_path, GOOD)
    assert Hold(control).read() is None
    assert read_result(tmp_path, GOOD).score.is_success
