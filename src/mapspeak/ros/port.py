"""The port to a ROS system, and its values for nodes and topics."""

import difflib
import uuid
from abc import abstractmethod
from collections.abc import AsyncGenerator, Callable, Coroutine, Iterable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from typing import Any, TypeVar

import anyio
from anyio.abc import TaskGroup

from mapspeak.errors import LinkError, plain_errors
from mapspeak.ros.activity import ActionGoal, Started, Subscription
from mapspeak.ros.link import Advertising, Patience, say_again
from mapspeak.ros.messages.fields import Dialect, Message
from mapspeak.ros.parameters import ParameterServices


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
        subscribes: Topics that it subscribes to for us.
    """

    node: str = ""
    publishes: frozenset[str] = frozenset()
    subscribes: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class EndQuality:
    """The quality of service that one end of a topic offers, or asks for.

    Attributes:
        is_reliable: Lost messages are sent again.
        is_latched: A late subscriber gets the last messages ("transient local").
    """

    is_reliable: bool
    is_latched: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicQuality:
    """The quality of service of each end of a topic."""

    publishers: tuple[EndQuality, ...]
    subscribers: tuple[EndQuality, ...]


class RosConnection(Advertising, ParameterServices):
    """One ROS system, kept connected. Waiting is limited in wall time; a limit closes nothing.

    Methods raise `LinkError` when the system cannot be reached or does not answer, and when a
    message, a name or a type is invalid. What all links have in common stands here.

    Attributes:
        patience: The time limits of this connection.
        started: Everything that was started over this connection: a stop ends it.
    """

    patience: Patience
    started: Started

    def __init__(self, patience: Patience) -> None:
        super().__init__()
        self.patience = patience
        self.started = Started()
        self._subscriptions: dict[str, Subscription] = {}
        self._tasks: TaskGroup | None = None

    @property
    @abstractmethod
    def link(self) -> LinkName:
        """How we are connected."""

    @property
    @abstractmethod
    def is_open(self) -> bool:
        """True when something can be sent at once."""

    @property
    @abstractmethod
    def connected_for_s(self) -> float | None:
        """Since when topics and goals have been connected, in wall time; None while not."""

    @property
    def lost_for_s(self) -> float | None:
        """Since when the connection has been lost, in wall time; None while there is one."""
        return None

    @property
    def own_ends(self) -> OwnEnds:
        """Our own part of the graph: answers about the graph do not take it for others'."""
        return OwnEnds()

    def start_soon(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run something in the background until the connection is closed."""
        if self._tasks is not None:
            self._tasks.start_soon(work)

    async def _start(self, tasks: TaskGroup) -> None:
        """Connect, and keep connected in the background.

        Raises:
            LinkError: The robot cannot be reached.
        """
        self._tasks = tasks

    @abstractmethod
    async def _leave(self) -> None:
        """Close, once the last publications have had time to arrive."""

    @abstractmethod
    async def wait_until_connected(self) -> None:
        """Return at once, or when the connection is open again."""

    # --- topics

    def subscribe(
        self, topic: str, *, type_name: str | None = None, throttle_ms: int = 0
    ) -> Subscription:
        """Return the subscription to a topic; begin one where there is none yet.

        The type is as this ROS writes it; None looks it up. Throttling keeps a least time between
        two messages, the least of all that were asked for.
        """
        subscription = self._subscriptions.get(topic)
        if subscription is None:
            self._check(topic, type_name)
            subscription = Subscription(topic, type_name=type_name, throttle_ms=throttle_ms)
            self._begin(subscription)
            self._subscriptions[topic] = subscription
        elif throttle_ms < subscription.throttle_ms:
            subscription.throttle_ms = throttle_ms
            self._end(subscription)
            self._begin(subscription)
        subscription.n_users += 1
        return subscription

    def unsubscribe(self, subscription: Subscription) -> None:
        """End one use of a subscription; the last one ends it at the robot too."""
        if self._subscriptions.get(subscription.topic) is subscription:
            subscription.n_users -= 1
            if subscription.n_users == 0:
                del self._subscriptions[subscription.topic]
                self._end(subscription)

    def renew(self, subscription: Subscription) -> None:
        """Subscribe again, perhaps in another way: a latched message may have been missed."""
        if self._subscriptions.get(subscription.topic) is subscription:
            self._end(subscription)
            subscription.n_renewals += 1
            self._begin(subscription)

    @abstractmethod
    def _begin(self, subscription: Subscription) -> None:
        """Read a topic, or see to it that it is read once that can be done."""

    @abstractmethod
    def _end(self, subscription: Subscription) -> None:
        """Read a topic no longer."""

    @abstractmethod
    async def publish(self, topic: str, message: Message) -> None:
        """Publish on an advertised topic."""

    def publish_everywhere(self, topic: str, message: Message) -> int:
        """Publish at once by every way that is open, and return how many: for a stop."""
        is_first = self._tell_first(topic)
        send = self._prepare(topic, message)
        if is_first:
            self.start_soon(partial(say_again, send))
        return send()

    @abstractmethod
    def _prepare(self, topic: str, message: Message) -> Callable[[], int]:
        """Return a function that publishes over each open connection and returns their number."""

    def clear_the_way(self) -> None:
        """Make sure that earlier messages do not delay the next one: for a stop.

        ROS 2 itself does not queue messages behind earlier ones.
        """

    # --- actions

    @abstractmethod
    async def send_goal(self, action: str, arguments: Message, *, type_name: str) -> ActionGoal:
        """Send a goal to an action of ROS 2 and return the goal, updated as its state changes."""

    @abstractmethod
    def cancel_goal(self, goal: ActionGoal) -> None:
        """Ask the server to cancel a goal; the goal's `end` tells whether it did.

        A withdrawn goal blocks no other from then on; its news are still passed on.
        """

    # --- the graph

    @abstractmethod
    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are."""

    @abstractmethod
    async def fetch_topics(self) -> Mapping[str, str]:
        """Return the type of each topic, as "package/Type"; costs less than the whole graph."""

    @abstractmethod
    async def fetch_time_s(self) -> float | None:
        """Return robot time; None where the robot does not say."""

    @abstractmethod
    async def fetch_nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes, in their order."""

    @abstractmethod
    async def fetch_node(self, node: str) -> NodeLinks:
        """Return the topics and services that a node publishes, subscribes to and serves."""

    @abstractmethod
    async def fetch_publishers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish on a topic."""

    @abstractmethod
    async def fetch_subscribers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that listen to a topic."""

    def find_quality(self, topic: str) -> TopicQuality | None:  # noqa: ARG002 - for native links
        """Return the quality of service at a topic's ends; None where the robot does not say."""
        return None

    @abstractmethod
    async def fetch_services(self) -> tuple[str, ...]:
        """Return the full names of all services, in their order."""

    @abstractmethod
    async def fetch_service_type(self, service: str) -> str:
        """Return a service's type, as "package/Type"."""

    @abstractmethod
    async def fetch_action_type(self, action: str) -> str:
        """Return an action's type, as "package/Type"."""

    @abstractmethod
    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:
        """Return the .msg texts of a type and of every type within it; empty where unknown.

        They are by name as "package/Type", the type itself first. A service has the two names
        "package/Type_Request" and "package/Type_Response", an action "package/Type_Goal",
        "package/Type_Result" and "package/Type_Feedback".
        """


Connection = TypeVar("Connection", bound=RosConnection)


@asynccontextmanager
async def keep_open(connection: Connection) -> AsyncGenerator[Connection]:
    """Keep a connection open while the context lasts.

    Raises:
        LinkError: The robot cannot be reached.
    """
    with plain_errors():
        async with anyio.create_task_group() as tasks:
            try:
                await connection._start(tasks)  # noqa: SLF001 - half of the same thing
                yield connection
            finally:
                with anyio.CancelScope(shield=True):
                    await connection._leave()  # noqa: SLF001 - likewise
                tasks.cancel_scope.cancel()


async def has_listeners(connection: RosConnection, topic: str) -> bool:
    """Return whether anybody listens to a topic; True where the robot does not say."""
    try:
        return bool(await connection.fetch_subscribers(topic))
    except LinkError:
        return True
