import math
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.coverage import measure_coverage, measure_known_area

HALL = """
    ########
    #......#
    #......#
    ########
    """

HALF_OF_IT = """
    ########
    #...????
    #...????
    ########
    """


def test_a_map_covers_itself_whole() -> None:
    coverage = measure_coverage(grid_from_text(HALL), grid_from_text(HALL))
    assert (coverage.paper_ratio, coverage.recall, coverage.precision) == (1.0, 1.0, 1.0)


def test_half_a_map_covers_half() -> None:
    coverage = measure_coverage(grid_from_text(HALF_OF_IT), grid_from_text(HALL))
    assert (coverage.paper_ratio, coverage.recall, coverage.precision) == (0.5, 0.5, 1.0)


def test_free_floor_in_the_wrong_place_counts_for_the_paper_but_not_for_recall() -> None:
    moved = grid_from_text(HALL, origin=Pose(20.0, 0.0))
    coverage = measure_coverage(moved, grid_from_text(HALL))
    assert (coverage.paper_ratio, coverage.recall, coverage.precision) == (1.0, 0.0, 0.0)


def test_the_papers_ratio_can_exceed_one() -> None:
    leaked = grid_from_text("........\n........\n........\n........")
    coverage = measure_coverage(leaked, grid_from_text(HALL))
    assert coverage.paper_ratio == pytest.approx(32 / 12)
    assert coverage.recall == 1.0
    assert coverage.precision == pytest.approx(12 / 32)


def test_floor_that_cannot_be_reached_does_not_count() -> None:
    reference = grid_from_text("###..\n..###")
    reachable = np.zeros((2, 5), dtype=bool)
    reachable[0, :2] = True
    coverage = measure_coverage(grid_from_text("?????\n..???"), reference, reachable=reachable)
    assert coverage.recall == 1.0


@given(x=st.integers(-9, 9), y=st.integers(-9, 9), margin=st.integers(0, 5))
def test_a_larger_array_with_another_origin_changes_nothing(x: int, y: int, margin: int) -> None:
    half, hall = grid_from_text(HALF_OF_IT), grid_from_text(HALL)
    wider = OccupancyGrid(
        cells=np.pad(half.cells, margin, constant_values=-1),
        resolution_m=1.0,
        origin=Pose(x - margin, y - margin),
    )
    there = OccupancyGrid(cells=hall.cells, resolution_m=1.0, origin=Pose(x, y))
    assert measure_coverage(wider, there) == measure_coverage(half, hall)


@pytest.mark.parametrize("n", [2, 5])
def test_a_finer_map_of_the_same_floor_covers_as_much(n: int) -> None:
    hall = grid_from_text(HALL, resolution_m=1.0)
    half = grid_from_text(HALF_OF_IT)
    finer = OccupancyGrid(
        cells=np.kron(half.cells, np.ones((n, n), dtype=np.int8)), resolution_m=1.0 / n
    )
    found, expected = measure_coverage(finer, hall), measure_coverage(half, hall)
    assert asdict(found) == pytest.approx(asdict(expected))


def test_a_turned_array_of_the_same_floor_covers_as_much() -> None:
    hall, half = grid_from_text(HALL), grid_from_text(HALF_OF_IT)
    turned = OccupancyGrid(
        cells=np.rot90(half.cells), resolution_m=1.0, origin=Pose(0.0, 4.0, -math.pi / 2)
    )
    assert measure_coverage(turned, hall).recall == 0.5


def test_a_map_that_shows_no_floor_has_nothing_wrong() -> None:
    coverage = measure_coverage(grid_from_text("????"), grid_from_text(HALL))
    assert (coverage.paper_ratio, coverage.recall, coverage.precision) == (0.0, 0.0, 1.0)


def test_a_reference_without_free_floor_is_refused() -> None:
    with pytest.raises(MapError, match="no free floor"):
        measure_coverage(grid_from_text(HALL), grid_from_text("####"))


def test_a_mask_of_another_shape_is_refused() -> None:
    with pytest.raises(MapError, match=r"\(1, 1\)"):
        measure_coverage(
            grid_from_text(HALL), grid_from_text(HALL), reachable=np.ones((1, 1), dtype=bool)
        )


def test_a_closed_room_has_no_open_border() -> None:
    known = measure_known_area(grid_from_text(HALL, resolution_m=0.5))
    assert known.open_border_m == 0.0
    assert known.free_area_m2 == 12 * 0.25
    assert known.occupied_area_m2 == 20 * 0.25
    assert known.known_ratio == 1.0


def test_the_open_border_runs_where_floor_meets_the_unknown() -> None:
    known = measure_known_area(grid_from_text(HALF_OF_IT, resolution_m=0.5))
    assert known.open_border_m == 2 * 0.5
    assert known.known_ratio == 24 / 32


def test_the_edge_of_the_array_is_an_open_border() -> None:
    assert measure_known_area(grid_from_text("..", resolution_m=0.5)).open_border_m == 6 * 0.5


def test_an_empty_map_knows_nothing() -> None:
    known = measure_known_area(
        OccupancyGrid(cells=np.zeros((0, 0), dtype=np.int8), resolution_m=0.05)
    )
    assert (known.known_ratio, known.free_area_m2, known.open_border_m) == (0.0, 0.0, 0.0)
