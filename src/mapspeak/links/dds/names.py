"""How ROS 2 names its topics, services, actions and types in DDS."""

import re
from dataclasses import dataclass

from mapspeak.ros.messages import bare_type

TOPIC, REQUEST, REPLY = "rt", "rq", "rr"
DISCOVERY_TOPIC = "ros_discovery_info"
DISCOVERY_TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"
SERVICE_PART = re.compile(r"_(?:Request|Response)$")
ACTION_PART = re.compile(r"_(?:SendGoal|GetResult)$|_FeedbackMessage$")


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceName:
    """One service, or one of the three services of an action.

    Attributes:
        service: Its full name, such as /robot/get_parameters.
        type_name: Such as "rcl_interfaces/srv/GetParameters".
    """

    service: str
    type_name: str

    @property
    def request_topic(self) -> str:
        """Where requests are written."""
        return request_topic(self.service)

    @property
    def reply_topic(self) -> str:
        """Where the answers to everybody's requests come."""
        return reply_topic(self.service)

    @property
    def request_type(self) -> str:
        """The type of the request as a message."""
        return f"{self.type_name}_Request"

    @property
    def reply_type(self) -> str:
        """The type of the answer as a message."""
        return f"{self.type_name}_Response"


def full_type(name: str, *, kind: str = "msg") -> str:
    """Gives a type as "package/kind/Type", however it was written."""
    package, *middle, last = name.strip("/").split("/")
    return f"{package}/{middle[0] if middle else kind}/{last}"


def dds_type(name: str) -> str:
    """Gives "nav_msgs::msg::dds_::OccupancyGrid_" for "nav_msgs/msg/OccupancyGrid"."""
    package, kind, last = full_type(name).split("/")
    return f"{package}::{kind}::dds_::{last}_"


def ros_type(dds_name: str) -> str | None:
    """Gives "nav_msgs/msg/OccupancyGrid"; None for a type that is not of ROS."""
    match dds_name.split("::"):
        case [package, kind, "dds_", last] if last.endswith("_"):
            return f"{package}/{kind}/{last[:-1]}"
        case _:
            return None


def dds_topic(topic: str) -> str:
    """Gives "rt/map" for "/map"."""
    return f"{TOPIC}/{topic.lstrip('/')}"


def request_topic(service: str) -> str:
    """Gives "rq/robot/get_parametersRequest" for "/robot/get_parameters"."""
    return f"{REQUEST}/{service.lstrip('/')}Request"


def reply_topic(service: str) -> str:
    """Gives "rr/robot/get_parametersReply" for "/robot/get_parameters"."""
    return f"{REPLY}/{service.lstrip('/')}Reply"


def topic_of(dds_name: str) -> str | None:
    """Gives "/map" for "rt/map"; None for what is no topic of ROS."""
    return dds_name[len(TOPIC) :] if dds_name.startswith(f"{TOPIC}/") else None


def service_of(dds_name: str) -> str | None:
    """Gives the service whose answers come on a topic of DDS; None where none do."""
    is_reply = dds_name.startswith(f"{REPLY}/") and dds_name.endswith("Reply")
    return dds_name[len(REPLY) : -len("Reply")] if is_reply else None


def is_hidden(name: str) -> bool:
    """True for what `ros2 topic list` and `ros2 service list` leave out, as actions' parts."""
    return any(part.startswith("_") for part in name.split("/"))


def service_type_of(reply_type: str) -> str:
    """Gives a service's type for that of its answers: "std_srvs/SetBool"."""
    return bare_type(SERVICE_PART.sub("", reply_type))


def action_type_of(part_type: str) -> str:
    """Gives an action's type for that of one of its services: "nav2_msgs/NavigateToPose"."""
    return bare_type(ACTION_PART.sub("", SERVICE_PART.sub("", part_type)))
