"""The nodes and topics of a ROS system and who is at their ends; what names may look like."""

import difflib
import re
import uuid
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from mapspeak.ros.messages import Dialect

NAME = re.compile(r"[~/]?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")
TYPE = re.compile(r"[A-Za-z]\w*(?:/(?:msg|srv|action))?/[A-Za-z]\w*")


def new_id() -> str:
    """Return an id that no other client of the same robot uses: 32 hex digits."""
    return uuid.uuid4().hex


def find_nearest(name: str, names: Iterable[str], *, most: int = 3) -> list[str]:
    """Return the names most like one, the most alike first: what somebody may have meant."""
    known = list(names)
    last = name.rstrip("/").rpartition("/")[2].lower()
    ending = [each for each in known if last and each.lower().endswith(f"/{last}")]
    like = difflib.get_close_matches(name, known, n=most, cutoff=0.5)
    return list(dict.fromkeys([*ending, *like]))[:most]


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
        """Return the topics of some types, in the order of their names."""
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
