"""Places joined into rooms: what is measured of borders, and who judges them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.spatial.grid import FloatArray, OccupancyGrid
from mapspeak.spatial.rooms import find_rooms
from mapspeak.spatial.rooms.basins import Basins, find_passes
from mapspeak.spatial.rooms.borders import MEASURES, PlaceGraph
from mapspeak.spatial.rooms.floor import Floor, build_floor
from mapspeak.spatial.rooms.joining import (
    join_places,
    join_surest,
    load_judge,
    number_by_area,
    read_trees,
)
from mapspeak.spatial.rooms.raster import Raster, build_raster
from mapspeak.spatial.rooms.segmentation import find_borders

CELL_M = 0.2

THREE_ROOMS = """
    ##############################################
    #..............#..............#..............#
    #..............#..............#..............#
    #..............#..............#..............#
    #..............#..............#..............#
    #.............................#..............#
    #............................................#
    #............................................#
    #............................................#
    #............................................#
    #............................................#
    #..............#.............................#
    #..............#..............#..............#
    #..............#..............#..............#
    #..............#..............#..............#
    #..............#..............#..............#
    ##############################################
"""


@pytest.fixture
def raster() -> Raster:
    return build_raster(grid_from_text(THREE_ROOMS, resolution_m=CELL_M))


@pytest.fixture
def floor(raster: Raster) -> Floor:
    return build_floor(raster)


@pytest.fixture
def basins(raster: Raster, floor: Floor) -> Basins:
    return find_borders(raster, floor, [], np.zeros_like(floor.floor))[0]


def _graph(basins: Basins, floor: Floor, raster: Raster) -> PlaceGraph:
    return PlaceGraph(basins, find_passes(basins, floor, raster.cell_size_m), raster)


def _join_nothing(measures: FloatArray) -> FloatArray:
    return np.zeros(len(measures))


def _join_all(measures: FloatArray) -> FloatArray:
    return np.ones(len(measures))


def test_a_join_measures_as_if_the_two_places_had_been_one(
    basins: Basins, floor: Floor, raster: Raster
) -> None:
    graph = _graph(basins, floor, raster)
    first, second = next((one, min(own)) for one, own in enumerate(graph.neighbours) if own)
    graph.join(first, second)
    labels = np.where(basins.labels == second, first, basins.labels).astype(np.int32)
    as_one = _graph(replace(basins, labels=labels), floor, raster)
    pairs = np.array([(one, other) for one, own in enumerate(graph.neighbours) for other in own])

    assert len(pairs) > 0
    assert graph.measure(pairs) == pytest.approx(as_one.measure(pairs))


def test_a_border_is_measured_alike_from_both_sides(
    basins: Basins, floor: Floor, raster: Raster
) -> None:
    graph = _graph(basins, floor, raster)
    pairs = np.array([(one, other) for one, own in enumerate(graph.neighbours) for other in own])
    is_even = graph.measure(pairs)[:, MEASURES.index("narrower_to_wider")] == 1

    here, there = graph.measure(pairs[~is_even]), graph.measure(pairs[~is_even, ::-1])

    assert here == pytest.approx(there)


def test_a_judge_that_joins_all_leaves_one_room(
    basins: Basins, floor: Floor, raster: Raster
) -> None:
    graph = _graph(basins, floor, raster)

    join_surest(graph, _join_all)

    assert number_by_area(graph)[1:].tolist() == [1] * int(basins.labels.max())


def test_a_judge_that_joins_nothing_leaves_nothing_too_small_for_a_room(
    basins: Basins, floor: Floor, raster: Raster
) -> None:
    graph = _graph(basins, floor, raster)

    join_places(graph, _join_nothing)
    rooms = number_by_area(graph)[basins.labels]

    areas_m2 = np.bincount(rooms[rooms > 0])[1:] * raster.cell_area_m2
    assert areas_m2.min() >= 1.5
    assert (rooms > 0).sum() == floor.floor.sum()


CORRIDORS = """
    ##########################################
    #........................................#
    #........................................#
    #........................................#
    #........................................#
    #........................................#
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##################......##################
    ##########################################
"""


@pytest.mark.parametrize(("text", "n_rooms"), [(THREE_ROOMS, 1), (CORRIDORS, 3)])
def test_two_strips_are_joined_only_where_that_is_surer(text: str, n_rooms: int) -> None:
    raster = build_raster(grid_from_text(text, resolution_m=2 * CELL_M))
    floor = build_floor(raster)
    graph = PlaceGraph(*find_borders(raster, floor, [], np.zeros_like(floor.floor)), raster)

    join_places(graph, lambda measures: np.full(len(measures), 0.47))

    assert number_by_area(graph).max() == n_rooms


def test_the_shipped_judge_finds_the_doors(basins: Basins, floor: Floor, raster: Raster) -> None:
    graph = _graph(basins, floor, raster)

    join_places(graph, load_judge())

    assert number_by_area(graph).max() == 3


def test_trees_add_the_value_of_the_leaf_that_a_border_comes_to() -> None:
    width, area = MEASURES.index("half_width_m"), MEASURES.index("smaller_log_area")
    text = json.dumps(
        {
            "trees": [
                [["half_width_m", 0.5, 1, 2], -1.0, ["smaller_log_area", 2.0, 3, 4], 0.5, 2.0],
                [["smaller_log_area", 1.0, 1, 2], 0.25, -0.25],
            ]
        }
    )
    measures = np.zeros((3, len(MEASURES)))
    measures[:, width] = 0.5, 0.6, 0.6
    measures[:, area] = 0.0, 2.0, 3.0

    said = read_trees(text)(measures)

    assert np.log(said / (1 - said)) == pytest.approx([-0.75, 0.25, 1.75])


TWO_ROOMS = """
    ################################
    #..............#...............#
    #..............#...............#
    #..............#...............#
    #..............#...............#
    #..............................#
    #..............................#
    #..............................#
    #..............................#
    #..............#...............#
    #..............#...............#
    #..............#...............#
    #..............#...............#
    ################################
"""


def test_a_region_behind_a_door_in_a_wall_is_sure() -> None:
    rooms = find_rooms(grid_from_text(TWO_ROOMS, resolution_m=CELL_M))

    assert len(rooms.regions) == 2
    assert [rooms.find_doubtful_door(region) for region in rooms.regions] == [None, None]


def test_short_walls_beside_a_door_divide_rooms_of_a_house_within_a_hall() -> None:
    cells = grid_from_text(TWO_ROOMS, resolution_m=CELL_M).cells
    wider = np.pad(cells, 30, constant_values=0)

    rooms = find_rooms(OccupancyGrid(cells=wider, resolution_m=CELL_M))

    assert len(rooms.regions) == 3
