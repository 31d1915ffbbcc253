"""The exploration loop: look at the map, choose a frontier, drive, and think again on the way."""

import math
from collections.abc import Awaitable, Callable, Sequence
from functools import partial

from mapspeak.driving.drive import OnProgress
from mapspeak.driving.exploration.blocked import BlockedPlace, has_room_at
from mapspeak.driving.exploration.camera import (
    PictureContext,
    find_camera_target,
    is_shown,
    is_view_due,
    measure_pictured_on,
    turn_for_picture,
)
from mapspeak.driving.exploration.progress import (
    BoundKind,
    Bounds,
    ExplorationState,
    Progress,
    find_not_worth,
    find_unreachable,
    is_unknown_beside,
    judge_end,
)
from mapspeak.driving.exploration.trips import (
    SLACK_S,
    Target,
    Trips,
    TripState,
)
from mapspeak.geometry import Point
from mapspeak.spatial.frontiers import Frontier, remaining_ratio
from mapspeak.worldmodel.model import WorldModel

SEEN_RATIO = 0.3
"""Less than this of what a frontier promised is left: it has been seen from afar.

That, and the frontier's own end, make the robot turn on the way, and nothing else: two frontiers
that are equally good would else take it back and forth between them.
"""
PAUSE_M = 3.0
"""As the crow flies from the last pause; nearer to it there is not much else to be looked at."""

Look = Callable[[], Awaitable[object]]
Pick = Callable[[Sequence[Frontier], WorldModel], Frontier]
"""Chooses one of several frontiers, which come best first."""


def take_first(frontiers: Sequence[Frontier], _world: WorldModel) -> Frontier:
    """Take the best one."""
    return frontiers[0]


class Explorer:
    """One robot's exploration; it advances only while a call waits.

    Args:
        pick: Chooses among frontiers; the first of the ranking unless told otherwise.
        look: Takes a picture, for explorations that the camera is to see all of.
    """

    def __init__(
        self, site: PictureContext, *, pick: Pick = take_first, look: Look | None = None
    ) -> None:
        self._site = site
        self._look = look
        self._pick = pick
        self._trips = Trips(site)
        self._state = ExplorationState.NOTHING_KNOWN
        self._bounds = Bounds()
        self._paused_at: Point | None = None
        self._elapsed_s = 0.0

    @property
    def is_going_on(self) -> bool:
        """True when the next call goes on with what an earlier one began."""
        return not self._state.is_end

    async def advance(
        self, bounds: Bounds | None, *, wait_s: float, on_trip: OnProgress
    ) -> Progress:
        """Explore until it ends, pauses, or `wait_s` of robot time have passed; begin if needed.

        Cancelling the call cancels the drive and stops the robot.

        Args:
            bounds: Where to end; None for those of the exploration that is going on.
            wait_s: Robot time after which to answer, with the robot still under way.

        Raises:
            PolicyError: The robot must not drive now, to any goal; it is stopped.
        """
        async with self._trips.one_call():
            if not self.is_going_on:
                self._trips.begin_count()
                self._paused_at, self._elapsed_s, self._bounds = None, 0.0, Bounds()
            self._bounds = bounds or self._bounds
            return await self._advance(wait_s, on_trip)

    async def _advance(self, wait_s: float, on_trip: OnProgress) -> Progress:
        begun_s, before_s = self._site.robot.now_s, self._elapsed_s
        while True:
            with self._site.drives.preparing() as ticket:
                world = await self._site.fetch_world_model()
                await self._look_on_the_way(world)
                bound = await self._site.compute(partial(self._bound_reached, world))
                if bound is not None:
                    await self._trips.give_up(is_seen=bound is not BoundKind.DURATION)
                    return await self._end(world, ExplorationState.BOUND_REACHED, bound=bound)
                seen_id = await self._site.compute(partial(self._find_seen_from_here, world))
                if seen_id is not None:
                    await self._trips.give_up(is_seen=True)
                    await turn_for_picture(self._site, on_progress=on_trip)
                    world = await self._site.fetch_world_model()
                    return await self._end(world, ExplorationState.AT_GOAL, seen_id=seen_id)
                state = await self._choose(world, ticket)
            if state is None:
                judge = partial(judge_end, world, self._blocked(world))
                return await self._end(world, await self._site.compute(judge))
            if state is TripState.UNDER_WAY:
                state = await self._trips.follow(
                    until_s=begun_s + wait_s, grid=world.grid, on_trip=on_trip
                )
            if state is TripState.ARRIVED:
                await self._take_picture()
            spent_s = self._site.robot.now_s - begun_s
            self._elapsed_s = before_s + spent_s
            # A simulation that is begun anew sets its clock back.
            ended = self._after(state, is_late=not 0.0 <= spent_s < wait_s - SLACK_S)
            if ended is ExplorationState.AT_GOAL:
                await turn_for_picture(self._site, on_progress=on_trip)
            if ended is not None:
                return await self._end(await self._site.fetch_world_model(), ended)

    async def _look_on_the_way(self, world: WorldModel) -> None:
        if is_view_due(world.robot, self._site.pictures.views):
            await self._take_picture()

    async def _take_picture(self) -> None:
        if self._bounds.for_camera and self._look is not None:
            await self._look()

    def _after(self, state: TripState, *, is_late: bool) -> ExplorationState | None:
        """Return how the call ends after a step of a trip; None where it goes on."""
        if state is TripState.INTERRUPTED:
            return ExplorationState.INTERRUPTED
        if state is TripState.ARRIVED and self._bounds.stops_at_goals:
            return ExplorationState.AT_GOAL
        return ExplorationState.DRIVING if is_late else None

    def _find_seen_from_here(self, world: WorldModel) -> str | None:
        """Return the id of a target seen from afar, where a pause is due for it."""
        trip = self._trips.current
        if not self._bounds.stops_at_goals or trip is None:
            return None
        is_near = (
            self._paused_at is not None and world.robot.point.distance_to(self._paused_at) < PAUSE_M
        )
        if is_near or not self._must_turn(world, trip.target):
            return None
        return trip.target.id

    async def _choose(self, world: WorldModel, ticket: int) -> TripState | None:
        """Set out to the next target if there is no trip, or its target has been seen from afar.

        Return None when no target is left.
        """
        trip = self._trips.current
        if trip is not None:
            must_turn = partial(self._must_turn, world, trip.target)
            if not await self._site.compute(must_turn):
                return TripState.UNDER_WAY
        target = await self._site.compute(lambda: self._find_target(world))
        if target is None:
            await self._trips.give_up(is_seen=True)
            return None
        if trip is not None and trip.target.pose == target.pose:
            return TripState.UNDER_WAY
        return await self._trips.set_out(target, ticket=ticket, grid=world.grid)

    def _find_target(self, world: WorldModel) -> Target | None:
        """Return the next frontier; where none is left, a place that was blocked before."""

        def is_closed(point: Point) -> bool:
            return self._trips.blocked.is_closed(point, world.grid)

        frontiers = [each for each in world.frontiers.frontiers if not is_closed(each.pose.point)]
        if self._bounds.for_camera:
            views = self._site.pictures.views
            target = find_camera_target(world, views, frontiers, is_closed=is_closed)
            if target is not None:
                return target
        if frontiers:
            frontier = self._pick(frontiers, world)
            return Target(id=frontier.id, pose=frontier.pose, frontier=frontier)
        retry = self._trips.blocked.worth_another_try(world.grid)
        nearest = min(retry, key=lambda each: _path_m(world, each), default=None)
        if nearest is None or not math.isfinite(_path_m(world, nearest)):
            return None
        return Target(id=nearest.id, pose=nearest.pose, earlier=nearest)

    def _blocked(self, world: WorldModel) -> tuple[BlockedPlace, ...]:
        """Return the blocked places at which something unknown is left."""
        blocked = self._trips.blocked
        return tuple(each for each in blocked if is_unknown_beside(world, each.pose.point))

    def _must_turn(self, world: WorldModel, target: Target) -> bool:
        """Return True when a target has been seen from afar, is gone, or is no place to stand.

        The last goal of an exploration is driven to its end.
        """
        is_last = self._bounds.n_goals is not None and self._trips.n_begun >= self._bounds.n_goals
        frontier = target.frontier
        if frontier is None:
            return not is_last and self._is_shown(world, target)
        if not has_room_at(world.grid, target.pose.point, radius_m=world.radius_m):
            return True
        is_gone = world.frontiers.find(target.id) is None
        return not is_last and (is_gone or remaining_ratio(world.grid, frontier) < SEEN_RATIO)

    def _is_shown(self, world: WorldModel, target: Target) -> bool:
        """Return True when pictures on the way have shown what a stop was for."""
        if not self._bounds.for_camera or target.earlier is not None:
            return False
        views, frontiers = self._site.pictures.views, world.frontiers.frontiers
        return is_shown(world, views, frontiers, target.pose.point)

    def _bound_reached(self, world: WorldModel) -> BoundKind | None:
        """Return which bound ends the exploration; None where it goes on."""
        bounds = self._bounds
        if bounds.duration_s is not None and self._elapsed_s >= bounds.duration_s - SLACK_S:
            return BoundKind.DURATION
        trip = self._trips.current
        if trip is not None and not self._must_turn(world, trip.target):
            return None
        if bounds.n_goals is not None and self._trips.n_begun >= bounds.n_goals:
            return BoundKind.GOALS
        if bounds.known_ratio is not None and world.frontiers.known_ratio >= bounds.known_ratio:
            return BoundKind.KNOWN
        return None

    async def _end(
        self,
        world: WorldModel,
        state: ExplorationState,
        *,
        bound: BoundKind | None = None,
        seen_id: str | None = None,
    ) -> Progress:
        self._state = state
        if state is ExplorationState.AT_GOAL:
            self._paused_at = world.robot.point
        return await self._site.compute(lambda: self._report(world, bound, seen_id))

    def _report(self, world: WorldModel, bound: BoundKind | None, seen_id: str | None) -> Progress:
        blocked = self._blocked(world)
        others = self._trips.blocked if self._trips.n_blocked else ()
        return Progress(
            state=self._state,
            bounds=self._bounds,
            bound=bound,
            seen_id=seen_id,
            trip_end=self._trips.end,
            n_goals=self._trips.n_begun,
            n_arrived=self._trips.n_arrived,
            n_seen=self._trips.n_seen,
            n_blocked=self._trips.n_blocked,
            n_ended=self._trips.n_ended,
            driven_m=self._trips.driven_m,
            elapsed_s=self._elapsed_s,
            known_area_m2=world.frontiers.floor_m2,
            known_ratio=world.frontiers.known_ratio,
            frontiers=world.frontiers.frontiers,
            trip=self._trips.current,
            pose=world.robot,
            pose_doubt=world.pose_doubt,
            unreachable=find_unreachable(world),
            blocked=blocked,
            passed_over=tuple(each for each in others if each not in blocked),
            not_worth=find_not_worth(world),
            closed=tuple(world.map.areas),
            pictured_ratio=self._measure_pictured(world),
        )

    def _measure_pictured(self, world: WorldModel) -> float | None:
        views = self._site.pictures.views
        return measure_pictured_on(world, views) if self._bounds.for_camera else None


def _path_m(world: WorldModel, place: BlockedPlace) -> float:
    path_m = world.path_m(place.pose.point)
    return math.inf if path_m is None else path_m
