import numpy as np
import pytest

from mapspeak.geometry import Point, Pose
from mapspeak.server.text.world.maps import say_merits, say_refusal, say_verdict
from mapspeak.spatial.frontiers import (
    Frontier,
    FrontierMerit,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
)

BEST, NEAREST, ONLY = FrontierMerit.BEST, FrontierMerit.NEAREST, FrontierMerit.ONLY
MOST_PER_METRE, MOST_TO_SEE = FrontierMerit.MOST_PER_METRE, FrontierMerit.MOST_TO_SEE


def frontier(*merits: FrontierMerit, detour_m: float | None = 0.0) -> Frontier:
    return Frontier(
        id="F1",
        points=np.zeros((1, 2)),
        anchor=Point(0.0, 0.0),
        length_m=1.0,
        gain_m2=2.0,
        distance_m=3.0,
        openness_m=3.0,
        pose=Pose(0.0, 0.0, 0.0),
        merits=merits,
        detour_m=detour_m,
    )


def refused(reason: RefusalReason) -> RefusedFrontier:
    return RefusedFrontier(
        anchor=Point(0.0, 0.0),
        length_m=1.0,
        reason=reason,
        gap_width_m=0.2,
        needed_width_m=0.4,
        least_gain_m2=0.5,
    )


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (frontier(BEST, MOST_PER_METRE), "best, most to see per metre, on the way"),
        (frontier(MOST_TO_SEE, detour_m=12.3), "most to see, a detour of 12 m"),
        (frontier(NEAREST, detour_m=2.4), "nearest, a detour of 2 m"),
        (frontier(detour_m=1.4), "on the way"),
        (frontier(detour_m=None), "little to see per metre"),
        (frontier(ONLY), "the only one"),
    ],
)
def test_merits_say_what_sets_a_frontier_apart(told: Frontier, words: str) -> None:
    assert say_merits(told) == words


def test_merits_are_short_however_much_there_is_to_say() -> None:
    words = say_merits(frontier(BEST, MOST_PER_METRE, NEAREST, detour_m=1234.0))
    assert len(words) < 60
    assert words.startswith("best")
    assert words.endswith("a detour of 1234 m")


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        (RefusalReason.NO_WAY, "behind a wall: no way over known floor"),
        (RefusalReason.TOO_NARROW, "gap of 0.2 m, the robot needs 0.40 m"),
        (RefusalReason.NOTHING_TO_SEE, "less than 0.50 m2 to see"),
        (RefusalReason.LOOKED_ALREADY, "visited already, nothing new came into view"),
        (
            RefusalReason.DRIVE_FAILED,
            "a drive there failed, and the map has not changed there since",
        ),
        (RefusalReason.CLOSED_OFF, "behind what is closed: no way while it is"),
    ],
)
def test_a_refusal_says_why_with_its_numbers(reason: RefusalReason, words: str) -> None:
    assert say_refusal(refused(reason)) == words


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        (FrontierVerdict.SOME_LEFT, "1 frontier; not offered: 1 behind walls."),
        (FrontierVerdict.NONE_LEFT, "No frontier is left: all known floor ends at walls."),
        (
            FrontierVerdict.ALL_REFUSED,
            "No frontier is left to go to; not offered: 1 behind walls.",
        ),
        (
            FrontierVerdict.NONE_REACHABLE,
            "No frontier can be reached: no free floor with room for the robot is near it.",
        ),
        (FrontierVerdict.NOTHING_KNOWN, "No free floor is known yet."),
    ],
)
def test_the_verdict_says_what_is_left(verdict: FrontierVerdict, words: str) -> None:
    report = FrontierReport(
        frontiers=(frontier(BEST),),
        refused=(refused(RefusalReason.NO_WAY),),
        verdict=verdict,
        n_named=1,
        floor_m2=8.0,
        known_ratio=0.9,
    )
    assert say_verdict(report) == words


def test_the_most_frequent_refusal_is_told_first() -> None:
    reasons = [RefusalReason.TOO_NARROW, RefusalReason.NO_WAY, RefusalReason.NO_WAY]
    report = FrontierReport(
        frontiers=(),
        refused=tuple(refused(reason) for reason in reasons),
        verdict=FrontierVerdict.ALL_REFUSED,
        n_named=0,
        floor_m2=8.0,
        known_ratio=1.0,
    )
    assert say_verdict(report).endswith("not offered: 2 behind walls, 1 too narrow for the robot.")
