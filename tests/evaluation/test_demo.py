import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from mapspeak.cli.simulating import demo
from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents.driver import read_map_text
from mapspeak.evaluation.tasks.catalogue import FAMILIES
from mapspeak.evaluation.trials import read_results
from mapspeak.spatial.mapfiles import load_map

SMALL_FLAT = """
title: A flat with a hall and two rooms, to be explored in a minute.
start: {at: [1.0, 1.0], yaw_deg: 0}
walls:
  - line: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]
  - line: [[0, 3], [8, 3]]
  - line: [[5, 3], [5, 6]]
doors:
  - {name: large room door, at: [2, 3], width_m: 1.0}
  - {name: small room door, at: [6.5, 3], width_m: 1.0}
rooms:
  - {name: hall, class: open_space, outline: [[0, 0], [8, 0], [8, 3], [0, 3]]}
  - {name: large room, class: room, outline: [[0, 3], [5, 3], [5, 6], [0, 6]]}
  - {name: small room, class: room, outline: [[5, 3], [8, 3], [8, 6], [5, 6]]}
objects:
  - {name: extinguisher, kind: fire_extinguisher, at: [7.9, 1.5], yaw_deg: 180}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the demo has run in a small flat, over a real server process."""
    folder = tmp_path_factory.mktemp("demo")
    world = folder / "flat.yaml"
    world.write_text(SMALL_FLAT)
    command = [sys.executable, "-m", "mapspeak", "demo", "--quiet"]
    done = subprocess.run(  # noqa: S603 - our own program
        [*command, "--world", str(world), "--out", str(folder / "out")],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "out"


def folder_of(run: Path, task: str) -> Path:
    """Gives the folder of the one trial of a task."""
    (path,) = (run / "trials" / task).glob("**/result.json")
    return path.parent


def test_all_three_tasks_succeed_by_the_simulators_truth(folder: Path) -> None:
    explored, room, tool = (
        next(each for each in read_results(folder) if each.trial.task == task)
        for task in FAMILIES["paper"]
    )
    assert explored.score.figures["coverage_recall"] > 0.98
    assert explored.n_collisions == 0
    assert room.score.reason == "It stands in small room."
    assert "from extinguisher, in sight" in tool.score.reason


def test_the_map_it_leaves_is_one_that_map_server_loads(folder: Path) -> None:
    loaded = load_map(folder_of(folder, "explore") / "map.yaml")
    assert loaded.grid.resolution_m == 0.05
    assert loaded.grid.free.sum() * 0.05**2 > 40


def test_what_was_seen_is_in_the_semantic_map(folder: Path) -> None:
    assert "fire extinguisher" in (folder / "semantic_map.yaml").read_text()


def test_the_pages_need_nothing_from_elsewhere(folder: Path) -> None:
    replay = (folder_of(folder, "explore") / "replay.html").read_text()
    assert "data:image/png;base64," in replay
    for page in (replay, (folder / "report.html").read_text()):
        assert 'src="http' not in page
        assert 'href="http' not in page.partition("<style>")[0]


def test_every_picture_is_kept(folder: Path) -> None:
    trial = folder_of(folder, "explore")
    turns = [json.loads(line) for line in (trial / "turns.jsonl").read_text().splitlines()]
    told = {name for turn in turns for name in turn.get("pictures", ())}
    assert told == {path.name for path in (trial / "pictures").iterdir()}
    assert len(told) > 5


def test_a_world_that_is_not_there_is_told_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="nosuch"):
        CliRunner().invoke(
            demo, ["--world", "nosuch", "--out", str(tmp_path / "out")], catch_exceptions=False
        )
    assert not (tmp_path / "out").exists()


def test_a_text_without_a_pose_is_no_map_text() -> None:
    with pytest.raises(Exception, match="names no robot pose"):
        read_map_text("## Rooms\nid | kind\nR1 | room")


@pytest.fixture
def interruptible() -> Iterator[None]:
    """What is begun in the background ignores SIGINT, and so would the programs it begins."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_early_signal_stops_it_with_one_line(tmp_path: Path, number: signal.Signals) -> None:
    world = tmp_path / "flat.yaml"
    os.mkfifo(world)
    command = [sys.executable, "-m", "mapspeak", "demo", "--world", str(world)]
    with (
        subprocess.Popen(  # noqa: S603 - our own program
            [*command, "--out", str(tmp_path / "out")], stderr=subprocess.PIPE, text=True
        ) as begun,
        world.open("w"),  # once the demo reads it
    ):
        begun.send_signal(number)
        _, said = begun.communicate(timeout=60)
    assert said == "Stopped.\n"
    assert begun.returncode == 130
