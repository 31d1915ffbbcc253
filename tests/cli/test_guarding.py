from pathlib import Path

import pytest

from mapspeak.cli import main
from mapspeak.cli.guarding import GuardChoice, build_guard
from mapspeak.safety import Policy


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
