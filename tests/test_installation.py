"""What is typed in this installation, and whose packages it runs with."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from mapspeak.installation import prefer_own_packages, say_install, shell_command

CHECKOUT = Path(__file__).parents[1]


def test_in_a_checkout_its_script_is_typed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sys.prefix", str(CHECKOUT / ".venv"))
    monkeypatch.chdir(CHECKOUT)
    assert shell_command("memory list") == "./run memory list"
    monkeypatch.chdir(tmp_path)
    assert shlex.split(shell_command("memory list")) == [str(CHECKOUT / "run"), "memory", "list"]


def test_elsewhere_the_program_is_typed_by_its_path_unless_the_shell_finds_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    folder = tmp_path / "an env" / "bin"
    folder.mkdir(parents=True)
    for name in ("python", "mapspeak"):
        (folder / name).write_text("#!/bin/sh\n")
        (folder / name).chmod(0o755)
    monkeypatch.setattr("sys.prefix", str(folder.parent))
    monkeypatch.setattr("sys.executable", str(folder / "python"))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert shlex.split(shell_command("release")) == [str(folder / "mapspeak"), "release"]
    monkeypatch.setenv("PATH", str(folder))
    assert shell_command("release") == "mapspeak release"


def test_an_extra_is_installed_by_the_packages_it_stands_for_into_this_environment() -> None:
    words = shlex.split(say_install("eval", "anthropic"))
    assert words[:4] == [sys.executable, "-m", "pip", "install"]
    assert [word.partition(">=")[0] for word in words[4:]] == ["inspect-ai", "openai", "anthropic"]


def test_without_pip_uv_installs_it_into_this_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    words = shlex.split(say_install("dds"))
    assert words[:5] == ["uv", "pip", "install", "--python", sys.executable]
    assert [word.partition(">=")[0] for word in words[5:]] == ["cyclonedds"]


def test_packages_of_a_sourced_ros_do_not_stand_before_our_own(tmp_path: Path) -> None:
    for name in ("click", "numpy", "cv2", "cbor2", "pydantic"):
        (tmp_path / f"{name}.py").write_text("raise ImportError('an old one of the system')\n")
    done = subprocess.run(
        [sys.executable, "-m", "mapspeak", "doctor", "--robot", "sim:office"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_what_only_a_sourced_ros_has_is_still_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.path", ["/opt/ros/lib", "", "/usr/lib/python3.11", "/venv/lib"])
    prefer_own_packages("/opt/ros/lib:")
    assert sys.path == ["", "/usr/lib/python3.11", "/venv/lib", "/opt/ros/lib"]


OPTIONAL = ("cyclonedds", "onnxruntime", "tokenizers", "inspect_ai", "openai", "rclpy")
PARTS = (
    "mapspeak.cli.serving.command",
    "mapspeak.server.app",
    "mapspeak.evaluation.runs.inspectlog",
)


@pytest.mark.parametrize("part", PARTS)
def test_nothing_that_is_optional_is_imported_before_it_is_wanted(part: str) -> None:
    script = f"import sys\nsys.modules.update(dict.fromkeys({OPTIONAL}))\nimport {part}"
    subprocess.run([sys.executable, "-c", script], check=True)  # noqa: S603 - our own words
