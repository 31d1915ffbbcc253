import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import crashing_writers
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore, Waypoint

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")


def run(scenario: str, path: Path) -> list[str]:
    command = [sys.executable, crashing_writers.__file__, scenario, str(path)]
    done = subprocess.run(command, check=True, capture_output=True, timeout=60)  # noqa: S603 - our own program
    acknowledged: list[str] = json.loads(done.stdout)
    return acknowledged


def names_in(path: Path) -> list[str]:
    return [place.name for place in SemanticMapStore(path).read().waypoints]


def test_two_processes_that_write_at_once_lose_nothing(tmp_path: Path) -> None:
    path = tmp_path / "places.yaml"

    acknowledged = run("at_once", path)

    assert len(acknowledged) == 2 * crashing_writers.N_EACH
    assert sorted(names_in(path)) == sorted(acknowledged)


def test_a_process_that_dies_at_any_step_of_a_write_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "places.yaml"

    acknowledged = run("at_every_step", path)

    assert len(acknowledged) > 5, "the write has steps to die at"
    assert set(acknowledged) <= set(names_in(path))
    assert set(names_in(path)) - set(acknowledged) <= {f"step {i}" for i in range(99)}


def test_a_process_that_is_killed_at_any_moment_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "places.yaml"

    acknowledged = run("at_any_moment", path)

    assert len(acknowledged) >= crashing_writers.N_KILLS
    assert set(acknowledged) <= set(names_in(path))


def test_what_a_crash_left_behind_is_cleared_by_the_next_write(tmp_path: Path) -> None:
    path = tmp_path / "places.yaml"
    (tmp_path / ".places.yaml.tmp").write_text("half a fi")

    SemanticMapStore(path).write(Waypoint(name="dock", pose=Pose(0.0, 0.0)))

    assert names_in(path) == ["dock"]
    assert not (tmp_path / ".places.yaml.tmp").exists()


def test_the_new_file_is_on_the_disk_before_it_takes_the_place_of_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "places.yaml"
    store = SemanticMapStore(path)
    store.write(Waypoint(name="hall", pose=Pose(0.0, 0.0)))
    steps: list[str] = []
    fsync, replace = os.fsync, os.replace

    def noted_fsync(descriptor: int) -> None:
        is_folder = stat.S_ISDIR(os.fstat(descriptor).st_mode)
        steps.append("sync folder" if is_folder else "sync file")
        fsync(descriptor)

    def noted_replace(source: Path, target: Path) -> None:
        steps.append("replace")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "replace", noted_replace)
    store.write(Waypoint(name="dock", pose=Pose(0.0, 0.0)))

    assert steps[-3:] == ["sync file", "replace", "sync folder"]
