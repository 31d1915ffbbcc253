import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.frontiers.reasons import with_reasons


def frontier(*, gain_m2: float, distance_m: float) -> Frontier:
    return Frontier(
        id="",
        points=np.zeros((1, 2)),
        anchor=Point(0.0, 0.0),
        length_m=1.0,
        gain_m2=gain_m2,
        distance_m=distance_m,
        openness_m=3.0,
        pose=Pose(0.0, 0.0, 0.0),
        reason="",
    )


def test_reasons_say_what_sets_each_frontier_apart() -> None:
    ranked = [
        frontier(gain_m2=6.0, distance_m=2.0),
        frontier(gain_m2=9.0, distance_m=8.0),
        frontier(gain_m2=2.0, distance_m=1.0),
        frontier(gain_m2=3.0, distance_m=9.0),
        frontier(gain_m2=1.0, distance_m=20.0),
    ]
    reasons = [
        each.reason
        for each in with_reasons(ranked, [0.0, 12.3, 2.4, 1.4, None], [3.0, 1.1, 2.0, 0.3, 0.05])
    ]
    assert reasons == [
        "best, most to see per metre, on the way",
        "most to see, going first costs 12 m more in all",
        "nearest, going first costs 2 m more in all",
        "on the way",
        "little to see per metre",
    ]


def test_a_reason_is_short_however_much_there_is_to_say() -> None:
    ranked = [frontier(gain_m2=6.0, distance_m=2.0), frontier(gain_m2=1.0, distance_m=3.0)]
    best, _ = with_reasons(ranked, [1234.0, 0.0], [3.0, 0.3])
    assert len(best.reason) < 60
    assert best.reason.startswith("best")
    assert best.reason.endswith("1234 m more in all")


def test_one_frontier_alone_needs_no_comparison() -> None:
    (only,) = with_reasons([frontier(gain_m2=6.0, distance_m=2.0)], [0.0], [3.0])
    assert only.reason == "the only one"
