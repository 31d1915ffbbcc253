"""What a person knows better than the search: robot.yaml, one line for each thing."""

import difflib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from mapspeak.errors import ConfigError
from mapspeak.ros import NAME, TYPE

MAX_FILE_BYTES = 1_000_000
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
    tree = _load_yaml(path)
    if tree is None:
        return RobotOverrides()
    if not isinstance(tree, dict):
        raise ConfigError(
            f"{path} is not a list of keys and values.", hint="Write lines like `map_topic: /map`."
        )
    try:
        return RobotOverrides.model_validate(dict(tree))
    except ValidationError as error:
        raise _fault_in(path, tree, error) from error


def _load_yaml(path: Path) -> Any:  # noqa: ANN401 - whatever a person wrote
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise ConfigError(
                f"{path} is larger than {MAX_FILE_BYTES:,} bytes.",
                hint="Give the robot.yaml, not a recording or a map.",
            )
        return YAML(typ="rt").load(path.read_text(encoding="utf-8"))
    except MarkedYAMLError as error:
        mark = error.problem_mark
        line = f", line {mark.line + 1}" if mark is not None else ""
        raise ConfigError(
            f"{path}{line} is no YAML: {error.problem}.", hint="Write `key: value` on each line."
        ) from error
    except (OSError, UnicodeDecodeError, YAMLError, RecursionError) as error:
        raise ConfigError(
            f"{path} cannot be read: {error}.", hint="Check the path, and that it is a text file."
        ) from error


def _fault_in(path: Path, tree: Any, error: ValidationError) -> ConfigError:  # noqa: ANN401
    first, *others = error.errors()
    key = str(first["loc"][0]) if first["loc"] else ""
    more = f" {len(others)} more lines are wrong." if others else ""
    if first["type"] == "extra_forbidden":
        known = difflib.get_close_matches(key, RobotOverrides.model_fields, n=1)
        what = f"'{key}' is not a key of robot.yaml."
        hint = f"Did you mean `{known[0]}`?" if known else f"The keys are: {_keys()}."
    else:
        what = f"'{key}' cannot be {str(first['input'])[:80]!r}: {first['msg']}."
        hint = "Topics look like /map, types like sensor_msgs/msg/Image, lengths like 0.18."
    return ConfigError(f"{path}, line {_line_of(tree, key)}: {what}{more}", hint=hint)


def _line_of(tree: Any, key: str) -> int:  # noqa: ANN401 - ruamel's own mapping
    lines = tree.lc.data or {}
    return int(lines[key][0]) + 1 if key in lines else 1


def _keys() -> str:
    return ", ".join(RobotOverrides.model_fields)
