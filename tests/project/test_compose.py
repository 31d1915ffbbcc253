"""The compose file: it cannot be started here, so what can be known of it is looked at."""

from pathlib import Path
from typing import Any

from click.testing import CliRunner
from ruamel.yaml import YAML

from mapspeak.cli import cli

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "compose"


def services() -> dict[str, Any]:
    return dict(YAML(typ="safe").load((FOLDER / "compose.yaml").read_text())["services"])


def test_every_file_it_builds_from_is_there() -> None:
    for service in services().values():
        build = service["build"]
        assert (FOLDER / build["context"] / build["dockerfile"]).is_file()


def test_mapspeak_understands_how_it_is_started() -> None:
    command = services()["mapspeak"]["command"].split()
    answer = CliRunner().invoke(cli, [*command, "--help"])
    assert answer.exit_code == 0
    options = [word for word in command if word.startswith("--")]
    assert all(option in answer.output for option in options)


def test_nobody_but_mapspeak_reaches_rosbridge() -> None:
    open_to_the_host = {name for name, service in services().items() if "ports" in service}
    assert open_to_the_host == {"mapspeak"}
    assert services()["mapspeak"]["ports"] == ["127.0.0.1:8766:8766"]


def test_the_pins_it_installs_are_there() -> None:
    text = (FOLDER / "mapspeak.Dockerfile").read_text()
    named = [word for word in text.split() if word.startswith("constraints/")]
    assert named
    assert all((ROOT / name).is_file() for name in named)
