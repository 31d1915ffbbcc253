import csv
import json
from pathlib import Path
from typing import Any

import pytest

from mapspeak.errors import ConfigError
from mapspeak.evaluation.report import write_report
from mapspeak.evaluation.report.paper import PAPER_ROWS, PAPER_TASKS
from mapspeak.evaluation.scores import wilson_interval
from mapspeak.evaluation.tasks import FAMILIES
from mapspeak.evaluation.trials import Failure, Score, TrialState, write_result
from reportmaking import make_result, make_trial, make_turns, write_course, write_run, write_trial


def report_of(run: Path) -> dict[str, Any]:
    """Writes the report of a run and reads its figures."""
    read: dict[str, Any] = json.loads(write_report(run).figures.read_text())
    return read


def lines_of(run: Path) -> list[dict[str, str]]:
    """Writes the report of a run and reads its lines."""
    with write_report(run).lines.open(newline="") as file:
        return list(csv.DictReader(file))


def test_success_is_counted_with_wilsons_interval(tmp_path: Path) -> None:
    trials = [make_trial(number) for number in (1, 2, 3)]
    write_run(tmp_path, *trials)
    write_trial(tmp_path, trials[0])
    write_trial(tmp_path, trials[1])
    write_trial(tmp_path, trials[2], failure=Failure.WRONG_SIZE)
    (row,) = report_of(tmp_path)["rows"]
    expected = wilson_interval(2, 3)
    assert expected is not None
    assert row["counted"]["n_successes"] == 2
    assert row["counted"]["success"] == {
        "value": expected.value,
        "low": expected.low,
        "high": expected.high,
    }
    assert row["counted"]["failures"] == {"wrong_size": 1}
    assert row["counted"]["figures"]["spl"]["value"] == pytest.approx((0.5 + 0.5 + 0.0) / 3)


def test_a_trial_that_was_only_begun_counts_as_not_successful(tmp_path: Path) -> None:
    done, begun, waiting = (make_trial(number) for number in (1, 2, 3))
    write_run(tmp_path, done, begun, waiting)
    write_trial(tmp_path, done)
    write_course(tmp_path, begun, *make_turns())
    report = report_of(tmp_path)
    (row,) = report["rows"]
    assert report["counts"]["n_standing"] == {"finished": 1, "unfinished": 1, "not run": 1}
    assert (row["counted"]["n_successes"], row["counted"]["n_trials"]) == (1, 2)
    assert (row["n_unfinished"], row["n_asked"]) == (1, 3)
    assert row["counted"]["figures"]["driven_m"]["value"] == 4.0, "it is in no mean"


def test_trials_that_crashed_or_hung_count_as_not_successful(tmp_path: Path) -> None:
    trials = [make_trial(number) for number in (1, 2, 3)]
    write_run(tmp_path, *trials)
    write_trial(tmp_path, trials[0])
    for trial, state in ((trials[1], TrialState.CRASHED), (trials[2], TrialState.HUNG)):
        broken = make_result(trial, failure=Failure.BROKEN, state=state, error="a bug")
        write_result(tmp_path, broken)
    report = report_of(tmp_path)
    assert report["counts"]["n_standing"] == {"finished": 1, "crashed": 1, "hung": 1}
    assert (report["counts"]["n_successes"], report["counts"]["n_counted"]) == (1, 3)


def test_a_broken_result_is_told_and_skipped(tmp_path: Path) -> None:
    good, broken = make_trial(1), make_trial(2)
    write_run(tmp_path, good, broken)
    write_trial(tmp_path, good)
    (write_trial(tmp_path, broken) / "result.json").write_text('{"trial": ')
    report = report_of(tmp_path)
    (row,) = report["rows"]
    assert row["counted"]["n_trials"] == 1
    assert [problem["trial_id"] for problem in report["problems"]] == [broken.id]
    assert "result.json cannot be read and is skipped" in report["problems"][0]["what"]


def test_the_result_of_another_trial_is_told_and_skipped(tmp_path: Path) -> None:
    one, other = make_trial(1), make_trial(2)
    write_run(tmp_path, one, other)
    write_trial(tmp_path, one)
    text = (tmp_path / "trials" / one.id / "result.json").read_text()
    (write_trial(tmp_path, other) / "result.json").write_text(text)
    (problem,) = report_of(tmp_path)["problems"]
    assert "the result of another trial" in problem["what"]


def test_an_agent_that_was_not_run_has_no_figure(tmp_path: Path) -> None:
    ours, asked = make_trial(1), make_trial(1, agent="anthropic/some-model")
    write_run(tmp_path, ours, asked)
    write_trial(tmp_path, ours)
    report = report_of(tmp_path)
    assert [row["counted"]["agent"] for row in report["rows"]] == ["scripted"]
    assert [row["agent"] for row in report["beside_paper"]] == ["scripted"]
    assert [row["agent"] for row in report["rows_by_world"]] == ["scripted"]
    agents = {row["agent"]: (row["n_asked"], row["n_counted"]) for row in report["agents"]}
    assert agents == {"scripted": (1, 1), "anthropic/some-model": (1, 0)}


def test_no_script_is_taken_for_a_model(tmp_path: Path) -> None:
    names = ("scripted", "mock", "mockllm/model", "command:codex", "openai/some-model")
    write_run(tmp_path, *(make_trial(1, agent=name) for name in names))
    kinds = [row["kind"] for row in report_of(tmp_path)["agents"]]
    assert ["no model" in kind for kind in kinds] == [True, True, True, False, False]
    assert kinds[-1] == "a model"


def test_the_papers_tasks_stand_beside_the_papers_figures(tmp_path: Path) -> None:
    explored = make_trial(1, task="explore")
    room = make_trial(1)
    write_run(tmp_path, explored, room)
    figures = {
        "coverage_paper_ratio": 0.98,
        "coverage_recall": 0.985,
        "coverage_known_ratio": 0.995,
    }
    score = Score(is_success=True, figures=figures, reason="98.50 %.")
    write_trial(tmp_path, explored, score=score)
    write_trial(tmp_path, room)
    report = report_of(tmp_path)
    (ours,) = report["beside_paper"]
    means = ours["explore"]["figures"]
    assert {name: means[name]["value"] for name in figures} == figures
    assert ours["smallest_room"]["n_successes"] == 1
    assert ours["fire_tool"] is None
    printed = [(row["coverage_paper_ratio"], row["n_smallest_room"]) for row in report["paper"]]
    assert printed == [(0.9783, 26), (0.9978, 28)]
    assert [row.n_fire_tool for row in PAPER_ROWS] == [30, 30]


def test_the_papers_tasks_are_those_of_the_catalogue() -> None:
    assert FAMILIES["paper"] == PAPER_TASKS


def test_coverage_grows_over_the_metres_at_which_the_answers_told_it(tmp_path: Path) -> None:
    trial = make_trial(1, task="explore")
    write_run(tmp_path, trial)
    score = Score(is_success=True, figures={"coverage_paper_ratio": 0.75}, reason="75 %.")
    write_trial(tmp_path, trial, score=score)
    # The room has 12 m2 of free floor, so the building has 16; 6 were told after 4 s, at 2 m.
    (curve,) = report_of(tmp_path)["curves"]
    assert curve["points"] == [
        {"driven_m": 2.0, "coverage_paper_ratio": 0.375},
        {"driven_m": 4.0, "coverage_paper_ratio": 0.75},
    ]


def test_a_decision_costs_what_the_trial_cost_over_its_decisions(tmp_path: Path) -> None:
    trial = make_trial(1, agent="openai/some-model")
    write_run(tmp_path, trial)
    write_trial(tmp_path, trial, n_input_tokens=3000, n_decisions=4)
    (row,) = report_of(tmp_path)["rows"]
    assert row["per_decision"]["n_input_tokens"]["value"] == 750.0
    assert "n_output_tokens" not in row["per_decision"], "nobody has counted them"


def test_every_trial_has_its_line(tmp_path: Path) -> None:
    done, waiting = make_trial(1), make_trial(2)
    write_run(tmp_path, done, waiting)
    write_trial(tmp_path, done)
    first, second = lines_of(tmp_path)
    assert (first["id"], first["standing"], first["driven_m"]) == (done.id, "finished", "4.0")
    assert (second["id"], second["standing"], second["is_success"]) == (waiting.id, "not run", "")


def test_an_answer_that_looks_like_a_formula_is_text_for_a_spreadsheet(tmp_path: Path) -> None:
    trial = make_trial(1)
    write_run(tmp_path, trial)
    write_trial(tmp_path, trial, answer='=HYPERLINK("http://x.example", "look")')
    (line,) = lines_of(tmp_path)
    assert line["answer"].startswith("'=HYPERLINK")


def test_a_run_of_which_nothing_is_done_has_a_report(tmp_path: Path) -> None:
    write_run(tmp_path, make_trial(1))
    report = report_of(tmp_path)
    assert report["rows"] == []
    assert report["counts"]["n_counted"] == 0


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"there is no run\.json"):
        write_report(tmp_path)
    (tmp_path / "run.json").write_text("{")
    with pytest.raises(ConfigError, match=r"run\.json cannot be read"):
        write_report(tmp_path)


def test_what_a_representation_is_worth_is_counted_over_all_tasks(tmp_path: Path) -> None:
    tasks, shown = ("smallest-room", "route"), ("table", "raw-grid")
    trials = [make_trial(1, task=task, representation=how) for task in tasks for how in shown]
    write_run(tmp_path, *trials)
    for trial in trials:
        is_hard = trial.representation == "raw-grid" and trial.task == "route"
        write_trial(tmp_path, trial, failure=Failure.INCOMPLETE if is_hard else None)
    rows = report_of(tmp_path)["all_tasks"]
    counts = {row["representation"]: (row["n_successes"], row["n_trials"]) for row in rows}
    assert counts == {"table": (2, 2), "raw-grid": (1, 2)}
