import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from drawing import grid_from_text
from mapspeak.cli import cli, main
from mapspeak.cli.memory.choosing import usual_memory
from mapspeak.spatial.mapwriting import write_map

ROOM = """
#########
#.......#
#.......#
#.......#
#.......#
#########
"""


def run_main(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["mapspeak", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["serve", "--robot", "rover"], "sim:WORLD"),
        (["serve", "--robot", "ws://127.0.0.1:1", "--detector"], "--robot sim"),
        (["serve", "--robot-file", "robot.yaml"], "--robot ws://"),
        (["doctor", "--robot", "ws://127.0.0.1:1"], "ros2 launch"),
        (["serve", "--robot", "sim:atlantis"], "atlantis"),
        (["serve", "--http", "0.0.0.0:8766"], "MAPSPEAK_HTTP_TOKEN"),
        (["serve", "--http", "nonsense"], "HOST:PORT"),
        (["serve", "--toolsets", "looks"], "'looks'. Did you mean look?"),
        (["serve", "--tools", "navigate"], "Did you mean navigate_to?"),
        (["serve", "--robot", "sim:warehose"], "Did you mean warehouse?"),
        (["eval", "--agent", "scriptd"], "Did you mean scripted?"),
        (["eval", "--task", "smallest_room"], "Did you mean smallest-room?"),
        (["srve"], "Did you mean serve?"),
        (["memory", "lst"], "Did you mean list?"),
        (["map", "missing.yaml"], "missing.yaml"),
        (["demo", "--quiet", "--out", "/proc/demo"], "--out"),
        (["simulate", "--rosbridge", "here"], "PORT"),
        (["simulate", "--rosbridge", "192.0.2.1:9090"], "another port"),
        (["simulate", "--world", "atlantis"], "atlantis"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    says: str,
) -> None:
    assert run_main(monkeypatch, *arguments) == 2
    error = capsys.readouterr().err
    assert says in error
    assert "Traceback" not in error


def test_a_map_file_is_shown_with_its_facts_and_pictures(tmp_path: Path) -> None:
    write_map(grid_from_text(ROOM, resolution_m=0.5), tmp_path / "map.yaml")
    outputs = ["--out", "map.png", "--json", "facts.json", "--rooms", "rooms.png"]
    paths = [str(tmp_path / name) if "." in name else name for name in outputs]
    result = CliRunner().invoke(cli, ["map", str(tmp_path / "map.yaml"), *paths])
    assert result.exit_code == 0, result.output
    assert "9 x 6 cells of 0.5 m" in result.output
    assert {path.name for path in tmp_path.iterdir()} >= {"map.png", "facts.json", "rooms.png"}


def test_a_bare_picture_needs_a_resolution(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    written = write_map(grid_from_text(ROOM, resolution_m=0.5), tmp_path / "map.yaml")
    assert run_main(monkeypatch, "map", str(written)) == 2
    assert "--resolution" in capsys.readouterr().err
    result = CliRunner().invoke(cli, ["map", str(written), "--resolution", "0.5"])
    assert "9 x 6 cells of 0.5 m" in result.output


def test_a_check_up_of_the_simulated_robot_finds_nothing_missing() -> None:
    result = CliRunner().invoke(cli, ["doctor", "--robot", "sim:office", "--json"])
    assert result.exit_code == 0, result.output
    findings = {each["what"]: each["health"] for each in json.loads(result.output)}
    assert findings == dict.fromkeys(("map", "pose", "place", "picture", "laser"), "fine")


def test_robots_that_do_not_name_their_map_remember_in_files_of_their_own() -> None:
    one, other = (usual_memory(Path(), "", f"ws://10.0.0.{n}:9090") for n in (1, 2))
    assert one != other
    assert not one.name.startswith(".")
    assert usual_memory(Path(), "hall 3", "ws://10.0.0.1:9090").name == "hall_3.yaml"
