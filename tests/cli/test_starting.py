from contextlib import AsyncExitStack, ExitStack
from pathlib import Path

import pytest

from mapspeak.cli.serving.starting import RobotStart, open_session
from mapspeak.cli.shared.options import GuardChoice
from mapspeak.cli.shared.robots import RobotChoice

LONG_S = 90.0


@pytest.mark.anyio
async def test_under_a_virtual_clock_records_age_as_the_robots_time_passes(tmp_path: Path) -> None:
    start = RobotStart(
        choice=RobotChoice(robot="sim:flat_1", clock="virtual"),
        memory=str(tmp_path / "places.yaml"),
        guard=GuardChoice(audit=tmp_path / "audit.jsonl", control=tmp_path / "control"),
    )
    async with AsyncExitStack() as links:
        session, _ = await open_session("", start, links, ExitStack(), tmp_path, lease_s=1e6)
        before, began_s = session.find_wall_time(), session.robot.now_s
        await session.robot.sleep(LONG_S)
        after = session.find_wall_time()
        passed_s = session.robot.now_s - began_s

    assert before is not None
    assert after is not None
    assert (after - before).total_seconds() == pytest.approx(passed_s, abs=1e-3)
