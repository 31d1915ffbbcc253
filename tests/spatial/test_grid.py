import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drawing import grid_from_text, text_from_grid
from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid

coordinates = st.floats(-1e4, 1e4)
origins = st.builds(Pose, coordinates, coordinates, st.floats(-math.pi, math.pi))
resolutions = st.floats(0.01, 2.0)
cells = st.builds(Cell, st.integers(-200, 200), st.integers(-200, 200))


def test_a_drawn_map_has_its_first_line_at_the_top() -> None:
    grid = grid_from_text(
        """
        #.
        .?
        """
    )
    assert grid.cells.tolist() == [[0, -1], [100, 0]]


def test_a_drawn_map_is_drawn_again_the_same() -> None:
    drawing = "####\n#..#\n#.?#\n####"
    assert text_from_grid(grid_from_text(drawing)) == drawing


@given(origin=origins, resolution_m=resolutions, cell=cells)
def test_the_middle_of_a_cell_lies_in_that_cell(
    origin: Pose, resolution_m: float, cell: Cell
) -> None:
    grid = OccupancyGrid(
        cells=np.zeros((1, 1), dtype=np.int8), resolution_m=resolution_m, origin=origin
    )
    assert grid.cell_at(grid.point_at(cell)) == cell


def test_the_origin_is_the_outer_corner_of_the_first_cell() -> None:
    grid = grid_from_text("..\n..", resolution_m=0.5, origin=Pose(-1.0, 2.0))
    assert grid.point_at(Cell(0, 0)) == Point(-0.75, 2.25)
    assert grid.cell_at(Point(-0.99, 2.01)) == Cell(0, 0)
    assert grid.cell_at(Point(-1.01, 2.01)) == Cell(0, -1)


def test_a_turned_origin_turns_the_rows() -> None:
    grid = grid_from_text("..\n..", origin=Pose(3.0, 0.0, math.pi / 2))
    middle = grid.point_at(Cell(0, 1))
    assert (middle.x, middle.y) == pytest.approx((2.5, 1.5))


def test_values_up_to_49_are_free_and_from_50_on_occupied() -> None:
    grid = OccupancyGrid(cells=np.array([[-1, 0, 49, 50, 100]]), resolution_m=1.0)
    assert grid.unknown.tolist() == [[True, False, False, False, False]]
    assert grid.free.tolist() == [[False, True, True, False, False]]
    assert grid.occupied.tolist() == [[False, False, False, True, True]]


def test_a_map_keeps_its_own_locked_copy_of_the_cells() -> None:
    array = np.zeros((2, 2), dtype=np.int8)
    grid = OccupancyGrid(cells=array, resolution_m=1.0)
    array[0, 0] = 100
    assert grid.cells[0, 0] == 0
    assert not grid.cells.flags.writeable


@pytest.mark.parametrize("resolution_m", [0.0, -0.05, math.nan, math.inf])
def test_a_resolution_that_is_no_positive_number_is_refused(resolution_m: float) -> None:
    with pytest.raises(MapError, match="resolution"):
        OccupancyGrid(cells=np.zeros((1, 1), dtype=np.int8), resolution_m=resolution_m)


@pytest.mark.parametrize("value", [-2, 101])
def test_values_that_are_no_occupancy_are_refused(value: int) -> None:
    with pytest.raises(MapError, match=str(value)):
        OccupancyGrid(cells=np.full((1, 1), value), resolution_m=1.0)


def test_an_array_that_is_not_flat_is_refused() -> None:
    with pytest.raises(MapError, match="3"):
        OccupancyGrid(cells=np.zeros((1, 1, 1), dtype=np.int8), resolution_m=1.0)


def test_a_map_that_lies_in_bytes_is_not_copied_and_any_other_is() -> None:
    message = bytes([0, 100, 255, 0])
    heard = np.frombuffer(message, dtype=np.int8).reshape(2, 2)
    assert np.shares_memory(OccupancyGrid(cells=heard, resolution_m=0.05).cells, heard)
    own = np.zeros((2, 2), dtype=np.int8)
    locked = own.view()
    locked.setflags(write=False)
    assert not np.shares_memory(OccupancyGrid(cells=locked, resolution_m=0.05).cells, own)
    changeable = np.frombuffer(bytearray(message), dtype=np.int8).reshape(2, 2)
    assert not np.shares_memory(
        OccupancyGrid(cells=changeable, resolution_m=0.05).cells, changeable
    )


def test_a_single_cell_is_free_occupied_or_unknown_and_unknown_outside() -> None:
    grid = OccupancyGrid(cells=np.array([[-1, 0, 49, 50, 100]], dtype=np.int8), resolution_m=1.0)
    cells = [Cell(0, col) for col in range(5)]
    assert [grid.is_free(cell) for cell in cells] == [False, True, True, False, False]
    assert [grid.is_occupied(cell) for cell in cells] == [False, False, False, True, True]
    assert [grid.is_unknown(cell) for cell in cells] == [True, False, False, False, False]
    outside = Cell(1, 0)
    assert not grid.is_free(outside)
    assert not grid.is_occupied(outside)
    assert grid.is_unknown(outside)


def test_masks_are_built_once_and_locked() -> None:
    grid = OccupancyGrid(cells=np.zeros((2, 2), dtype=np.int8), resolution_m=1.0)
    assert grid.free is grid.free
    with pytest.raises(ValueError, match="read-only"):
        grid.free[0, 0] = False


def test_the_window_around_a_place_stays_on_the_array() -> None:
    grid = OccupancyGrid(cells=np.zeros((10, 20), dtype=np.int8), resolution_m=0.5)
    assert grid.window_around(Point(5.2, 0.3), 1.0) == (slice(0, 3), slice(8, 13))
    assert grid.window_around(Point(-9.0, 99.0), 1.0) == (slice(10, 10), slice(0, 0))
    assert grid.window(np.array([2, 4]), np.array([3, 19]), margin=1) == (slice(1, 6), slice(2, 20))


def test_values_are_looked_up_at_points_with_another_outside() -> None:
    grid = OccupancyGrid(cells=np.zeros((1, 2), dtype=np.int8), resolution_m=1.0)
    points = np.array([[[0.5, 0.5], [1.5, 0.5]], [[-0.5, 0.5], [0.5, 1.5]]])
    assert grid.look_up(np.array([[7, 8]]), points, outside=0).tolist() == [[7, 8], [0, 0]]
