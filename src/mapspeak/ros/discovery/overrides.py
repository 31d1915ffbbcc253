"""Overrides of the search by a person: robot.yaml, one line for each thing."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from mapspeak.ros.messages.fields import NAME, TYPE
from mapspeak.settings import read_settings

TopicName = Annotated[str, Field(pattern=rf"^{NAME.pattern}$")]
Namespace = Annotated[str, Field(pattern=rf"^{NAME.pattern}/?$")]
TypeName = Annotated[str, Field(pattern=rf"^{TYPE.pattern}$")]
FrameName = Annotated[str, Field(pattern=r"^/?[\w/.-]+$")]
Words = Annotated[str, Field(pattern=r"\S", max_length=200)]


CameraName = Annotated[str, Field(pattern=r"^[\w/.-]+$", max_length=60)]
PlainWord = Annotated[str, Field(pattern=r"^[\w.:%-]+$", max_length=200)]


class RosSettings(BaseModel):
    """The section `ros` of robot.yaml: the ROS that the robot runs, and how it is found over DDS.

    Attributes:
        static_peers: Addresses of machines that multicast does not reach, as in ROS_STATIC_PEERS.
        rmw_implementation: As in RMW_IMPLEMENTATION; for `--robot ros2` only.
        cyclonedds_uri: As in CYCLONEDDS_URI: the path of a file, or the settings themselves.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    version: Literal[1, 2] | None = None
    domain_id: Annotated[int, Field(ge=0, le=232)] | None = None
    discovery_range: Literal["SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT"] | None = None
    static_peers: tuple[PlainWord, ...] = ()
    rmw_implementation: PlainWord | None = None
    cyclonedds_uri: Annotated[str, Field(pattern=r"\S", max_length=20_000)] | None = None

    @property
    def variables(self) -> dict[str, str]:
        """These settings as the environment variables that ROS reads."""
        said = {
            "ROS_DOMAIN_ID": None if self.domain_id is None else str(self.domain_id),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": self.discovery_range,
            "ROS_STATIC_PEERS": ";".join(self.static_peers) or None,
            "RMW_IMPLEMENTATION": self.rmw_implementation,
            "CYCLONEDDS_URI": self.cyclonedds_uri,
        }
        return {name: value for name, value in said.items() if value is not None}


def _as_section(said: object) -> object:
    """Return the section that a bare number stands for."""
    return {"version": said} if isinstance(said, int) else said


class RobotOverrides(BaseModel):
    """The keys of robot.yaml; what is left away is found by asking the robot.

    Attributes:
        ros: Which ROS it runs, 1 or 2, or a section that says more; see `RosSettings`.
        namespace: Looks for topics and frames below this name first: robot1, or /robot1.
        pose_topic: "tf", or a topic that tells the pose.
        pose_type: The type of that topic, where the robot does not list it.
        camera_topic: Of sensor_msgs/Image or sensor_msgs/CompressedImage.
        cameras: Such topics by the names that the cameras have; without `camera_topic` the first
            looks ahead.
        camera_type: The type of that topic, where the robot does not list it.
        navigation_name: The action, or the topic for goals.
        velocity_topic: Of geometry_msgs/Twist or TwistStamped.
        velocity_type: The type of that topic, where the robot does not list it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Words | None = None
    ros: Annotated[RosSettings, BeforeValidator(_as_section)] = RosSettings()
    namespace: Namespace | None = None
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
    cameras: Annotated[dict[CameraName, TopicName], Field(max_length=12)] = Field(
        default_factory=dict
    )
    scan_topic: TopicName | None = None
    navigation: Literal["nav2", "move_base", "goal_topic", "none"] | None = None
    navigation_name: TopicName | None = None
    velocity_topic: TopicName | None = None
    velocity_type: TypeName | None = None


def load_robot_file(path: Path) -> RobotOverrides:
    """Read robot.yaml.

    Raises:
        ConfigError: The file cannot be read, or a line of it is wrong; says which.
    """
    advice = "Topics look like /map, types like sensor_msgs/msg/Image, lengths like 0.18."
    return read_settings(path, RobotOverrides, name="robot.yaml", advice=advice)
