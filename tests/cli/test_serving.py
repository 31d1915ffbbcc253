"""What `mapspeak serve --help` says of the tools that can be chosen."""

import re
from pathlib import Path

from click.testing import CliRunner

from fakes import FakeRobot
from mapspeak.cli import cli
from mapspeak.semantic import SemanticMapStore
from mapspeak.server import DEFAULT_TOOLSETS
from mapspeak.server.tools import build_toolsets
from mapspeak.session import Session


def test_the_help_names_every_toolset_and_those_that_are_there_by_default(tmp_path: Path) -> None:
    session = Session(FakeRobot(), SemanticMapStore(tmp_path / "places.yaml"), lease_s=60.0)

    said = " ".join(CliRunner().invoke(cli, ["serve", "--help"]).output.split())

    found = re.search(r"in place of ([\w,]+); others are ([\w, ]+)\.", said)
    assert found is not None
    assert tuple(found[1].split(",")) == DEFAULT_TOOLSETS
    others = set(re.findall(r"\w+", found[2])) - {"and"}
    assert others | set(DEFAULT_TOOLSETS) == set(build_toolsets(session))
