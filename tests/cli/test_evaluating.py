from pathlib import Path

import pytest
from click.testing import CliRunner
from filelock import FileLock

from mapspeak.cli.evaluating import evaluate
from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents import agent_names
from mapspeak.evaluation.agents.models import Thinking
from mapspeak.evaluation.tasks import FAMILIES
from mapspeak.evaluation.trials import (
    RunPlan,
    read_plan,
    read_results,
    trial_folder,
    write_plan,
)
from mapspeak.server import Representation

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
    asked = ("--agent", "random,scripted", "--task", "question-way", "--worlds", str(world))
    status, printed = run(*asked, "--trials", "1", "--out", str(folder))
    assert status == 0
    assert "question-way" in printed
    plan = read_plan(folder)
    assert [trial.agent for trial in plan.trials] == ["random", "scripted"]
    assert [trial.task for trial in plan.preparations] == ["explore"]
    results = list(read_results(folder))
    assert results[1].score.is_success, results[1]

    (folder / "trials" / plan.preparations[0].id / "map.pgm").unlink()
    status, again = run(*asked, "--trials", "1", "--out", str(folder))
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
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "run.json").write_text(
        '{"trials": [], "versions": {}, "options": {"seed": 7}}'
    )
    asked = ("--task", "question-way", "--worlds", str(world), "--out", str(tmp_path / "out"))
    with pytest.raises(ConfigError, match="seed 7"):
        run(*asked)


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
    assert len(read_plan(tmp_path / "out").trials) == 2


def test_a_result_that_was_cut_off_is_run_again_and_told(tmp_path: Path) -> None:
    world, folder = tmp_path / "two.yaml", tmp_path / "out"
    world.write_text(TWO_ROOMS)
    asked = ("--agent", "random", "--task", "question-way", "--worlds", str(world), "--trials", "1")
    run(*asked, "--out", str(folder))
    (trial,) = read_plan(folder).trials
    (trial_folder(folder, trial) / "result.json").write_text("")
    status, printed = run(*asked, "--out", str(folder))
    assert status == 0
    assert "1 result was cut off and is run again" in printed
    assert [result.trial for result in read_results(folder)] == [trial]


def test_with_fewer_agents_what_others_did_stays_in_table_and_report(tmp_path: Path) -> None:
    world, folder = tmp_path / "two.yaml", tmp_path / "out"
    world.write_text(TWO_ROOMS)
    asked = ("--task", "question-way", "--worlds", str(world), "--trials", "1")
    run(*asked, "--agent", "random,scripted", "--out", str(folder))
    status, printed = run(*asked, "--agent", "scripted", "--out", str(folder))
    assert status == 0
    assert "1 trial that is not asked for any more has a result" in printed
    assert "random" in printed
    assert "random" in (folder / "report.csv").read_text()


def test_a_report_that_cannot_be_put_in_its_place_leaves_no_half_of_it(tmp_path: Path) -> None:
    write_plan(tmp_path, RunPlan(trials=(), versions={}, options={"seed": 0}))
    (tmp_path / "report.html").mkdir()
    with pytest.raises(IsADirectoryError):
        run("--report", "--out", str(tmp_path))
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".report")] == []
