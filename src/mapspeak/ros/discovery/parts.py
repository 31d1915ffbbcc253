"""What a robot is used for, part by part: how good each one found is, and which find is better."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum

from mapspeak.ros.discovery.profile import (
    NavigationKind,
    PoseSource,
    RobotProfile,
    end_of_goals,
)


class Worth(IntEnum):
    """How good a part is that was found, the worst first."""

    MISSING = 0
    NAMED = 1
    SECOND_BEST = 2
    FULL = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotPart:
    """What belongs together in a profile.

    Attributes:
        key: By which robot.yaml names it.
        topic: Gives the topic, or the action, that shows whether it is alive.
        is_heard: We publish that topic, and the robot listens.
        is_second_best: Tells whether there may be better.
    """

    key: str
    fields: tuple[str, ...]
    topic: Callable[[RobotProfile], str | None]
    is_heard: Callable[[RobotProfile], bool] = lambda _: False
    is_second_best: Callable[[RobotProfile], bool] = lambda _: False

    def worth(self, profile: RobotProfile) -> Worth:
        """Return how good it is."""
        topic = self.topic(profile)
        if topic is None:
            return Worth.MISSING
        if topic in profile.dead_topics:
            return Worth.NAMED
        return Worth.SECOND_BEST if self.is_second_best(profile) else Worth.FULL

    def is_alive(self, profile: RobotProfile) -> bool:
        """Tell whether it is there, and not by name only."""
        return self.worth(profile) > Worth.NAMED

    def values(self, profile: RobotProfile) -> dict[str, object]:
        """Return its fields."""
        return {name: getattr(profile, name) for name in self.fields}


def _show_pose(profile: RobotProfile) -> str | None:
    return profile.tf_topics[0] if profile.pose_source is PoseSource.TF else profile.pose_topic


def _show_navigation(profile: RobotProfile) -> str | None:
    return end_of_goals(profile.navigation, profile.navigation_name)


MAP = RobotPart(
    key="map_topic",
    fields=("map_topic", "map_updates_topic", "other_map_topics"),
    topic=lambda profile: profile.map_topic,
)
POSE = RobotPart(
    key="pose_topic",
    fields=(
        *("pose_source", "pose_topic", "pose_type", "map_frame", "base_frame", "tf_topics"),
        *("namespace", "other_namespaces", "name"),
    ),
    topic=_show_pose,
    is_second_best=lambda profile: profile.pose_source is not PoseSource.TF,
)
CAMERA = RobotPart(
    key="camera_topic",
    fields=("camera_topic", "camera_type", "camera_info_topic"),
    topic=lambda profile: profile.camera_topic,
)
LASER = RobotPart(
    key="scan_topic", fields=("scan_topic",), topic=lambda profile: profile.scan_topic
)
NAVIGATION = RobotPart(
    key="navigation",
    fields=("navigation", "navigation_name", "planner_name"),
    topic=_show_navigation,
    is_heard=lambda profile: profile.navigation is NavigationKind.GOAL_TOPIC,
    is_second_best=lambda profile: profile.navigation is NavigationKind.GOAL_TOPIC,
)
VELOCITY = RobotPart(
    key="velocity_topic",
    fields=("velocity_topic", "velocity_type"),
    topic=lambda profile: profile.velocity_topic,
    is_heard=lambda _: True,
)
RADIUS = RobotPart(
    key="radius_m",
    fields=("radius_m", "radius_source"),
    topic=lambda profile: profile.radius_source or None,
)
PARTS = (MAP, POSE, CAMERA, LASER, NAVIGATION, VELOCITY, RADIUS)


def find_missing(profile: RobotProfile) -> tuple[RobotPart, ...]:
    """Return the parts of which better may be found."""
    return tuple(part for part in PARTS if part.worth(profile) is not Worth.FULL)


def improve(
    before: RobotProfile, now: RobotProfile, *, is_settled: bool, keeps_navigation: bool
) -> RobotProfile:
    """Return the better of two looks, part by part: what was found is not lost by a later look.

    Args:
        before: As the robot is used.
        now: As it looks now.
        is_settled: What is as good as before is used no more for another one.
        keeps_navigation: A drive of ours runs over the navigation of before.
    """
    values: dict[str, object] = {}
    dead: set[str] = set()
    for part in PARTS:
        is_kept = keeps_navigation and part is NAVIGATION
        source = before if is_kept or not _is_better(part, before, now, is_settled) else now
        values |= part.values(source)
        topic = part.topic(source)
        if topic in source.dead_topics:
            dead.add(topic)
    # An unknown distribution or clock may be known by now.
    values["distro"] = now.distro or before.distro
    values["clock_topic"] = before.clock_topic or now.clock_topic
    return replace(before, dead_topics=frozenset(dead), **values)  # type: ignore[arg-type]


def _is_better(part: RobotPart, before: RobotProfile, now: RobotProfile, is_settled: bool) -> bool:  # noqa: FBT001
    if part.worth(now) != part.worth(before):
        return part.worth(now) > part.worth(before)
    return not is_settled or part.topic(now) == part.topic(before)
