"""What a running ROS system consists of."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from mapspeak.ros.messages import Dialect


@dataclass(frozen=True, slots=True, kw_only=True)
class RosGraph:
    """The topics and actions that are there at one moment.

    Attributes:
        dialect: Which ROS it is.
        distro: Such as "jazzy"; empty where the robot does not say.
        types: The type of each topic, as "package/Type".
        actions: The action servers of ROS 2; ROS 1 shows them as topics only.
    """

    dialect: Dialect
    distro: str = ""
    types: Mapping[str, str] = field(default_factory=dict)
    actions: tuple[str, ...] = ()

    def topics_of(self, *types: str) -> list[str]:
        """Gives the topics of some types, in the order of their names."""
        return sorted(topic for topic, type_name in self.types.items() if type_name in types)


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeLinks:
    """What one node has to do with.

    Attributes:
        publishes: Topics, by name.
        subscribes: Topics, by name.
        serves: Services, by name.
    """

    publishes: tuple[str, ...] = ()
    subscribes: tuple[str, ...] = ()
    serves: tuple[str, ...] = ()


class LinkKind(StrEnum):
    """What connects us to a ROS system."""

    ROSBRIDGE = "rosbridge"
    RCLPY = "rclpy"
    DDS = "DDS"


@dataclass(frozen=True, slots=True)
class LinkName:
    """How we are connected.

    Attributes:
        kind: Through what.
        place: Where to, without secrets: an address or a domain.
    """

    kind: LinkKind
    place: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnEnds:
    """What of a ROS system is our own doing.

    Attributes:
        node: The last part of the name of the node that speaks and listens for us; empty where no
            node is told that does.
        publishes: Topics that it publishes for us.
        hears: Topics that it listens to for us.
    """

    node: str = ""
    publishes: frozenset[str] = frozenset()
    hears: frozenset[str] = frozenset()
