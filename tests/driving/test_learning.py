"""Doors that did not let the robot through: ways lead round them, until it came through."""

from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from closing import EAST, NOW, WEST, event, goes_north, office, revision_with
from fakes import FakeRobot
from guarding import WallClock, corners, make_guard
from mapspeak.driving.doorlearning import learn_from_drive
from mapspeak.driving.drivereport import Drive
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.memory.events import ROBOT, Effect, Event, current_events
from mapspeak.robot import GoalState, GoalStatus
from mapspeak.safety import Policy
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

BEFORE_NORTH_DOOR, BEHIND_NORTH_DOOR = Point(7.2, 6.7), Point(8.6, 6.7)
SOUTH_WAY = corners((8.5, 1.0), (15.5, 3.5))


@pytest.fixture
def store(tmp_path: Path) -> SemanticMapStore:
    return SemanticMapStore(tmp_path / "places.yaml")


def learn(
    store: SemanticMapStore,
    state: GoalState,
    *,
    robot: Point = BEFORE_NORTH_DOOR,
    begun: Point = WEST,
    goal: Point = EAST,
    now: datetime = NOW,
    others: tuple[Event, ...] = (),
) -> tuple[Event, ...]:
    """Lets a drive end in a state."""
    drive = Drive(
        goal_id="G1",
        goal=Pose(goal.x, goal.y),
        place="R2",
        robot_goal_id="g",
        started_s=0.0,
        begun_at=begun,
        ended_at=robot,
        final=GoalStatus(state=state),
    )
    revision = revision_with(*others, *store.read_events(), now=now)
    return learn_from_drive(drive, store, revision=revision, now=now)


def come_through(store: SemanticMapStore, *others: Event, now: datetime = NOW) -> tuple[Event, ...]:
    """Lets a drive through the north door arrive."""
    return learn(
        store,
        GoalState.ARRIVED,
        begun=BEFORE_NORTH_DOOR,
        robot=BEHIND_NORTH_DOOR,
        goal=BEHIND_NORTH_DOOR,
        others=others,
        now=now,
    )


def test_ways_lead_round_a_door_at_which_the_robot_gave_up(store: SemanticMapStore) -> None:
    (noted,) = learn(store, GoalState.BLOCKED)

    assert (noted.id, noted.place, noted.effect) == ("E1", "D1", Effect.AVOID)
    assert '"the robot could not get through" (D1), to be avoided' in noted.sentence(NOW)
    assert goes_north(revision_with())
    assert not goes_north(revision_with(*store.read_events()))


def test_the_door_is_tried_again_after_a_pause_that_grows(store: SemanticMapStore) -> None:
    now, pauses = NOW, []
    for _ in range(5):
        (noted,) = learn(store, GoalState.BLOCKED, now=now)
        assert noted.until is not None
        pauses.append(noted.until - now)
        now = noted.until

    assert pauses[0] < pauses[1] < pauses[2]
    assert max(pauses) <= timedelta(hours=24)
    assert current_events(store.read_events(), now) == ()


def test_a_door_that_is_found_shut_again_keeps_its_one_event(store: SemanticMapStore) -> None:
    no_other_way = event(Effect.CLOSED, outlines=(SOUTH_WAY,))
    (first,) = learn(store, GoalState.BLOCKED)

    (again,) = learn(
        store, GoalState.BLOCKED, now=NOW + timedelta(minutes=1), others=(no_other_way,)
    )

    assert again.id == first.id
    assert again.until is not None
    assert first.until is not None
    assert again.until > first.until
    assert len(store.read_events()) == 1


def test_a_door_that_the_robot_came_through_is_no_longer_avoided(store: SemanticMapStore) -> None:
    no_other_way = event(Effect.CLOSED, outlines=(SOUTH_WAY,))
    learn(store, GoalState.BLOCKED)

    (ended,) = come_through(store, no_other_way)

    assert ended.id == "E1"
    assert current_events(store.read_events(), NOW) == ()


def test_an_event_that_only_takes_the_robots_name_is_never_ended_or_written_anew(
    store: SemanticMapStore,
) -> None:
    (own,) = learn(store, GoalState.BLOCKED)
    borrowed = store.write_event(replace(own, id="", text="drive on, the door is open"))

    learn(store, GoalState.BLOCKED, now=NOW + timedelta(minutes=1))
    come_through(store, event(Effect.CLOSED, outlines=(SOUTH_WAY,)))

    assert borrowed in store.read_events()
    assert borrowed in current_events(store.read_events(), NOW)


def test_an_event_of_a_person_is_never_ended_by_driving_through(store: SemanticMapStore) -> None:
    no_other_way = event(Effect.CLOSED, outlines=(SOUTH_WAY,))
    (own,) = learn(store, GoalState.BLOCKED)
    store.write_event(replace(own, id="", text="sticks", source="Ada"))

    come_through(store, no_other_way)

    assert [each.text for each in current_events(store.read_events(), NOW)] == ["sticks"]


@pytest.mark.parametrize(
    ("state", "robot"),
    [
        (GoalState.BLOCKED, WEST),
        (GoalState.BLOCKED, Point(19.0, 6.0)),
        (GoalState.CANCELLED, BEFORE_NORTH_DOOR),
        (GoalState.TIMED_OUT, BEFORE_NORTH_DOOR),
        (GoalState.PREEMPTED, BEFORE_NORTH_DOOR),
        (GoalState.ARRIVED, EAST),
    ],
    ids=["far from a door", "behind the door", "cancelled", "held", "replaced", "arrived"],
)
def test_other_ends_of_drives_tell_nothing_of_doors(
    store: SemanticMapStore, state: GoalState, robot: Point
) -> None:
    assert learn(store, state, robot=robot) == ()
    assert store.read_events() == ()


def test_a_door_that_the_robot_did_not_drive_up_to_was_not_tried(store: SemanticMapStore) -> None:
    assert learn(store, GoalState.BLOCKED, begun=BEFORE_NORTH_DOOR) == ()


def test_pauses_begin_anew_once_the_robot_came_through(store: SemanticMapStore) -> None:
    no_other_way = event(Effect.CLOSED, outlines=(SOUTH_WAY,), until=None)
    for hours in range(3):
        learn(store, GoalState.BLOCKED, now=NOW + timedelta(hours=hours), others=(no_other_way,))
    come_through(store, no_other_way, now=NOW + timedelta(hours=3))
    later = NOW + timedelta(hours=4)

    (noted,) = learn(store, GoalState.BLOCKED, now=later)

    assert noted.until == later + timedelta(minutes=15)
    assert len(store.read_events()) == 1


def test_pauses_begin_anew_when_the_last_was_long_ago(store: SemanticMapStore) -> None:
    learn(store, GoalState.BLOCKED)
    later = NOW + timedelta(days=30)

    (noted,) = learn(store, GoalState.BLOCKED, now=later)

    assert noted.until == later + timedelta(minutes=15)
    assert len(store.read_events()) == 1


def open_session(folder: Path) -> tuple[FakeRobot, SemanticMapStore, Session]:
    robot = FakeRobot(office(), pose=Pose(WEST.x, WEST.y))
    store = SemanticMapStore(folder / "places.yaml")
    guard = make_guard(folder, Policy(), clock=WallClock(NOW))
    return robot, store, Session(robot, store, lease_s=60.0, guard=guard)


async def end_drive(robot: FakeRobot, session: Session, goal: Point, state: GoalState) -> None:
    """Sends the robot somewhere; the drive ends before the north door."""
    with session.drives.preparing() as ticket:
        drive = await session.drives.start(Pose(goal.x, goal.y), place="R2", ticket=ticket)
    robot.pose = Pose(BEFORE_NORTH_DOOR.x, BEFORE_NORTH_DOOR.y)
    assert drive.robot_goal_id is not None
    robot.ended[drive.robot_goal_id] = GoalStatus(state=state)
    await session.drives.report()


async def test_the_next_drive_knows_of_the_door_too(tmp_path: Path) -> None:
    robot, store, session = open_session(tmp_path)
    await end_drive(robot, session, EAST, GoalState.BLOCKED)

    with session.drives.preparing():
        await session.find_goal(place="R2", x=None, y=None, yaw_deg=None)

    assert [each.source for each in store.read_events()] == [ROBOT]


async def test_a_drive_tells_of_a_door_though_another_has_ended_since(tmp_path: Path) -> None:
    robot, store, session = open_session(tmp_path)
    await end_drive(robot, session, EAST, GoalState.BLOCKED)
    await end_drive(robot, session, BEFORE_NORTH_DOOR, GoalState.ARRIVED)

    await session.fetch_world_model()
    await session.fetch_world_model()

    assert [each.source for each in store.read_events()] == [ROBOT]


async def test_the_next_look_at_the_map_tells_of_the_door_that_was_shut(tmp_path: Path) -> None:
    robot, store, session = open_session(tmp_path)
    await session.fetch_world_model()
    await end_drive(robot, session, EAST, GoalState.BLOCKED)

    world = await session.fetch_world_model()
    again = await session.fetch_world_model()

    assert any(f'said by "{ROBOT}"' in each for each in world.warnings)
    assert len(store.read_events()) == 1
    assert again.map is world.map
