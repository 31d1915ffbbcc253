"""The revisions of a map, with what a policy closes."""

from pathlib import Path

import pytest

from fakes import FakeRobot, two_rooms
from guarding import make_guard, rectangle
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import AreaRule, Policy
from mapspeak.session import Session

pytestmark = pytest.mark.anyio


async def test_a_rule_that_closes_nothing_is_told_before_anybody_drives_or_looks(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    rules = (
        AreaRule(name="the archive", region_id="R77"),
        rectangle("quay", (900.0, 900.0), (901.0, 901.0)),
        rectangle("pit", (0.5, 0.5), (1.0, 1.0)),
    )
    guard = make_guard(tmp_path, Policy(areas=rules))
    memory = SemanticMapStore(tmp_path / "map.yaml")
    session = Session(FakeRobot(two_rooms()), memory, lease_s=60.0, guard=guard)
    for _ in range(2):
        await session.robot.watch_map()  # type: ignore[attr-defined]
    assert [each.message for each in caplog.records] == [
        "The policy closes R77 (the archive), which is not on this map.",
        "The policy's area 'quay' lies off this map: it closes nothing here.",
    ]
