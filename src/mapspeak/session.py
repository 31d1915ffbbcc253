"""The one stateful object: a robot, its latest world model, its memory, its drives, its clients."""

import logging
import threading
from collections.abc import Awaitable, Callable, Generator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import replace
from datetime import datetime
from functools import cached_property, partial
from typing import TypeVar, cast

import anyio
import anyio.to_thread

from mapspeak.driving.doorlearning import learn_from_drive
from mapspeak.driving.drive import DriveBook
from mapspeak.driving.drivereport import Drive
from mapspeak.driving.episodewriter import EpisodeWriter, Keeping
from mapspeak.driving.exploration.blocked import FrontierTries
from mapspeak.driving.lease import Lease
from mapspeak.errors import LinkError, MapError, MapspeakError, SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory import MemoryStore, PictureBook, SemanticMap
from mapspeak.memory.alignment.framed import FramedMemory
from mapspeak.memory.episodes.observation import (
    EpisodePage,
    EpisodeQuery,
    ObservationKind,
    named_pictures,
)
from mapspeak.memory.episodes.store import EpisodeStore, memory_folder
from mapspeak.memory.episodes.textindex import VectorRank
from mapspeak.memory.events import Event
from mapspeak.memory.search.meaningindex import Embedder, find_model
from mapspeak.places.relations.choosing import CheckedGoal, choose_goal
from mapspeak.robot import CameraPicture, Cause, CauseCode, Robot
from mapspeak.ros.activity import Started
from mapspeak.ros.port import RosConnection
from mapspeak.safety import Guard, GuardedConnection, GuardedRobot, MapReviser, WhenBusy
from mapspeak.skill import SkilledRobot
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.model import WorldModel, revise
from mapspeak.worldmodel.recollection import Recollector
from mapspeak.worldmodel.revision import MapRevision

LOOK_S = 0.05
"""Wall time between two looks for a hold, and at where a drive leads."""
WATCH_S = 0.5
"""Wall time between two looks at the clients and at how a drive stands."""
MAP_S = 3.0
"""Wall time for a map to come, where only the name of a room is wanted of it."""
QUIET_S = 1.0
"""Wall time without a call after which the vectors of episodes are made: questions go first."""
T = TypeVar("T")
logger = logging.getLogger(__name__)


class Session:
    """Holds what tools share. It holds; it does not compute.

    Args:
        robot: The robot itself; tools never see it where there is a guard.
        lease_s: A driving robot without a client is stopped after this time.
        guard: What commands are held to; None in tests.
        find_model: Finds what compares meanings; asked once, when it is needed.

    Attributes:
        robot: The port to the robot, behind the guard.
        pictures: Taken lately, by their ids.
        episodes: Every observation, as it was made.
        memory: What is remembered, as it is on the robot's map.
        keeper: Which frame of the memory the robot's map is in.
        recollector: Keeps what was made of the memory.
        world: The map as it was looked at last; None before.
        skilled: The robot where it has skills of its own; each is run through the guard alone.
    """

    def __init__(
        self,
        robot: Robot,
        memory: MemoryStore,
        *,
        lease_s: float,
        guard: Guard | None = None,
        ros: RosConnection | None = None,
        skilled: SkilledRobot | None = None,
        find_model: Callable[[], Embedder | None] = find_model,
    ) -> None:
        self.guard = guard
        self._reviser: MapReviser | None = None
        self._guarded: GuardedRobot | None = None
        when_busy = WhenBusy.REPLACE
        if guard is not None:
            self._reviser = MapReviser(
                guard.policy.areas,
                wall_clock=guard.wall_clock,
                read_events=self.recall_events,
                # A configured clearance is kept to the millimetre.
                leaves_pockets=not guard.policy.clearance_m,
            )
            self._guarded = GuardedRobot(robot, guard=guard, reviser=self._reviser)
            when_busy = guard.policy.when_busy
            if ros is not None:
                guarded = GuardedConnection(
                    ros,
                    guard=guard,
                    now_s=lambda: robot.now_s,
                    teleop=self._guarded.teleop,
                    planner=self._guarded.planner,
                )
                # Its other members are passed on by name.
                ros = cast("RosConnection", guarded)
        self.ros, self.skilled = ros, skilled
        self.robot: Robot = self._guarded or robot
        name_robot, lock = lambda: robot.description.name, threading.RLock()
        self.memory = FramedMemory(memory, name_robot=name_robot, lock=lock)
        self.pictures, folder = PictureBook(), memory_folder(memory.path)
        episodes = EpisodeStore(folder, named_pictures=lambda: named_pictures(memory.read()))
        wall_clock = None if guard is None else guard.wall_clock
        self.episodes = EpisodeWriter(episodes, wall_clock=wall_clock)
        self.recollector = Recollector(find_model, kept=folder)
        memory.kept = self.recollector
        self.drives = DriveBook(self.robot, when_busy=when_busy)
        self._revising = anyio.Lock()
        self.keeper, self._lease = self.memory.keeper, Lease(lease_s)
        self.world: WorldModel | None = None
        self._tries, self._looked_s, self._learned = FrontierTries(), 0.0, set[str]()

    def client_is_heard(self) -> AbstractContextManager[None]:
        """Mark a client's call: its lease begins anew."""
        return self._lease.call()

    async def client_is_gone(self, client: str) -> None:
        """Stop the robot when the client that sent it somewhere has gone away."""
        cause = Cause(code=CauseCode.CLIENT_GONE)
        self.drives.dismiss(cause, owner=client)
        if client in self.drives.owners or client in self._started.owners:
            logger.warning("The client hung up during its drive: stopping the robot.")
            await self.drives.stop(cause)

    @property
    def _started(self) -> Started:
        """What was started over ROS: nothing without it."""
        return Started() if self.ros is None else self.ros.started

    @property
    def _is_busy(self) -> bool:
        """True while something goes on that was started here."""
        return self.drives.is_busy or self._started.is_busy

    async def compute(self, work: Callable[[], T]) -> T:
        """Do heavy work in a thread, so that a stop is answered meanwhile."""
        return await anyio.to_thread.run_sync(work)

    async def fetch_world_model(self, *, needs_memory: bool = False) -> WorldModel:
        """Return the map as it is now, with everything on it under its id.

        Args:
            needs_memory: Nothing can be said without the memory: what cannot be read is not empty.

        Raises:
            MapError: The robot's map has no cells.
            LinkError: The robot has no map yet.
            SemanticMapError: The memory is needed and cannot be read.
        """
        async with self._revising:
            grid = await self.robot.fetch_map()
            if not grid.cells.size:
                raise MapError(
                    f"The robot's map has no cells: {grid.n_cols} x {grid.n_rows}.",
                    hint="Wait until SLAM or the map server has sent one, then look again.",
                )
            stamped = await self.robot.fetch_pose()
            recall = self._recall if needs_memory else self._recall_if_possible
            memory = await self.compute(partial(recall, grid))
            revision, warnings = await self._revise(grid)
            news = [each for each in self.drives.ended if each.goal_id not in self._learned]
            if await self._learn_doors(news, revision):
                revision, warnings = await self._revise(grid)
            await self.compute(lambda: self._tries.learn(news, revision, stamped.pose))
            self._learned |= {each.goal_id for each in news}
            self.world = WorldModel(
                grid,
                stamped.pose,
                replace(memory, warnings=(*memory.warnings, *warnings)),
                radius_m=self.robot.description.radius_m,
                tried=self._tries.find_tried(revision),
                previous=self.world,
                revision=revision,
                recollector=self.recollector,
                pose_doubt=stamped.find_doubt(self.robot.now_s),
                is_radius_assumed=self.robot.description.is_radius_assumed,
                now=self.find_wall_time(),
                pictures=self.pictures.taken,
            )
            self._looked_s = self.robot.now_s
            return self.world

    async def find_room_id(self, point: Point) -> str | None:
        """Return the room a point lies in, on the map that was looked at last.

        Rooms of an earlier map may be gone on this one, and its new ones have no id there.

        Raises:
            LinkError: The robot has no map yet.
        """
        world = self.world
        if world is None or self.robot.now_s < self._looked_s:
            # A simulation that was begun anew may show another world.
            with anyio.move_on_after(MAP_S) as waiting:
                await self.robot.fetch_map()
            if waiting.cancelled_caught:
                raise LinkError("No map has come yet.", hint="Wait, then ask again.")
            world = await self.fetch_world_model()
        return await self.compute(lambda: world.find_room_id(point))

    async def keep_picture(self, picture: CameraPicture, *, labels: tuple[str, ...]) -> Keeping:
        """Keep a picture as an episode, with what the robot's detector reports in it."""
        if not self.episodes.is_open:
            return Keeping()
        room_id = None
        with suppress(LinkError, MapError):
            room_id = await self.find_room_id(picture.pose.point)
        keep = partial(self.episodes.keep, ObservationKind.PICTURE, picture=picture.data)
        keep = partial(keep, pose=picture.pose, stamp_s=picture.stamp_s, labels=labels)
        return await self.compute(partial(keep, room_id=room_id, name_map=self.memory.name_map))

    def find_wall_time(self) -> datetime | None:
        """Return the time by the calendar; None where the operator's clock is not known."""
        return None if self.guard is None else self.guard.wall_clock()

    def find_episodes(self, query: EpisodeQuery) -> EpisodePage:
        """Return the observations that pass a query, compared by meaning where that is possible."""
        rank = self._rank if query.words or isinstance(query.near, EpisodeQuery) else None
        placed = replace(query, placings=self.memory.place_maps())
        return self.episodes.store.find(placed, rank=rank)

    @cached_property
    def _rank(self) -> VectorRank | None:
        if (embedder := self.recollector.embedder) is None:
            return None
        return VectorRank(self.episodes.store.database, embedder, lock=threading.Lock())

    async def warm_memory(self) -> None:
        """Load what the first question would wait for: the model, the index of the memory.

        Meanwhile everything else is answered. What cannot be read now is told who asks for it.
        """
        # Ending the server does not wait for it.
        in_thread = partial(anyio.to_thread.run_sync, abandon_on_cancel=True)
        with suppress(MapspeakError):
            try:
                world = await self.fetch_world_model()
            except MapspeakError:
                # Without a map yet, all but the joining is made ready.
                await in_thread(lambda: self.recollector.warm(self.memory.read()))
                raise
            await in_thread(partial(_prepare, world))
            await in_thread(self.recollector.keep_things)
            await self._lease.wait_for_silence(QUIET_S)
            while self._rank is not None and await in_thread(self._rank.learn_ahead):
                await self._lease.wait_for_silence(QUIET_S)

    async def keep_vectors(self) -> None:
        """Keep the vectors of remembered texts, so that a later session need not make them."""
        if self.episodes.is_open:
            await self.compute(self.recollector.keep_if_many)

    async def meet_map(self) -> None:
        """Find out which frame of the memory the robot's map is in, before a write."""
        try:
            grid = await self.robot.fetch_map()
        except LinkError:
            return
        if grid.cells.size:
            await self.compute(partial(self._meet, grid))

    async def find_goal(
        self,
        *,
        place: str | None = None,
        x: float | None = None,
        y: float | None = None,
        yaw_deg: float | None = None,
        as_near: bool = False,
    ) -> CheckedGoal:
        """Return the pose to drive to, or raise GoalError, as `choose_goal` does."""
        world = await self.fetch_world_model()
        choose = partial(choose_goal, place=place, x=x, y=y, yaw_deg=yaw_deg, as_near=as_near)
        return await self.compute(partial(choose, world))

    async def _revise(self, grid: OccupancyGrid) -> tuple[MapRevision, tuple[str, ...]]:
        """Return the map with what is closed on it now, and what is to be said of that."""
        reviser, radius_m = self._reviser, self.robot.description.radius_m
        if reviser is None:
            return revise(grid, self.world, radius_m=radius_m), ()
        revision = await reviser.revise(grid, radius_m=radius_m)
        others = () if self.guard is None else self.guard.warn_of_servers()
        return revision, (*others, *await self.compute(lambda: reviser.describe(revision)))

    async def _learn_doors(self, news: Sequence[Drive], revision: MapRevision) -> bool:
        """Remember what drives tell of doors; true when that changes ways."""
        if (now := self.find_wall_time()) is None:
            return False
        learn = partial(learn_from_drive, store=self.memory, revision=revision, now=now)
        try:
            return bool(await self.compute(lambda: [each for one in news for each in learn(one)]))
        except SemanticMapError as error:
            logger.warning("What drives tell of doors is not remembered: %s", error)
            return False

    def recall_events(self) -> tuple[Event, ...]:
        """Return the events that are remembered; of a broken file those that were read before."""
        try:
            return self.memory.read_events()
        except SemanticMapError:
            return ()

    def _recall(self, grid: OccupancyGrid) -> SemanticMap:
        """Return what is remembered, as it is on a map."""
        self._meet(grid)
        return self.memory.read()

    def _meet(self, grid: OccupancyGrid) -> None:
        """Let the memory see the robot's map; of one begun anew no older picture can be told."""
        n_before = self.keeper.n_maps
        self.memory.meet(grid)
        if self.keeper.n_maps != n_before:
            self.pictures.forget()
            self._tries = FrontierTries()
            self._learned |= {each.goal_id for each in self.drives.ended}

    def _recall_if_possible(self, grid: OccupancyGrid) -> SemanticMap:
        """Return what is remembered; a broken file costs the memory, not the map."""
        try:
            return self._recall(grid)
        except SemanticMapError as error:
            return SemanticMap(warnings=(str(error),))

    async def keep_watch(self) -> None:
        """Stop a driving robot for a hold, a closed area, or want of clients; until cancelled."""
        with self._announced():
            async with anyio.create_task_group() as tasks:
                if self._guarded is not None:
                    # Apart from each other: one that is slow to tell its map is stopped at once.
                    tasks.start_soon(self._again_and_again, self._guarded.obey_hold, LOOK_S)
                    tasks.start_soon(self._again_and_again, self._guarded.watch, LOOK_S)
                    tasks.start_soon(self._again_and_again, self._guarded.watch_map, LOOK_S)
                tasks.start_soon(self._again_and_again, self._watch, WATCH_S)

    @contextmanager
    def _announced(self) -> Generator[None]:
        """Let an operator's stop know of this robot for as long."""
        if self._guarded is None or self.guard is None:
            yield
            return
        for warning in self.guard.warn_of_servers():
            logger.warning("%s", warning)
        self.guard.hold.join(self._guarded.name, address=self.guard.address)
        try:
            yield
        finally:
            self.guard.hold.leave(self._guarded.name)

    async def _again_and_again(self, look: Callable[[], Awaitable[None]], every_s: float) -> None:
        told = ""
        while True:
            await anyio.sleep(every_s)
            try:
                await look()
                told = ""
            except MapspeakError as error:
                if str(error) != told:
                    logger.warning("While watching the robot: %s", error)
                told = str(error)

    async def _watch(self) -> None:
        if self._lease.is_over and self._is_busy:
            logger.warning("No client for %.0f s: stopping the robot.", self._lease.duration_s)
            silent_s = self._lease.duration_s
            await self.drives.stop(Cause(code=CauseCode.CLIENT_SILENT, after_s=silent_s))
        await self.drives.watch()

    async def close(self) -> None:
        """Leave the robot standing."""
        if self.guard is not None:
            self.guard.approvals.close()
        with anyio.CancelScope(shield=True):
            if self._is_busy:
                await self.drives.stop(Cause(code=CauseCode.SERVER_ENDED))
            if self.episodes.is_open:
                await self.compute(self.recollector.keep)


def _prepare(world: WorldModel) -> None:
    """Make what the first question would, in its thread: things, their index, rooms and ways."""
    world.recollection.prepare()
    _ = world.judge
