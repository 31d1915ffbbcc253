"""An office whose two rooms are joined by two corridors, and events that close parts of it."""

import itertools
from datetime import UTC, datetime, timedelta

from drawing import grid_from_text
from guarding import corners
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMap, Waypoint
from mapspeak.memory.events import Effect, Event
from mapspeak.places.recall.events import (
    close_floor_of,
    find_hindrances,
)
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.revision import MapRevision

RADIUS_M = 0.25
NOW = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
LATER = NOW + timedelta(hours=2)
DRAWN = grid_from_text(
    """
    ################################################
    #..............#................#..............#
    #..............#................#..............#
    #..............#................#..............#
    #..............#................#..............#
    #..............###..#########..##..............#
    #..............................................#
    #..............................................#
    #..............................................#
    #..............################.#..............#
    #..............#              #.#..............#
    #..............#              ###..............#
    #..............#                #..............#
    #..............#                #..............#
    #..............##################..............#
    #..............................................#
    #..............................................#
    #..............................................#
    #..............##################..............#
    #..............#                #..............#
    ################                ################
    """,
    resolution_m=0.5,
)
WEST, EAST = Point(4.0, 6.0), Point(20.0, 6.0)
NORTH_WAY = corners((8.5, 5.6), (15.5, 7.4))
"""The shorter of the two corridors between the rooms, by a little."""


def office() -> OccupancyGrid:
    cells = DRAWN.cells.repeat(5, axis=0).repeat(5, axis=1)
    return OccupancyGrid(cells=cells, resolution_m=0.1)


def event(effect: Effect, **more: object) -> Event:
    given = {"text": "painters at work", "place": "C1", "outlines": (NORTH_WAY,), "until": LATER}
    return Event(effect=effect, **{**given, **more})  # type: ignore[arg-type]


def revision_with(*events: Event, now: datetime = NOW) -> MapRevision:
    bare = MapRevision(office(), radius_m=RADIUS_M)
    return bare.with_areas(
        tuple(close_floor_of(events, bare, now)), tuple(find_hindrances(events, bare, now))
    )


def world_on(revision: MapRevision, *places: Waypoint) -> WorldModel:
    robot, memory = Pose(WEST.x, WEST.y), SemanticMap(waypoints=places)
    return WorldModel(revision.grid, robot, memory, radius_m=RADIUS_M, revision=revision)


def goes_north(revision: MapRevision, start: Point = WEST, goal: Point = EAST) -> bool:
    path = revision.find_path(start, goal)
    assert path is not None
    return max(point.y for point in path.points) > 4.0 and any(
        8.5 < point.x < 15.5 and point.y > 4.0 for point in _along(path.points)
    )


def _along(points: tuple[Point, ...]) -> list[Point]:
    return [
        Point(a.x + n / 50 * (b.x - a.x), a.y + n / 50 * (b.y - a.y))
        for a, b in itertools.pairwise(points)
        for n in range(51)
    ]
