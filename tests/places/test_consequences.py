"""What a closure cuts off, and who is told: goals, records, explorations, sessions."""

from dataclasses import replace
from pathlib import Path

import pytest

from closing import EAST, LATER, NOW, RADIUS_M, WEST, event, office, revision_with, world_on
from fakes import FakeRobot
from guarding import WallClock, corners, make_guard, rectangle
from mapspeak.driving.exploration.progress import (
    Bounds,
    ExplorationState,
    Progress,
    find_unreachable,
    judge_end,
)
from mapspeak.errors import GoalError, PolicyError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMap, SemanticMapStore, Waypoint
from mapspeak.memory.events import Effect
from mapspeak.places.goalcheck import GoalVerdict, say_check
from mapspeak.places.recall.events import (
    close_floor_of,
    find_cut_off,
)
from mapspeak.places.relations.choosing import check_place, find_place
from mapspeak.safety import MapReviser, Policy
from mapspeak.server.text.world.drives import say_progress
from mapspeak.server.text.world.look import MapLook, view_of
from mapspeak.server.text.world.maps import say_refusal
from mapspeak.server.text.world.tables import describe_world
from mapspeak.server.text.world.ways import describe_measures
from mapspeak.session import Session
from mapspeak.spatial import UNKNOWN
from mapspeak.spatial.frontiers import RefusalReason
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.revision import MapRevision

pytestmark = pytest.mark.anyio


def test_a_closure_names_the_rooms_that_it_cuts_off() -> None:
    south = corners((8.5, 1.0), (15.5, 3.5))
    world = world_on(revision_with(event(Effect.CLOSED, outlines=(south,))))
    here, there = (world.rooms.find_region_at(each) for each in (WEST, EAST))
    assert here is not None
    assert there is not None

    both = event(Effect.CLOSED, id="E2")
    cut_off = find_cut_off(world, both, NOW)

    assert there.id in cut_off
    assert here.id not in cut_off
    assert there.id not in find_cut_off(world_on(revision_with()), both, NOW)


def test_a_goal_behind_a_closure_names_what_closes_the_way() -> None:
    south = corners((8.5, 1.0), (15.5, 3.5))
    world = world_on(
        revision_with(
            event(Effect.CLOSED, id="E2"), event(Effect.CLOSED, place="C2", outlines=(south,))
        )
    )

    check = check_place(world, find_place(world, f"{EAST.x}, {EAST.y}")).check

    assert check.verdict is GoalVerdict.UNREACHABLE
    assert "area 'C1', closed by event E2 until 14:00" in say_check(check)
    assert "as wide as the robot" not in say_check(check)


def test_a_record_behind_a_closure_is_no_less_trusted() -> None:
    closed = revision_with(
        event(Effect.CLOSED), event(Effect.CLOSED, outlines=(corners((8.5, 1.0), (15.5, 3.5)),))
    )
    memory = SemanticMap(waypoints=(Waypoint(name="far", pose=Pose(EAST.x, EAST.y)),))

    world = WorldModel(
        closed.grid, Pose(WEST.x, WEST.y), memory, radius_m=RADIUS_M, revision=closed
    )

    assert world.path_m(EAST) is None
    assert world.judge.findings == ()


def test_what_nobody_saw_behind_a_closure_is_told_as_closed_off() -> None:
    grid = office()
    cells = grid.cells.copy()
    cells[:, 235:] = UNKNOWN
    grid = replace(grid, cells=cells)
    south = corners((8.5, 1.0), (15.5, 3.5))
    bare = MapRevision(grid, radius_m=RADIUS_M)
    events = [event(Effect.CLOSED, id="E2"), event(Effect.CLOSED, outlines=(south,))]
    closed = bare.with_areas(tuple(close_floor_of(events, bare, NOW)))

    world = world_on(closed)
    unreachable = find_unreachable(world)

    assert judge_end(world, ()) is ExplorationState.REST_UNREACHABLE
    sentence = say_progress(ended_exploration(world))
    assert "behind what is closed (the area 'C1', closed by event E2 until 14:00" in sentence
    assert "behind walls" not in sentence
    assert {each.reason for each in unreachable} == {RefusalReason.CLOSED_OFF}
    assert say_refusal(unreachable[0]) in describe_world(view_of(world, MapLook()))


def ended_exploration(world: WorldModel) -> Progress:
    """Return an exploration that has ended without a drive, as it stands."""
    return Progress(
        state=judge_end(world, ()),
        bounds=Bounds(),
        bound=None,
        seen_id=None,
        trip_end=None,
        n_goals=0,
        n_arrived=0,
        n_seen=0,
        n_blocked=0,
        n_ended=0,
        driven_m=0.0,
        elapsed_s=0.0,
        known_area_m2=world.frontiers.floor_m2,
        known_ratio=world.frontiers.known_ratio,
        frontiers=world.frontiers.frontiers,
        trip=None,
        pose=world.robot,
        pose_doubt=None,
        unreachable=find_unreachable(world),
        blocked=(),
        not_worth=(),
        closed=tuple(world.map.areas),
    )


def test_a_way_that_is_closed_is_measured_as_none_with_what_closes_it() -> None:
    south = corners((8.5, 1.0), (15.5, 3.5))
    world = world_on(
        revision_with(event(Effect.CLOSED, id="E2"), event(Effect.CLOSED, outlines=(south,)))
    )
    there = world.rooms.find_region_at(EAST)
    assert there is not None

    told = describe_measures(world, start="robot", places=None)

    assert f"{there.id} | 19.98, 6.48 | no way (unreachable)" in told
    assert "the shortest leads over the area 'C1', closed by event E2 until 14:00" in told


def test_the_nearest_is_by_the_shortest_path_also_where_the_way_leads_round() -> None:
    far_round = Waypoint(name="printer", pose=Pose(18.0, 6.0))
    other = Waypoint(name="copier", pose=Pose(18.0, 2.0))
    world = world_on(revision_with(event(Effect.AVOID)), other, far_round)

    told = describe_measures(world, start="robot", places=["printer", "copier"])
    nearest = find_place(world, "nearest remembered place")

    first, second = (line.split(" | ") for line in told.splitlines() if " | 18.00, " in line)
    assert (first[0], second[0]) == ("printer", "copier")
    assert nearest.name == "W2"
    assert "m by the shortest path" in nearest.reason
    assert float(first[2]) > float(second[2]), "the way round is told as it is driven"
    assert "path m is of the way to drive" in told


async def test_an_event_closes_and_opens_again_by_itself_and_the_policy_stays() -> None:
    clock = WallClock(NOW)
    pit = rectangle("pit", (2.0, 2.0), (3.0, 3.0))
    events = [event(Effect.CLOSED), event(Effect.NONE, text="the pit is open again", place="pit")]
    reviser = MapReviser([pit], wall_clock=clock, read_events=lambda: events)

    before = await reviser.revise(office(), radius_m=RADIUS_M)
    clock.now = LATER
    after = await reviser.revise(office(), radius_m=RADIUS_M)

    assert [area.name for area in before.areas] == ["pit", "C1"]
    assert [area.name for area in after.areas] == ["pit"]


async def test_the_revision_stays_while_events_do() -> None:
    reviser = MapReviser([], wall_clock=WallClock(NOW), read_events=lambda: [event(Effect.AVOID)])
    grid = office()

    first = await reviser.revise(grid, radius_m=RADIUS_M)

    assert await reviser.revise(grid, radius_m=RADIUS_M) is first
    assert first.hindrances


async def test_a_session_heeds_the_events_of_its_memory(tmp_path: Path) -> None:
    robot = FakeRobot(office())
    store = SemanticMapStore(tmp_path / "places.yaml", map_id=robot.description.map_name)
    guard = make_guard(tmp_path, Policy(), clock=WallClock(NOW))
    session = Session(robot, store, lease_s=60.0, guard=guard)
    store.write_event(event(Effect.CLOSED))

    world = await session.fetch_world_model()

    assert [area.name for area in world.map.areas] == ["C1"]
    assert 'E1 "painters at work" (C1), closed to the robot, until 14:00.' in world.warnings
    with pytest.raises((PolicyError, GoalError)):
        await session.robot.send_goal(Pose(12.0, 6.5))
