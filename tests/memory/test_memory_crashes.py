import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore, Waypoint

ROOT = Path(__file__).parents[2]


def crash(n_kills: int) -> dict[str, int]:
    command = [sys.executable, "-m", "benchmarks.memory_crashes", "--kills", f"{n_kills}", "--json"]
    done = subprocess.run(  # noqa: S603 - our own program
        command, check=True, capture_output=True, timeout=1800, cwd=ROOT
    )
    figures: dict[str, int] = json.loads(done.stdout)
    return figures


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")
@pytest.mark.parametrize("n_kills", [15, pytest.param(1000, marks=pytest.mark.slow)])
def test_writers_that_are_killed_lose_nothing_that_was_acknowledged(n_kills: int) -> None:
    figures = crash(n_kills)
    assert figures["kill at steps"] + figures["kill at moments"] >= 1.9 * n_kills
    assert figures["places acknowledged"] >= n_kills
    assert figures["observations acknowledged"] > 0
    assert figures["lost, or not whole"] == 0


def test_a_mistake_by_hand_is_said_with_its_line_while_the_last_good_places_stay(
    tmp_path: Path,
) -> None:
    path = tmp_path / "places.yaml"
    store = SemanticMapStore(path)
    store.write(Waypoint(name="dock", pose=Pose(1.0, 2.0)))
    mistaken = path.read_text().replace("yaw_deg", "yaw")
    path.write_text(mistaken)
    places = store.read()
    assert [place.name for place in places.waypoints] == ["dock"]
    (warning,) = places.warnings
    assert "line 6" in warning
    assert "is not a key that belongs here" in warning
    with pytest.raises(SemanticMapError, match="line 6"):
        store.write(Waypoint(name="yard", pose=Pose(0.0, 0.0)))
    assert path.read_text() == mistaken
