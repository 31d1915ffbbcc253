"""What a client is told of an earlier session's memory, in its first answer."""

import threading
from datetime import timedelta
from pathlib import Path

import anyio
import numpy as np
import pytest
from mcp.client import Client

from alignment_maps import HOUSE
from fakes import FakeRobot, two_rooms
from guarding import MONDAY_NOON, WallClock, make_guard
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMap, SemanticMapStore
from mapspeak.safety import Guard
from mapspeak.spatial import OccupancyGrid
from missioning import MissionRobot
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio


def _guard(folder: Path, *, later: timedelta = timedelta(0)) -> Guard:
    return make_guard(folder, clock=WallClock(MONDAY_NOON + later))


async def _write(client: Client, name: str, x: float) -> None:
    place = {"name": name, "description": "", "x": x, "y": 1.4}
    report_of(await client.call_tool("write_semantic_data", place))


async def _remember(folder: Path, grid: OccupancyGrid, *names: str) -> None:
    async with connect(FakeRobot(grid), folder, guard=_guard(folder)) as client:
        for n, name in enumerate(names):
            await _write(client, name, 1.5 + 0.5 * n)


async def test_the_first_answer_tells_what_is_remembered_and_that_it_fits(tmp_path: Path) -> None:
    await _remember(tmp_path, two_rooms(), "sink", "bench")
    guard = _guard(tmp_path, later=timedelta(minutes=25))
    async with connect(FakeRobot(two_rooms()), tmp_path, guard=guard) as client:
        first = text_of(await client.call_tool("describe_place", {"place": "R1"}))
        second = text_of(await client.call_tool("describe_place", {"place": "R1"}))
    said = "Memory: 2 places remembered before, the last 25 min ago, on this map.\n"
    assert first.startswith(said)
    assert second == first.removeprefix(said)


async def test_what_is_written_with_the_first_call_is_not_from_before(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, guard=_guard(tmp_path)) as client:
        await _write(client, "sink", 1.5)
        text = text_of(await client.call_tool("describe_place", {"place": "R1"}))
    assert "Memory:" not in text


async def test_a_report_is_told_it_beside_its_fields(tmp_path: Path) -> None:
    await _remember(tmp_path, two_rooms(), "sink")
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        answer = await client.call_tool("check_goal", {"place": "R1"})
    assert report_of(answer)["verdict"] == "ok"
    assert text_of(answer).endswith("Memory: 1 place remembered before, on this map.")


async def test_places_of_another_map_are_told_as_such(tmp_path: Path) -> None:
    house = OccupancyGrid(cells=HOUSE.cells, resolution_m=HOUSE.resolution_m, origin=HOUSE.origin)
    await _remember(tmp_path, house, "sink")
    upset = OccupancyGrid(
        cells=np.flip(HOUSE.cells.T, 0), resolution_m=HOUSE.resolution_m, origin=Pose(-3.0, 7.0)
    )
    async with connect(FakeRobot(upset), tmp_path, guard=_guard(tmp_path)) as client:
        text = text_of(await client.call_tool("look_at_map", {}))
    assert text.startswith("Memory: 1 place remembered before, the last 0 s ago, not on this map")


class SlowStore(SemanticMapStore):
    """A memory that is not read before a test says so."""

    may_read = threading.Event()

    def read(self) -> SemanticMap:
        self.may_read.wait()
        return super().read()


async def test_a_stop_does_not_wait_for_the_memory(tmp_path: Path) -> None:
    robot, memory = MissionRobot(), SlowStore(tmp_path / "map.yaml")
    async with (
        connect(robot, tmp_path, memory=memory) as client,
        anyio.create_task_group() as tasks,
    ):
        tasks.start_soon(client.call_tool, "stop_robot", {})
        try:
            with anyio.fail_after(20.0):
                await robot.stopped.wait()
        finally:
            memory.may_read.set()
    assert robot.n_stops == 1
