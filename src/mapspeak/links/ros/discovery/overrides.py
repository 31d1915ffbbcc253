"""What a person knows better than the search: robot.yaml, one line for each thing."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from mapspeak.ros import NAME, TYPE
from mapspeak.settings import read_settings

TopicName = Annotated[str, Field(pattern=rf"^{NAME.pattern}$")]
TypeName = Annotated[str, Field(pattern=rf"^{TYPE.pattern}$")]
FrameName = Annotated[str, Field(pattern=r"^/?[\w/.-]+$")]
Words = Annotated[str, Field(pattern=r"\S", max_length=200)]


class RobotOverrides(BaseModel):
    """The keys of robot.yaml; what is left away is found by asking the robot.

    Attributes:
        name: How people call the robot.
        ros: 1 or 2.
        namespace: Looks for topics below this name first, such as /robot1.
        radius_m: Of the smallest circle around the robot.
        map_name: Which map or building it drives in.
        map_topic: Of nav_msgs/OccupancyGrid.
        map_updates_topic: Of map_msgs/OccupancyGridUpdate.
        map_frame: The fixed frame of the map.
        base_frame: The robot's own frame.
        pose_topic: "tf", or a topic that tells the pose.
        pose_type: The type of that topic, where the robot does not list it.
        camera_topic: Of sensor_msgs/Image or sensor_msgs/CompressedImage.
        camera_type: The type of that topic, where the robot does not list it.
        camera_info_topic: Of sensor_msgs/CameraInfo.
        scan_topic: Of sensor_msgs/LaserScan.
        navigation: How goals are sent.
        navigation_name: The action, or the topic for goals.
        velocity_topic: Of geometry_msgs/Twist or TwistStamped.
        velocity_type: The type of that topic, where the robot does not list it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Words | None = None
    ros: Literal[1, 2] | None = None
    namespace: TopicName | None = None
    radius_m: Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)] | None = None
    map_name: Words | None = None
    map_topic: TopicName | None = None
    map_updates_topic: TopicName | None = None
    map_frame: FrameName | None = None
    base_frame: FrameName | None = None
    pose_topic: TopicName | None = None
    pose_type: TypeName | None = None
    camera_topic: TopicName | None = None
    camera_type: TypeName | None = None
    camera_info_topic: TopicName | None = None
    scan_topic: TopicName | None = None
    navigation: Literal["nav2", "move_base", "goal_topic", "none"] | None = None
    navigation_name: TopicName | None = None
    velocity_topic: TopicName | None = None
    velocity_type: TypeName | None = None


def load_robot_file(path: Path) -> RobotOverrides:
    """Reads robot.yaml.

    Raises:
        ConfigError: The file cannot be read, or a line of it is wrong; says which.
    """
    advice = "Topics look like /map, types like sensor_msgs/msg/Image, lengths like 0.18."
    return read_settings(path, RobotOverrides, name="robot.yaml", advice=advice)
