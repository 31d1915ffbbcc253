import json
import shutil
from importlib import resources
from pathlib import Path
from urllib.parse import unquote

import pytest

from mapspeak.evaluation.report import write_report
from mapspeak.evaluation.trials import (
    Failure,
    RunPlan,
    Sitting,
    ToolCall,
    TrialState,
    Turn,
    write_plan,
    write_result,
)
from reportmaking import (
    ReadPage,
    make_result,
    make_trial,
    make_turns,
    write_course,
    write_picture,
    write_run,
    write_trial,
)

HOSTILE = (
    "</pre></script><script>alert(1)</script><img src=//evil.example/x onerror='alert(2)'>&amp;"
)


def page_of(run: Path, **limits: int) -> ReadPage:
    """Writes the report of a run and reads its page."""
    return ReadPage.of(write_report(run, **limits).page)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run with a success, a failure, one cut short, and one that was not begun."""
    run = tmp_path / "run"
    trials = [make_trial(number) for number in (1, 2, 3, 4)]
    write_run(run, *trials)
    write_trial(run, trials[0])
    write_trial(run, trials[1], failure=Failure.CORRIDOR_FOR_ROOM)
    write_course(run, trials[2], *make_turns())
    return run


def test_every_id_is_there_once_and_every_reference_finds_one(run: Path) -> None:
    page = page_of(run)
    ids = page.values("id")
    wanted = [value for value in page.values("href", "for") if value.startswith("#")]
    assert page.is_whole
    assert len(ids) == len(set(ids))
    assert {unquote(value.removeprefix("#")) for value in wanted} <= set(ids)
    assert f"{make_trial(2).id}/step-4" in ids


def test_the_page_needs_nothing_from_elsewhere(run: Path) -> None:
    page = page_of(run)
    references = page.values("href", "src", "data", "poster", "action", "srcset")
    assert references
    assert all(value.startswith(("#", "data:image/png;base64,")) for value in references)
    (policy,) = [v for v in page.values("content") if "default-src" in v]
    assert "default-src 'none'; img-src data:;" in policy
    (style,) = page.all("style")
    assert "url(" not in style.text
    assert "@import" not in style.text
    assert {each.tag for each in page.elements} & {"link", "iframe", "object", "base"} == set()


def test_hostile_text_is_shown_as_text(tmp_path: Path) -> None:
    trial = make_trial(1, world=f"flat {HOSTILE}", agent=HOSTILE)
    write_run(tmp_path, trial)
    call = ToolCall(tool=HOSTILE, arguments={HOSTILE: HOSTILE})
    turns = (Turn(role=HOSTILE, text=HOSTILE, call=call, pictures=(HOSTILE,), is_error=True),)
    write_course(tmp_path, trial, *turns)
    result = make_result(trial, prompt=HOSTILE, answer=HOSTILE, error=HOSTILE)
    write_result(tmp_path, result)
    page = page_of(tmp_path)
    (script,) = page.all("script")
    own = resources.files("mapspeak.evaluation.report") / "replay.js"
    assert script.text == own.read_text("utf-8")
    assert page.all("img") == []
    assert page.text.count(HOSTILE) >= 8
    handlers = {name for each in page.elements for name in each.attributes if name[:2] == "on"}
    assert handlers == set()


def test_what_nobody_can_see_in_a_text_is_spelled_out(tmp_path: Path) -> None:
    trial = make_trial(1)
    write_run(tmp_path, trial)
    write_trial(tmp_path, trial, answer="room \u202egnorw\x00")
    text = page_of(tmp_path).text
    assert "room <U+202E>gnorw<U+0000>" in text
    assert "\u202e" not in text


def test_the_figures_of_the_page_are_those_of_the_report(run: Path) -> None:
    page = page_of(run)
    rows = json.loads((run / "report.json").read_text())["rows"]
    shown = {
        tuple(float(cell.attributes[f"data-{end}"] or "") for end in ("value", "low", "high"))
        for cell in page.all("td", "figure")
    }
    told = {
        tuple(interval.values())
        for row in rows
        for interval in (
            row["counted"]["success"],
            *row["counted"]["figures"].values(),
            *row["per_decision"].values(),
        )
    }
    (row,) = rows
    assert shown
    assert shown <= told
    assert tuple(row["counted"]["success"].values()) in shown
    assert "1/3 (33.33 %)" in page.text


def test_the_page_says_what_counts_and_what_was_not_run(run: Path) -> None:
    text = page_of(run).text
    assert "1 of 3 trials were done as asked." in text
    assert "Asked for were 4: 2 finished, 1 unfinished, 1 not run." in text
    assert "begun and has no result counts as not successful" in text
    assert "corridor for room" in text


def test_a_model_that_was_not_run_is_named_without_a_figure(run: Path) -> None:
    trials = [make_trial(1), make_trial(1, agent="anthropic/some-model")]
    write_run(run, *trials)
    page = page_of(run)
    lines = [row.text for row in page.all("tr") if "some-model" in row.text]
    assert len(lines) == 2, "among the agents, and in the list of trials"
    assert "not run: none of 1, so no figure is given" in lines[0]
    assert "not run" in lines[1]


def test_the_papers_figures_are_marked_as_the_papers(run: Path) -> None:
    page = page_of(run)
    lines = [row.text for row in page.all("tr") if "the paper, not run here" in row.text]
    assert ["97.83 %" in lines[0], "26/30" in lines[0], "30/30" in lines[0]] == [True] * 3
    assert ["99.78 %" in lines[1], "28/30" in lines[1], "30/30" in lines[1]] == [True] * 3
    assert "one warehouse in NVIDIA Isaac Sim" in page.text


def test_a_script_beside_the_papers_models_is_called_one(run: Path) -> None:
    (line,) = [row.text for row in page_of(run).all("tr") if "here, picture-table" in row.text]
    assert "no model" in line


def test_a_mean_of_one_trial_pretends_no_interval(tmp_path: Path) -> None:
    trial = make_trial(1)
    write_run(tmp_path, trial)
    write_trial(tmp_path, trial)
    shown = [cell.text for cell in page_of(tmp_path).all("td", "figure")]
    assert "0.5" in shown, "its path length counts half, and nothing is said of others"


def test_a_replay_shows_where_the_robot_stood_at_every_step(run: Path) -> None:
    page = page_of(run)
    steps = {each.attributes.get("id"): each for each in page.all("li")}
    first, last = (steps[f"{make_trial(1).id}/step-{number}"].attributes for number in (1, 4))
    # The map is 8 m by 4 m at a pixel per metre, and its picture counts v from the top.
    assert (first["data-u"], first["data-v"], first["data-driven"]) == ("1.0", "2.5", "0.0")
    assert (last["data-u"], last["data-v"], last["data-driven"]) == ("5.0", "2.5", "1.0")


def test_a_replay_tells_every_call_and_answer_in_its_order(run: Path) -> None:
    page = page_of(run)
    (replay, *_) = page.all("details", "trial")
    told = ["Go to the smallest room.", 'look_at_map{"layers": ["rooms"]}', "Explored: 6.0 m2"]
    places = [replay.text.index(each) for each in (*told, "I go there.")]
    assert places == sorted(places)


def test_nothing_of_a_replay_is_hidden_from_those_without_scripts(run: Path) -> None:
    page = page_of(run)
    assert not any("hidden" in each.attributes for each in page.elements)
    assert page.all("button") == [], "the script makes its own"


def test_a_picture_seen_twice_is_in_the_page_once(run: Path) -> None:
    page = page_of(run)
    seen = page.all("svg", "seen")
    images = page.all("image")
    assert len(seen) == 2, "the trial that was cut short has lost its picture"
    assert len(images) == 2, "that picture, and the map of all three"


def test_pictures_are_linked_when_the_page_would_be_too_large(run: Path) -> None:
    for number in (1, 2):
        folder = run / "trials" / make_trial(number).id
        write_picture(folder, "003.png", shade=number, size=(1500, 1500))
    n_bytes = sum(len(path.read_bytes()) for path in run.rglob("turns.jsonl"))
    page = page_of(run, page_limit_bytes=2 * n_bytes)
    linked = [unquote(each.attributes["src"] or "") for each in page.all("img", "seen")]
    assert len(linked) == 2
    assert all((run / name).is_file() for name in linked)
    assert "they are linked from the folder beside it" in page.text
    assert "img-src data: 'self' file:" in " ".join(page.values("content"))


def test_replays_are_pages_of_their_own_when_they_are_too_long(run: Path) -> None:
    page = page_of(run, page_limit_bytes=10)
    assert page.all("details", "trial") == []
    assert "page of its own in the folder beside this one" in page.text
    links = [unquote(v) for v in page.values("href") if v.endswith(".html")]
    assert len(links) == 3
    for link in links:
        replay = ReadPage.of(run / link)
        (back,) = [value for value in replay.values("href") if value.endswith("report.html")]
        assert ((run / link).parent / back).resolve() == (run / "report.html").resolve()
        assert all((run / link).parent.joinpath(src).is_file() for src in replay.values("src"))


def test_the_same_folder_gives_the_same_bytes_wherever_it_lies(run: Path, tmp_path: Path) -> None:
    first = write_report(run)
    copy = write_report(Path(shutil.copytree(run, tmp_path / "elsewhere")))
    again = write_report(run)
    for one, other in ((first, copy), (first, again)):
        assert one.page.read_bytes() == other.page.read_bytes()
        assert one.figures.read_bytes() == other.figures.read_bytes()
        assert one.lines.read_bytes() == other.lines.read_bytes()


def test_a_broken_conversation_is_told_and_the_rest_is_shown(run: Path) -> None:
    folder = run / "trials" / make_trial(1).id
    (folder / "turns.jsonl").write_text('{"role": 7}\n')
    (folder / "state.jsonl").write_text("no json\n")
    (folder / "map.pgm").write_text("no map")
    (replay, *_) = page_of(run).all("details", "trial")
    for name in ("turns.jsonl", "state.jsonl", "map.yaml"):
        assert f"{name} cannot be read" in replay.text
    assert "It stands in the toilet." in replay.text


def test_a_picture_elsewhere_is_not_looked_at(run: Path) -> None:
    trial = make_trial(1)
    write_picture(run, "secret.png", shade=200)
    turns = (Turn(role="tool", pictures=("../../../../../../pictures/secret.png", "..")),)
    write_course(run, trial, *turns)
    (replay, *_) = page_of(run).all("details", "trial")
    assert "secret.png is missing" in replay.text
    assert "The picture .. is missing" in replay.text


def test_a_file_that_is_no_picture_is_not_shown_as_one(run: Path) -> None:
    folder = run / "trials" / make_trial(1).id
    (folder / "pictures" / "003.png").write_text("<svg onload='alert(1)'/>")
    (replay, *_) = page_of(run).all("details", "trial")
    assert "003.png is no picture." in replay.text


def test_earlier_sittings_are_shown_with_what_was_different_in_them(tmp_path: Path) -> None:
    first, second = make_trial(1), make_trial(2)
    earlier = Sitting(versions={"mapspeak": "1.0.0"}, options={"seed": 0, "n_trials": 1}, n_done=1)
    now = RunPlan(
        trials=(first, second),
        versions={"mapspeak": "2.0.0"},
        options={"seed": 0, "n_trials": 2},
        earlier=(earlier,),
    )
    write_plan(tmp_path, now)
    write_trial(tmp_path, first)
    write_trial(tmp_path, second)
    page = page_of(tmp_path)
    assert "run in several sittings" in page.text
    assert "n_trials: 1; mapspeak: 1.0.0" in page.text
    told = json.loads((tmp_path / "report.json").read_text())["earlier"]
    assert [(each["versions"]["mapspeak"], each["n_done"]) for each in told] == [("1.0.0", 1)]


def test_a_run_in_one_sitting_says_nothing_of_others(run: Path) -> None:
    assert "sitting" not in page_of(run).text


def test_a_broken_trial_says_in_the_list_what_broke_it(tmp_path: Path) -> None:
    trial = make_trial(1)
    write_run(tmp_path, trial)
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
    write_run(tmp_path, trial)
    write_trial(tmp_path, trial, failure=Failure.WRONG_PLACE, state=TrialState.OUT_OF_BUDGET)
    (trials,) = page_of(tmp_path).all("table", "trials")
    assert "wrong place, out of budget" in trials.text
