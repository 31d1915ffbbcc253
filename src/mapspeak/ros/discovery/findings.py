"""What was found on a robot, as lines of a check-up, with how to start what is missing."""

from mapspeak.robot import Finding, Health
from mapspeak.ros import LinkKind, LinkName
from mapspeak.ros.discovery.parts import CAMERA, LASER, MAP, NAVIGATION, VELOCITY, RobotPart, Worth
from mapspeak.ros.discovery.profile import NavigationKind, PoseSource, RobotProfile

START_MAP = "Start SLAM (slam_toolbox, cartographer, gmapping) or a map server on the robot."
START_POSE = "Start SLAM or AMCL on the robot, so that TF leads from the map to its base."
START_CAMERA = (
    "Start the camera driver, or name camera_topic in robot.yaml; all else works without."
)
START_LASER = "Start the laser's driver, or name scan_topic in robot.yaml; all else works without."
START_NAVIGATION = "Start Nav2 (ROS 1: move_base) on the robot, or name navigation in robot.yaml."
START_RADIUS = "Name radius_m in robot.yaml: the navigation does not tell it (robot_radius)."
START_VELOCITY = "Name velocity_topic in robot.yaml, so that a stop can command zero velocity."


def describe_profile(
    profile: RobotProfile, link: LinkName, *, reason: str = "", map_age_s: float | None = None
) -> tuple[Finding, ...]:
    """Return a line for each thing that mapspeak uses of a robot.

    Args:
        profile: What was found.
        link: How we are connected.
        reason: Why in that way; empty where nobody could wonder.
        map_age_s: Since the map's stamp; None where there is no map.
    """
    ros = "ROS 1" if profile.dialect == "ros1" else "ROS 2"
    distro = profile.distro or "distribution not told"
    age = "" if map_age_s is None else f", stamped {map_age_s:.1f} s ago"
    return (
        Finding(what="link", health=Health.FINE, said=_say_link(link) + (reason and f", {reason}")),
        Finding(what="ROS", health=Health.FINE, said=f"{ros}, {distro}"),
        *_describe_namespace(profile),
        _describe(MAP, "map topic", profile, START_MAP, Health.MISSING, more=age),
        _describe_pose(profile),
        _describe(CAMERA, "camera topic", profile, START_CAMERA),
        _describe(LASER, "scan topic", profile, START_LASER),
        _describe_navigation(profile),
        _describe_planner(profile),
        _describe(VELOCITY, "velocity topic", profile, START_VELOCITY),
        _describe_radius(profile),
    )


def _say_link(link: LinkName) -> str:
    return f"{link.kind}{' at' if link.kind is LinkKind.ROSBRIDGE else ','} {link.place}"


def _describe(
    part: RobotPart,
    what: str,
    profile: RobotProfile,
    hint: str,
    health: Health = Health.DOUBTFUL,
    *,
    more: str = "",
) -> Finding:
    topic = part.topic(profile)
    match part.worth(profile):
        case Worth.MISSING:
            return Finding(what=what, health=health, said="none found", hint=hint)
        case Worth.NAMED:
            nobody = "listens to it" if part.is_heard(profile) else "publishes it"
            said = f"{topic} is named, but nobody {nobody}"
            return Finding(what=what, health=health, said=said, hint=hint)
        case _:
            return Finding(what=what, health=Health.FINE, said=f"{topic}{more}")


def _describe_namespace(profile: RobotProfile) -> tuple[Finding, ...]:
    others = profile.other_namespaces
    if others:
        said = f"{len(others)} robots are here: {', '.join(others)}"
        hint = f"Say in robot.yaml which one is meant: `namespace: {others[0]}`."
        return (Finding(what="namespace", health=Health.MISSING, said=said, hint=hint),)
    if not profile.namespace:
        return ()
    return (Finding(what="namespace", health=Health.FINE, said=profile.namespace),)


def _describe_pose(profile: RobotProfile) -> Finding:
    what = "pose source"
    match profile.pose_source:
        case PoseSource.TF:
            said = f"TF from {profile.map_frame} to {profile.base_frame}"
            return Finding(what=what, health=Health.FINE, said=said)
        case PoseSource.POSE_TOPIC:
            return Finding(what=what, health=Health.FINE, said=f"{profile.pose_topic}")
        case PoseSource.ODOMETRY:
            said = f"{profile.pose_topic}: odometry, which drifts against the map"
            return Finding(what=what, health=Health.DOUBTFUL, said=said, hint=START_POSE)
        case PoseSource.NONE:
            return Finding(what=what, health=Health.MISSING, said="none found", hint=START_POSE)


def _describe_planner(profile: RobotProfile) -> Finding:
    said = profile.planner_name or "none found, and none needed for goals"
    return Finding(what="planner", health=Health.FINE, said=said)


def _describe_radius(profile: RobotProfile) -> Finding:
    said = f"{profile.radius_m:.2f} m, {profile.radius_source or 'assumed'}"
    if profile.radius_source:
        return Finding(what="radius", health=Health.FINE, said=said)
    return Finding(what="radius", health=Health.DOUBTFUL, said=said, hint=START_RADIUS)


def _describe_navigation(profile: RobotProfile) -> Finding:
    what, name = "navigation", profile.navigation_name
    worth = NAVIGATION.worth(profile)
    if worth is Worth.MISSING:
        return Finding(what=what, health=Health.MISSING, said="none found", hint=START_NAVIGATION)
    if worth is Worth.NAMED:
        said = f"{profile.navigation}: {name} is named, but nobody serves it"
        return Finding(what=what, health=Health.MISSING, said=said, hint=START_NAVIGATION)
    if profile.navigation is NavigationKind.GOAL_TOPIC:
        said = f"{name}: a topic for goals, which does not say how a drive ends"
        return Finding(what=what, health=Health.DOUBTFUL, said=said, hint=START_NAVIGATION)
    return Finding(what=what, health=Health.FINE, said=f"{profile.navigation}: {name}")
