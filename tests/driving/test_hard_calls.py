"""Calls that explore, search or follow a route: at once, cut short, or as a clock misbehaves."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import anyio
import pytest

from failing_robot import FailingRobot
from fakes import FakeRobot, two_rooms
from mapspeak.driving.drive import DriveBook
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration.explorer import Explorer
from mapspeak.driving.exploration.progress import Bounds, ExplorationState
from mapspeak.driving.routes.following import RouteBook, RouteState
from mapspeak.driving.routes.planning import WhenBlocked
from mapspeak.driving.search.progress import Budget, SearchState
from mapspeak.driving.search.searcher import Judgement, Searcher
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.memory import PictureBook, SemanticMap, SemanticMapStore
from mapspeak.robot import GoalState
from mapspeak.safety import Caller, calling
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import NOTHING_TRIED, FrontierReport
from mapspeak.worldmodel.model import WorldModel
from roaming import RoamingRobot, session_of, world_from_text

pytestmark = pytest.mark.anyio

T = TypeVar("T")
ROOMS = """
################################
#............#.................#
#............#.................#
#............#.................#
#..............................#
#..............................#
#............#.................#
#............#.................#
##########....##################
#..............................#
#..............................#
#..............................#
################################
"""
START = (1.0, 2.0)
NEAR, FAR = Pose(2.5, 1.4), Pose(6.0, 1.4)


async def tell_nobody(_report: DriveReport) -> None:
    await anyio.lowlevel.checkpoint()


async def drive_often(drives: DriveBook, n_drives: int = 210) -> None:
    """Sends the robot to and fro until old drives are forgotten."""
    for _ in range(n_drives):
        with calling(Caller(session="another")), drives.preparing() as ticket:
            await drives.start(NEAR, place="there", ticket=ticket)


async def test_two_calls_that_explore_at_once_count_each_frontier_once(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(ROOMS, start=START))
    explorer = Explorer(session_of(robot, tmp_path))
    async with anyio.create_task_group() as tasks:
        for _ in range(2):
            tasks.start_soon(lambda: explorer.advance(None, wait_s=3.0, on_trip=tell_nobody))
    told = await explorer.advance(None, wait_s=1.0, on_trip=tell_nobody)
    assert told.elapsed_s == pytest.approx(robot.now_s, abs=0.5)
    assert told.n_goals == len(robot.goals)
    assert told.n_arrived + told.n_seen + told.n_blocked <= told.n_goals


class StillRobot(RoamingRobot):
    """A robot whose clock can be made to stand still, as that of a paused simulation does."""

    is_still = False

    async def sleep(self, duration_s: float) -> None:
        if self.is_still:
            await anyio.lowlevel.checkpoint()
            raise LinkError("The robot's simulated clock has stood still for 5 s.", hint="Wait.")
        await super().sleep(duration_s)


async def test_exploring_and_searching_end_where_the_robots_clock_stands(tmp_path: Path) -> None:
    robot = StillRobot(world_from_text(ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer, searcher = Explorer(session), Searcher(session)

    async def explore() -> ExplorationState:
        return (await explorer.advance(None, wait_s=1.0, on_trip=tell_nobody)).state

    async def search() -> SearchState:
        searcher.note_picture(await robot.fetch_picture())
        judgement = Judgement(is_seen=False)
        return (
            await searcher.advance("chair", judgement, Budget(), wait_s=1.0, on_trip=tell_nobody)
        ).state

    for call, driving in ((explore, ExplorationState.DRIVING), (search, SearchState.DRIVING)):
        while await call() is not driving:
            pass
        robot.is_still = True
        with anyio.fail_after(20.0), pytest.raises(LinkError, match="clock stands still"):
            await call()
        robot.is_still = False
        assert await call() is driving


async def test_a_clock_that_is_set_back_does_not_prolong_a_wait() -> None:
    robot = FailingRobot()
    robot.set_clock(1_000.0)
    drives = DriveBook(robot)
    with drives.preparing() as ticket:
        drive = await drives.start(FAR, place="there", ticket=ticket)
    n_told = 0

    async def begin_anew(_report: DriveReport) -> None:
        nonlocal n_told
        n_told += 1
        if n_told == 2:
            robot.set_clock(0.0)
        await anyio.lowlevel.checkpoint()

    await drives.wait(drive.goal_id, wait_s=10.0, on_progress=begin_anew)
    assert robot.now_s < 10.0


async def test_an_exploration_whose_drive_is_forgotten_goes_on(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    await explorer.advance(None, wait_s=1.0, on_trip=tell_nobody)
    await drive_often(session.drives)
    told = await explorer.advance(None, wait_s=5.0, on_trip=tell_nobody)
    assert told.state is ExplorationState.INTERRUPTED
    told = await explorer.advance(None, wait_s=1.0, on_trip=tell_nobody)
    assert told.state is ExplorationState.DRIVING


async def follow(route: RouteBook, wait_s: float) -> RouteState:
    told = await route.advance(
        wait_s=wait_s, when_blocked=WhenBlocked.WAIT, on_progress=tell_nobody
    )
    return told.state


@pytest.mark.parametrize("is_begun_anew", [True, False])
async def test_a_route_whose_drive_is_forgotten_goes_on(
    tmp_path: Path,
    is_begun_anew: bool,  # noqa: FBT001 - a parameter of pytest
) -> None:
    session = Session(FakeRobot(two_rooms()), SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    route = RouteBook(session)
    await route.begin(["6.0, 1.4"], pause_s=0.0, is_looking=False)
    assert await follow(route, 1.0) is RouteState.DRIVING
    await drive_often(session.drives)
    if is_begun_anew:
        await route.begin(["6.0, 1.4"], pause_s=0.0, is_looking=False)
    assert await follow(route, 20.0) is RouteState.DONE


async def test_who_gives_up_exploring_in_an_outage_leaves_a_robot_that_is_stopped_after_it(
    tmp_path: Path,
) -> None:
    robot = OutOfReach(world_from_text(ROOMS, start=START))
    session = session_of(robot, tmp_path)
    explorer = Explorer(session)
    await explorer.advance(None, wait_s=1.0, on_trip=tell_nobody)
    with anyio.CancelScope() as scope:
        robot.is_reachable, robot.give_up = False, scope.cancel
        await explorer.advance(None, wait_s=5.0, on_trip=tell_nobody)
    assert (await session.drives.report()).is_stop_owed


class OutOfReach(RoamingRobot):
    """A robot that can be made not to hear, and whose caller gives up as he asks for the map."""

    is_reachable = True
    give_up: Callable[[], None] | None = None

    async def fetch_map(self) -> OccupancyGrid:
        if self.give_up is not None:
            self.give_up()
            await anyio.lowlevel.checkpoint()
        return await super().fetch_map()

    async def cancel_goal(self, robot_goal_id: str) -> None:
        if not self.is_reachable:
            raise LinkError("There is no connection.", hint="Wait.")
        await super().cancel_goal(robot_goal_id)


class HeavyWorld(WorldModel):
    """A world model that tells in which threads its frontiers were looked for."""

    asked_in: set[int]

    @property
    def frontiers(self) -> FrontierReport:
        self.asked_in.add(threading.get_ident())
        return super().frontiers


class HeavySite:
    """What an exploration needs, with world models that tell where they were worked on."""

    def __init__(self, robot: RoamingRobot) -> None:
        self.robot = robot
        self.drives = DriveBook(robot)
        self.pictures = PictureBook()
        self.asked_in: set[int] = set()

    async def fetch_world_model(self) -> WorldModel:
        grid, pose = await self.robot.fetch_map(), (await self.robot.fetch_pose()).pose
        world = HeavyWorld(grid, pose, SemanticMap(), radius_m=self.robot.description.radius_m)
        world.asked_in = self.asked_in
        return world

    async def compute(self, work: Callable[[], T]) -> T:
        return await anyio.to_thread.run_sync(work)


async def test_a_stop_is_answered_while_an_exploration_looks_for_frontiers() -> None:
    site = HeavySite(RoamingRobot(world_from_text(ROOMS, start=START)))
    explorer = Explorer(site)
    bounds = Bounds(known_ratio=1.0)
    while not (await explorer.advance(bounds, wait_s=25.0, on_trip=tell_nobody)).state.is_end:
        pass
    assert site.asked_in
    assert threading.get_ident() not in site.asked_in


async def test_what_drives_on_an_older_map_have_shown_counts_no_more_on_a_new_one(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    with session.drives.preparing() as ticket:
        drive = await session.drives.start(FAR, place="F1", ticket=ticket)
    await session.drives.wait(drive.goal_id, wait_s=20.0, on_progress=tell_nobody)
    world = await session.fetch_world_model()
    assert session._tries.find_tried(world.map).looked_from == (FAR.point,)
    with session.drives.preparing() as ticket:
        await session.drives.start(NEAR, place="F2", ticket=ticket)
    robot.end_goal(GoalState.BLOCKED)
    robot.grid = two_rooms().crop(slice(0, 6), slice(0, 12))
    world = await session.fetch_world_model()
    assert session._tries.find_tried(world.map) == NOTHING_TRIED
