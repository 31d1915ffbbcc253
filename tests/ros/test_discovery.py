"""What a robot offers, told from the names and types it lists."""

from pathlib import Path
from typing import Any

import pytest

from mapspeak.errors import ConfigError
from mapspeak.ros.discovery.overrides import RobotOverrides, RosSettings, load_robot_file
from mapspeak.ros.discovery.profile import (
    NavigationKind,
    PoseSource,
    RobotPart,
    RobotProfile,
)
from mapspeak.ros.discovery.topics import choose_profile
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import RosGraph

GRID = "nav_msgs/OccupancyGrid"
TURTLEBOT_4 = {
    "/map": GRID,
    "/map_updates": "map_msgs/OccupancyGridUpdate",
    "/global_costmap/costmap": GRID,
    "/local_costmap/costmap": GRID,
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
    "/odom": "nav_msgs/Odometry",
    "/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    "/goal_pose": "geometry_msgs/PoseStamped",
    "/oakd/rgb/preview/image_raw": "sensor_msgs/Image",
    "/oakd/rgb/preview/image_raw/compressed": "sensor_msgs/CompressedImage",
    "/oakd/rgb/preview/image_raw/compressedDepth": "sensor_msgs/CompressedImage",
    "/oakd/rgb/preview/depth": "sensor_msgs/Image",
    "/oakd/rgb/preview/camera_info": "sensor_msgs/CameraInfo",
    "/scan": "sensor_msgs/LaserScan",
    "/cmd_vel": "geometry_msgs/Twist",
    "/cmd_vel_nav": "geometry_msgs/Twist",
}
FRAMES = frozenset({"map", "odom", "base_footprint", "base_link"})


def choose(
    types: dict[str, str],
    *,
    dialect: Dialect = Dialect.ROS2,
    actions: tuple[str, ...] = (),
    frames: frozenset[str] = FRAMES,
    dead: tuple[str, ...] = (),
    services: tuple[str, ...] | None = None,
    **said: Any,  # noqa: ANN401 - the keys of robot.yaml
) -> RobotProfile:
    graph = RosGraph(dialect=dialect, types=types, actions=actions)
    listed = None if services is None else frozenset(services)
    return choose_profile(
        graph, RobotOverrides(**said), frames=frames, dead=frozenset(dead), services=listed
    )


def test_a_turtlebot_4_is_understood() -> None:
    profile = choose(TURTLEBOT_4, actions=("/dock", "/navigate_to_pose"))
    assert profile.map_topic == "/map"
    assert profile.map_updates_topic == "/map_updates"
    assert profile.pose_source is PoseSource.TF
    assert profile.base_frame == "base_footprint"
    assert profile.camera_topic == "/oakd/rgb/preview/image_raw/compressed"
    (camera,) = profile.cameras
    assert (camera.name, camera.info_topic) == ("oakd", "/oakd/rgb/preview/camera_info")
    assert profile.scan_topic == "/scan"
    assert profile.navigation is NavigationKind.NAV2
    assert profile.navigation_name == "/navigate_to_pose"
    assert profile.velocity_topic == "/cmd_vel"


def test_the_robots_own_planner_is_found() -> None:
    actions = ("/navigate_to_pose", "/compute_path_to_pose")
    assert choose(TURTLEBOT_4, actions=actions).planner_name == "/compute_path_to_pose"
    assert choose(TURTLEBOT_4, actions=actions[:1]).planner_name is None


def test_costmaps_alone_are_no_map() -> None:
    assert choose({"/local_costmap/costmap": GRID}).map_topic is None


@pytest.mark.parametrize(
    ("frames", "topics", "source", "topic"),
    [
        (frozenset(), ("/amcl_pose", "/odom"), PoseSource.POSE_TOPIC, "/amcl_pose"),
        (frozenset({"odom"}), ("/odom",), PoseSource.ODOMETRY, "/odom"),
        (frozenset(), ("/initialpose",), PoseSource.NONE, None),
    ],
)
def test_the_pose_comes_from_the_best_source_and_is_said_which(
    frames: frozenset[str], topics: tuple[str, ...], source: PoseSource, topic: str | None
) -> None:
    profile = choose({each: TURTLEBOT_4[each] for each in topics}, frames=frames)
    assert profile.pose_source is source
    assert profile.pose_topic == topic


def test_move_base_is_found_by_its_goal_topic() -> None:
    types = {
        "/move_base/goal": "move_base_msgs/MoveBaseActionGoal",
        "/move_base_simple/goal": "geometry_msgs/PoseStamped",
    }
    profile = choose(types, dialect=Dialect.ROS1)
    assert profile.navigation is NavigationKind.MOVE_BASE
    assert profile.navigation_name == "/move_base"
    assert profile.planner_name == "/move_base/make_plan"


def test_a_move_base_that_tells_no_status_gives_way_to_a_topic_for_goals() -> None:
    types = {
        "/move_base/goal": "move_base_msgs/MoveBaseActionGoal",
        "/robot/goal": "geometry_msgs/PoseStamped",
    }
    dead = choose(types, dialect=Dialect.ROS1, dead=("/move_base/status",))
    assert dead.navigation is NavigationKind.GOAL_TOPIC
    alone = choose(types, dialect=Dialect.ROS1, dead=("/move_base/status", "/robot/goal"))
    assert alone.navigation is NavigationKind.MOVE_BASE
    assert not RobotPart.NAVIGATION.is_alive(alone)


def test_move_bases_planner_is_named_only_where_it_answers() -> None:
    types = {"/move_base/goal": "move_base_msgs/MoveBaseActionGoal"}
    for services, found in (((), None), (("/move_base/make_plan",), "/move_base/make_plan")):
        profile = choose(types, dialect=Dialect.ROS1, services=services)
        assert profile.planner_name == found


def test_a_topic_that_somebody_publishes_comes_before_a_better_name() -> None:
    types = {"/scan": "sensor_msgs/LaserScan", "/other_scan": "sensor_msgs/LaserScan"}
    assert choose(types, dead=("/scan",)).scan_topic == "/other_scan"
    assert choose(types, dead=("/scan", "/other_scan")).scan_topic == "/scan"


def test_an_action_that_robot_yaml_names_and_nobody_serves_is_not_alive() -> None:
    assert not RobotPart.NAVIGATION.is_alive(choose(TURTLEBOT_4, navigation="nav2"))
    served = choose(TURTLEBOT_4, navigation="nav2", actions=("/navigate_to_pose",))
    assert RobotPart.NAVIGATION.is_alive(served)


def in_namespaces(*robots: str) -> dict[str, str]:
    return {
        f"/{robot}{topic}": type_name
        for robot in robots
        for topic, type_name in TURTLEBOT_4.items()
    }


def test_the_only_robot_is_found_in_its_namespace() -> None:
    profile = choose(in_namespaces("robot1"))
    assert profile.namespace == "/robot1"
    assert profile.tf_topics == ("/robot1/tf", "/robot1/tf_static")
    assert profile.name == "robot1"


def test_a_name_of_frames_that_nobody_publishes_hides_no_namespace() -> None:
    types = {**in_namespaces("robot1"), "/tf": "tf2_msgs/TFMessage"}
    assert choose(types).namespace == ""
    assert choose(types, dead=("/tf",)).namespace == "/robot1"


@pytest.mark.parametrize("said", ["robot1", "/robot1", "/robot1/"])
def test_a_namespace_is_the_same_with_a_slash_and_without(said: str) -> None:
    profile = choose(in_namespaces("robot1", "robot2"), namespace=said)
    assert profile.namespace == "/robot1"
    assert profile.tf_topics == ("/robot1/tf", "/robot1/tf_static")
    assert profile.other_namespaces == ()


def test_of_several_robots_none_is_chosen_silently() -> None:
    assert choose(in_namespaces("a", "b")).other_namespaces == ("/a", "/b")


def test_of_several_robots_none_is_mixed_with_another_where_none_was_chosen() -> None:
    profile = choose(in_namespaces("a", "b"), actions=("/b/navigate_to_pose",))
    assert profile.navigation_name == "/a/goal_pose"
    used = (profile.map_topic, profile.scan_topic, profile.velocity_topic, *profile.tf_topics)
    assert all(topic is not None and topic.startswith("/a/") for topic in used)


def test_a_goal_topic_serves_where_there_is_no_action() -> None:
    profile = choose({"/goal_pose": "geometry_msgs/PoseStamped"})
    assert profile.navigation is NavigationKind.GOAL_TOPIC
    assert profile.navigation_name == "/goal_pose"


def test_a_robot_without_navigation_has_none() -> None:
    assert choose({"/map": GRID}).navigation is NavigationKind.NONE


def test_of_several_robots_the_one_of_the_namespace_is_taken() -> None:
    types = {
        f"/{robot}{topic}": type_name
        for robot in ("alpha", "beta")
        for topic, type_name in TURTLEBOT_4.items()
    }
    frames = frozenset({"map", "alpha/base_link", "beta/base_link"})
    profile = choose(
        types,
        frames=frames,
        namespace="/beta",
        actions=("/alpha/navigate_to_pose", "/beta/navigate_to_pose"),
    )
    assert profile.map_topic == "/beta/map"
    assert profile.map_updates_topic == "/beta/map_updates"
    assert profile.scan_topic == "/beta/scan"
    assert profile.velocity_topic == "/beta/cmd_vel"
    assert profile.navigation_name == "/beta/navigate_to_pose"
    assert profile.base_frame == "beta/base_link"
    assert profile.tf_topics == ("/beta/tf", "/beta/tf_static")
    assert profile.name == "beta"


def test_what_the_chosen_robot_lacks_is_not_taken_from_another_one() -> None:
    types = {
        **in_namespaces("alpha"),
        "/beta/tf": "tf2_msgs/TFMessage",
        "/map": GRID,
        "/camera/image_raw": "sensor_msgs/Image",
    }
    profile = choose(
        types,
        frames=frozenset({"map", "alpha/base_link"}),
        namespace="beta",
        actions=("/alpha/navigate_to_pose",),
    )
    assert profile.navigation is NavigationKind.NONE
    assert profile.velocity_topic is None
    assert profile.scan_topic is None
    assert profile.base_frame == "base_link"
    # What is in no robot's namespace serves all of them.
    assert profile.map_topic == "/map"
    assert profile.camera_topic == "/camera/image_raw"


@pytest.mark.parametrize(
    ("frames", "actions"),
    [({"map", "alpha/base_link"}, ()), ({"map"}, ("/alpha/navigate_to_pose",))],
)
def test_another_robot_is_known_by_its_frames_and_its_navigation_too(
    frames: set[str], actions: tuple[str, ...]
) -> None:
    types = {"/tf": "tf2_msgs/TFMessage", "/alpha/cmd_vel": "geometry_msgs/Twist"}
    found = choose(types, frames=frozenset(frames), actions=actions, namespace="beta")
    assert found.velocity_topic is None


def test_every_field_that_a_person_says_is_taken_as_it_stands() -> None:
    profile = choose(
        TURTLEBOT_4,
        name="Ada",
        radius_m=0.17,
        map_name="office",
        map_topic="/other/map",
        map_frame="world",
        base_frame="chassis",
        pose_topic="/odom",
        camera_topic="/cam/image_raw",
        camera_type="sensor_msgs/msg/Image",
        scan_topic="/laser",
        navigation="goal_topic",
        velocity_topic="/drive",
        velocity_type="geometry_msgs/msg/TwistStamped",
    )
    assert profile.name == "Ada"
    assert profile.radius_m == 0.17
    assert profile.map_topic == "/other/map"
    assert profile.map_updates_topic is None
    assert profile.map_frame == "world"
    assert profile.base_frame == "chassis"
    assert profile.pose_source is PoseSource.ODOMETRY
    assert profile.cameras[0].type_name == "sensor_msgs/Image"
    assert profile.scan_topic == "/laser"
    assert profile.navigation_name == "/goal_pose"
    assert profile.velocity_type == "geometry_msgs/TwistStamped"


def load(tmp_path: Path, text: str) -> RobotOverrides:
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    return load_robot_file(path)


def test_robot_yaml_is_read(tmp_path: Path) -> None:
    said = load(tmp_path, "name: Ada  # after the countess\nros: 2\nradius_m: 0.17\n")
    assert said == RobotOverrides(name="Ada", ros=RosSettings(version=2), radius_m=0.17)
    assert load(tmp_path, "# nothing\n") == RobotOverrides()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("name: Ada\nmap_topik: /map\n", "line 2: 'map_topik' is not a key"),
        ("name: Ada\n\nmap_topic: no topic\n", "line 3: 'map_topic' cannot be 'no topic'"),
        ("radius_m: -1\n", "line 1: 'radius_m' cannot be '-1'"),
        ("radius_m: .nan\n", "line 1: 'radius_m'"),
        ("ros: 3\n", "line 1: 'ros.version' cannot be '3'"),
        ("navigation: fly\n", "line 1: 'navigation' cannot be 'fly'"),
        ("- a\n- b\n", "not a list of keys"),
        ("name: [\n", "line 2 is no YAML"),
        ("name: a\nname: b\n", "line 2 is no YAML"),
    ],
)
def test_a_wrong_line_of_robot_yaml_is_named(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(ConfigError) as raised:
        load(tmp_path, text)
    assert told in raised.value.message


def test_the_section_ros_says_how_the_robot_is_found(tmp_path: Path) -> None:
    section = "ros:\n  version: 2\n  domain_id: 41\n  static_peers: [10.0.0.7, robot.local]\n"
    said = load(tmp_path, section + "  discovery_range: LOCALHOST\n").ros
    assert said.version == 2
    assert said.variables == {
        "ROS_DOMAIN_ID": "41",
        "ROS_STATIC_PEERS": "10.0.0.7;robot.local",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }


def test_a_misspelt_key_of_the_section_ros_is_answered_with_the_right_one(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="line 2") as raised:
        load(tmp_path, "ros:\n  domain: 41\n")
    assert "`domain_id`" in raised.value.hint


def test_a_misspelt_key_is_answered_with_the_right_one(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as raised:
        load(tmp_path, "map_topik: /map\n")
    assert "`map_topic`" in raised.value.hint


def test_a_robot_file_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        load_robot_file(tmp_path / "none.yaml")
