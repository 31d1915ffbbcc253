"""From rooms on a grid to the area graph."""

import math
from collections import Counter, defaultdict
from collections.abc import Mapping
from itertools import combinations

import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial.areagraph.graph import (
    MICROMETRE_DECIMALS,
    Area,
    AreaGraph,
    Line,
    Passage,
    Polygon,
    Ring,
)
from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.outlines import (
    BorderRun,
    Vertex,
    VertexRing,
    find_borders,
    trace_polygons,
)
from mapspeak.spatial.rooms import Door, RoomMap

VertexLine = tuple[Vertex, Vertex]
Place = tuple[float, float]
"""Row and column of a point, as real numbers on the scale of vertices."""


def build_area_graph(
    rooms: RoomMap, *, name: str, texts: Mapping[str, str] | None = None
) -> AreaGraph:
    """Return the regions of a map with their outlines, and its doors with their lines.

    Outlines run exactly along the borders of cells, so areas neither overlap nor leave gaps, and
    the area inside an outline is that of its cells.

    Args:
        texts: What people read about regions, by their ids.

    Raises:
        MapError: A text holds control characters.
    """
    borders = find_borders(rooms.labels)
    polygons = trace_polygons(borders)
    lines = _find_lines(rooms, borders)
    areas = tuple(
        Area(
            region=region,
            text=(texts or {}).get(region.id, ""),
            polygons=tuple(
                Polygon(
                    outer=_ring(rooms.grid, each.outer),
                    holes=tuple(_ring(rooms.grid, hole) for hole in each.holes),
                )
                for each in polygons.get(region.index, ())
            ),
        )
        for region in rooms.regions
    )
    passages = tuple(
        Passage(door=door, line=_line(rooms.grid, lines.get(door.id))) for door in rooms.doors
    )
    return AreaGraph(name=name, areas=areas, passages=passages)


def _find_lines(rooms: RoomMap, borders: list[BorderRun]) -> dict[str, VertexLine | None]:
    """Return the line of each door by its id."""
    index = {region.id: region.index for region in rooms.regions}
    shared: defaultdict[tuple[int, int], list[BorderRun]] = defaultdict(list)
    for border in borders:
        if 0 < border.label < border.other:
            shared[border.label, border.other].append(border)
    doors: defaultdict[tuple[int, int], list[Door]] = defaultdict(list)
    for door in rooms.doors:
        first, second = sorted(index[region_id] for region_id in door.region_ids)
        doors[first, second].append(door)
    found: dict[str, VertexLine | None] = {}
    for pair, between in doors.items():
        middles = np.array([(door.place.x, door.place.y) for door in between])
        places = [(float(row), float(col)) for row, col in rooms.grid.fractional_cells_at(middles)]
        lines = find_lines(shared[pair], places)
        found |= {door.id: line for door, line in zip(between, lines, strict=True)}
    return found


def _ring(grid: OccupancyGrid, vertices: VertexRing) -> Ring:
    points = _points(grid, vertices)
    return (*points, points[0])


def _line(grid: OccupancyGrid, line: VertexLine | None) -> Line | None:
    if line is None:
        return None
    one, other = _points(grid, line)
    return one, other


def _points(grid: OccupancyGrid, vertices: tuple[Vertex, ...]) -> tuple[Point, ...]:
    """Return the places of corners of cells; the grid speaks of cells by their centres."""
    rows, cols = np.array(vertices).T - 0.5
    return tuple(
        Point(round(x, MICROMETRE_DECIMALS) + 0.0, round(y, MICROMETRE_DECIMALS) + 0.0)
        for x, y in grid.points_at(rows, cols).tolist()
    )


def find_lines(borders: list[BorderRun], places: list[Place]) -> list[VertexLine | None]:
    """Return the line of each door between two areas, in the order of the doors.

    Args:
        borders: All that these two areas have in common, from one side.
        places: The middle of each door.
    """
    ends: list[list[Vertex]] = [[] for _ in places]
    for run in _runs(borders):
        nearest = min(range(len(places)), key=lambda i: _distance(run, places[i]))
        # A closed run has no vertex at which it begins or ends.
        touches = Counter(vertex for border in run for vertex in (border.start, border.end))
        ends[nearest] += [vertex for vertex, n in touches.items() if n % 2]
    pairs = (combinations(sorted(set(each)), 2) for each in ends)
    return [max(some, key=lambda pair: math.dist(*pair), default=None) for some in pairs]


def _runs(borders: list[BorderRun]) -> list[list[BorderRun]]:
    """Return the borders that hang together."""
    at: defaultdict[Vertex, list[int]] = defaultdict(list)
    for index, border in enumerate(borders):
        at[border.start].append(index)
        at[border.end].append(index)
    left = dict.fromkeys(range(len(borders)))
    runs = []
    while left:
        open_ends = [next(iter(left))]
        run = []
        while open_ends:
            index = open_ends.pop()
            if index not in left:
                continue
            del left[index]
            border = borders[index]
            run.append(border)
            open_ends += at[border.start] + at[border.end]
        runs.append(run)
    return runs


def _distance(run: list[BorderRun], place: Place) -> float:
    """Return the distance in cells from a point to the nearest border of a run."""
    corners = np.array([(border.start, border.end) for border in run], np.float64)
    nearest = np.clip(np.array(place), corners.min(axis=1), corners.max(axis=1))
    return float(np.hypot(*(nearest - np.array(place)).T).min())
