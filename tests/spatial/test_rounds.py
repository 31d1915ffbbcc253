import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import distances_from
from mapspeak.spatial.paths.rounds import (
    find_shortest_rounds,
    find_ways_between,
    find_worthiest_first,
)


@given(seed=st.integers(0, 2**32 - 1), n_stops=st.integers(1, 6))
@settings(max_examples=30)
def test_shortest_rounds_are_those_of_trying_all_orders(seed: int, n_stops: int) -> None:
    rng = np.random.default_rng(seed)
    between_m = rng.uniform(1.0, 9.0, (n_stops, n_stops))
    from_start_m = rng.uniform(1.0, 9.0, n_stops)
    expected = [
        min(
            from_start_m[first] + sum(between_m[a, b] for a, b in itertools.pairwise(order))
            for order in itertools.permutations(range(n_stops))
            if order[0] == first
        )
        for first in range(n_stops)
    ]
    assert find_shortest_rounds(from_start_m, between_m).tolist() == pytest.approx(expected)


@given(seed=st.integers(0, 2**32 - 1), n_stops=st.integers(1, 5))
@settings(max_examples=30)
def test_the_worthiest_way_is_that_of_trying_all_orders_of_all_choices(
    seed: int, n_stops: int
) -> None:
    rng = np.random.default_rng(seed)
    between_m = rng.uniform(1.0, 9.0, (n_stops, n_stops))
    from_start_m, worth_m = rng.uniform(1.0, 9.0, (2, n_stops))
    needed = rng.random(n_stops) < 0.3
    gains_m: dict[int | None, float] = {} if needed.any() else {None: 0.0}
    for n_passed in range(1, n_stops + 1):
        for order in itertools.permutations(range(n_stops), n_passed):
            legs_m = [between_m[a, b] for a, b in itertools.pairwise(order)]
            gain_m = worth_m[list(order)].sum() - from_start_m[order[0]] - sum(legs_m)
            if set(np.flatnonzero(needed)) <= set(order):
                gains_m[order[0]] = max(gain_m, gains_m.get(order[0], gain_m))
    first = find_worthiest_first(from_start_m, between_m, worth_m, needed)
    assert gains_m[first] == pytest.approx(max(gains_m.values()))


def test_ways_between_stops_lead_around_walls() -> None:
    cells = np.zeros((120, 120), np.int8)
    cells[60, :100] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    below, above, beyond = Point(1.0, 2.0), Point(1.0, 4.0), Point(5.5, 3.0)
    distances = distances_from(grid, below, radius_m=0.25)
    between_m = find_ways_between(distances, [below, above, beyond])
    assert np.diag(between_m).tolist() == [0.0, 0.0, 0.0]
    for index, stop in enumerate((below, above, beyond)):
        assert between_m[0, index] == pytest.approx(distances.distance_to(stop), abs=0.6)
    assert between_m[0, 1] > 8.0
