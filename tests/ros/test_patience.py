"""How long navigation and actions are waited for."""

from mapspeak.ros.link import USUAL_PATIENCE

FAST_DDS_REPEATS_S = 3.0
"""The period of its heartbeats, unless a robot's profile says otherwise."""


def test_a_word_that_was_lost_on_the_way_is_waited_for_until_it_comes_again() -> None:
    assert min(USUAL_PATIENCE.acceptance_s, USUAL_PATIENCE.end_s) > FAST_DDS_REPEATS_S
