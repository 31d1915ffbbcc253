"""How long navigation and actions are waited for."""

import pytest

from mapspeak.ros.actions import ActionPatience
from mapspeak.ros.robot.driving import DrivingPatience

FAST_DDS_REPEATS_S = 3.0
"""The period of its heartbeats, unless a robot's profile says otherwise."""


@pytest.mark.parametrize("patience", [DrivingPatience(), ActionPatience()])
def test_a_word_that_was_lost_on_the_way_is_waited_for_until_it_comes_again(
    patience: DrivingPatience | ActionPatience,
) -> None:
    assert min(patience.acceptance_s, patience.end_s) > FAST_DDS_REPEATS_S
