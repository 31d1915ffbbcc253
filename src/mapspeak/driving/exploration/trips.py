"""Trips: drives to one target after the other that may be given up on the way for a better one."""

import math
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, TypeVar

import anyio

from mapspeak.driving.drive import DriveBook, OnProgress
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration.blocked import BlockedPlace, BlockedPlaces, TripEnd
from mapspeak.errors import GoalError, LinkError, PolicyError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.robot import Cause, CauseCode, GoalState, Robot
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import Frontier
from mapspeak.worldmodel.model import WorldModel

T = TypeVar("T")
RETHINK_S = 1.0
"""The map is looked at so often on the way."""
SLACK_S = 0.01


class TripContext(Protocol):
    """A robot, its drives, and the map as it is now; a session is one."""

    @property
    def robot(self) -> Robot:
        """The port to the robot."""
        ...

    @property
    def drives(self) -> DriveBook:
        """Every drive of the robot."""
        ...

    async def fetch_world_model(self) -> WorldModel:
        """Return the map as it is now, with everything on it under its id."""
        ...

    async def compute(self, work: Callable[[], T]) -> T:
        """Do heavy work so that a stop is answered meanwhile."""
        ...


TURN = "a turn"


async def turn_to(
    site: TripContext,
    yaw_rad: float,
    *,
    wait_s: float,
    on_progress: OnProgress,
    what: str = TURN,
) -> DriveReport:
    """Turn the robot where it stands, and return how that went.

    Args:
        what: It is called so when it is asked about.

    Raises:
        GoalError: The robot was stopped meanwhile.
        LinkError: The robot cannot be reached.
    """
    with site.drives.preparing() as ticket:
        here = (await site.robot.fetch_pose()).pose
        goal = Pose(here.x, here.y, wrap_angle(yaw_rad))
        drive = await site.drives.start(goal, place=name_turn(goal, what), ticket=ticket)
    return await site.drives.wait(drive.goal_id, wait_s=wait_s, on_progress=on_progress)


def name_turn(goal: Pose, what: str = TURN) -> str:
    """Return what a drive is called that only turns the robot."""
    return f"{what} to {goal.yaw_deg:.0f} deg"


def spread_headings(first_rad: float, n_headings: int) -> list[float]:
    """Return headings all around, in radians, evenly spread, counter-clockwise."""
    step_rad = math.tau / n_headings
    return [wrap_angle(first_rad + index * step_rad) for index in range(n_headings)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where to go next, and why.

    Attributes:
        id: F3, W2, or the words for a place that has no id.
        frontier: The frontier to look over; None for another place.
        earlier: The try before, where the place was blocked then.
    """

    id: str
    pose: Pose
    frontier: Frontier | None = None
    earlier: BlockedPlace | None = None


@dataclass(frozen=True, slots=True)
class Trip:
    """A target that the robot is on its way to."""

    target: Target
    goal_id: str


class TripState(StrEnum):
    """How a trip stands."""

    UNDER_WAY = "under_way"
    ARRIVED = "arrived"
    BLOCKED = "blocked"
    INTERRUPTED = "interrupted"
    REPLACED = "replaced"
    """The client that explores sent the robot elsewhere meanwhile, and that drive has ended."""


class Trips:
    """The trip under way, the metres driven so far, and the places that were blocked.

    Attributes:
        current: The trip under way; None between two.
        n_seen: How many were left on the way, since what they were for had been seen from afar.
        n_ended: How many were cancelled, or ended by a stop or another goal.
        end: Why the latest trip ended before its target; None when it did not.
    """

    def __init__(self, site: TripContext) -> None:
        self._site = site
        self.current: Trip | None = None
        self.blocked = BlockedPlaces()
        self.n_begun = self.n_arrived = self.n_seen = self.n_blocked = self.n_ended = 0
        self.end: TripEnd | None = None
        self._ended_m = self._begun_at_m = 0.0
        self._advancing = anyio.Lock()

    @property
    def driven_m(self) -> float:
        """How far the robot has come on trips, by its own poses; not on drives of others."""
        return self._ended_m + (0.0 if self.current is None else self._count_under_way())

    def _count_under_way(self) -> float:
        return self._site.drives.odometer.driven_m - self._begun_at_m

    def _leave(self) -> Trip | None:
        """Count the metres of the trip under way, if there is one, and take it for ended."""
        self._ended_m, trip, self.current = self.driven_m, self.current, None
        return trip

    def begin_count(self) -> None:
        """Count trips and metres from zero again; what was blocked stays remembered."""
        self.n_begun = self.n_arrived = self.n_seen = self.n_blocked = self.n_ended = 0
        self._ended_m, self._begun_at_m = 0.0, self._site.drives.odometer.driven_m

    async def set_out(self, target: Target, *, ticket: int, grid: OccupancyGrid) -> TripState:
        """Send the robot to a target; one it was on the way to is given up.

        Args:
            ticket: Of the drive book, from before the target was chosen.

        Raises:
            PolicyError: The robot must not drive now, wherever to.
        """
        try:
            drive = await self._site.drives.start(target.pose, place=target.id, ticket=ticket)
        except GoalError as error:
            return self._take_in_refusal(target, error.message, ticket=ticket, grid=grid)
        self.n_seen += self._leave() is not None
        self._begun_at_m = self._site.drives.odometer.driven_m
        self.current = Trip(target, drive.goal_id)
        self.n_begun += 1
        return TripState.UNDER_WAY

    async def follow(
        self, *, until_s: float, grid: OccupancyGrid, on_trip: OnProgress
    ) -> TripState:
        """Wait until it is time to think again of the trip under way, and say how it stands.

        Args:
            until_s: Robot time at which to answer in any case.
            grid: The map of that moment; a place that proves blocked is remembered with it.
        """
        trip = self.current
        if trip is None:
            return TripState.INTERRUPTED
        wait_s = min(RETHINK_S, until_s - self._site.robot.now_s)
        if wait_s <= SLACK_S:
            return TripState.UNDER_WAY
        drives, before_s = self._site.drives, self._site.robot.now_s
        try:
            report = await drives.wait(trip.goal_id, wait_s=wait_s, on_progress=_tell_nobody)
        except GoalError:
            # So many drives have begun since that this one is forgotten.
            self._leave()
            self.n_ended += 1
            return TripState.INTERRUPTED
        await on_trip(report)
        state = self._take_in(trip, report, grid)
        if state is TripState.UNDER_WAY and self._site.robot.now_s == before_s:
            raise LinkError(
                "The robot's clock stands still.",
                hint="Unpause the simulation, then call again to go on.",
            )
        return state

    @asynccontextmanager
    async def one_call(self) -> AsyncGenerator[None]:
        """Let one call after the other advance.

        Where the caller gives up, or the policy forbids to drive, the robot comes to a stand.
        """
        async with self._advancing:
            try:
                yield
            except (anyio.get_cancelled_exc_class(), PolicyError):
                with anyio.CancelScope(shield=True):
                    if (trip := self._leave()) is not None:
                        self.n_ended += 1
                        await self._site.drives.abandon(trip.goal_id)
                raise

    async def give_up(self, *, is_seen: bool = False) -> None:
        """Bring the robot to a stand, where it is on a trip."""
        trip = self.current
        if trip is not None:
            self.n_seen += is_seen
            self.n_ended += not is_seen
            try:
                with anyio.CancelScope(shield=True), suppress(GoalError):
                    await self._site.drives.cancel(trip.goal_id)
            finally:
                self._leave()

    def _take_in(self, trip: Trip, report: DriveReport, grid: OccupancyGrid) -> TripState:
        status = report.status
        if not status.state.is_final:
            return TripState.UNDER_WAY
        self._leave()
        if status.state is GoalState.ARRIVED:
            self.end = None
            self.n_arrived += 1
            self.blocked.forget(trip.target.pose.point)
            return TripState.ARRIVED
        if self._is_replaced_by_own(report):
            self.n_begun -= 1
            return TripState.REPLACED
        self.end = TripEnd(goal_id=trip.goal_id, goal_state=status.state, cause=status.cause)
        if status.state in (GoalState.CANCELLED, GoalState.PREEMPTED):
            self.n_ended += 1
            return TripState.INTERRUPTED
        self.n_blocked += 1
        self._remember_blocked(trip.target, self.end, report.pose, grid)
        return TripState.BLOCKED

    def _is_replaced_by_own(self, report: DriveReport) -> bool:
        """Return True when the same client drove elsewhere meanwhile, and that drive has ended."""
        cause, latest = report.status.cause, self._site.drives.latest
        is_own = latest is not None and latest.caller.owner == report.drive.caller.owner
        is_replaced = cause is not None and cause.code is CauseCode.REPLACED
        return is_replaced and is_own and self._site.drives.under_way is None

    def _take_in_refusal(
        self, target: Target, why: str, *, ticket: int, grid: OccupancyGrid
    ) -> TripState:
        """Take a refusal for one of the place, unless another client drives the robot now."""
        self.end = TripEnd(cause=Cause(code=CauseCode.REFUSED, quote=why))
        if self._is_not_ours(ticket):
            self.n_ended += self._leave() is not None
            return TripState.INTERRUPTED
        self._remember_blocked(target, self.end, target.pose, grid)
        return TripState.BLOCKED

    def _remember_blocked(
        self, target: Target, end: TripEnd, stuck: Pose, grid: OccupancyGrid
    ) -> None:
        self.blocked.remember(target.id, target.pose, stuck=stuck.point, end=end, grid=grid)

    def _is_not_ours(self, ticket: int) -> bool:
        """Return True when the robot was stopped meanwhile, or follows a drive of another."""
        drives = self._site.drives
        with drives.preparing() as now:
            was_stopped = now != ticket
        goal_id = None if self.current is None else self.current.goal_id
        under_way = drives.under_way
        return was_stopped or (under_way is not None and under_way.goal_id != goal_id)


async def _tell_nobody(_report: DriveReport) -> None:
    """Take what is told again at the end of each short wait."""
