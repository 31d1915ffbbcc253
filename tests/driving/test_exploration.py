import itertools
from pathlib import Path

import anyio
import pytest

from causes import CRATE
from drawing import grid_from_text
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration.blocked import BlockedPlaces, TripEnd
from mapspeak.driving.exploration.explorer import Explorer
from mapspeak.driving.exploration.progress import BoundKind, Bounds, ExplorationState, Progress
from mapspeak.errors import GoalError, PolicyError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.places.relations.viewpoints import face_new_walls
from mapspeak.robot import GoalState
from mapspeak.server.reports.exploring import ExploreAnswer
from mapspeak.server.text.world.drives import say_progress
from mapspeak.server.tools.sightings import look_ahead
from mapspeak.simulator import World
from mapspeak.spatial.frontiers import RefusalReason
from roaming import RoamingRobot, session_of, world_from_text

pytestmark = pytest.mark.anyio

THREE_ROOMS = """
################################
#............#.................#
#............#.................#
#............#.................#
#............#.................#
#..............................#
#..............................#
#..............................#
#..............................#
#............#.................#
#............#.................#
#............#.................#
##########....##################
#..............................#
#..............................#
#..............................#
#..............................#
#..............................#
#..............................#
################################
"""
START = (1.0, 3.8)

MANY_ROOMS = """
################################################
#..........#..............#....................#
#..........#..............#....................#
#..........#...######.....#..........####......#
#..........#...######................####......#
#....................................####......#
#....................................####......#
#..........#...######.....#....................#
#..........#...######.....#....................#
#######..############..########..###########..##
#..........#..............#..........#.........#
#..........#..............#..........#.........#
#...####...#..............#..........#.........#
#...####......................####.............#
#...####......................####.............#
#..........#..............#...####...#.........#
#..........#..............#..........#.........#
################################################
"""

BEHIND_A_SLIT = """
################################
#............#######...........#
#............#######...........#
#............#######...........#
#..............................#
#..............................#
#............#######...........#
#............#######...........#
#............#######...........#
################################
"""


class ForbiddingRobot(RoamingRobot):
    """A robot that must not drive to the lower part of its map."""

    def __init__(self, world: World, *, farthest_y: float = -1.2) -> None:
        super().__init__(world)
        self._farthest_y = farthest_y

    async def send_goal(self, goal: Pose) -> str:
        if goal.y < self._farthest_y or self._farthest_y < -50.0:
            raise GoalError("The lower room: keep out.", hint="Ask who runs the robot.")
        return await super().send_goal(goal)


class HeldRobot(RoamingRobot):
    """A robot that somebody holds."""

    is_held = True
    n_asked = 0

    async def send_goal(self, goal: Pose) -> str:
        self.n_asked += 1
        if self.is_held:
            raise PolicyError("The robot is held.", hint="Ask who runs the robot.")
        return await super().send_goal(goal)


async def _tell_nobody(_report: DriveReport) -> None:
    """Nobody waits for news."""


async def _explore(
    explorer: Explorer, bounds: Bounds | None = None, wait_s: float = 25.0
) -> Progress:
    """Calls until the exploration ends or pauses."""
    progress = await explorer.advance(bounds, wait_s=wait_s, on_trip=_tell_nobody)
    n_calls = 1
    while progress.state is ExplorationState.DRIVING and n_calls < 40:
        progress = await explorer.advance(bounds, wait_s=wait_s, on_trip=_tell_nobody)
        n_calls += 1
    return progress


async def test_exploring_ends_when_nothing_is_left(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    progress = await _explore(Explorer(session))
    assert progress.state is ExplorationState.NOTHING_LEFT
    assert progress.known_area_m2 > 25.0
    assert progress.known_ratio == pytest.approx(1.0)
    assert progress.driven_m == pytest.approx(robot.simulation.truth.driven_m, rel=0.1)
    assert robot.simulation.truth.n_collisions == 0


async def test_what_lies_behind_a_slit_is_left_and_cannot_be_reached(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(BEHIND_A_SLIT, start=(1.5, 1.2)))
    progress = await _explore(Explorer(session_of(robot, tmp_path)))
    assert progress.state is ExplorationState.REST_UNREACHABLE
    assert progress.unreachable
    assert RefusalReason.TOO_NARROW in {each.reason for each in progress.unreachable}


async def test_a_frontier_seen_from_afar_is_not_driven_to_its_end(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    progress = await _explore(Explorer(session_of(robot, tmp_path)))
    assert progress.n_seen > 0
    assert progress.n_goals == progress.n_arrived + progress.n_seen + progress.n_blocked


async def test_the_way_driven_between_two_calls_is_counted(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    before = await explorer.advance(None, wait_s=1.0, on_trip=_tell_nobody)
    truth_m = robot.simulation.truth.driven_m
    for _ in range(20):
        await robot.sleep(0.5)
        await session.drives.watch()
    truth_m = robot.simulation.truth.driven_m - truth_m
    after = await explorer.advance(None, wait_s=1.0, on_trip=_tell_nobody)
    assert truth_m > 1.0
    assert after.driven_m - before.driven_m >= 0.9 * truth_m


async def test_a_call_ends_in_time_and_the_next_one_goes_on_with_the_same_drive(
    tmp_path: Path,
) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    explorer = Explorer(session_of(robot, tmp_path))
    first = await explorer.advance(None, wait_s=1.0, on_trip=_tell_nobody)
    assert first.state is ExplorationState.DRIVING
    assert robot.now_s == pytest.approx(1.0, abs=0.1)
    second = await explorer.advance(None, wait_s=0.5, on_trip=_tell_nobody)
    assert second.trip == first.trip
    assert len(robot.goals) == 1
    assert second.elapsed_s == pytest.approx(1.5, abs=0.1)


async def test_nothing_moves_on_between_two_calls(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    await explorer.advance(None, wait_s=1.0, on_trip=_tell_nobody)
    await robot.sleep(60.0)
    assert len(robot.goals) == 1


async def test_a_stop_ends_the_exploration_until_it_is_called_again(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    await explorer.advance(None, wait_s=1.0, on_trip=_tell_nobody)
    await session.drives.stop()
    stopped = await explorer.advance(None, wait_s=5.0, on_trip=_tell_nobody)
    assert stopped.state is ExplorationState.INTERRUPTED
    assert len(robot.goals) == 1
    again = await _explore(explorer)
    assert again.state is ExplorationState.NOTHING_LEFT


async def test_a_goal_of_somebody_else_is_not_taken_away_again(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    await explorer.advance(None, wait_s=1.0, on_trip=_tell_nobody)
    with session.drives.preparing() as ticket:
        other = await session.drives.start(Pose(0.5, 0.0), place="there", ticket=ticket)
    told = await explorer.advance(None, wait_s=5.0, on_trip=_tell_nobody)
    assert told.state is ExplorationState.INTERRUPTED
    assert session.drives.latest is not None
    assert session.drives.latest.goal_id == other.goal_id


async def test_a_drive_of_the_same_client_in_between_does_not_end_the_exploration(
    tmp_path: Path,
) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    await explorer.advance(None, wait_s=1.0, on_trip=_tell_nobody)
    with session.drives.preparing() as ticket:
        own = await session.drives.start(Pose(0.5, 0.0), place="there", ticket=ticket)
    await session.drives.wait(own.goal_id, wait_s=30.0, on_progress=_tell_nobody)
    again = await _explore(explorer)
    assert again.state is ExplorationState.NOTHING_LEFT
    assert again.n_goals == again.n_arrived + again.n_seen + again.n_blocked


async def test_who_gives_up_waiting_leaves_the_robot_standing(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)

    with anyio.CancelScope() as scope:

        async def give_up(_report: DriveReport) -> None:
            scope.cancel()
            await anyio.lowlevel.checkpoint()

        await Explorer(session).advance(None, wait_s=25.0, on_trip=give_up)
    assert scope.cancelled_caught
    assert (await session.drives.report()).status.state is GoalState.CANCELLED


async def test_a_blocked_frontier_is_tried_again_in_the_end(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    robot.n_to_fail = 1
    progress = await _explore(Explorer(session_of(robot, tmp_path)))
    assert progress.state is ExplorationState.NOTHING_LEFT
    assert progress.known_area_m2 > 25.0


async def test_a_robot_that_cannot_drive_says_what_is_left_and_why(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    robot.n_to_fail = 1000
    progress = await _explore(Explorer(session_of(robot, tmp_path)))
    assert progress.state is ExplorationState.REST_UNREACHABLE
    assert {place.end.cause for place in progress.blocked} == {CRATE}
    assert len(robot.goals) < 40


async def test_a_frontier_that_the_policy_forbids_is_left_out_and_named(tmp_path: Path) -> None:
    robot = ForbiddingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    progress = await _explore(Explorer(session))
    assert progress.state is ExplorationState.REST_UNREACHABLE
    assert "keep out" in str(progress.blocked[0].end.cause)


async def test_a_policy_that_forbids_everything_ends_the_exploration(tmp_path: Path) -> None:
    robot = ForbiddingRobot(world_from_text(THREE_ROOMS, start=START), farthest_y=-100.0)
    progress = await _explore(Explorer(session_of(robot, tmp_path)))
    assert progress.state is ExplorationState.REST_UNREACHABLE
    assert all("keep out" in str(place.end.cause) for place in progress.blocked)
    assert robot.simulation.truth.driven_m == 0.0


async def test_a_robot_that_must_not_drive_now_is_not_asked_again_and_again(
    tmp_path: Path,
) -> None:
    robot = HeldRobot(world_from_text(THREE_ROOMS, start=START))
    explorer = Explorer(session_of(robot, tmp_path))
    with pytest.raises(PolicyError, match="is held"):
        await explorer.advance(None, wait_s=25.0, on_trip=_tell_nobody)
    assert robot.n_asked == 1
    robot.is_held = False
    assert (await _explore(explorer)).state is ExplorationState.NOTHING_LEFT


async def test_exploring_ends_after_so_many_goals_and_goes_on_when_called_again(
    tmp_path: Path,
) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    explorer = Explorer(session_of(robot, tmp_path))
    one = await _explore(explorer, Bounds(n_goals=1))
    assert one.state is ExplorationState.BOUND_REACHED
    assert (one.n_goals, one.n_arrived) == (1, 1)
    assert (one.n_seen, one.n_blocked, one.bound) == (0, 0, BoundKind.GOALS)
    rest = await _explore(explorer)
    assert rest.state is ExplorationState.NOTHING_LEFT


async def test_exploring_ends_with_the_robot_standing_when_the_time_is_over(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    progress = await _explore(Explorer(session), Bounds(duration_s=3.0))
    assert progress.state is ExplorationState.BOUND_REACHED
    assert progress.trip is None
    assert (await session.drives.report()).status.state is GoalState.CANCELLED


async def test_exploring_ends_when_enough_is_known(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    progress = await _explore(Explorer(session_of(robot, tmp_path)), Bounds(known_ratio=0.05))
    assert progress.state is ExplorationState.BOUND_REACHED
    assert robot.goals == []


async def test_exploring_pauses_at_goals_where_asked(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    explorer = Explorer(session_of(robot, tmp_path))
    states: list[ExplorationState] = []
    while not states or not states[-1].is_end:
        states.append((await _explore(explorer, Bounds(stops_at_goals=True))).state)
    assert states[-1] is ExplorationState.NOTHING_LEFT
    assert set(states[:-1]) <= {ExplorationState.AT_GOAL}


async def test_exploring_pauses_also_where_a_goal_has_been_seen_from_afar(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    explorer = Explorer(session_of(robot, tmp_path))
    pauses = []
    progress = await _explore(explorer, Bounds(stops_at_goals=True))
    while not progress.state.is_end:
        pauses.append(progress)
        progress = await _explore(explorer, Bounds(stops_at_goals=True))
    seen = [each for each in pauses if each.seen_id is not None]
    assert seen
    assert all(each.trip is None for each in pauses)
    points = [each.pose.point for each in seen]
    assert all(a.distance_to(b) > 2.5 for a, b in itertools.pairwise(points))


async def test_at_a_pause_the_robot_faces_what_no_picture_shows(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    progress = await _explore(explorer, Bounds(stops_at_goals=True))
    turns_rad = []
    while not progress.state.is_end:
        world, pose = await session.fetch_world_model(), progress.pose
        better = face_new_walls(world, pose, session.pictures.views)
        turns_rad.append(abs(wrap_angle(better.yaw_rad - pose.yaw_rad)))
        await look_ahead(session)
        progress = await _explore(explorer, Bounds(stops_at_goals=True))
    assert turns_rad == pytest.approx([0.0] * len(turns_rad), abs=0.1)


def test_a_blocked_place_is_open_again_when_the_map_has_changed_there() -> None:
    closed = grid_from_text("....##....\n....##....\n....##....", resolution_m=0.5)
    opened = grid_from_text("..........\n..........\n....##....", resolution_m=0.5)
    places = BlockedPlaces()
    goal = Pose(4.0, 0.8)
    places.remember("F1", goal, stuck=Pose(1.5, 0.8).point, end=TripEnd(cause=CRATE), grid=closed)
    assert places.is_closed(goal.point, closed)
    assert not places.is_closed(goal.point, opened)


def test_a_place_that_was_blocked_twice_is_tried_no_more_while_nothing_changes() -> None:
    grid = grid_from_text("..........\n..........", resolution_m=0.5)
    places = BlockedPlaces()
    goal = Pose(4.0, 0.5)
    for _ in range(2):
        places.remember("F1", goal, stuck=goal.point, end=TripEnd(cause=CRATE), grid=grid)
    assert not places.worth_another_try(grid)
    assert [place.n_tries for place in places] == [2]


async def test_the_metres_of_an_exploration_are_those_of_its_own_drives(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    before = await _explore(explorer, Bounds(stops_at_goals=True))
    with session.drives.preparing() as ticket:
        drive = await session.drives.start(Pose(0.0, 0.0), place="the start", ticket=ticket)
    await session.drives.wait(drive.goal_id, wait_s=60.0, on_progress=_tell_nobody)
    driven_m = session.drives.odometer.driven_m
    after = await _explore(explorer, Bounds(stops_at_goals=True))
    assert driven_m > before.driven_m
    assert after.driven_m == pytest.approx(
        before.driven_m + session.drives.odometer.driven_m - driven_m
    )


async def test_every_drive_of_an_exploration_is_counted_once(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    robot.n_to_fail = 1
    states: list[ExplorationState] = []
    while len(states) < 60 and (not states or not states[-1].is_end or len(states) == 2):
        progress = await explorer.advance(None, wait_s=1.5, on_trip=_tell_nobody)
        if states:
            ended = progress.n_arrived + progress.n_seen + progress.n_blocked + progress.n_ended
            assert progress.n_goals == ended + (progress.trip is not None)
        states.append(progress.state)
        if len(states) == 1:
            await session.drives.stop()
    assert ExplorationState.INTERRUPTED in states
    assert states[-1] is ExplorationState.NOTHING_LEFT


async def test_a_share_that_is_reached_says_what_it_leaves(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    progress = await _explore(Explorer(session_of(robot, tmp_path)), Bounds(known_ratio=0.05))
    assert progress.bound is BoundKind.KNOWN
    best = max(progress.frontiers, key=lambda each: each.gain_m2)
    assert f"{best.id}" in say_progress(progress)
    assert "Left:" in say_progress(progress)


async def test_a_share_that_is_reached_on_the_way_ends_it_before_the_next_frontier(
    tmp_path: Path,
) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=START))
    explorer, bounds = Explorer(session_of(robot, tmp_path)), Bounds(known_ratio=0.5)
    progress = await explorer.advance(bounds, wait_s=0.5, on_trip=_tell_nobody)
    n_goals = []
    while not progress.state.is_end:
        if progress.known_ratio >= 0.5:
            n_goals.append(progress.n_goals)
        progress = await explorer.advance(bounds, wait_s=0.5, on_trip=_tell_nobody)
    assert progress.bound is BoundKind.KNOWN
    assert {*n_goals, progress.n_goals} == {progress.n_goals}


async def test_a_frontier_that_is_none_any_more_is_left_for_the_next(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(MANY_ROOMS, start=(1.0, 2.6)))
    explorer, gone = Explorer(session_of(robot, tmp_path)), ""
    while True:
        progress = await explorer.advance(Bounds(), wait_s=0.5, on_trip=_tell_nobody)
        ids = [each.id for each in progress.frontiers]
        trip, answer = progress.trip, ExploreAnswer.of(progress)
        if trip is None or trip.target.frontier is not None:
            assert answer.next.partition(":")[0] in ("", *ids)
        assert gone == "" or trip is None or trip.target.id != gone
        gone = "" if trip is None or trip.target.id in ids else trip.target.id
        if progress.state.is_end:
            break
