"""From rooms on a grid to the area graph: outlines along the edges of cells, and lines of doors.

A vertex is a corner of a cell, as (row, col) counted in whole cells from the grid's origin. Every
border runs with its own label on the left, so outer rings are counter-clockwise and holes are
clockwise (as RFC 7946 wants them). Borders break wherever the label on either side changes, so
outlines of neighbours share all corners along their common border.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from mapspeak.spatial.rooms import Door, RoomMap

Vertex = tuple[int, int]
VertexRing = tuple[Vertex, ...]
"""Without the first vertex repeated."""

VertexPolygon = tuple[VertexRing, list[VertexRing]]
"""An outer ring with its holes."""

VertexLine = tuple[Vertex, Vertex]
Place = tuple[float, float]
"""Row and column of a point, as real numbers on the scale of vertices."""

Labels = NDArray[np.integer[Any]]

_LEFT, _STRAIGHT, _RIGHT = 1, 0, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class BorderRun:
    """A straight piece of border, with its label on the left.

    Attributes:
        other: The label on the right; 0 for none.
        direction: 0 along columns, 1 along rows, 2 and 3 backwards.
    """

    label: int
    other: int
    direction: int
    start: Vertex
    end: Vertex


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
    borders = _find_borders(rooms.labels)
    polygons = _trace_polygons(borders)
    lines = _find_lines(rooms, borders)
    areas = tuple(
        Area(
            region=region,
            text=(texts or {}).get(region.id, ""),
            polygons=tuple(
                Polygon(
                    outer=_ring(rooms.grid, outer),
                    holes=tuple(_ring(rooms.grid, hole) for hole in holes),
                )
                for outer, holes in polygons.get(region.index, ())
            ),
        )
        for region in rooms.regions
    )
    passages = tuple(Passage(door=door, line=lines.get(door.id)) for door in rooms.doors)
    return AreaGraph(name=name, areas=areas, passages=passages)


def _find_lines(rooms: RoomMap, borders: list[BorderRun]) -> dict[str, Line]:
    """Return the line of each door that has one, by its id."""
    index = {region.id: region.index for region in rooms.regions}
    shared: defaultdict[tuple[int, int], list[BorderRun]] = defaultdict(list)
    for border in borders:
        if 0 < border.label < border.other:
            shared[border.label, border.other].append(border)
    doors: defaultdict[tuple[int, int], list[Door]] = defaultdict(list)
    for door in rooms.doors:
        first, second = sorted(index[region_id] for region_id in door.region_ids)
        doors[first, second].append(door)
    found: dict[str, Line] = {}
    for pair, between in doors.items():
        middles = np.array([(door.place.x, door.place.y) for door in between])
        places = [(float(row), float(col)) for row, col in rooms.grid.fractional_cells_at(middles)]
        for door, line in zip(between, _choose_lines(shared[pair], places), strict=True):
            if line is not None:
                one, other = _points(rooms.grid, line)
                found[door.id] = one, other
    return found


def _ring(grid: OccupancyGrid, vertices: VertexRing) -> Ring:
    points = _points(grid, vertices)
    return (*points, points[0])


def _points(grid: OccupancyGrid, vertices: tuple[Vertex, ...]) -> tuple[Point, ...]:
    """Return the positions of cell corners; the grid's own conversion is for cell centres."""
    rows, cols = np.array(vertices).T - 0.5
    return tuple(
        Point(round(x, MICROMETRE_DECIMALS) + 0.0, round(y, MICROMETRE_DECIMALS) + 0.0)
        for x, y in grid.points_at(rows, cols).tolist()
    )


def _choose_lines(borders: list[BorderRun], places: list[Place]) -> list[VertexLine | None]:
    """Return the line of each door between two areas, in the order of the doors.

    Args:
        borders: All common borders of these two areas, from one side.
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
    """Return the connected runs of borders."""
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


def _find_borders(labels: Labels) -> list[BorderRun]:
    """Return all borders of all labels above 0."""
    padded = np.pad(labels, 1)
    here = padded[1:-1, 1:-1]
    return [
        *_pieces(here, padded[:-2, 1:-1], direction=0),
        *_pieces(here, padded[1:-1, 2:], direction=1),
        *_pieces(here, padded[2:, 1:-1], direction=2),
        *_pieces(here, padded[1:-1, :-2], direction=3),
    ]


def _pieces(here: Labels, there: Labels, *, direction: int) -> list[BorderRun]:
    """Return the borders towards one side: runs of cells with the same two labels."""
    rows, cols = np.nonzero((here != there) & (here > 0))
    is_upright = direction in {1, 3}
    order = np.lexsort((rows, cols)) if is_upright else np.arange(rows.size)
    rows, cols = rows[order], cols[order]
    label, other = here[rows, cols], there[rows, cols]
    along, across = (rows, cols) if is_upright else (cols, rows)
    goes_on = (np.diff(along) == 1) & (np.diff(across) == 0)
    goes_on &= (np.diff(label) == 0) & (np.diff(other) == 0)
    first = np.flatnonzero(np.concatenate([[True], ~goes_on])) if rows.size else rows
    last = np.append(first[1:], rows.size) - 1 if rows.size else rows
    start, end = along[first], along[last] + 1
    if direction in {2, 3}:
        start, end = end, start
    line = across[first] + (direction in {1, 2})
    starts, ends = ([at, line] if is_upright else [line, at] for at in (start, end))
    pieces = np.stack([label[first], other[first], *starts, *ends], axis=1).tolist()
    return [
        BorderRun(label=own, other=beside, direction=direction, start=(r0, c0), end=(r1, c1))
        for own, beside, r0, c0, r1, c1 in pieces
    ]


def _trace_polygons(borders: list[BorderRun]) -> dict[int, list[VertexPolygon]]:
    """Return the polygons of every label, the largest first.

    Cells that touch at a corner only are apart: each gets a polygon of its own. No ring visits a
    vertex twice; a hole may touch an outer ring or another hole at single vertices.
    """
    rings: defaultdict[int, list[VertexRing]] = defaultdict(list)
    following = {(border.label, border.start, border.direction): border for border in borders}
    while following:
        first = next(iter(following.values()))
        rings[first.label] += _split(_follow(following, first))
    return {label: _assemble(rings[label]) for label in sorted(rings)}


def _follow(following: dict[tuple[int, Vertex, int], BorderRun], first: BorderRun) -> list[Vertex]:
    """Take one closed line out of the borders.

    The left turn comes first where two cells touch at a corner: it stays with the same cell.
    """
    vertices = []
    border = first
    while True:
        vertices.append(border.start)
        del following[border.label, border.start, border.direction]
        ahead = (
            following.get((border.label, border.end, (border.direction + turn) % 4))
            for turn in (_LEFT, _STRAIGHT, _RIGHT)
        )
        successor = next((each for each in ahead if each is not None), None)
        if successor is None:
            return vertices
        border = successor


def _split(vertices: list[Vertex]) -> list[VertexRing]:
    """Cut a closed line that touches itself into rings that do not."""
    rings: list[VertexRing] = []
    path: list[Vertex] = []
    place: dict[Vertex, int] = {}
    for vertex in [*vertices, vertices[0]]:
        if vertex in place:
            loop = path[place[vertex] :]
            del path[place[vertex] :]
            for each in loop:
                del place[each]
            rings.append(tuple(loop))
        place[vertex] = len(path)
        path.append(vertex)
    return rings


def _assemble(rings: list[VertexRing]) -> list[VertexPolygon]:
    """Assign each hole to the smallest outer ring around it."""
    outers = sorted((ring for ring in rings if _twice_area(ring) > 0), key=_twice_area)
    holes: list[list[VertexRing]] = [[] for _ in outers]
    for ring in rings:
        if _twice_area(ring) > 0:
            continue
        # The centre of the cell to the left of the ring's first piece.
        (row, col), (next_row, next_col) = ring[:2]
        down, right = np.sign(next_row - row), np.sign(next_col - col)
        point = row + 0.5 * (down + right), col + 0.5 * (right - down)
        around = (i for i, outer in enumerate(outers) if len(outers) == 1 or _holds(outer, point))
        holes[next(around)].append(ring)
    return list(zip(outers, holes, strict=True))[::-1]


def _twice_area(ring: VertexRing) -> int:
    """Return twice the area in cells, positive when the ring runs counter-clockwise."""
    ahead = (*ring[1:], ring[0])
    return sum(
        one[1] * other[0] - other[1] * one[0] for one, other in zip(ring, ahead, strict=True)
    )


def _holds(ring: VertexRing, point: tuple[float, float]) -> bool:
    """Return True if a cell's centre lies in a ring, by counting crossings."""
    rows, cols = np.array(ring).T
    next_rows = np.roll(rows, -1)
    crosses = (rows > point[0]) != (next_rows > point[0])
    return bool((crosses & (cols > point[1])).sum() % 2)
