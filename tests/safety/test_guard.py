"""The revisions of a map, with what a policy closes."""

from pathlib import Path

import numpy as np
import pytest

from fakes import FakeRobot, two_rooms
from guarding import WallClock, make_guard, rectangle
from mapspeak.memory import SemanticMapStore
from mapspeak.memory.events import Effect, Event
from mapspeak.safety import AreaRule, CommandKind, MapReviser, Policy
from mapspeak.safety.guard import RateLog
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid

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


async def test_a_map_is_surveyed_once_until_it_or_the_robots_width_changes() -> None:
    reviser = MapReviser((), wall_clock=WallClock())
    first = await reviser.revise(two_rooms(), radius_m=0.2)
    grid = first.grid
    assert await reviser.revise(grid, radius_m=0.2) is first
    assert reviser.latest is first
    wider = await reviser.revise(grid, radius_m=0.3)
    assert (wider is first, wider.radius_m) == (False, 0.3)
    closed = OccupancyGrid(
        cells=np.full_like(grid.cells, 100),
        resolution_m=grid.resolution_m,
        origin=grid.origin,
    )
    assert (await reviser.revise(closed, radius_m=0.3)).grid is closed


@pytest.mark.parametrize(("effect", "closes"), [(Effect.CLOSED, True), (Effect.SLOW, False)])
def test_an_event_that_closes_a_place_is_as_good_as_a_rule(effect: Effect, *, closes: bool) -> None:
    events = [Event(text="wet paint", place="corridor", effect=effect)]
    reviser = MapReviser((), wall_clock=WallClock(), read_events=lambda: events)
    assert reviser.has_rules == closes
    assert not MapReviser((), wall_clock=WallClock()).has_rules


@pytest.mark.parametrize(
    ("now_s", "n_counted"), [(9.0, 2), (59.0, 2), (61.0, 1), (-30.0, 2), (-70.0, 0), (400.0, 0)]
)
def test_commands_of_the_last_minute_are_counted_though_the_clock_jumps(
    now_s: float, n_counted: int
) -> None:
    rates = RateLog()
    for noted_s in (0.0, 5.0):
        rates.note(CommandKind.DRIVE, noted_s)
    rates.note(CommandKind.CALL, 5.0)
    assert rates.count(CommandKind.DRIVE, now_s) == n_counted
