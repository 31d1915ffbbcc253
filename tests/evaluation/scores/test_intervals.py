import pytest
from scipy import stats  # type: ignore[import-untyped]  # it ships no types

from mapspeak.evaluation.scores.rows import count_rows, wilson_interval
from mapspeak.evaluation.trials import TrialState
from reportmaking import make_result, make_trial


@pytest.mark.parametrize(("n_successes", "n_trials"), [(0, 30), (26, 30), (30, 30), (1, 2)])
def test_wilsons_interval_is_that_of_scipy(n_successes: int, n_trials: int) -> None:
    ours = wilson_interval(n_successes, n_trials)
    theirs = stats.binomtest(n_successes, n_trials).proportion_ci(method="wilson")
    assert ours is not None
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high))


def test_nothing_has_no_interval() -> None:
    assert wilson_interval(0, 0) is None


def test_a_trial_that_broke_counts_as_one_that_took_no_shortest_way() -> None:
    (row,) = count_rows(
        (
            make_result(make_trial(1), shortest_m=5.0, driven_m=5.0),
            make_result(make_trial(2), shortest_m=None, state=TrialState.CRASHED),
        )
    )
    assert row.figures["spl"] == 0.5
    assert (row.n_trials, row.n_broken) == (2, 1)
