"""Where on the robot a laser is, by frames that hang together in any way."""

import math

import numpy as np
import pytest

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.ros.messages.poses import FrameTransform
from mapspeak.ros.robot.sensors import find_mounting, place_beams
from mapspeak.ros.transforms import TransformTree


def tree(*frames: tuple[str, str, Pose]) -> TransformTree:
    grown = TransformTree()
    transforms = [
        FrameTransform(parent_from_child=pose, parent=parent, child=child, stamp_s=1.0)
        for parent, child, pose in frames
    ]
    grown.take(transforms, is_static=False)
    return grown


def one_metre_ahead(grown: TransformTree, *, base: str) -> tuple[float, float]:
    mounting = find_mounting(grown, base=base, sensor="laser")
    angles_rad, ranges_m = place_beams(mounting, np.zeros(1), np.ones(1))
    return math.degrees(angles_rad[0]), float(ranges_m[0])


def test_the_base_may_hang_beside_the_laser_as_well_as_above_it() -> None:
    grown = tree(
        ("odom", "base_link", Pose(5.0, 6.0, 1.0)),
        ("base_link", "base_footprint", Pose(0.0, 0.0, math.radians(20))),
        ("base_link", "laser", Pose(0.0, 0.0, math.radians(50))),
    )
    assert one_metre_ahead(grown, base="base_footprint") == pytest.approx((30.0, 1.0))
    assert one_metre_ahead(grown, base="base_link") == pytest.approx((50.0, 1.0))


def test_a_scan_in_the_frame_of_the_base_itself_stays_as_it_is() -> None:
    grown = tree(("odom", "base_link", Pose(5.0, 6.0, 1.0)))
    mounting = find_mounting(grown, base="base_link", sensor="base_link")
    assert np.allclose(mounting, np.eye(4))


def test_a_laser_of_another_robot_is_mounted_nowhere_on_this_one() -> None:
    grown = tree(("odom", "base_link", Pose(0, 0)), ("other", "laser", Pose(0, 0)))
    with pytest.raises(LinkError, match="laser"):
        find_mounting(grown, base="base_link", sensor="laser")


def test_frames_that_go_round_in_a_circle_say_nothing_of_the_laser() -> None:
    grown = tree(
        ("a", "base_link", Pose(0, 0)), ("base_link", "a", Pose(0, 0)), ("b", "laser", Pose(0, 0))
    )
    with pytest.raises(LinkError):
        find_mounting(grown, base="base_link", sensor="laser")
