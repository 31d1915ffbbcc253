"""The port to a ROS system, and its values for nodes and topics."""

import difflib
import uuid
from collections.abc import Callable, Coroutine, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol

from mapspeak.errors import LinkError
from mapspeak.ros.activity import ActionGoal, Started, Subscription
from mapspeak.ros.messages.fields import Dialect, Message
from mapspeak.ros.patience import Patience


def new_id() -> str:
    """Return an id that no other client of the same robot uses: 32 hex digits."""
    return uuid.uuid4().hex


def find_nearest(name: str, names: Iterable[str], *, most: int = 3) -> list[str]:
    """Return the names most like a misspelled one, the most alike first."""
    known = list(names)
    last = name.rstrip("/").rpartition("/")[2].lower()
    ending = [each for each in known if last and each.lower().endswith(f"/{last}")]
    like = difflib.get_close_matches(name, known, n=most, cutoff=0.5)
    return list(dict.fromkeys([*ending, *like]))[:most]


@dataclass(frozen=True, slots=True, kw_only=True)
class RosGraph:
    """The topics and actions that are there at one moment.

    Attributes:
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
    """The topics and services of one node."""

    publishes: tuple[str, ...] = ()
    subscribes: tuple[str, ...] = ()
    serves: tuple[str, ...] = ()


class LinkKind(StrEnum):
    """The kinds of connections to a ROS system."""

    ROSBRIDGE = "rosbridge"
    RCLPY = "rclpy"
    DDS = "DDS"


@dataclass(frozen=True, slots=True)
class LinkName:
    """How we are connected.

    Attributes:
        place: Where to, without secrets: an address or a domain.
    """

    kind: LinkKind
    place: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnEnds:
    """The part of a ROS graph that is our own.

    Attributes:
        node: The last part of the name of the node that publishes and subscribes for us; empty
            where the graph shows none.
        publishes: Topics that it publishes for us.
        hears: Topics that it subscribes to for us.
    """

    node: str = ""
    publishes: frozenset[str] = frozenset()
    hears: frozenset[str] = frozenset()


class RosConnection(Protocol):
    """One ROS system, kept connected. Waiting is limited in wall time; a limit closes nothing.

    Methods raise `LinkError` when the system cannot be reached or does not answer, and when a
    message, a name or a type is invalid.
    """

    @property
    def link(self) -> LinkName:
        """How we are connected."""

    @property
    def patience(self) -> Patience:
        """The time limits of this connection."""

    @property
    def is_open(self) -> bool:
        """True when something can be sent at once."""

    @property
    def connected_for_s(self) -> float | None:
        """Since when topics and goals have been connected, in wall time; None while not."""

    @property
    def lost_for_s(self) -> float | None:
        """Since when the connection has been lost, in wall time; None while there is one."""

    @property
    def own_ends(self) -> OwnEnds:
        """Our own part of the graph: answers about the graph do not take it for others'."""

    @property
    def started(self) -> Started:
        """Everything that was started over this connection: a stop ends it."""

    def start_soon(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run something in the background until the connection is closed."""

    async def wait_until_connected(self) -> None:
        """Return at once, or when the connection is open again."""

    def subscribe(
        self, topic: str, *, type_name: str | None = None, throttle_ms: int = 0
    ) -> Subscription:
        """Return the subscription to a topic; begin one where there is none yet.

        The type is as this ROS writes it; None looks it up. Throttling keeps a least time between
        two messages.
        """

    def unsubscribe(self, subscription: Subscription) -> None:
        """End one use of a subscription; the last one ends it at the robot too."""

    def renew(self, subscription: Subscription) -> None:
        """Subscribe again, perhaps in another way: a latched message may have been missed."""

    def advertise(self, topic: str, *, type_name: str, is_latched: bool = False) -> None:
        """Say that we will publish; the robot needs a moment until it listens.

        A late subscriber of a latched topic ("transient local") gets the last message.
        """

    def unadvertise(self, topic: str) -> None:
        """Take back an advertisement; do nothing for a topic that was not advertised."""

    def advertise_late(self) -> None:
        """Tell the robot of each topic advertised from now on only with its first message.

        For a robot that is only watched: it should not look as if we drove it. Zero velocity is
        then repeated for a second, until the robot has discovered our publisher.
        """

    def advertise_early(self) -> None:
        """Tell the robot at once of all advertised topics, now and from now on.

        For clients that may move it, so that a stop is received at once. This is the default.
        """

    async def publish(self, topic: str, message: Message) -> None:
        """Publish on an advertised topic."""

    def publish_everywhere(self, topic: str, message: Message) -> int:
        """Publish at once by every way that is open, and return how many: for a stop."""

    async def call_service(
        self,
        service: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        type_name: str | None = None,
        timeout_s: float | None = None,
    ) -> dict[str, Any]:
        """Return the answer of a service.

        Where no type is given it is looked up; where no limit is, the usual one is taken.
        """

    async def send_goal(self, action: str, arguments: Message, *, type_name: str) -> ActionGoal:
        """Send a goal to an action of ROS 2 and return the goal, updated as its state changes."""

    def cancel_goal(self, goal: ActionGoal) -> None:
        """Ask the server to cancel a goal; the goal's `end` tells whether it did.

        A withdrawn goal blocks no other from then on; its news are still passed on.
        """

    def clear_the_way(self) -> None:
        """Make sure that earlier messages do not delay the next one: for a stop."""

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are."""

    async def fetch_topics(self) -> Mapping[str, str]:
        """Return the type of each topic, as "package/Type"; costs less than the whole graph."""

    async def fetch_time_s(self) -> float | None:
        """Return robot time; None where the robot does not say."""

    async def fetch_nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes, in their order."""

    async def fetch_node(self, node: str) -> NodeLinks:
        """Return the topics and services that a node publishes, subscribes to and serves."""

    async def fetch_publishers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish on a topic."""

    async def fetch_subscribers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that listen to a topic."""

    async def fetch_services(self) -> tuple[str, ...]:
        """Return the full names of all services, in their order."""

    async def fetch_service_type(self, service: str) -> str:
        """Return a service's type, as "package/Type"."""

    async def fetch_action_type(self, action: str) -> str:
        """Return an action's type, as "package/Type"."""

    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:
        """Return the .msg texts of a type and of every type within it; empty where unknown.

        They are by name as "package/Type", the type itself first. A service has the two names
        "package/Type_Request" and "package/Type_Response", an action "package/Type_Goal",
        "package/Type_Result" and "package/Type_Feedback".
        """

    async def fetch_parameter_names(self, node: str) -> tuple[str, ...]:
        """Return the names of a node's parameters; ROS 1 keeps them below the node's name."""

    async def fetch_parameter(self, node: str, name: str) -> Any:  # noqa: ANN401 - any YAML value
        """Return the value of a node's parameter; None where it is not set."""

    async def set_parameter(self, node: str, name: str, value: Any) -> None:  # noqa: ANN401
        """Set a node's parameter; None deletes it.

        Raises:
            LinkError: The node refuses it, and says why.
        """


def started_over(connection: RosConnection | None) -> Started:
    """Return everything started over a connection; nothing without a connection."""
    try:
        return Started() if connection is None else connection.started
    except LinkError:
        return Started()


async def has_listeners(connection: RosConnection, topic: str) -> bool:
    """Return whether anybody listens to a topic; True where the robot does not say."""
    try:
        return bool(await connection.fetch_subscribers(topic))
    except LinkError:
        return True
