"""What a run finds in its folder, and what it makes of it."""

import errno
from dataclasses import replace
from pathlib import Path

import pytest

from mapspeak.errors import ConfigError
from mapspeak.evaluation.runs.folder import check_folder, take_up, writing_to
from mapspeak.evaluation.trials import (
    RunPlan,
    Trial,
    TrialState,
    is_done,
    read_result,
    trial_folder,
    write_plan,
    write_result,
)
from reportmaking import make_result, make_trial

FIRST, SECOND, THIRD = (make_trial(number) for number in (1, 2, 3))


def plan_of(*trials: Trial, version: str = "1.2.3", **options: object) -> RunPlan:
    """Gives a plan with the seed 0."""
    return RunPlan(trials=trials, versions={"mapspeak": version}, options={"seed": 0, **options})


def result_file(run: Path, trial: Trial) -> Path:
    """Gives where the result of a trial lies."""
    return trial_folder(run, trial) / "result.json"


def test_a_new_folder_takes_the_plan_as_it_is(tmp_path: Path) -> None:
    plan = plan_of(FIRST, SECOND)
    found = take_up(tmp_path / "new", plan)
    assert (found.plan, found.notes) == (plan, ())


@pytest.mark.parametrize("text", ["", '{"tri', "[]", '{"trials": []}'])
def test_a_broken_plan_is_told_with_what_to_do(tmp_path: Path, text: str) -> None:
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(ConfigError, match=r"run\.json cannot be read: .* Delete it and start"):
        take_up(tmp_path, plan_of(FIRST))


@pytest.mark.parametrize("text", ["", '{"trial": {"task": "smal'])
def test_half_a_result_is_thrown_away_and_told(tmp_path: Path, text: str) -> None:
    write_result(tmp_path, make_result(FIRST))
    result_file(tmp_path, FIRST).write_text(text)
    found = take_up(tmp_path, plan_of(FIRST))
    assert not is_done(tmp_path, FIRST)
    assert found.notes == (
        "1 result was cut off and is run again: smallest-room/flat/scripted/picture-table/001.",
    )


def test_a_whole_result_that_is_not_understood_is_never_thrown_away(tmp_path: Path) -> None:
    write_result(tmp_path, make_result(FIRST))
    result_file(tmp_path, FIRST).write_text('{"trial": "of the future"}')
    with pytest.raises(ConfigError, match=r"001/result\.json is no result: trial"):
        take_up(tmp_path, plan_of(FIRST))
    assert is_done(tmp_path, FIRST)


def test_a_result_of_another_trial_is_not_taken_for_this_one(tmp_path: Path) -> None:
    write_result(tmp_path, make_result(replace(FIRST, seed=7)))
    with pytest.raises(ConfigError, match="holds another trial, with the seed 7"):
        take_up(tmp_path, plan_of(FIRST))


def test_what_was_finished_stays_when_less_is_asked_for(tmp_path: Path) -> None:
    exploring = make_trial(task="explore")
    asked = replace(plan_of(FIRST, SECOND, THIRD), preparations=(exploring,))
    write_plan(tmp_path, asked)
    for trial in (exploring, FIRST, SECOND):
        write_result(tmp_path, make_result(trial))
    found = take_up(tmp_path, plan_of(FIRST))
    assert found.plan.trials == (FIRST, SECOND), "the third has no result, and nobody asks for it"
    assert found.plan.preparations == (exploring,)
    assert found.notes == (
        "1 trial that is not asked for any more has a result, and stays in the report.",
    )


def test_an_exploration_is_asked_for_or_a_preparation_but_never_both(tmp_path: Path) -> None:
    exploring = make_trial(task="explore")
    write_plan(tmp_path, replace(plan_of(FIRST), preparations=(exploring,)))
    write_result(tmp_path, make_result(exploring))
    assert take_up(tmp_path, plan_of(exploring, FIRST)).plan.preparations == ()
    write_plan(tmp_path, plan_of(exploring))
    later = take_up(tmp_path, replace(plan_of(FIRST), preparations=(exploring,))).plan
    assert (later.trials, later.preparations) == ((FIRST, exploring), ())


def test_each_sitting_keeps_the_versions_that_it_ran_with(tmp_path: Path) -> None:
    write_plan(tmp_path, take_up(tmp_path, plan_of(FIRST, SECOND)).plan)
    write_result(tmp_path, make_result(FIRST))
    found = take_up(tmp_path, plan_of(FIRST, SECOND, version="2.0.0"))
    (earlier,) = found.plan.earlier
    assert (earlier.versions, earlier.n_done) == ({"mapspeak": "1.2.3"}, 1)
    assert found.plan.versions == {"mapspeak": "2.0.0"}
    assert found.notes == ("Earlier results were made with mapspeak 1.2.3, now it is 2.0.0.",)

    write_plan(tmp_path, found.plan)
    write_result(tmp_path, make_result(SECOND))
    third = take_up(tmp_path, plan_of(FIRST, SECOND, THIRD, version="2.0.0", n_trials=3)).plan
    assert [(each.versions["mapspeak"], each.n_done) for each in third.earlier] == [
        ("1.2.3", 1),
        ("2.0.0", 2),
    ]


def test_going_on_with_the_same_is_no_sitting_of_its_own(tmp_path: Path) -> None:
    write_plan(tmp_path, plan_of(FIRST))
    write_result(tmp_path, make_result(FIRST))
    assert take_up(tmp_path, plan_of(FIRST)).plan.earlier == ()


def test_another_seed_is_refused(tmp_path: Path) -> None:
    write_plan(tmp_path, plan_of(FIRST))
    with pytest.raises(ConfigError, match="the seed 0, not 5"):
        take_up(tmp_path, plan_of(FIRST, seed=5))


def test_two_trials_that_would_lie_in_one_folder_are_refused(tmp_path: Path) -> None:
    here, there = make_trial(world="maps/a.yaml"), make_trial(world="maps_a.yaml")
    with pytest.raises(ConfigError, match=r"maps/a\.yaml and maps_a\.yaml"):
        take_up(tmp_path, plan_of(here, there))


@pytest.mark.parametrize("state", [TrialState.CRASHED, TrialState.HUNG])
def test_what_broke_is_run_again_only_where_that_is_asked_for(
    tmp_path: Path, state: TrialState
) -> None:
    write_result(tmp_path, make_result(FIRST, state=state))
    write_result(tmp_path, make_result(SECOND))
    take_up(tmp_path, plan_of(FIRST, SECOND))
    assert read_result(tmp_path, FIRST).state is state
    found = take_up(tmp_path, plan_of(FIRST, SECOND), has_retry=True)
    assert found.notes == ("1 broken trial is run again.",)
    assert (is_done(tmp_path, FIRST), is_done(tmp_path, SECOND)) == (False, True)


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("the demo's")
    with pytest.raises(ConfigError, match="holds other things"):
        check_folder(tmp_path)


def test_a_run_that_has_lost_its_plan_goes_on(tmp_path: Path) -> None:
    write_result(tmp_path, make_result(FIRST))
    (tmp_path / "report.html").write_text("ours")
    check_folder(tmp_path)
    check_folder(tmp_path / "new")


def test_a_place_that_cannot_be_written_to_is_told_without_a_trace(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="file/out cannot be written to"):
        check_folder(tmp_path / "file" / "out")
    with pytest.raises(ConfigError, match="No space left"), writing_to(tmp_path):
        raise OSError(errno.ENOSPC, "No space left on device")


def test_an_error_that_has_nothing_to_do_with_writing_passes_through(tmp_path: Path) -> None:
    with pytest.raises(ConnectionResetError), writing_to(tmp_path):
        raise ConnectionResetError
