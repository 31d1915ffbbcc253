"""The search loop: go where the thing may be seen, look, take in what the model thinks, go on."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mapspeak.driving.drive import OnProgress
from mapspeak.driving.exploration.blocked import has_room_at
from mapspeak.driving.exploration.trips import SLACK_S, Target, TripContext, Trips, TripState
from mapspeak.driving.search.candidates import (
    CandidateKind,
    SearchCandidate,
    find_candidates,
    unseen_area_m2,
)
from mapspeak.driving.search.evidence import (
    Earlier,
    Look,
    Opinions,
    find_context_score,
    read_earlier,
    speaks_of,
)
from mapspeak.driving.search.progress import (
    Budget,
    BudgetKind,
    SearchProgress,
    SearchState,
    find_seen_regions,
)
from mapspeak.driving.search.seenfloor import REACH_M, SeenFloor
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import TakenPicture, name_key
from mapspeak.robot import CameraPicture, Detection
from mapspeak.spatial.frontiers import remaining_ratio
from mapspeak.worldmodel.model import WorldModel

LEFT_RATIO = 0.3
"""Less than this of what a place had to show is left: it was seen on the way."""
BETTER_RATIO = 1.5
"""When the model changes its mind, the robot turns only for a target this much better."""
HERE_M = 0.15
HERE_RAD = math.radians(8)
SAME_M = 1.0
"""A place to look from that has moved no farther is the same."""
APART_M = 2.0
MOST_NEXT = 6
UNKNOWN_RANGE_M = 3.0
DISMISSED_M = 1.5
"""Detections this near to a false one are taken for the same false one."""

Choose = Callable[[Sequence[SearchCandidate]], SearchCandidate | None]
"""Choose one of several viewpoints, sorted best first; return None to take none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What the model says between two steps.

    Attributes:
        is_seen: The thing is in the last picture; None where it does not say.
        likely: How likely the thing is near what the last picture shows, from 0 to 1.
    """

    is_seen: bool | None = None
    likely: float | None = None
    scores: Mapping[str, float] = field(default_factory=dict)


def take_best(candidates: Sequence[SearchCandidate]) -> SearchCandidate:
    """Take the first one."""
    return candidates[0]


class Searcher:
    """One search after the other; each advances only while a call waits.

    Args:
        choose: Chooses where to look next; the best unless told otherwise.
    """

    def __init__(self, site: TripContext, *, choose: Choose = take_best) -> None:
        self._site = site
        self._choose = choose
        self._trips = Trips(site)
        self._judged: dict[str, list[Look]] = {}
        self._begin("", Earlier())
        self._state = SearchState.NOT_FOUND

    def _begin(self, thing: str, earlier: Earlier) -> None:
        self._thing = thing
        self._earlier = earlier
        self._seen = SeenFloor(earlier=earlier.looks)
        self._is_begun_now = True
        self._looks_anew = False
        self._label: str | None = None
        self._budget = Budget()
        self._shown: Look | None = None
        self._opinions = Opinions()
        self._visited: set[str] = set()
        self._looked: Point | None = None
        self._here: SearchCandidate | None = None
        self._next: tuple[SearchCandidate, ...] = ()
        self._n_looks = 0
        self._state = SearchState.DRIVING
        self._has_new_opinion = False
        self._reported: Point | None = None
        self._dismissed: list[Point] = []
        self._trips.begin_count()

    def note_picture(self, picture: CameraPicture) -> None:
        """Take in that the caller was shown a picture."""
        self._n_looks += 1
        self._seen.add_look(picture.pose, picture.horizontal_fov_rad)
        self._shown = picture.pose, picture.horizontal_fov_rad
        self._looked = picture.pose.transform(Point(REACH_M / 2, 0.0))

    async def advance(
        self,
        thing: str,
        judgement: Judgement,
        budget: Budget,
        *,
        wait_s: float,
        on_trip: OnProgress,
        earlier: Sequence[TakenPicture] = (),
    ) -> SearchProgress:
        """Search until there is something to look at, it ends, or `wait_s` has passed.

        Cancelling the call cancels the drive and stops the robot.

        Args:
            thing: What to look for; another one than before begins a new search.
            wait_s: Robot time after which to answer, with the robot still under way.
            earlier: The pictures so far, the oldest first; a new search begins from them.

        Raises:
            PolicyError: The robot must not drive now, to any goal; it is stopped.
        """
        key = name_key(thing)
        async with self._trips.one_call():
            if self._state.is_end or key != name_key(self._thing):
                await self._trips.give_up()
                seen_before = self._judged.get(key, ())
                self._begin(thing, read_earlier(earlier, thing, judged=seen_before))
            self._take_in(judgement)
            return await self._advance(judgement, budget, wait_s, on_trip)

    def _take_in(self, judgement: Judgement) -> None:
        if judgement.is_seen is False and self._reported is not None:
            self._dismissed.append(self._reported)
        if judgement.is_seen is False and self._shown is not None:
            self._judged.setdefault(name_key(self._thing), []).append(self._shown)
        self._reported = self._shown = None
        self._opinions.add_scores(judgement.scores)
        if judgement.likely is not None and self._looked is not None:
            self._opinions.add_view(self._looked, judgement.likely)
        self._has_new_opinion = bool(judgement.scores) or judgement.likely is not None

    async def _advance(
        self, judgement: Judgement, budget: Budget, wait_s: float, on_trip: OnProgress
    ) -> SearchProgress:
        self._budget, self._label = budget, None
        if judgement.is_seen:
            await self._trips.give_up()
            return await self._end(SearchState.FOUND)
        deadline_s = self._site.robot.now_s + wait_s
        ended = None
        while ended is None:
            ended = await self._step(deadline_s, on_trip)
            # A simulation that is begun anew sets its clock back.
            if ended is None and not -wait_s <= self._site.robot.now_s - deadline_s < -SLACK_S:
                ended = SearchState.DRIVING
        return await self._end(ended)

    async def _step(self, deadline_s: float, on_trip: OnProgress) -> SearchState | None:
        """Drive on for a moment; return how the call ends, None where it goes on."""
        with self._site.drives.preparing() as ticket:
            world = await self._site.fetch_world_model()
            if self._find_spent() is not None:
                await self._trips.give_up()
                return SearchState.BUDGET_SPENT
            state = await self._set_out(world, ticket)
        if state is TripState.UNDER_WAY:
            state = await self._trips.follow(until_s=deadline_s, grid=world.grid, on_trip=on_trip)
        match state:
            case None:
                return SearchState.NOT_FOUND
            case TripState.INTERRUPTED:
                return SearchState.INTERRUPTED
            case TripState.ARRIVED if (here := self._here) is not None and here.name:
                self._visited.add(here.name)
        self._label = await self._find_report()
        if self._label is None:
            return SearchState.LOOK if state is TripState.ARRIVED else None
        await self._trips.give_up()
        return SearchState.REPORTED

    async def _set_out(self, world: WorldModel, ticket: int) -> TripState | None:
        """Set out to the next place where there is no trip, or it has become pointless."""
        trip, here = self._trips.current, self._here
        if (
            trip is not None
            and here is not None
            and not self._has_new_opinion
            and not await self._is_pointless(world, here)
        ):
            return TripState.UNDER_WAY
        candidates = await self._site.compute(lambda: self._find_candidates(world))
        if not candidates and self._seen.n_earlier:
            self._seen.forget_earlier()
            candidates = await self._site.compute(lambda: self._find_candidates(world))
            self._looks_anew |= bool(candidates)
        was_asked, self._has_new_opinion = self._has_new_opinion, False
        best = self._choose(candidates) if candidates else None
        if best is None:
            await self._trips.give_up()
            self._here = None
            return None
        is_going = trip is not None and here is not None and was_asked
        if is_going and best.rate < BETTER_RATIO * _rate_now(here, candidates):
            return TripState.UNDER_WAY
        self._here = best
        self._next = _pick_apart(best, candidates)
        if _stands_at(world, best):
            await self._trips.give_up()
            return TripState.ARRIVED
        target = Target(id=best.id, pose=best.pose, frontier=best.frontier)
        return await self._trips.set_out(target, ticket=ticket, grid=world.grid)

    def _find_candidates(self, world: WorldModel) -> list[SearchCandidate]:
        self._recall_context(world)
        found = find_candidates(
            world,
            self._thing,
            seen=self._seen,
            opinions=self._opinions,
            visited=self._visited,
            pictures=self._earlier.reporting,
        )
        blocked = self._trips.blocked
        return [
            each
            for each in found
            if not blocked.is_closed(each.pose.point, world.grid)
            and (each.kind is CandidateKind.REMEMBERED or not self._seen.has_look_from(each.pose))
        ]

    def _recall_context(self, world: WorldModel) -> None:
        """Take in what remembered places say of where the thing may be; a kitchen has fridges."""
        for place in world.places:
            waypoint = place.waypoint
            named = (*waypoint.safety_landmarks, *waypoint.functional_landmarks)
            words = ", ".join((waypoint.name, *(each.label for each in named)))
            if (score := find_context_score(words, self._thing)) is not None:
                self._opinions.add_context(waypoint.pose.point, score)

    async def _is_pointless(self, world: WorldModel, here: SearchCandidate) -> bool:
        """Return True if the place was seen on the way, or the robot cannot stand there."""
        if not has_room_at(world.grid, here.pose.point, radius_m=world.radius_m):
            return True
        if here.name:
            return False
        left_m2 = await self._site.compute(
            lambda: unseen_area_m2(world, here.pose, seen=self._seen)
        )
        if here.frontier is not None:
            left_ratio = remaining_ratio(world.grid, here.frontier)
            return left_ratio < LEFT_RATIO and left_m2 < LEFT_RATIO * here.area_m2
        return left_m2 < LEFT_RATIO * here.area_m2

    async def _find_report(self) -> str | None:
        """Return what the robot's own detector takes for the thing; None where it sees no such."""
        robot = self._site.robot
        if robot.description.detector is None:
            return None
        detections = await robot.fetch_detections()
        pose = (await robot.fetch_pose()).pose
        self._seen.add(pose, None)
        found = None
        for each in detections:
            place = _place_of(each, pose)
            is_new = all(place.distance_to(other) > DISMISSED_M for other in self._dismissed)
            if speaks_of(each.label, self._thing):
                if is_new and found is None:
                    self._reported, found = place, each.label
            elif (score := find_context_score(each.label, self._thing)) is not None:
                self._has_new_opinion |= self._opinions.add_context(place, score)
        return found

    def _find_spent(self) -> BudgetKind | None:
        budget = self._budget
        if budget.n_looks is not None and self._n_looks >= budget.n_looks:
            return BudgetKind.LOOKS
        if budget.driven_m is not None and self._trips.driven_m >= budget.driven_m:
            return BudgetKind.METRES
        return None

    async def _end(self, state: SearchState) -> SearchProgress:
        self._state = state
        world = await self._site.fetch_world_model()
        return await self._site.compute(lambda: self._report(world))

    def _report(self, world: WorldModel) -> SearchProgress:
        trip = self._trips.current
        seen = self._seen.mask_on(world.grid)
        earlier = self._earlier if self._is_begun_now else None
        looks_anew = self._looks_anew
        self._is_begun_now = self._looks_anew = False
        n_free = max(int(np.count_nonzero(world.grid.free)), 1)
        return SearchProgress(
            state=self._state,
            budget=self._budget,
            spent=self._find_spent(),
            label=self._label,
            trip_end=self._trips.end,
            earlier=earlier,
            looks_anew=looks_anew,
            thing=self._thing,
            n_looks=self._n_looks,
            n_earlier=self._seen.n_earlier,
            driven_m=self._trips.driven_m,
            here=None if self._here is None else _from_here(world, self._here),
            goal_id=None if trip is None else trip.goal_id,
            next=tuple(_from_here(world, each) for each in self._next),
            regions=find_seen_regions(world, seen) if self._state.is_end else (),
            seen_ratio=int(np.count_nonzero(seen)) / n_free,
            blocked=tuple(self._trips.blocked),
            pose=world.robot,
            pose_doubt=world.pose_doubt,
        )


def _from_here(world: WorldModel, candidate: SearchCandidate) -> SearchCandidate:
    """Return a place with the way to it from where the robot is now, if there is one."""
    path_m = world.path_m(candidate.pose.point)
    return candidate if path_m is None else replace(candidate, path_m=path_m)


def _pick_apart(
    best: SearchCandidate, others: Sequence[SearchCandidate]
) -> tuple[SearchCandidate, ...]:
    """Return the best of some places that are not much the same as one before."""
    picked = [best]
    for each in others:
        away_m = (each.pose.point.distance_to(other.pose.point) for other in picked)
        if min(away_m) >= APART_M and len(picked) <= MOST_NEXT:
            picked.append(each)
    return tuple(picked[1:])


def _rate_now(here: SearchCandidate | None, candidates: Sequence[SearchCandidate]) -> float:
    """Return what speaks for the place under way, as things stand now."""
    if here is None or here.name:
        return math.inf
    same = (
        each.rate
        for each in candidates
        if each.pose.point.distance_to(here.pose.point) <= SAME_M and each.kind is here.kind
    )
    return max(same, default=0.0)


def _place_of(detection: Detection, pose: Pose) -> Point:
    range_m = UNKNOWN_RANGE_M if detection.range_m is None else detection.range_m
    along = Pose(pose.x, pose.y, pose.yaw_rad + detection.bearing_rad)
    return along.transform(Point(range_m, 0.0))


def _stands_at(world: WorldModel, candidate: SearchCandidate) -> bool:
    turn_rad = abs(wrap_angle(candidate.pose.yaw_rad - world.robot.yaw_rad))
    is_near = world.robot.point.distance_to(candidate.pose.point) <= HERE_M
    return is_near and turn_rad <= HERE_RAD
