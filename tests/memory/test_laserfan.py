"""What the laser met around a direction: as a line of text, cut from a whole turn, told wrongly."""

import math

import numpy as np
import pytest
from hypothesis import given

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import LaserFan, LaserRing, build_ring
from mapspeak.memory.laserfan import HALF_FAN_RAD, SAME_STAND_M, STEP_RAD
from mapspeak.memory.things.thing import NOISE
from waypoints import laser_fans

HERE = Pose(1.0, 2.0, math.radians(90))
TEXT = "from -4.0 to 4.0 deg at 2.2 2.1 - >20 3.4 m"


def ring(met_m: dict[int, float], *, pose: Pose = HERE, otherwise_m: float = 5.0) -> LaserRing:
    """A turn with one beam to a degree, each to 5 m but for some, by degrees from the heading."""
    degrees = np.arange(-180, 180)
    ranges_m = np.array([met_m.get(int(each), otherwise_m) for each in degrees])
    return build_ring(pose, angles_rad=np.radians(degrees), ranges_m=ranges_m, reach_m=20.0)


def said(turn: LaserRing, stood: Pose, bearing_deg: float) -> str:
    fan = turn.find_fan(stood, math.radians(bearing_deg))
    assert fan is not None
    return fan.text


@given(laser_fans())
def test_a_line_of_text_says_all_that_it_keeps(fan: LaserFan) -> None:
    again = LaserFan.read(fan.text)
    assert again.text == fan.text
    assert len(again.ranges_m) == len(fan.ranges_m)
    assert math.remainder(again.first_rad - fan.first_rad, math.tau) == pytest.approx(0, abs=1e-4)


def test_a_line_of_text_tells_what_was_met_from_what_was_not_and_what_is_not_known() -> None:
    fan = LaserFan.read(f"  {TEXT} ")
    assert fan.ranges_m == (2.2, 2.1, None, math.inf, 3.4)
    assert fan.reach_m == 20.0
    assert math.degrees(fan.step_rad) == pytest.approx(2.0)
    assert fan.text == TEXT


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("2.15 2.13", "should be like 'from"),
        ("from -4.0 to 4.0 deg at 2.15 2.13 wall m", "beam 3 should be metres"),
        ("from -4.0 to 4.0 deg at 2.15 -1 m", "beam 2 should be metres"),
        ("from -4.0 to 4.0 deg at 2.15 nan m", "beam 2 should be metres"),
        ("from 4.0 to -4.0 deg at 2.15 2.13 m", "from right to left"),
        ("from 4.0 to 4.2 deg at 2.15 2.13 m", "from right to left"),
        ("from 0.0 to 400.0 deg at 2.15 2.13 m", "1 to 360 degrees in all"),
        ("from -4.0 to 4.0 deg at 2.15 m", "1 beams should be 2 to 360"),
        ("from -4.0 to 4.0 deg at >20 >10 m", "of one reach"),
        ("from -4.0 to 4.0 deg at 2000 2.13 m", "0 to 1000 m"),
        ("from -4.0 to 4.0 deg at >0 2.13 m", "of one reach"),
    ],
)
def test_what_is_no_such_line_is_refused_with_the_reason(text: str, reason: str) -> None:
    with pytest.raises(SemanticMapError, match=reason):
        LaserFan.read(text)


def test_a_fan_reaches_two_standard_deviations_to_either_side_of_what_was_told() -> None:
    assert 0 <= HALF_FAN_RAD - 2 * NOISE.bearing_rad < STEP_RAD
    text = said(ring({9: 2.0}), HERE, 10)
    assert text.startswith("from -12.0 to 30.0 deg at 5.0 ")
    assert text.split()[6:-1][7] == "2.0"


def test_a_fan_to_the_back_goes_round_behind() -> None:
    text = said(ring({-171: 2.0}), HERE, 180)
    assert text.startswith("from 159.0 to 201.0 deg at ")
    assert text.split()[6:-1][10] == "2.0"


def test_a_fan_of_another_heading_has_the_same_beams_in_the_world() -> None:
    turned = Pose(HERE.x, HERE.y, HERE.yaw_rad + math.radians(31))
    text = said(ring({21: 2.0}), turned, -10)
    assert text.startswith("from -31.0 to 11.0 deg at ")
    assert text.split()[6:-1][7] == "2.0"


def test_nothing_met_and_nothing_known_are_told_apart() -> None:
    text = said(ring({0: math.inf, 3: math.nan}), HERE, 0)
    assert text.split()[6:-1][6:10] == ["5.0", ">20", "-", "5.0"]


def test_from_elsewhere_or_where_nothing_is_known_there_is_no_fan() -> None:
    near, away = (Pose(HERE.x + SAME_STAND_M * share, HERE.y) for share in (0.9, 1.1))
    assert ring({}).find_fan(near, 0.0) is not None
    assert ring({}).find_fan(away, 0.0) is None
    assert ring({}, otherwise_m=math.nan).find_fan(HERE, 0.0) is None


def test_of_several_beams_to_a_step_the_nearest_counts_and_a_coarse_laser_leaves_gaps() -> None:
    fine = build_ring(
        HERE, angles_rad=np.radians([-1.4, 0.1, 1.3]), ranges_m=np.array([1, 2, 3]), reach_m=9.0
    )
    assert fine.ranges_m[0] == 2.0
    assert np.isnan(fine.ranges_m).sum() == 119


def test_a_laser_of_no_reach_says_nothing_of_beams_that_met_nothing() -> None:
    blind = build_ring(HERE, angles_rad=np.zeros(1), ranges_m=np.array([math.inf]), reach_m=0.0)
    assert np.isnan(blind.ranges_m).all()
