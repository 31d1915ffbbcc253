import json
from dataclasses import replace
from pathlib import Path

import httpx2
import pytest

from livepage import find_free_address
from mapspeak.errors import ConfigError
from mapspeak.evaluation.agent import ServerAccess
from mapspeak.evaluation.runs.attempt import attempt
from mapspeak.evaluation.trials import (
    Trial,
    TrialResult,
    Turn,
    read_turns,
    trial_folder,
)
from mapspeak.safety import read_audit
from mapspeak.simulator import load_world
from mapspeak.spatial.mapfiles import load_map
from sites import make_flat, prepare


def run_one(run: Path, task: str, *, seed: int = 1, agent: str = "scripted") -> TrialResult:
    """Runs one trial in the flat, from a map and a memory that were drawn by hand."""
    run.mkdir(parents=True, exist_ok=True)
    world = make_flat(run)
    preparation = prepare(run, world)
    trial = Trial(
        task=task, world="flat", seed=seed, agent=agent, representation="picture-table", number=1
    )
    return attempt(run, trial, world, preparation)


def without_wall_time(run: Path, trial: Trial) -> tuple[str, list[object]]:
    """Gives everything that is written of a trial, but for the wall clock."""
    folder = trial_folder(run, trial)
    turns = [replace(turn, wall_s=0.0) for turn in read_turns(folder)]
    result = json.loads((folder / "result.json").read_text())
    del result["wall_s"], result["cpu_s"]
    return json.dumps(result) + (folder / "state.jsonl").read_text(), [turns]


def test_the_same_seed_gives_the_same_trial(tmp_path: Path) -> None:
    first = run_one(tmp_path / "first", "side-of-pose")
    again = run_one(tmp_path / "again", "side-of-pose")
    assert without_wall_time(tmp_path / "first", first.trial) == without_wall_time(
        tmp_path / "again", again.trial
    )


@pytest.mark.parametrize("agent", ["scripted", "oracle"])
def test_the_smallest_room_is_found_on_a_known_map(tmp_path: Path, agent: str) -> None:
    result = run_one(tmp_path, "smallest-room", agent=agent)
    assert result.score.is_success, result.score.reason
    assert result.n_collisions == 0
    assert result.shortest_m is not None


@pytest.mark.parametrize(
    ("task", "seed"), [("superlative", 2), ("view", 1), ("errand-patrol", 1), ("blocked-way", 1)]
)
def test_who_knows_the_truth_does_what_is_asked(tmp_path: Path, task: str, seed: int) -> None:
    world = load_world("flat_1")
    preparation = prepare(tmp_path, world)
    trial = replace(preparation, task=task, seed=seed, agent="oracle")
    result = attempt(tmp_path, trial, world, preparation)
    assert result.score.is_success, result.score.reason


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "trials"),
    [
        ("flat_1", (("errand-faults", 3), ("errand-faults", 7), ("errand-fetch", 8))),
        ("flat_2", (("errand-faults", 2), ("errand-fetch", 8))),
    ],
)
def test_things_that_the_way_of_an_exploration_shows_are_gone_to(
    tmp_path: Path, name: str, trials: tuple[tuple[str, int], ...]
) -> None:
    world = load_world(name)
    preparation = Trial(
        task="explore",
        world=name,
        seed=0,
        agent="scripted",
        representation="picture-table",
        number=1,
    )
    attempt(tmp_path, preparation, world, None)
    for task, seed in trials:
        trial = replace(preparation, task=task, seed=seed, number=seed + 1)
        result = attempt(tmp_path, trial, world, preparation)
        assert result.score.is_success, (task, seed, result.answer, result.score.reason)


def test_a_trial_can_be_watched_in_a_live_page(tmp_path: Path) -> None:
    world, address, seen = make_flat(tmp_path), find_free_address(), list[int]()
    preparation = prepare(tmp_path, world)
    trial = Trial(
        task="question-way",
        world=str(tmp_path / "flat.yaml"),
        seed=1,
        agent="scripted",
        representation="picture-table",
        number=1,
    )

    def look(turn: Turn) -> None:
        if turn.role == "tool":
            seen.append(httpx2.get(f"http://{address}/").status_code)

    access = ServerAccess.STDIO
    attempt(tmp_path, trial, world, preparation, connection=access, view=address, on_turn=look)
    assert seen
    assert set(seen) == {200}


def test_a_question_is_answered_without_driving(tmp_path: Path) -> None:
    result = run_one(tmp_path, "question-way")
    assert result.score.is_success, result.score.reason
    assert result.driven_m == 0


def test_every_call_and_picture_is_kept_for_replay(tmp_path: Path) -> None:
    result = run_one(tmp_path, "view")
    turns = read_turns(trial_folder(tmp_path, result.trial))
    assert [turn.role for turn in turns[:2]] == ["system", "user"]
    assert turns[1].text.startswith("Take a picture of")
    assert result.score.is_success, result.score.reason
    pictures = [name for turn in turns for name in turn.pictures]
    folder = trial_folder(tmp_path, result.trial) / "pictures"
    assert pictures
    assert all((folder / name).exists() for name in pictures)


def test_a_script_drives_under_the_guard_that_a_served_robot_has(tmp_path: Path) -> None:
    result = run_one(tmp_path, "side-of-pose")
    lines = list(read_audit(trial_folder(tmp_path, result.trial) / "audit.jsonl"))
    drives = [line for line in lines if line.event == "decision" and line.kind == "drive"]
    assert drives
    assert {line.verdict for line in drives} == {"allowed"}


def test_the_clock_of_a_trial_is_its_robots(tmp_path: Path) -> None:
    result = run_one(tmp_path, "side-of-pose")
    lines = list(read_audit(trial_folder(tmp_path, result.trial) / "audit.jsonl"))
    assert all(line.wall_time.startswith("2000-01-01T00:0") for line in lines)


def test_what_a_trial_computed_is_kept(tmp_path: Path) -> None:
    result = run_one(tmp_path, "question-way")
    assert result.cpu_s > 0


def test_a_server_of_its_own_leaves_the_robots_map_when_it_ends(tmp_path: Path) -> None:
    world = load_world("flat_1")
    preparation = prepare(tmp_path, world)
    trial = replace(preparation, task="question-way", agent="mock")
    assert attempt(tmp_path, trial, world, preparation).n_calls > 0
    given, left = (
        load_map(trial_folder(tmp_path, each) / "map.yaml").grid for each in (preparation, trial)
    )
    assert (left.cells == given.cells).all()


def test_a_note_that_gives_orders_is_not_obeyed(tmp_path: Path) -> None:
    result = run_one(tmp_path, "hostile-note")
    assert result.score.is_success, result.score.reason


def test_a_task_on_a_known_map_needs_one(tmp_path: Path) -> None:
    world = make_flat(tmp_path)
    trial = Trial(
        task="smallest-room",
        world="flat",
        seed=0,
        agent="scripted",
        representation="picture-table",
        number=1,
    )
    with pytest.raises(ConfigError, match="finished map"):
        attempt(tmp_path, trial, world, None)
