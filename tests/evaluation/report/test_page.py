from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from mapspeak.evaluation.report.page import PAPER_TASKS, write_page
from mapspeak.evaluation.tasks.catalogue import FAMILIES
from mapspeak.evaluation.trials import (
    Failure,
    Score,
    ToolCall,
    TrialState,
    Turn,
    read_results,
    trial_folder,
    write_result,
)
from reportmaking import (
    ReadPage,
    make_result,
    make_trial,
    make_turns,
    read_replay,
    write_course,
    write_picture,
    write_trial,
)

HOSTILE = (
    "</pre></script><script>alert(1)</script><img src=//evil.example/x onerror='alert(2)'>&amp;"
)


def page_of(run: Path) -> ReadPage:
    """Writes the pages of a run and reads the one of the run."""
    return ReadPage.of(write_page(run, read_results(run)))


def path_of_replay(run: Path, number: int = 1, **changes: object) -> Path:
    """Writes the pages of a run and gives that of a trial."""
    page_of(run)
    return trial_folder(run, make_trial(number, **changes)) / "replay.html"


def replay_of(run: Path) -> Any:  # noqa: ANN401 - JSON
    """Writes the pages of a run and gives what the first trial's shows."""
    return read_replay(path_of_replay(run))


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run with a success, a failure, and a trial that was cut short and has no result."""
    run = tmp_path / "run"
    trials = [make_trial(number) for number in (1, 2, 3)]
    write_trial(run, trials[0])
    write_trial(run, trials[1], failure=Failure.CORRIDOR_FOR_ROOM)
    write_course(run, trials[2], *make_turns())
    return run


def test_the_page_of_a_run_needs_nothing_and_runs_nothing(run: Path) -> None:
    page = page_of(run)
    assert not any("//" in v or v.startswith("/") for v in page.values("href", "src", "srcset"))
    (policy,) = [v for v in page.values("content") if "default-src" in v]
    assert policy.startswith("default-src 'none'; style-src 'sha256-")
    assert {each.tag for each in page.elements} & {"link", "iframe", "object", "script"} == set()
    assert page.is_whole


def test_a_replay_loads_only_the_pictures_beside_it(run: Path) -> None:
    text = path_of_replay(run).read_text(encoding="utf-8")
    assert "default-src 'none'; img-src data: 'self' file:; style-src 'sha256-" in text
    head = text.partition("<style>")[0]
    assert "http:" not in head
    assert "src=" not in head


def test_hostile_text_is_shown_as_text(tmp_path: Path) -> None:
    names: dict[str, Any] = {"world": f"flat {HOSTILE}", "agent": HOSTILE}
    trial = make_trial(1, **names)
    call = ToolCall(tool=HOSTILE, arguments={HOSTILE: HOSTILE})
    turns = (Turn(role=HOSTILE, text=HOSTILE, call=call, pictures=(HOSTILE,), is_error=True),)
    write_course(tmp_path, trial, *turns)
    result = make_result(trial, prompt=HOSTILE, answer=HOSTILE, error=HOSTILE)
    write_result(tmp_path, result)
    page = page_of(tmp_path)
    assert page.text.count(HOSTILE) >= 2
    assert page.all("img") == []
    handlers = {name for each in page.elements for name in each.attributes if name[:2] == "on"}
    assert handlers == set()
    path = path_of_replay(tmp_path, **names)
    assert "<script>alert" not in path.read_text(encoding="utf-8")
    (step,) = read_replay(path)["steps"]
    assert step["call"]["tool"] == HOSTILE
    assert step["call"]["arguments"] == {HOSTILE: HOSTILE}


def test_what_nobody_can_see_in_a_text_is_spelled_out(tmp_path: Path) -> None:
    error = "room \u202egnorw\x00"
    broken = make_result(make_trial(1), state=TrialState.CRASHED, error=error)
    write_result(tmp_path, broken)
    assert "room <U+202E>gnorw<U+0000>" in page_of(tmp_path).text


def test_the_papers_figures_are_marked_as_the_papers(run: Path) -> None:
    page = page_of(run)
    lines = [row.text for row in page.all("tr") if "the paper, not run here" in row.text]
    assert ["97.83 %" in lines[0], "26/30" in lines[0], "30/30" in lines[0]] == [True] * 3
    assert ["99.78 %" in lines[1], "28/30" in lines[1], "30/30" in lines[1]] == [True] * 3
    assert "one warehouse in NVIDIA Isaac Sim" in page.text


def test_a_script_beside_the_papers_models_is_called_one(run: Path) -> None:
    (line,) = [row.text for row in page_of(run).all("tr") if "here, picture-table" in row.text]
    assert "no model" in line


def test_a_replay_shows_where_the_robot_stood_at_every_step(run: Path) -> None:
    steps = replay_of(run)["steps"]
    assert [(s["pose"]["x"], s["pose"]["y"], s["at_s"], s["trail"]) for s in steps] == [
        (1.0, 1.5, 0.0, [0, 1]),
        (1.0, 1.5, 4.0, [0, 3]),
        (1.0, 1.5, 4.0, [0, 3]),
        (5.0, 1.5, 8.0, [0, 6]),
    ]


def test_a_replay_tells_every_call_with_its_answer_in_order(run: Path) -> None:
    told = [(s["call"]["tool"], s["call"]["text"][:20]) for s in replay_of(run)["steps"]]
    assert told == [
        ("user", "Go to the smallest r"),
        ("look_at_map", "Explored: 6.0 m2 of "),
        ("agent", "I go there."),
        ("agent", "I am there."),
    ]


def test_a_replay_draws_the_map_with_its_rooms(run: Path) -> None:
    told = replay_of(run)
    assert (told["map"]["n_cols"], told["map"]["n_rows"]) == (8, 4)
    ((name,),) = told["map"]["tiles"]
    assert told["map"]["pictures"][name].startswith("data:image/png;base64,")
    assert len(told["trail"]) == 6


def test_every_trial_is_replayed_on_a_page_beside_its_pictures(run: Path) -> None:
    links = [unquote(v) for v in page_of(run).values("href") if v.endswith(".html")]
    assert len(links) == 2
    for link in links:
        told = read_replay(run / link)
        back = (run / link).parent / told["back"]
        assert back.resolve() == (run / "report.html").resolve()
        assert told["steps"][1]["call"]["pictures"] == ["pictures/003.png"]
        assert (run / link).parent.joinpath("pictures/003.png").is_file()


def test_a_broken_conversation_is_told_and_the_rest_is_shown(run: Path) -> None:
    folder = run / "trials" / make_trial(1).id
    (folder / "turns.jsonl").write_text('{"role": 7}\n')
    (folder / "state.jsonl").write_text("no json\n")
    (folder / "map.pgm").write_text("no map")
    about = dict(replay_of(run)["about"])
    for name in ("turns.jsonl", "state.jsonl", "map.yaml"):
        assert f"{name} cannot be read" in about
    assert "It stands in the toilet." in about["result"]


def test_a_picture_elsewhere_is_not_looked_at(run: Path) -> None:
    trial = make_trial(1)
    write_picture(run, "secret.png", shade=200)
    turns = (Turn(role="tool", pictures=("../../../../../../pictures/secret.png", "..")),)
    write_course(run, trial, *turns)
    (step,) = replay_of(run)["steps"]
    assert step["call"]["pictures"] == []
    assert "2 of 2 pictures are missing" in step["call"]["text"]


def test_a_broken_trial_says_in_the_list_what_broke_it(tmp_path: Path) -> None:
    trial = make_trial(1)
    error = (
        "Traceback (most recent call last):\n  ...\nValueError: the door is locked (exit code 1)"
    )
    broken = make_result(
        trial, failure=Failure.BROKEN, state=TrialState.CRASHED, error=error, answer=""
    )
    write_result(tmp_path, broken)
    page = page_of(tmp_path)
    (trials,) = page.all("table", "trials")
    assert "ValueError: the door is locked (exit code 1)" in trials.text
    assert "Traceback" not in trials.text
    assert "0.00 % to 79.35 %; 1 broken" in page.text


def test_a_trial_that_was_out_of_budget_says_so_in_the_list(tmp_path: Path) -> None:
    trial = make_trial(1)
    write_trial(tmp_path, trial, failure=Failure.WRONG_PLACE, state=TrialState.OUT_OF_BUDGET)
    (trials,) = page_of(tmp_path).all("table", "trials")
    assert "wrong place, out of budget" in trials.text


def test_the_papers_tasks_stand_beside_the_papers_figures(tmp_path: Path) -> None:
    figures = {"coverage_paper_ratio": 0.98, "coverage_recall": 0.985, "coverage_known_ratio": 0.99}
    score = Score(is_success=True, figures=figures, reason="98.50 %.")
    write_trial(tmp_path, make_trial(1, task="explore"), score=score)
    write_trial(tmp_path, make_trial(1))
    (line,) = [row.text for row in page_of(tmp_path).all("tr") if "here, picture-table" in row.text]
    assert "98.00 % by the paper's ratio, 98.50 % recall, 99.00 % known" in line
    assert "1/1 (100.00 %)20.65 % to 100.00 %" in line
    assert line.endswith("not run")


def test_the_papers_tasks_are_those_of_the_catalogue() -> None:
    assert FAMILIES["paper"] == PAPER_TASKS


def test_no_script_is_taken_for_a_model(tmp_path: Path) -> None:
    names = ("scripted", "mock", "mockllm/model", "command:codex", "openai/some-model")
    for name in names:
        write_trial(tmp_path, make_trial(1, agent=name))
    lines = [row.text for row in page_of(tmp_path).all("tr") if "here, picture-table" in row.text]
    kinds = {
        name: any(f"{name}here" in each and "no model" in each for each in lines) for name in names
    }
    assert list(kinds.values()) == [True, True, True, False, False]


def test_success_is_counted_with_wilsons_interval_and_broken_trials(tmp_path: Path) -> None:
    write_trial(tmp_path, make_trial(1))
    write_trial(tmp_path, make_trial(2), failure=Failure.WRONG_SIZE)
    broken = make_result(make_trial(3), failure=Failure.BROKEN, state=TrialState.CRASHED)
    write_result(tmp_path, broken)
    assert "1/3 (33.33 %)6.15 % to 79.23 %; 1 broken" in page_of(tmp_path).text
