"""Trips: drives to one target after the other that may be given up on the way for a better one.

A trip advances only while somebody waits for it. Its drive stands in the drive book like any
other, so that a stop, a cancelled goal or a newer goal ends it.
"""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import StrEnum

import anyio

from mapspeak.errors import GoalError
from mapspeak.geometry import Pose
from mapspeak.navigation.drive import DriveReport
from mapspeak.navigation.exploration.blocked import BlockedPlaces
from mapspeak.navigation.exploration.site import Site
from mapspeak.robot import GoalState
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import Frontier

__all__ = ["OnTrip", "Target", "Trip", "TripState", "Trips"]

OnTrip = Callable[[DriveReport], Awaitable[None]]

JUMP_M = 3.0
"""A pose that is this far from the last one was corrected, not driven."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where to go next, and why.

    Attributes:
        id: F3, W2, or the words for a place that has no id.
        pose: Where to stand.
        reason: Why there, in words.
        frontier: The frontier to look over; None where it is none.
    """

    id: str
    pose: Pose
    reason: str
    frontier: Frontier | None = None


@dataclass(frozen=True, slots=True)
class Trip:
    """A target that the robot is on its way to.

    Attributes:
        target: Where to.
        goal_id: Its drive in the drive book.
    """

    target: Target
    goal_id: str


class TripState(StrEnum):
    """How a trip stands."""

    UNDER_WAY = "under_way"
    ARRIVED = "arrived"
    BLOCKED = "blocked"
    INTERRUPTED = "interrupted"


class Trips:
    """The trip under way, the metres driven so far, and the places that were blocked.

    Attributes:
        current: The trip under way; None between two.
        blocked: Places that could not be reached.
        n_begun: How many trips there were.
        driven_m: How far the robot has come on them, by its own poses.
        why_ended: Why the latest trip ended as it did; empty when it arrived.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self.current: Trip | None = None
        self.blocked = BlockedPlaces()
        self.n_begun = 0
        self.driven_m = 0.0
        self.why_ended = ""
        self._last_pose: Pose | None = None

    def begin_count(self) -> None:
        """Counts trips and metres from zero again; what was blocked stays remembered."""
        self.n_begun = 0
        self.driven_m = 0.0
        self._last_pose = None

    def note_pose(self, pose: Pose) -> None:
        """Adds the way from the last pose to this one."""
        if self._last_pose is not None:
            step_m = self._last_pose.point.distance_to(pose.point)
            self.driven_m += step_m if step_m < JUMP_M else 0.0
        self._last_pose = pose

    async def set_out(
        self, target: Target, *, ticket: int, client: str, grid: OccupancyGrid
    ) -> TripState:
        """Sends the robot to a target; one it was on the way to is given up.

        Args:
            target: Where to.
            ticket: Of the drive book, from before the target was chosen.
            client: Who asks for it.
            grid: The map by which it was chosen.

        Raises:
            PolicyError: The robot must not drive now, wherever to.
        """
        try:
            drive = await self._site.drives.start(
                target.pose, place=target.id, ticket=ticket, client=client
            )
        except GoalError as error:
            return self._take_in_refusal(target, error.message, ticket=ticket, grid=grid)
        self.current = Trip(target, drive.goal_id)
        self.n_begun += 1
        return TripState.UNDER_WAY

    async def follow(self, *, wait_s: float, grid: OccupancyGrid, on_trip: OnTrip) -> TripState:
        """Waits for the trip under way, so much robot time at most, and says how it stands.

        Args:
            wait_s: At most, in robot time.
            grid: The map of that moment; a place that proves blocked is remembered with it.
            on_trip: Told about the drive.
        """
        trip = self.current
        if trip is None:
            return TripState.INTERRUPTED
        report = await self._site.drives.wait(trip.goal_id, wait_s=wait_s, on_progress=_tell_nobody)
        self.note_pose(report.pose)
        await on_trip(report)
        return self._take_in(trip, report, grid)

    async def give_up(self) -> None:
        """Brings the robot to a stand, where it is on a trip."""
        trip, self.current = self.current, None
        if trip is not None:
            with anyio.CancelScope(shield=True):
                report = await self._site.drives.cancel(trip.goal_id)
                self.note_pose(report.pose)

    def _take_in(self, trip: Trip, report: DriveReport, grid: OccupancyGrid) -> TripState:
        status = report.status
        if not status.state.is_final:
            return TripState.UNDER_WAY
        self.current = None
        self.why_ended = status.reason
        if status.state is GoalState.ARRIVED:
            self.blocked.forget(trip.target.pose.point)
            return TripState.ARRIVED
        if status.state in (GoalState.CANCELLED, GoalState.PREEMPTED):
            self.why_ended = status.reason or f"{trip.goal_id} was {status.state}."
            return TripState.INTERRUPTED
        self.why_ended = status.reason or f"The drive ended as {status.state}."
        self._remember_blocked(trip.target, report.pose, grid)
        return TripState.BLOCKED

    def _take_in_refusal(
        self, target: Target, why: str, *, ticket: int, grid: OccupancyGrid
    ) -> TripState:
        """Takes a refusal for one of the place, unless the robot belongs to somebody else now."""
        self.why_ended = why
        if self._is_not_ours(ticket):
            self.current = None
            return TripState.INTERRUPTED
        self._remember_blocked(target, target.pose, grid)
        return TripState.BLOCKED

    def _remember_blocked(self, target: Target, stuck: Pose, grid: OccupancyGrid) -> None:
        self.blocked.remember(
            target.id, target.pose, stuck=stuck.point, reason=self.why_ended, grid=grid
        )

    def _is_not_ours(self, ticket: int) -> bool:
        """True when the robot was stopped meanwhile, or is on a drive that somebody else wants."""
        drives = self._site.drives
        with drives.preparing() as now:
            was_stopped = now != ticket
        goal_id = None if self.current is None else self.current.goal_id
        under_way = drives.under_way
        return was_stopped or (under_way is not None and under_way.goal_id != goal_id)


async def _tell_nobody(_report: DriveReport) -> None:
    """Takes what is told again at the end of each short wait."""
