"""Two looks at one robot, the later one better in parts."""

from dataclasses import replace

import pytest

from mapspeak.ros.discovery.profile import (
    CameraTopics,
    NavigationKind,
    PoseSource,
    RobotProfile,
    find_missing,
    improve,
)
from mapspeak.ros.messages.fields import Dialect

WHOLE = RobotProfile(
    name="robot",
    dialect=Dialect.ROS2,
    radius_m=0.35,
    radius_source="costmap",
    map_topic="/map",
    pose_source=PoseSource.TF,
    cameras=(CameraTopics(name="camera", topic="/image"),),
    scan_topic="/scan",
    navigation=NavigationKind.NAV2,
    navigation_name="/navigate_to_pose",
    velocity_topic="/cmd_vel",
)
BARE = RobotProfile(name="robot", dialect=Dialect.ROS2)
GOAL_TOPIC = replace(WHOLE, navigation=NavigationKind.GOAL_TOPIC, navigation_name="/goal_pose")


def later(
    before: RobotProfile,
    now: RobotProfile,
    *,
    is_settled: bool = True,
    keeps_navigation: bool = False,
) -> RobotProfile:
    return improve(before, now, is_settled=is_settled, keeps_navigation=keeps_navigation)


def test_what_is_missing_is_told_by_its_key_in_robot_yaml() -> None:
    assert find_missing(WHOLE) == ()
    without = replace(WHOLE, scan_topic=None, radius_source="")
    assert list(find_missing(without)) == ["scan_topic", "radius_m"]
    assert len(find_missing(BARE)) == 7


def test_what_appears_is_taken_in_and_what_disappears_is_kept() -> None:
    assert later(BARE, WHOLE) == WHOLE
    assert later(WHOLE, BARE) == WHOLE


def test_a_topic_for_goals_gives_way_to_nav2_and_never_the_other_way_round() -> None:
    assert later(GOAL_TOPIC, WHOLE).navigation is NavigationKind.NAV2
    assert later(WHOLE, GOAL_TOPIC).navigation is NavigationKind.NAV2


def test_the_navigation_of_a_drive_under_way_stays() -> None:
    kept = later(GOAL_TOPIC, replace(WHOLE, scan_topic="/better"), keeps_navigation=True)
    assert kept.navigation is NavigationKind.GOAL_TOPIC


@pytest.mark.parametrize(("is_settled", "topic"), [(False, "/map"), (True, "/first/map")])
def test_another_map_is_taken_only_as_long_as_the_robot_is_being_found(
    is_settled: bool,  # noqa: FBT001 - a case
    topic: str,
) -> None:
    first = replace(WHOLE, map_topic="/first/map")
    assert later(first, WHOLE, is_settled=is_settled).map_topic == topic


def test_a_topic_is_alive_again_once_somebody_publishes_it() -> None:
    dead = replace(WHOLE, dead_topics=frozenset({"/image"}))
    assert list(find_missing(dead)) == ["camera_topic"]
    assert later(dead, WHOLE).dead_topics == frozenset()
    assert later(WHOLE, dead).dead_topics == frozenset()


def test_what_tells_more_of_the_same_topic_is_taken_in_late() -> None:
    more = replace(WHOLE.cameras[0], info_topic="/camera_info")
    rear = CameraTopics(name="rear", topic="/rear/image")
    told = replace(WHOLE, cameras=(more, rear))
    assert later(WHOLE, told).cameras == (more, rear)
