"""What doctor says of a robot's profile."""

from dataclasses import replace

import pytest

from mapspeak.cli.checkup import Finding, Health, describe_profile
from mapspeak.ros.discovery.profile import NavigationKind, RobotProfile
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import LinkKind, LinkName

DDS = LinkName(LinkKind.DDS, "ROS domain 41")
ROBOT = RobotProfile(name="robot", dialect=Dialect.ROS2, distro="kilted", map_topic="/map")


def describe(
    profile: RobotProfile, link: LinkName = DDS, **more: float | str
) -> dict[str, Finding]:
    return {each.what: each for each in describe_profile(profile, link, **more)}  # type: ignore[arg-type]


def test_the_link_is_said_with_why_it_was_taken() -> None:
    assert describe(ROBOT)["link"].said == "DDS, ROS domain 41"
    assert describe(ROBOT, reason="no rclpy")["link"].said == "DDS, ROS domain 41, no rclpy"
    bridge = LinkName(LinkKind.ROSBRIDGE, "ws://robot:9090")
    assert describe(ROBOT, bridge)["link"].said == "rosbridge at ws://robot:9090"


def test_a_distribution_that_is_not_known_is_not_left_away() -> None:
    assert describe(ROBOT)["ROS"].said == "ROS 2, kilted"
    assert "not told" in describe(replace(ROBOT, distro=""))["ROS"].said


def test_the_map_tells_its_age() -> None:
    assert describe(ROBOT, map_age_s=12.34)["map topic"].said == "/map, stamped 12.3 s ago"


@pytest.mark.parametrize(
    ("what", "health", "nobody"),
    [
        ("map topic", Health.MISSING, "nobody publishes it"),
        ("scan topic", Health.DOUBTFUL, "nobody publishes it"),
        ("velocity topic", Health.DOUBTFUL, "nobody listens to it"),
        ("navigation", Health.MISSING, "nobody serves it"),
    ],
)
def test_what_exists_by_name_only_is_not_well(what: str, health: Health, nobody: str) -> None:
    dead = replace(
        ROBOT,
        scan_topic="/scan",
        velocity_topic="/cmd_vel",
        navigation=NavigationKind.NAV2,
        navigation_name="/navigate_to_pose",
        dead_topics=frozenset({"/map", "/scan", "/cmd_vel", "/navigate_to_pose"}),
    )
    assert describe(dead)[what].health is health
    assert f"is named, but {nobody}" in describe(dead)[what].said


def test_of_several_robots_one_is_to_be_chosen() -> None:
    found = describe(replace(ROBOT, other_namespaces=("/a", "/b")))["namespace"]
    assert found.health is Health.MISSING
    assert "`namespace: /a`" in found.hint
