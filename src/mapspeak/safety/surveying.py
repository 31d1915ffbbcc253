"""One revision of each map for all who plan on it, with the areas that are closed now."""

import logging
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime

import anyio
import anyio.to_thread

from mapspeak.memory.events import Effect, Event
from mapspeak.places.recall.notices import (
    close_floor_of,
    find_hindrances,
    say_events,
    say_unplaced,
)
from mapspeak.safety.policy import AreaRule
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.closures import ClosedArea, Outline, mask_areas, outlines_of_region
from mapspeak.worldmodel.revision import MapRevision

logger = logging.getLogger(__name__)


class Surveyor:
    """Makes the revisions of a robot's map.

    Args:
        rules: Which areas are closed, and when.
        wall_clock: The operator's.
        read_events: Gives the events that are remembered. They close what they say, and never
            open what a rule closes.
        leaves_pockets: A robot that a gap too narrow by a cell shuts in gets out of it.
    """

    def __init__(
        self,
        rules: Sequence[AreaRule],
        *,
        wall_clock: Callable[[], datetime],
        read_events: Callable[[], Sequence[Event]] = tuple,
        leaves_pockets: bool = False,
    ) -> None:
        self._rules = tuple(rules)
        self._read_events = read_events
        self._wall_clock = wall_clock
        self._leaves_pockets = leaves_pockets
        self._turn = anyio.Lock()
        self._latest: MapRevision | None = None
        self._warned: set[str] = set()

    @property
    def has_rules(self) -> bool:
        """True when there is anything that may be closed, now or at another hour."""
        has_closure = any(each.effect is Effect.CLOSED for each in self._read_events())
        return bool(self._rules) or has_closure

    @property
    def latest(self) -> MapRevision | None:
        """The revision that was made last; its areas are those that were closed then."""
        return self._latest

    async def survey(self, grid: OccupancyGrid, *, radius_m: float) -> MapRevision:
        """Return the revision of a map: the same one while map and closed areas are the same."""
        async with self._turn:
            self._latest = await anyio.to_thread.run_sync(self._survey, grid, radius_m)
            return self._latest

    def describe(self, revision: MapRevision) -> tuple[str, ...]:
        """Return events in words, and which rules are about regions that are not on the map."""
        events, now = self._read_events(), self._wall_clock()
        return (
            *self._say_off(revision),
            *say_events(events, now),
            *say_unplaced(events, revision, now),
        )

    def _say_off(self, revision: MapRevision) -> Iterator[str]:
        """Tell each rule that closes nothing on a map."""
        for rule in self._rules:
            if rule.region_id and revision.rooms.find_region(rule.region_id) is None:
                yield f"The policy closes {rule.region_id} ({rule.name}), which is not on this map."
        for rule in self._rules:
            if rule.outline and _is_off(rule, revision.grid):
                yield f"The policy's area {rule.name!r} lies off this map: it closes nothing here."

    def _survey(self, grid: OccupancyGrid, radius_m: float) -> MapRevision:
        before = self._latest
        is_known = before is not None and before.radius_m == radius_m and before.is_of(grid)
        revision = (
            before
            if before is not None and is_known
            else MapRevision(
                grid, radius_m=radius_m, previous=before, leaves_pockets=self._leaves_pockets
            )
        )
        if not is_known:
            self._warn(revision)
        events, now = self._read_events(), self._wall_clock()
        areas = (*self._find_closed(revision), *close_floor_of(events, revision, now))
        hindrances = tuple(find_hindrances(events, revision, now))
        if areas == revision.areas and hindrances == revision.hindrances:
            return revision
        return revision.with_areas(areas, hindrances)

    def _warn(self, revision: MapRevision) -> None:
        """Tell the operator at once, and once, which rules close nothing."""
        for each in self._say_off(revision):
            if each not in self._warned:
                self._warned.add(each)
                logger.warning("%s", each)

    def _find_closed(self, revision: MapRevision) -> Iterator[ClosedArea]:
        now = self._wall_clock()
        for rule in self._rules:
            ends = None if rule.hours is None else rule.hours.end_of(now)
            if rule.hours is not None and ends is None:
                continue
            until = "" if ends is None else f"{ends:%H:%M}"
            for outline, *further in _outlines_of(rule, revision):
                yield ClosedArea(
                    name=rule.name,
                    outline=outline,
                    further_outlines=tuple(further),
                    until=until,
                    reason=rule.reason,
                )


def _is_off(rule: AreaRule, grid: OccupancyGrid) -> bool:
    area = ClosedArea(name=rule.name, outline=rule.outline, further_outlines=rule.further_outlines)
    return bool(grid.cells.size) and not mask_areas(grid, [area]).any()


def _outlines_of(rule: AreaRule, revision: MapRevision) -> Iterator[tuple[Outline, ...]]:
    """Return the outlines of each area that a rule closes."""
    if rule.outline:
        yield (rule.outline, *rule.further_outlines)
        return
    region = revision.rooms.find_region(rule.region_id)
    if region is not None:
        yield from ((outline,) for outline in outlines_of_region(revision.rooms, region))
