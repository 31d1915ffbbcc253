import numpy as np
import pytest
from scipy import stats  # type: ignore[import-untyped]  # it ships no types

from mapspeak.evaluation.scores.rows import bootstrap_interval, wilson_interval


@pytest.mark.parametrize(("n_successes", "n_trials"), [(0, 30), (26, 30), (30, 30), (1, 2)])
def test_wilsons_interval_is_that_of_scipy(n_successes: int, n_trials: int) -> None:
    ours = wilson_interval(n_successes, n_trials)
    theirs = stats.binomtest(n_successes, n_trials).proportion_ci(method="wilson")
    assert ours is not None
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high))


def test_the_bootstrap_is_near_that_of_scipy() -> None:
    values = np.random.default_rng(1).gamma(2.0, 3.0, 40).tolist()
    ours = bootstrap_interval(values)
    theirs = stats.bootstrap(
        (values,), np.mean, method="percentile", rng=np.random.default_rng(2)
    ).confidence_interval
    assert ours is not None
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), rel=0.05)


def test_nothing_has_no_interval_and_one_value_has_no_width() -> None:
    assert wilson_interval(0, 0) is None
    assert bootstrap_interval([]) is None
    alone = bootstrap_interval([2.0])
    assert alone is not None
    assert (alone.low, alone.high) == (2.0, 2.0)
