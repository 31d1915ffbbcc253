"""In which order stops are driven past: never longer than as given, and shortest where few."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.driving.routes.ordering import MOST_EXACT, measure_order, order_shortest
from mapspeak.spatial.grid import FloatArray

SEEDS = st.integers(0, 10_000)
whether_the_end_is_fixed = pytest.mark.parametrize("is_end_fixed", [False, True])


def ways_between(seed: int, n_stops: int) -> FloatArray:
    """Gives the ways between places spread over a floor, from the first to all others."""
    points = np.random.default_rng(seed).uniform(0.0, 30.0, (n_stops + 1, 2))
    away = points[:, None] - points[None, 1:]
    return np.asarray(np.hypot(away[..., 0], away[..., 1]))


@whether_the_end_is_fixed
@given(seed=SEEDS, n_stops=st.integers(1, 7))
def test_of_few_stops_no_other_order_is_shorter(
    *, is_end_fixed: bool, seed: int, n_stops: int
) -> None:
    legs_m = ways_between(seed, n_stops)
    order = order_shortest(legs_m, is_end_fixed=is_end_fixed)
    orders = [
        each
        for each in itertools.permutations(range(n_stops))
        if not is_end_fixed or each[-1] == n_stops - 1
    ]
    assert sorted(order) == list(range(n_stops))
    assert measure_order(legs_m, order) == pytest.approx(
        min(measure_order(legs_m, each) for each in orders)
    )


@whether_the_end_is_fixed
@given(seed=SEEDS, n_stops=st.integers(MOST_EXACT + 1, 16))
def test_of_many_stops_the_order_is_no_longer_than_as_given(
    *, is_end_fixed: bool, seed: int, n_stops: int
) -> None:
    legs_m = ways_between(seed, n_stops)
    order = order_shortest(legs_m, is_end_fixed=is_end_fixed)
    assert sorted(order) == list(range(n_stops))
    assert not is_end_fixed or order[-1] == n_stops - 1
    assert measure_order(legs_m, order) <= measure_order(legs_m, range(n_stops)) + 1e-9


@given(seed=SEEDS)
def test_pieces_that_are_turned_and_moved_come_near_to_the_shortest(seed: int) -> None:
    legs_m = ways_between(seed, MOST_EXACT)
    exact_m = measure_order(legs_m, order_shortest(legs_m, is_end_fixed=False))
    # One stop more, where another stands, costs nothing, and is too many to be ordered exactly.
    doubled = np.column_stack([np.vstack([legs_m, legs_m[-1]]), np.append(legs_m[:, -1], 0.0)])
    near_m = measure_order(doubled, order_shortest(doubled, is_end_fixed=False))
    assert exact_m - 1e-9 <= near_m <= 1.25 * exact_m


def test_a_stop_that_no_way_leads_to_does_not_hide_the_order_of_the_others() -> None:
    legs_m = ways_between(3, 4)
    legs_m[:, 2] = np.inf
    assert sorted(order_shortest(legs_m, is_end_fixed=False)) == [0, 1, 2, 3]
