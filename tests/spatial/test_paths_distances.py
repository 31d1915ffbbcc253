import heapq
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.geometry import Point
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.paths import clearance_m, distances_from
from mapspeak.spatial.paths.lattice import moves_within
from mapspeak.spatial.paths.wavefront import Seeds, spread

NEIGHBOURS = [step for step in itertools.product((-1, 0, 1), repeat=2) if step != (0, 0)]


def dijkstra(free: np.ndarray, start: tuple[int, int]) -> np.ndarray:
    """The textbook algorithm over eight neighbours, without cutting corners."""
    costs = np.full(free.shape, np.inf)
    costs[start] = 0.0
    heap = [(0.0, start)]
    while heap:
        cost, (row, col) = heapq.heappop(heap)
        if cost > costs[row, col]:
            continue
        for d_row, d_col in NEIGHBOURS:
            around = [(row + d_row, col), (row, col + d_col), (row + d_row, col + d_col)]
            if not all(0 <= r < free.shape[0] and 0 <= c < free.shape[1] for r, c in around):
                continue
            if all(free[cell] for cell in around) and (
                cost + math.hypot(d_row, d_col) < costs[around[2]]
            ):
                costs[around[2]] = cost + math.hypot(d_row, d_col)
                heapq.heappush(heap, (costs[around[2]], around[2]))
    return costs


def scattered(seed: int, shape: tuple[int, int], wall_ratio: float) -> np.ndarray:
    free = np.random.default_rng(seed).random(shape) > wall_ratio
    free[0, 0] = True
    return free


@given(
    seed=st.integers(0, 2**32 - 1),
    n_rows=st.integers(1, 14),
    n_cols=st.integers(1, 14),
    wall_ratio=st.sampled_from([0.1, 0.3, 0.45]),
)
@settings(max_examples=60)
def test_distances_are_those_of_dijkstra(
    seed: int, n_rows: int, n_cols: int, wall_ratio: float
) -> None:
    free = scattered(seed, (n_rows, n_cols), wall_ratio)
    grid = OccupancyGrid(cells=np.where(free, 0, 100).astype(np.int8), resolution_m=0.5)
    field = distances_from(grid, Point(0.25, 0.25), radius_m=0.0)
    rows, cols = np.indices(free.shape)
    found = field.distances_at(rows.ravel(), cols.ravel()).reshape(free.shape)
    np.testing.assert_allclose(found, 0.5 * dijkstra(free, (0, 0)), rtol=1e-5)


def test_weighted_costs_are_the_mean_of_both_ends_times_the_length() -> None:
    east, west = 1, 4
    moves = np.array([[east, east | west, west]], dtype=np.uint8)
    weights = np.array([[1.0, 3.0, 2.0]], dtype=np.float32)
    seeds = Seeds(np.array([0]), np.zeros(1, dtype=np.float32))
    assert spread(moves, weights, seeds).tolist() == [0.0, 2.0, 4.5]


def test_several_seeds_each_start_with_what_they_have_cost() -> None:
    east, west = 1, 4
    moves = np.array([[east] + [east | west] * 3 + [west]], dtype=np.uint8)
    seeds = Seeds(np.array([0, 4]), np.array([0.0, 2.5], dtype=np.float32))
    costs = spread(moves, None, seeds)
    assert costs.tolist() == [0.0, 1.0, 2.0, 3.0, 2.5]


def test_the_distance_to_a_place_behind_a_wall_goes_around_it() -> None:
    grid = grid_from_text(".....\n.###.\n.#...")
    field = distances_from(grid, Point(0.5, 0.5), radius_m=0.0)
    assert field.distance_to(Point(2.5, 0.5)) == pytest.approx(10.0)


def test_a_place_without_a_way_is_not_reachable() -> None:
    field = distances_from(grid_from_text("..#.."), Point(0.5, 0.5), radius_m=0.0)
    assert field.distance_to(Point(4.5, 0.5)) is None
    assert not field.is_reachable(Point(4.5, 0.5))
    assert field.path_to(Point(4.5, 0.5)) is None
    assert field.distance_to(Point(77.0, 0.5)) is None


def test_the_distance_within_a_cell_is_the_straight_one() -> None:
    field = distances_from(grid_from_text(".."), Point(0.1, 0.5), radius_m=0.0)
    assert field.distance_to(Point(0.9, 0.5)) == pytest.approx(0.8)


def test_the_path_to_a_place_is_about_as_long_as_its_distance() -> None:
    cells = np.zeros((90, 120), np.int8)
    cells[30, :80] = 100
    cells[60, 40:] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    field = distances_from(grid, Point(0.4, 0.4), radius_m=0.2)
    goal = Point(5.5, 4.0)
    path, distance = field.path_to(goal), field.distance_to(goal)
    assert path is not None
    assert distance is not None
    assert 0.9 * distance <= path.length_m <= 1.1 * distance
    assert (path.points[0], path.points[-1]) == (Point(0.4, 0.4), goal)


def test_a_wave_with_goals_stops_when_it_has_reached_them_all() -> None:
    moves = moves_within(np.ones((1, 50), np.bool_))
    seeds = Seeds(np.array([0]), np.zeros(1, dtype=np.float32))
    costs = spread(moves, None, seeds, goals=np.array([3, 9]))
    assert costs[[3, 9]].tolist() == [3.0, 9.0]
    assert np.isinf(costs[20:]).all()


def test_a_large_map_keeps_the_clearance_of_each_of_its_cells() -> None:
    cells = np.where(np.random.default_rng(4).random((711, 711)) < 0.05, 100, 0).astype(np.int8)
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    lattice = distances_from(grid, Point(0.5, 0.5), radius_m=0.1).lattice
    assert lattice.factor == 2
    assert (lattice.fine_clearance_m == clearance_m(grid)).all()
    assert lattice.clearance_m[3, 5] == lattice.fine_clearance_m[6:8, 10:12].max()


def test_a_large_map_keeps_the_connections_of_its_cells() -> None:
    cells = np.where(np.random.default_rng(4).random((710, 711)) < 0.05, 100, 0).astype(np.int8)
    cells[:4, :4] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=1.0)
    field = distances_from(grid, Point(0.5, 0.5), radius_m=1.2)
    assert field.lattice.factor == 2
    rows, cols = np.nonzero(field.lattice.passable[:40, :40])
    found = field.distances_at(rows, cols)
    true = dijkstra(field.lattice.passable[:80, :80], (0, 0))[rows, cols]
    assert (np.isfinite(found) == np.isfinite(true)).mean() > 0.99
    both = np.isfinite(found) & np.isfinite(true)
    assert np.abs(found[both] - true[both]).max() <= 6


def test_a_large_map_shows_no_way_through_a_thin_diagonal_wall() -> None:
    cells = np.zeros((800, 800), np.int8)
    steps = np.arange(800)
    cells[steps, steps] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    field = distances_from(grid, grid.point_at(Cell(10, 700)), radius_m=0.0)
    assert not field.is_reachable(grid.point_at(Cell(700, 10)))
    assert field.is_reachable(grid.point_at(Cell(600, 700)))


def test_distances_cannot_be_changed() -> None:
    field = distances_from(grid_from_text(".."), Point(0.5, 0.5), radius_m=0.0)
    with pytest.raises(ValueError, match="read-only"):
        field.costs[0] = 3


def test_a_way_to_draw_leads_over_free_floor_and_is_as_long_as_the_distance_says() -> None:
    grid = grid_from_text(
        """
        ..........
        .########.
        ........#.
        ........#.
        """
    )
    distances = distances_from(grid, Point(0.5, 0.5), radius_m=0.3)
    way = distances.way_to(Point(9.5, 0.5))
    assert way is not None
    assert (way[0], way[-1]) == (Point(0.5, 0.5), Point(9.5, 0.5))
    assert all(grid.free[cell.row, cell.col] for cell in map(grid.cell_at, way))
    length_m = sum(one.distance_to(other) for one, other in itertools.pairwise(way))
    assert length_m == pytest.approx(distances.distance_to(Point(9.5, 0.5)), abs=0.01)
    assert distances.way_to(Point(4.5, 2.5)) is None


def test_a_wall_that_costs_thousands_is_crossed_where_no_other_way_is() -> None:
    weights = np.ones((7, 9), dtype=np.float32)
    weights[:, 4] = 3267.0
    seeds = Seeds(np.array([0]), np.zeros(1, dtype=np.float32))
    costs = spread(moves_within(np.ones(weights.shape, dtype=bool)), weights, seeds)
    there = costs.reshape(weights.shape)
    assert there[0, 3] == 3.0
    assert there[0, 8] == pytest.approx(6 + 3268.0)
    assert there[6, 8] == pytest.approx(there[0, 8] + 6 * math.sqrt(2) - 6, abs=0.01)
