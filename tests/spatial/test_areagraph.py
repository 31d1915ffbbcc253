"""The area graph of drawn regions: what outlines and door lines must be, and that files keep it."""

import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.areagraph import (
    AreaGraph,
    LatLon,
    MapAnchor,
    Polygon,
    Ring,
    build_area_graph,
)
from mapspeak.spatial.areagraph.files import from_json, to_geojson, to_json, to_osm
from mapspeak.spatial.rooms import Door, Region, RoomClass, RoomMap, find_rooms

Labels = NDArray[np.int16]

TWO_ROOMS = """
    ##############
    #......#.....#
    #......#.....#
    #............#
    #............#
    #......#.....#
    #......#.....#
    ##############
"""

label_arrays = arrays(np.int16, (7, 8), elements=st.integers(0, 3))
origins = st.builds(Pose, st.floats(-5e5, 5e5), st.floats(-5e5, 5e5), st.floats(-4.0, 4.0))
anchors = st.builds(
    MapAnchor,
    lat_deg=st.floats(-80.0, 80.0),
    lon_deg=st.floats(-180.0, 180.0),
    yaw_rad=st.floats(-4.0, 4.0),
)
texts = st.text(st.characters(exclude_categories=("Cc", "Cs"), exclude_characters="\ufffe\uffff"))


def region_of(index: int, others: frozenset[int] = frozenset()) -> Region:
    return Region(
        id=f"R{index}",
        index=index,
        room_class=list(RoomClass)[index % 3],
        free_area_m2=1 / 3,
        floor_area_m2=0.1 + 0.2,
        length_m=1e-17 * index,
        width_m=1.0,
        heading_rad=math.pi / 7,
        widest=Point(1 / 3, -1 / 7),
        clearance_m=math.pi,
        door_ids=tuple(f"D{min(index, other)}{max(index, other)}" for other in sorted(others)),
        neighbour_ids=tuple(f"R{other}" for other in sorted(others)),
    )


def rooms_of(labels: Labels, *, origin: Pose | None = None) -> RoomMap:
    """Gives regions as drawn, with a door between each two that touch."""
    grid = OccupancyGrid(
        cells=np.zeros(labels.shape, np.int8), resolution_m=0.05, origin=origin or Pose(0, 0, 0)
    )
    touching: dict[tuple[int, int], Point] = {}
    steps = [(labels[:-1], labels[1:], (1.0, 0.5)), (labels[:, :-1], labels[:, 1:], (0.5, 1.0))]
    for here, there, (down, right) in steps:
        for row, col in np.argwhere((here != there) & (here > 0) & (there > 0)).tolist():
            pair = sorted((int(here[row, col]), int(there[row, col])))
            x, y = grid.points_at(np.array([row + down - 0.5]), np.array([col + right - 0.5]))[0]
            touching.setdefault((pair[0], pair[1]), Point(float(x), float(y)))
    indices = [int(index) for index in np.unique(labels) if index]
    behind = {i: frozenset(sum(pair) - i for pair in touching if i in pair) for i in indices}
    return RoomMap(
        grid=grid,
        labels=labels,
        regions=tuple(region_of(index, behind[index]) for index in indices),
        doors=tuple(
            Door(id=f"D{a}{b}", place=place, width_m=1 / 3, region_ids=(f"R{a}", f"R{b}"))
            for (a, b), place in touching.items()
        ),
    )


def graph_of(text: str) -> AreaGraph:
    """Gives the area graph of regions drawn as digits, in cells of 5 cm; '.' is no region."""
    lines = [line.strip() for line in text.strip().splitlines()]
    rows = [[0 if sign == "." else int(sign) for sign in line] for line in reversed(lines)]
    return build_area_graph(rooms_of(np.array(rows, np.int16)), name="drawn")


def rings_of(graph: AreaGraph) -> set[Ring]:
    polygons = (polygon for area in graph.areas for polygon in area.polygons)
    return {ring for polygon in polygons for ring in polygon.rings}


def rings_in_geojson(text: str, anchor: MapAnchor | None = None) -> set[Ring]:
    """Gives the closed lines of a file in metres of the map."""
    rings = set()
    for feature in json.loads(text)["features"]:
        geometry = feature["geometry"] or {"type": "", "coordinates": []}
        parts = {"Polygon": [geometry["coordinates"]], "MultiPolygon": geometry["coordinates"]}
        for ring in (ring for part in parts.get(geometry["type"], []) for ring in part):
            rings.add(
                tuple(
                    Point(x, y) if anchor is None else anchor.point_at(LatLon(y, x))
                    for x, y in ring
                )
            )
    return rings


def rings_in_osm(text: str, anchor: MapAnchor | None = None) -> set[Ring]:
    """Gives the closed ways of a file in metres of the map."""
    root, anchor = ET.fromstring(text), anchor or MapAnchor()  # noqa: S314 - our own text
    places = {
        node.attrib["id"]: anchor.point_at(
            LatLon(float(node.attrib["lat"]), float(node.attrib["lon"]))
        )
        for node in root.iter("node")
    }
    ways = (tuple(places[nd.attrib["ref"]] for nd in way.iter("nd")) for way in root.iter("way"))
    return {points for points in ways if points[0] == points[-1]}


def in_cells(ring: Ring) -> list[tuple[int, int]]:
    return [(round(point.x / 0.05), round(point.y / 0.05)) for point in ring]


def steps_of(start: tuple[int, int], end: tuple[int, int]) -> list[tuple[int, int]]:
    """Gives the corners of cells along an edge without its end; it must follow rows or columns."""
    (x, y), (next_x, next_y) = start, end
    assert x == next_x or y == next_y
    right, up = int(np.sign(next_x - x)), int(np.sign(next_y - y))
    return [(x + i * right, y + i * up) for i in range(abs(next_x - x) + abs(next_y - y))]


def cells_inside(polygons: tuple[Polygon, ...], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Gives the cells whose centres lie inside an odd number of rings."""
    rows, cols = np.indices(shape) + 0.5
    inside = np.zeros(shape, bool)
    for ring in (ring for polygon in polygons for ring in polygon.rings):
        for (x, y), (next_x, next_y) in pairwise(in_cells(ring)):
            inside ^= ((rows > y) != (rows > next_y)) & (cols < x if x == next_x else False)
    return inside


def test_a_room_is_outlined_along_its_cells_counter_clockwise() -> None:
    (area,) = graph_of("""
        .....
        .111.
        .11..
        .....
    """).areas

    (polygon,) = area.polygons
    assert in_cells(polygon.outer) == [(1, 1), (3, 1), (3, 2), (4, 2), (4, 3), (1, 3), (1, 1)]
    assert polygon.holes == ()
    assert polygon.area_m2 == pytest.approx(5 * 0.05**2)


def test_a_room_around_a_pillar_has_a_hole_that_runs_clockwise() -> None:
    (area,) = graph_of("""
        1111
        1..1
        1111
    """).areas

    (polygon,) = area.polygons
    assert [in_cells(hole) for hole in polygon.holes] == [[(1, 2), (3, 2), (3, 1), (1, 1), (1, 2)]]
    assert polygon.area_m2 == pytest.approx(10 * 0.05**2)


def test_a_room_in_parts_has_a_polygon_for_each_the_largest_first() -> None:
    (area,) = graph_of("""
        11..1
        11...
        ..1..
    """).areas

    assert [round(polygon.area_m2 / 0.05**2) for polygon in area.polygons] == [4, 1, 1]


def test_a_room_inside_another_leaves_a_hole_in_it() -> None:
    outer, inner = graph_of("""
        11111
        1.1.1
        11211
        11111
    """).areas

    assert len(outer.polygons[0].holes) == 3
    assert len(inner.polygons) == 1


def test_a_part_inside_the_hole_of_another_part_keeps_its_own_hole() -> None:
    (area,) = graph_of("""
        1111111
        1.....1
        1.111.1
        1.1.1.1
        1.111.1
        1.....1
        1111111
    """).areas

    assert [len(polygon.holes) for polygon in area.polygons] == [1, 1]
    assert [round(polygon.area_m2 / 0.05**2) for polygon in area.polygons] == [24, 8]


def test_neighbours_share_every_corner_of_their_border() -> None:
    left, right, above = graph_of("""
        3333
        1122
        1122
    """).areas

    shared = {(2, 0), (2, 2)}
    assert set(in_cells(left.polygons[0].outer)) & set(in_cells(right.polygons[0].outer)) == shared
    assert (2, 2) in in_cells(above.polygons[0].outer)


def test_the_line_of_a_door_runs_from_post_to_post() -> None:
    (passage,) = graph_of("""
        111.222
        1111222
        1111222
        111.222
    """).passages

    assert passage.line is not None
    assert in_cells(passage.line) == [(4, 1), (4, 3)]
    assert passage.door.region_ids == ("R1", "R2")


def test_two_doors_between_the_same_rooms_have_a_line_each() -> None:
    rooms = rooms_of(np.array([[1, 1, 2], [1, 0, 2], [1, 0, 2], [1, 1, 2]], np.int16))
    (door,) = rooms.doors
    second = replace(door, id="D9", place=Point(0.1, 0.175))
    regions = tuple(replace(region, door_ids=("D12", "D9")) for region in rooms.regions)
    rooms = replace(rooms, doors=(door, second), regions=regions)

    lines = [passage.line for passage in build_area_graph(rooms, name="").passages]

    assert [in_cells(line) for line in lines if line] == [[(2, 0), (2, 1)], [(2, 3), (2, 4)]]


def test_a_room_all_around_another_has_no_line_to_it() -> None:
    (passage,) = graph_of("""
        111
        121
        111
    """).passages

    assert passage.line is None


def test_a_found_map_has_its_regions_and_doors_as_nodes_and_edges() -> None:
    rooms = find_rooms(grid_from_text(TWO_ROOMS, resolution_m=0.5))

    graph = build_area_graph(rooms, name="two rooms")

    assert [area.region for area in graph.areas] == list(rooms.regions)
    assert [passage.door for passage in graph.passages] == list(rooms.doors)
    first, second = rooms.doors[0].region_ids
    region = next(area.region for area in graph.areas if area.id == first)
    assert [each.id for each in graph.passages_by_area()[first]] == list(region.door_ids)
    assert second in region.neighbour_ids


def test_a_map_without_floor_has_an_empty_graph_that_files_keep() -> None:
    graph = build_area_graph(rooms_of(np.zeros((3, 3), np.int16)), name="")

    assert (graph.areas, graph.passages) == ((), ())
    assert from_json(to_json(graph)) == graph
    assert rings_in_geojson(to_geojson(graph)) == rings_of(graph)
    assert rings_in_osm(to_osm(graph)) == rings_of(graph)


def test_an_area_without_any_cell_is_kept_by_files() -> None:
    full = graph_of("11.22")
    empty = replace(full, areas=tuple(replace(area, polygons=()) for area in full.areas))

    assert from_json(to_json(empty)) == empty
    assert rings_in_geojson(to_geojson(empty)) == rings_in_osm(to_osm(empty)) == set()


@pytest.mark.parametrize("name", ["office\x00", "line\nbreak", "\ud800", "\uffff"])
def test_names_that_files_cannot_carry_are_refused(name: str) -> None:
    with pytest.raises(MapError, match="control characters"):
        build_area_graph(rooms_of(np.ones((2, 2), np.int16)), name=name)


@settings(max_examples=150)
@given(labels=label_arrays)
def test_outlines_hold_exactly_the_cells_of_their_area(labels: Labels) -> None:
    for area in build_area_graph(rooms_of(labels), name="").areas:
        mine = labels == area.region.index
        assert np.array_equal(cells_inside(area.polygons, labels.shape), mine)
        n_parts, _ = cv2.connectedComponents(mine.astype(np.uint8), connectivity=4)
        assert len(area.polygons) == n_parts - 1
        total_m2 = sum(polygon.area_m2 for polygon in area.polygons)
        assert total_m2 == pytest.approx(mine.sum() * 0.05**2)


@settings(max_examples=150)
@given(labels=label_arrays)
def test_no_outline_crosses_or_touches_itself(labels: Labels) -> None:
    for area in build_area_graph(rooms_of(labels), name="").areas:
        for ring in (ring for polygon in area.polygons for ring in polygon.rings):
            visited = [step for edge in pairwise(in_cells(ring)) for step in steps_of(*edge)]
            assert len(set(visited)) == len(visited)


@settings(max_examples=100)
@given(labels=label_arrays, origin=origins, name=texts, text=texts)
def test_nothing_is_lost_on_the_way_through_a_file(
    labels: Labels, origin: Pose, name: str, text: str
) -> None:
    rooms = rooms_of(labels, origin=origin)
    words = {region.id: text for region in rooms.regions}
    graph = build_area_graph(rooms, name=name, texts=words)

    assert from_json(to_json(graph)) == graph
    assert rings_in_geojson(to_geojson(graph)) == rings_of(graph)
    assert rings_in_osm(to_osm(graph)) == rings_of(graph)


@settings(max_examples=100)
@given(labels=label_arrays, origin=origins, anchor=anchors)
def test_nothing_is_lost_on_the_way_through_latitude_and_longitude(
    labels: Labels, origin: Pose, anchor: MapAnchor
) -> None:
    graph = build_area_graph(rooms_of(labels, origin=origin), name="map")

    assert rings_in_geojson(to_geojson(graph, anchor=anchor), anchor) == rings_of(graph)
    assert rings_in_osm(to_osm(graph, anchor=anchor), anchor) == rings_of(graph)


@settings(max_examples=20)
@given(
    doors=st.lists(st.integers(2, 22), min_size=1, max_size=3),
    wall=st.integers(8, 30),
    origin=origins,
)
def test_a_found_building_survives_every_form(doors: list[int], wall: int, origin: Pose) -> None:
    cells = np.zeros((28, 40), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    cells[:, wall] = 100
    for door in doors:
        cells[door : door + 4, wall] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.2, origin=origin)
    graph = build_area_graph(find_rooms(grid), name="building")

    assert from_json(to_json(graph)) == graph
    assert rings_in_geojson(to_geojson(graph)) == rings_of(graph)
    assert rings_in_osm(to_osm(graph)) == rings_of(graph)
