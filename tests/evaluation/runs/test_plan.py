from pathlib import Path

import pytest

from mapspeak.errors import ConfigError
from mapspeak.evaluation.runs.plan import RunOptions, plan_run
from mapspeak.evaluation.runs.runner import make_jobs
from mapspeak.evaluation.runs.showing import announce
from sites import make_flat


def test_the_largest_world_is_explored_first_and_before_all_else(tmp_path: Path) -> None:
    options = RunOptions(worlds=("flat_1", "office", "flat_2"), n_trials=2, folder=tmp_path)
    worlds = options.load_worlds()
    jobs = list(make_jobs(options, plan_run(options, worlds), worlds))
    assert [job.trial.task for job in jobs[:4]] == ["explore"] * 3 + ["smallest-room"]
    assert [job.trial.world for job in jobs[:3]] == ["office", "flat_2", "flat_1"]


def test_a_plan_names_the_versions_it_was_made_with(tmp_path: Path) -> None:
    options = RunOptions(worlds=("flat_1",), n_trials=1, folder=tmp_path)
    plan = plan_run(options, options.load_worlds())
    assert list(plan.versions) == ["mapspeak", "python", "numpy"]


def test_a_representation_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no representation 'poem'"):
        RunOptions(folder=tmp_path, representations=("poem",))


def test_a_script_is_asked_once_whatever_models_may_think(tmp_path: Path) -> None:
    options = RunOptions(
        agents=("scripted", "mock"),
        tasks=("smallest-room",),
        worlds=("flat_1",),
        n_trials=1,
        thinking=("low", "high"),
        folder=tmp_path,
    )
    trials = plan_run(options, options.load_worlds()).trials
    assert [trial.answerer for trial in trials] == ["scripted", "mock+low", "mock+high"]


def test_thinking_without_anyone_who_thinks_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--thinking is for models"):
        RunOptions(folder=tmp_path, agents=("scripted", "oracle"), thinking=("low",))


@pytest.mark.parametrize("other", ["maps_a.yaml", "maps/A.yaml"])
def test_two_trials_that_would_lie_in_one_folder_are_refused(tmp_path: Path, other: str) -> None:
    world = make_flat(tmp_path)
    options = RunOptions(worlds=("maps/a.yaml", other), folder=tmp_path)
    with pytest.raises(ConfigError, match=rf"maps/a\.yaml and {other}"):
        plan_run(options, dict.fromkeys(options.worlds, world))


def test_it_is_announced_how_much_there_is_to_do_and_how_to_stop(tmp_path: Path) -> None:
    options = RunOptions(worlds=("flat_1",), n_trials=3, folder=tmp_path)
    said = announce(options, plan_run(options, options.load_worlds()))
    assert said.startswith("7 trials in 1 world by scripted, 2 at a time: about 1 min")
    assert "Ctrl-C stops; the same command goes on." in said


def test_each_trial_of_a_task_has_the_next_seed(tmp_path: Path) -> None:
    options = RunOptions(
        tasks=("smallest-room",), worlds=("flat_1",), n_trials=3, seed=40, folder=tmp_path
    )
    trials = plan_run(options, options.load_worlds()).trials
    assert sorted({(trial.number, trial.seed) for trial in trials}) == [(1, 40), (2, 41), (3, 42)]


def test_an_agent_that_sees_less_starts_from_its_own_exploration(tmp_path: Path) -> None:
    options = RunOptions(
        folder=tmp_path,
        worlds=("flat_1",),
        tasks=("fire-tool",),
        n_trials=1,
        agents=("scripted", "blind", "bearings", "random"),
    )
    worlds = options.load_worlds()
    jobs = make_jobs(options, plan_run(options, worlds), worlds)
    began = {job.trial.agent: job.after.agent for job in jobs if job.after is not None}
    assert began == {
        "scripted": "scripted",
        "blind": "blind",
        "bearings": "bearings",
        "random": "scripted",
    }
