import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from filelock import FileLock

from mapspeak.cli.evaluating import evaluate
from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents.catalogue import agent_names
from mapspeak.evaluation.agents.models.chat import Thinking
from mapspeak.evaluation.runs.plan import RunOptions
from mapspeak.evaluation.runs.runner import run_evaluation
from mapspeak.evaluation.tasks.catalogue import FAMILIES
from mapspeak.evaluation.trials import TrialResult, read_results, trial_folder, write_result
from mapspeak.server.reports.representations import Representation
from reportmaking import make_result, make_trial

TWO_ROOMS = """
title: Two rooms with a door between them.
start: {at: [1.0, 1.0], yaw_deg: 0}
walls:
  - line: [[0, 0], [5, 0], [5, 2.4], [0, 2.4], [0, 0]]
  - line: [[3, 0], [3, 2.4]]
doors:
  - {name: door, at: [3, 1.2], width_m: 1.0}
rooms:
  - {name: large room, class: room, outline: [[0, 0], [3, 0], [3, 2.4], [0, 2.4]]}
  - {name: small room, class: room, outline: [[3, 0], [5, 0], [5, 2.4], [3, 2.4]]}
objects: []
"""


def run(*arguments: str) -> tuple[int, str]:
    """Runs the command and gives its exit status and what it printed."""
    done = CliRunner().invoke(evaluate, [*arguments, "--quiet"], catch_exceptions=False)
    return done.exit_code, done.output


def test_an_evaluation_ends_with_a_table_and_goes_on_where_it_was(tmp_path: Path) -> None:
    world, folder = tmp_path / "two.yaml", tmp_path / "out"
    world.write_text(TWO_ROOMS)
    # One trial at a time: what ends first is told first.
    asked = (
        *("--agent", "random,scripted", "--task", "question-way", "--worlds", str(world)),
        *("--trials", "1", "--jobs", "1", "--out", str(folder)),
    )
    status, printed = run(*asked)
    assert status == 0
    assert "question-way" in printed
    results = {result.trial.agent: result for result in read_results(folder)}
    assert results["scripted"].score.is_success, results["scripted"]
    explored = next(each for each in read_results(folder) if each.trial.task == "explore")
    (trial_folder(folder, explored.trial) / "map.pgm").unlink()
    status, again = run(*asked)
    assert status == 0
    assert again == printed


@pytest.mark.parametrize(
    "asked",
    [
        ("--agent", "nobody"),
        ("--task", "nothing"),
        ("--worlds", "nowhere"),
        ("--representation", "nohow"),
        ("--agent", ","),
        ("--task", ""),
        ("--worlds", " "),
        ("--representation", ""),
        ("--thinking", "lots"),
        ("--thinking", "low"),
    ],
)
def test_what_does_not_exist_is_refused_before_anything_runs(
    tmp_path: Path, asked: tuple[str, str]
) -> None:
    with pytest.raises(ConfigError):
        run(*asked, "--out", str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_two_runs_never_share_a_folder(tmp_path: Path) -> None:
    world = tmp_path / "two.yaml"
    world.write_text(TWO_ROOMS)
    (tmp_path / "out").mkdir()
    asked = ("--task", "question-way", "--worlds", str(world), "--out", str(tmp_path / "out"))
    with FileLock(tmp_path / "out" / ".run.lock"), pytest.raises(ConfigError, match="Another run"):
        run(*asked)


def test_a_folder_keeps_its_seed(tmp_path: Path) -> None:
    world = tmp_path / "two.yaml"
    world.write_text(TWO_ROOMS)
    asked = ("--task", "question-way", "--worlds", str(world), "--out", str(tmp_path / "out"))
    run(*asked, "--agent", "random", "--trials", "1", "--seed", "7")
    with pytest.raises(ConfigError, match="seed 7"):
        run(*asked, "--agent", "random", "--trials", "1")


def test_the_help_names_all_there_is_to_choose_from() -> None:
    told = " ".join(CliRunner().invoke(evaluate, ["--help"]).output.split())
    names = (*agent_names(), *FAMILIES, *Representation, *Thinking)
    assert [name for name in names if name not in told] == []


def test_what_is_named_twice_is_run_once(tmp_path: Path) -> None:
    world = tmp_path / "two.yaml"
    world.write_text(TWO_ROOMS)
    status, _ = run(
        *("--agent", "random,scripted,random", "--task", "question-way,question-way"),
        *("--worlds", f"{world},{world}", "--trials", "1", "--out", str(tmp_path / "out")),
    )
    assert status == 0
    asked = [each for each in read_results(tmp_path / "out") if each.trial.task != "explore"]
    assert len(asked) == 2


def test_a_report_is_made_anew_from_all_results_that_are_there(tmp_path: Path) -> None:
    world, folder = tmp_path / "two.yaml", tmp_path / "out"
    world.write_text(TWO_ROOMS)
    asked = ("--task", "question-way", "--worlds", str(world), "--trials", "1")
    run(*asked, "--agent", "random", "--out", str(folder))
    status, printed = run(*asked, "--agent", "scripted", "--out", str(folder))
    assert status == 0
    assert "random" not in printed, "the table has what was asked for"
    status, _ = run("--report", "--out", str(folder))
    assert status == 0
    page = (folder / "report.html").read_text()
    assert "question-way/" in page
    assert "/random/" in page


def test_a_report_of_a_run_that_was_stopped_says_how_many_trials_are_missing(
    tmp_path: Path,
) -> None:
    world, folder = tmp_path / "two.yaml", tmp_path / "out"
    world.write_text(TWO_ROOMS)

    def stop(_result: TrialResult) -> None:
        raise KeyboardInterrupt

    options = RunOptions(
        agents=("random",), tasks=("question-way",), worlds=(str(world),), n_trials=2, folder=folder
    )
    with pytest.raises(KeyboardInterrupt):
        run_evaluation(options, on_plan=lambda _plan: None, on_done=stop)
    status, printed = run("--report", "--out", str(folder))
    assert status == 1
    assert "2 of 3 trials have no result." in printed


@pytest.mark.parametrize("number", ["nan", "inf"])
def test_a_time_that_is_no_number_is_refused(tmp_path: Path, number: str) -> None:
    status, printed = run("--hang-s", number, "--out", str(tmp_path / "out"))
    assert status == 2
    assert "--hang-s" in printed
    assert not (tmp_path / "out").exists()


def test_a_report_of_a_folder_without_results_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="holds no result"):
        run("--report", "--out", str(tmp_path))


def test_a_report_that_cannot_be_put_in_its_place_leaves_no_half_of_it(tmp_path: Path) -> None:
    write_result(tmp_path, make_result(make_trial()))
    (tmp_path / "report.html").mkdir()
    with pytest.raises(IsADirectoryError):
        run("--report", "--out", str(tmp_path))
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".report")] == []


def test_sigterm_ends_a_run_as_ctrl_c_does(tmp_path: Path) -> None:
    asked = ["eval", "--task", "explore", "--worlds", "flat_1", "--out", str(tmp_path / "out")]
    with subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-m", "mapspeak", *asked], stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("1 trials in 1 world by scripted")
        process.terminate()
        said = process.stderr.read()
    assert process.returncode == 130
    assert said.startswith("Stopped: 0 of ")
    assert not list((tmp_path / "out").glob("**/result.json"))
