import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from fakes import two_rooms
from mapspeak.cli import main
from mapspeak.cli.shared.options import GuardChoice, build_guard
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore, Waypoint
from mapspeak.safety import Policy
from mapspeak.spatial.mapwriting import write_map


def test_a_server_does_not_start_with_a_mistake_in_its_policy_and_names_the_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "policy.yaml"
    path.write_text("speed:\n  linear_mps: 0.4\n  angular_rad: 1.0\n")
    monkeypatch.setattr("sys.argv", ["mapspeak", "serve", "--policy", str(path)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert "policy.yaml, line 3: 'speed.angular_rad' is not a key" in said
    assert "angular_radps" in said


def test_without_a_file_the_defaults_hold_and_the_log_goes_to_the_users_data(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    guard = build_guard(GuardChoice(), robot="sim")
    assert guard.policy == Policy()
    assert guard.audit.path == tmp_path / "mapspeak" / "audit.jsonl"
    assert guard.hold.file == tmp_path / "mapspeak" / "control" / "hold"


def modes_under(folder: Path) -> dict[str, str]:
    return {each.name: oct(each.stat().st_mode & 0o777) for each in folder.iterdir()}


def run_main(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> None:
    monkeypatch.setattr("sys.argv", ["mapspeak", *map(str, arguments)])
    with pytest.raises(SystemExit):
        main()


@pytest.fixture
def umask() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)


@pytest.mark.usefixtures("umask")
def test_what_a_person_asks_for_by_name_has_the_usual_permissions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    memory, out = tmp_path / "memory.yaml", tmp_path / "out"
    SemanticMapStore(memory).write(Waypoint(name="desk", pose=Pose(1.0, 1.0)))
    write_map(two_rooms(), tmp_path / "map.yaml")
    out.mkdir()
    wanted = ("--out", out / "map.png", "--json", out / "map.json")
    run_main(monkeypatch, "map", tmp_path / "map.yaml", *wanted)
    named = ("--semantic-map", memory, "--out", out / "places.geojson")
    run_main(monkeypatch, "memory", "export", *named)
    assert modes_under(out) == dict.fromkeys(("map.png", "map.json", "places.geojson"), "0o644")


@pytest.mark.usefixtures("umask")
def test_what_is_not_asked_for_by_name_is_for_its_user_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    control = tmp_path / "control"
    run_main(monkeypatch, "stop", "--control", control, "--wait-s", "0")
    assert modes_under(control) == {"hold": "0o600"}
    assert control.stat().st_mode & 0o777 == 0o700
    assert os.umask(0o022) == 0o022
