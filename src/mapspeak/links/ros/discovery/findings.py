"""What was found on a robot, as lines of a check-up, with how to start what is missing."""

from mapspeak.links.ros.discovery.profile import NavigationKind, PoseSource, RobotProfile
from mapspeak.robot import Finding, Health

START_MAP = "Start SLAM (slam_toolbox, cartographer, gmapping) or a map server on the robot."
START_POSE = "Start SLAM or AMCL on the robot, so that TF leads from the map to its base."
START_CAMERA = (
    "Start the camera driver, or name camera_topic in robot.yaml; all else works without."
)
START_LASER = "Start the laser's driver, or name scan_topic in robot.yaml; all else works without."
START_NAVIGATION = "Start Nav2 (ROS 1: move_base) on the robot, or name navigation in robot.yaml."
START_RADIUS = "Name radius_m in robot.yaml: the navigation does not tell it (robot_radius)."
START_VELOCITY = "Name velocity_topic in robot.yaml, so that a stop can command zero velocity."


def describe_profile(profile: RobotProfile) -> tuple[Finding, ...]:
    """Gives a line for each thing that mapspeak uses of a robot."""
    ros = "ROS 1" if profile.dialect == "ros1" else "ROS 2"
    return (
        Finding(what="ROS", health=Health.FINE, said=f"{ros} {profile.distro}".strip()),
        _found("map topic", profile.map_topic, START_MAP),
        _describe_pose(profile),
        _found("camera topic", profile.camera_topic, START_CAMERA, Health.DOUBTFUL),
        _found("scan topic", profile.scan_topic, START_LASER, Health.DOUBTFUL),
        _describe_navigation(profile),
        _describe_planner(profile),
        _found("velocity topic", profile.velocity_topic, START_VELOCITY, Health.DOUBTFUL),
        _describe_radius(profile),
    )


def _found(what: str, name: str | None, hint: str, health: Health = Health.MISSING) -> Finding:
    if name is None:
        return Finding(what=what, health=health, said="none found", hint=hint)
    return Finding(what=what, health=Health.FINE, said=name)


def _describe_pose(profile: RobotProfile) -> Finding:
    match profile.pose_source:
        case PoseSource.TF:
            said = f"TF from {profile.map_frame} to {profile.base_frame}"
            return Finding(what="pose source", health=Health.FINE, said=said)
        case PoseSource.POSE_TOPIC:
            return Finding(what="pose source", health=Health.FINE, said=f"{profile.pose_topic}")
        case PoseSource.ODOMETRY:
            return Finding(
                what="pose source",
                health=Health.DOUBTFUL,
                said=f"{profile.pose_topic}: odometry, which drifts against the map",
                hint=START_POSE,
            )
        case PoseSource.NONE:
            return _found("pose source", None, START_POSE)


def _describe_planner(profile: RobotProfile) -> Finding:
    said = profile.planner_name or "none found, and none needed for goals"
    return Finding(what="planner", health=Health.FINE, said=said)


def _describe_radius(profile: RobotProfile) -> Finding:
    said = f"{profile.radius_m:.2f} m, {profile.radius_source or 'assumed'}"
    if profile.radius_source:
        return Finding(what="radius", health=Health.FINE, said=said)
    return Finding(what="radius", health=Health.DOUBTFUL, said=said, hint=START_RADIUS)


def _describe_navigation(profile: RobotProfile) -> Finding:
    name = profile.navigation_name
    if profile.navigation is NavigationKind.GOAL_TOPIC:
        return Finding(
            what="navigation",
            health=Health.DOUBTFUL,
            said=f"{name}: a topic for goals, which does not say how a drive ends",
            hint=START_NAVIGATION,
        )
    said = None if name is None else f"{profile.navigation}: {name}"
    return _found("navigation", said, START_NAVIGATION)
