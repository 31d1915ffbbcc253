import pytest
from scipy import stats  # type: ignore[import-untyped]  # it ships no types

from mapspeak.evaluation.scores.rows import wilson_interval


@pytest.mark.parametrize(("n_successes", "n_trials"), [(0, 30), (26, 30), (30, 30), (1, 2)])
def test_wilsons_interval_is_that_of_scipy(n_successes: int, n_trials: int) -> None:
    ours = wilson_interval(n_successes, n_trials)
    theirs = stats.binomtest(n_successes, n_trials).proportion_ci(method="wilson")
    assert ours is not None
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high))


def test_nothing_has_no_interval() -> None:
    assert wilson_interval(0, 0) is None
