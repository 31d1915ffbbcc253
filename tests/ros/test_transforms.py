"""The robot's tree of frames: found, broken, turned in a circle."""

import math

import pytest

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.ros.messages.poses import FrameTransform
from mapspeak.ros.transforms import TransformTree


def transform(parent: str, child: str, pose: Pose, stamp_s: float = 1.0) -> FrameTransform:
    return FrameTransform(parent_from_child=pose, parent=parent, child=child, stamp_s=stamp_s)


def tree(*transforms: FrameTransform) -> TransformTree:
    grown = TransformTree()
    grown.take(transforms, is_static=False)
    return grown


def test_transforms_are_chained_from_the_map_to_the_base() -> None:
    grown = tree(
        transform("map", "odom", Pose(1.0, 0.0, math.pi / 2), stamp_s=5.0),
        transform("odom", "base_link", Pose(2.0, 0.0, 0.0), stamp_s=4.0),
    )
    found = grown.find(outer="map", inner="base_link")
    assert found.pose.x == pytest.approx(1.0)
    assert found.pose.y == pytest.approx(2.0)
    assert found.pose.yaw_rad == pytest.approx(math.pi / 2)
    assert found.stamp_s == 4.0


def test_a_static_transform_does_not_make_a_pose_old() -> None:
    grown = tree(transform("map", "base_footprint", Pose(1.0, 0.0), stamp_s=9.0))
    grown.take([transform("base_footprint", "base_link", Pose(0, 0), stamp_s=0)], is_static=True)
    assert grown.find(outer="map", inner="base_link").stamp_s == 9.0


def test_a_latecomer_does_not_replace_what_is_newer() -> None:
    grown = tree(transform("map", "base_link", Pose(1.0, 0.0), stamp_s=5.0))
    grown.take([transform("map", "base_link", Pose(9.0, 0.0), stamp_s=4.0)], is_static=False)
    assert grown.find(outer="map", inner="base_link").pose.x == 1.0


def test_a_transform_that_is_told_again_as_it_was_is_no_news() -> None:
    frozen = transform("map", "base_link", Pose(1.0, 0.0), stamp_s=5.0)
    grown = TransformTree()
    assert grown.take([frozen], is_static=False)
    assert not grown.take([frozen], is_static=False)
    assert grown.take([transform("map", "base_link", Pose(1.0, 0.0), stamp_s=5.1)], is_static=False)


def test_a_clock_that_was_set_back_does_not_freeze_the_pose() -> None:
    grown = tree(transform("map", "base_link", Pose(1.0, 0.0), stamp_s=5_000.0))
    grown.take([transform("map", "base_link", Pose(2.0, 0.0), stamp_s=0.5)], is_static=False)
    assert grown.find(outer="map", inner="base_link").pose.x == 2.0


def moving(*poses: tuple[float, Pose]) -> TransformTree:
    return tree(*(transform("map", "base_link", pose, stamp_s=at_s) for at_s, pose in poses))


def test_a_frame_that_moves_is_found_where_it_was() -> None:
    grown = moving((1.0, Pose(0.0, 2.0, 3.0)), (2.0, Pose(1.0, 2.0, -3.0)), (3.0, Pose(5.0, 5.0)))
    found = grown.find(outer="map", inner="base_link", at_s=1.5)
    assert (found.pose.x, found.pose.y, found.stamp_s) == (0.5, 2.0, 1.5)
    assert abs(found.pose.yaw_rad) == pytest.approx(math.pi)
    assert grown.find(outer="map", inner="base_link", at_s=2.0).pose == Pose(1.0, 2.0, -3.0)


def test_before_all_that_was_heard_and_after_it_a_frame_is_where_it_was_last() -> None:
    grown = moving((1.0, Pose(0.0, 0.0)), (2.0, Pose(1.0, 0.0)))
    for at_s in (0.5, 2.0, 2.5, 1e9, math.nan):
        assert grown.find(outer="map", inner="base_link", at_s=at_s).pose == Pose(1.0, 0.0)


def test_each_part_of_a_chain_is_taken_at_the_same_time() -> None:
    grown = moving((1.0, Pose(0.0, 0.0, 0.0)), (2.0, Pose(0.0, 0.0, math.pi / 2)))
    for at_s in (1.2, 1.6):
        arm = transform("base_link", "arm", Pose(at_s, 0.0), stamp_s=at_s)
        grown.take([arm], is_static=False)
    found = grown.find(outer="map", inner="arm", at_s=1.5)
    assert math.hypot(found.pose.x, found.pose.y) == pytest.approx(1.5)
    assert found.pose.yaw_rad == pytest.approx(math.pi / 4)


def test_a_clock_that_was_set_back_leaves_nothing_of_before() -> None:
    grown = moving((5_000.0, Pose(1.0, 0.0)), (0.5, Pose(2.0, 0.0)), (1.5, Pose(3.0, 0.0)))
    assert grown.find(outer="map", inner="base_link", at_s=1.0).pose.x == pytest.approx(2.5)


def test_a_gap_names_both_of_its_edges() -> None:
    grown = tree(
        transform("odom", "base_link", Pose(0.0, 0.0)), transform("earth", "map", Pose(0.0, 0.0))
    )
    with pytest.raises(LinkError, match="gap: from 'base_link' it reaches 'odom' and not 'map'"):
        grown.find(outer="map", inner="base_link")


def test_a_frame_that_is_not_there_is_named_with_those_that_are() -> None:
    grown = tree(transform("odom", "base_link", Pose(0.0, 0.0)))
    with pytest.raises(LinkError, match="no frame 'map'; it has base_link, odom") as raised:
        grown.find(outer="map", inner="base_link")
    assert "AMCL" in raised.value.hint


def test_a_circle_is_found_and_drawn() -> None:
    grown = tree(
        transform("odom", "base_link", Pose(0.0, 0.0)),
        transform("camera", "odom", Pose(0.0, 0.0)),
        transform("base_link", "camera", Pose(0.0, 0.0)),
    )
    with pytest.raises(LinkError, match="circle: base_link -> odom -> camera -> base_link"):
        grown.find(outer="map", inner="base_link")


def test_no_transforms_at_all_are_said() -> None:
    with pytest.raises(LinkError, match="publishes no TF"):
        TransformTree().find(outer="map", inner="base_link")


def test_endless_new_frames_do_not_fill_the_memory() -> None:
    grown = TransformTree()
    for number in range(20_000):
        grown.take([transform("map", f"tag_{number}", Pose(0.0, 0.0))], is_static=False)
    assert len(grown.frames) <= 10_001
