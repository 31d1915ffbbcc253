"""One revision of each map for all who plan on it, with the areas that are closed now."""

from collections.abc import Callable, Iterator, Sequence
from datetime import datetime

import anyio
import anyio.to_thread
import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.navigation.closures import ClosedArea
from mapspeak.navigation.revision import MapRevision
from mapspeak.navigation.safety.policy import AreaRule
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import Region, RoomMap

__all__ = ["Surveyor"]


class Surveyor:
    """Makes the revisions of a robot's map.

    Args:
        rules: Which areas are closed, and when.
        wall_clock: The operator's.
    """

    def __init__(self, rules: Sequence[AreaRule], *, wall_clock: Callable[[], datetime]) -> None:
        self._rules = tuple(rules)
        self._wall_clock = wall_clock
        self._turn = anyio.Lock()
        self._latest: MapRevision | None = None

    @property
    def latest(self) -> MapRevision | None:
        """The revision that was made last; its areas are those that were closed then."""
        return self._latest

    async def survey(self, grid: OccupancyGrid, *, radius_m: float) -> MapRevision:
        """Gives the revision of a map: the same one while map and closed areas are the same."""
        async with self._turn:
            self._latest = await anyio.to_thread.run_sync(self._survey, grid, radius_m)
            return self._latest

    def describe(self, revision: MapRevision) -> tuple[str, ...]:
        """Gives what is closed in words, and rules about regions that are not on the map."""
        unplaced = tuple(
            f"The policy closes {rule.region_id} ({rule.name}), which is not on this map."
            for rule in self._rules
            if rule.region_id and revision.rooms.find_region(rule.region_id) is None
        )
        return (*(_say_closed(area) for area in revision.areas), *unplaced)

    def _survey(self, grid: OccupancyGrid, radius_m: float) -> MapRevision:
        before = self._latest
        is_known = before is not None and before.radius_m == radius_m and before.is_of(grid)
        revision = (
            before
            if before is not None and is_known
            else MapRevision(grid, radius_m=radius_m, previous=before)
        )
        areas = tuple(self._find_closed(revision))
        return revision if areas == revision.areas else revision.with_areas(areas)

    def _find_closed(self, revision: MapRevision) -> Iterator[ClosedArea]:
        now = self._wall_clock()
        for rule in self._rules:
            ends = None if rule.hours is None else rule.hours.end_of(now)
            if rule.hours is not None and ends is None:
                continue
            until = "" if ends is None else f"{ends:%H:%M}"
            for outline in _outlines_of(rule, revision):
                yield ClosedArea(name=rule.name, outline=outline, until=until)


def _say_closed(area: ClosedArea) -> str:
    xs, ys = [corner.x for corner in area.outline], [corner.y for corner in area.outline]
    extent = f"x {min(xs):.1f} to {max(xs):.1f}, y {min(ys):.1f} to {max(ys):.1f}"
    return f"Closed to the robot: {area.title} ({extent})."


def _outlines_of(rule: AreaRule, revision: MapRevision) -> Iterator[tuple[Point, ...]]:
    if rule.outline:
        yield rule.outline
        return
    region = revision.rooms.find_region(rule.region_id)
    if region is not None:
        yield from _outlines_of_region(revision.rooms, region)


def _outlines_of_region(rooms: RoomMap, region: Region) -> Iterator[tuple[Point, ...]]:
    """Gives the outer borders of a region's parts, through the centres of its border cells."""
    inside = (rooms.labels == region.index).astype(np.uint8)
    contours, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    for contour in contours:
        cols, rows = contour[:, 0, 0].astype(np.intp), contour[:, 0, 1].astype(np.intp)
        yield tuple(Point(x, y) for x, y in rooms.grid.points_at(rows, cols).tolist())
