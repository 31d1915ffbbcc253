"""A thing seen again: what the laser met goes with the direction that it was met around."""

import math

import pytest

from mapspeak.geometry import Pose
from mapspeak.memory import Confidence, Landmark, LaserFan, Waypoint, merge_waypoint, seen_from

HERE = Pose(1.0, 2.0, 0.0)
OLD = LaserFan.read("from -2.0 to 2.0 deg at 3.0 3.0 3.0 m")
NEW = LaserFan.read("from -2.0 to 2.0 deg at 2.0 2.0 2.0 m")


def place(*landmarks: Landmark, pose: Pose = HERE) -> Waypoint:
    return Waypoint(name="dock", pose=pose, functional_landmarks=landmarks)


def tap(fan: LaserFan | None, *, confidence: Confidence | None = None) -> Landmark:
    return Landmark(label="tap", bearing_rad=0.0, laser=fan, confidence=confidence)


def merged(before: Waypoint, now: Waypoint) -> tuple[LaserFan | None, ...]:
    return tuple(each.laser for each in merge_waypoint(before, now).waypoint.landmarks)


def test_the_look_whose_direction_counts_says_what_was_met_around_it() -> None:
    assert merged(place(tap(OLD)), place(tap(NEW))) == (NEW,)
    assert merged(place(tap(OLD)), place(tap(None))) == (None,)
    surer = tap(OLD, confidence=Confidence.CERTAIN)
    assert merged(place(surer), place(tap(NEW))) == (OLD,)


def test_a_label_alone_leaves_what_was_met_before() -> None:
    assert merged(place(tap(OLD)), place(Landmark(label="tap"))) == (OLD,)


def test_each_view_from_elsewhere_keeps_what_was_met_there() -> None:
    there = Pose(1.0, 0.5, math.radians(20))
    assert merged(place(tap(OLD)), place(tap(NEW), pose=there)) == (NEW, OLD)


def test_from_where_it_stood_the_beams_turn_and_from_elsewhere_they_are_left_out() -> None:
    turned = seen_from(tap(OLD), HERE, Pose(1.05, 2.0, math.radians(30)))
    assert turned.laser is not None
    assert math.degrees(turned.laser.first_rad) == pytest.approx(-32.0)
    assert seen_from(tap(OLD), HERE, Pose(1.3, 2.0, 0.0)).laser is None
