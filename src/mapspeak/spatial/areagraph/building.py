"""From rooms on a grid to the area graph."""

from collections import defaultdict

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
from mapspeak.spatial.areagraph.lines import VertexLine, find_lines
from mapspeak.spatial.areagraph.outlines import (
    Border,
    Vertex,
    VertexPolygon,
    VertexRing,
    find_borders,
    trace_polygons,
)
from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.rooms import Door, RoomMap


def build_area_graph(rooms: RoomMap, *, name: str) -> AreaGraph:
    """Gives the regions of a map with their outlines, and its doors with their lines.

    Outlines run exactly along the borders of cells, so areas neither overlap nor leave gaps, and
    the area inside an outline is that of its cells.

    Args:
        rooms: A map divided into regions.
        name: What the map is called.

    Raises:
        MapError: The name holds control characters.
    """
    borders = find_borders(rooms.labels)
    polygons = trace_polygons(borders)
    lines = _find_lines(rooms, borders)
    areas = tuple(
        Area(
            region=region,
            polygons=tuple(_polygon(rooms.grid, each) for each in polygons.get(region.index, ())),
        )
        for region in rooms.regions
    )
    passages = tuple(
        Passage(door=door, line=_line(rooms.grid, lines.get(door.id))) for door in rooms.doors
    )
    return AreaGraph(name=name, areas=areas, passages=passages)


def _find_lines(rooms: RoomMap, borders: list[Border]) -> dict[str, VertexLine | None]:
    """Gives the line of each door by its id."""
    index = {region.id: region.index for region in rooms.regions}
    shared: defaultdict[tuple[int, int], list[Border]] = defaultdict(list)
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


def _polygon(grid: OccupancyGrid, polygon: VertexPolygon) -> Polygon:
    return Polygon(
        outer=_ring(grid, polygon.outer), holes=tuple(_ring(grid, hole) for hole in polygon.holes)
    )


def _ring(grid: OccupancyGrid, vertices: VertexRing) -> Ring:
    points = _points(grid, vertices)
    return (*points, points[0])


def _line(grid: OccupancyGrid, line: VertexLine | None) -> Line | None:
    if line is None:
        return None
    one, other = _points(grid, line)
    return one, other


def _points(grid: OccupancyGrid, vertices: tuple[Vertex, ...]) -> tuple[Point, ...]:
    """Gives the places of corners of cells; the grid speaks of cells by their centres."""
    rows, cols = np.array(vertices).T - 0.5
    return tuple(
        Point(round(x, MICROMETRE_DECIMALS) + 0.0, round(y, MICROMETRE_DECIMALS) + 0.0)
        for x, y in grid.points_at(rows, cols).tolist()
    )
