"""A ROS 2 system over rclpy, as one of its nodes sees it."""

from collections.abc import AsyncGenerator, Iterable, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any

import anyio
from anyio.abc import TaskGroup
from anyio.from_thread import BlockingPortal
from rclpy.exceptions import NameValidationException
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from mapspeak.errors import LinkError, plain_errors
from mapspeak.links.endpoints import (
    FIRST_SIGN_S,
    LONGEST_LOOK_S,
    Decode,
    Endpoint,
    Take,
    is_hidden,
    nobody_serves,
    unknown,
)
from mapspeak.links.native import NativeLink
from mapspeak.links.rclpy.endpoints import RclpyReader, RclpyService, RclpyWriter
from mapspeak.links.rclpy.participant import RclpyParticipant, errors_of_ros, wait_until
from mapspeak.links.rclpy.types import RclpyTypes, find_definitions, find_message
from mapspeak.ros.activity import Subscription
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import NANOSECONDS, bare_type, check_name
from mapspeak.ros.port import LinkKind, LinkName, NodeLinks, RosConnection, keep_open

UNNAMED = "_NODE_NAME_UNKNOWN_"
"""A node of which more is not known yet."""
QUIET_S = 0.3
"""Without anything new, after which all that is there counts as found."""
WATCH_S = 0.2
"""Between two looks at the graph of readers and writers."""
HINT = (
    "Check that the robot runs ROS 2, that its ROS_DOMAIN_ID and RMW_IMPLEMENTATION are those of "
    "mapspeak (--robot ros2:DOMAIN), and that `ros2 node list` on this machine shows it."
)


class Ros2Connection(NativeLink):
    """One ROS 2 system, as our node in it sees it.

    Args:
        distro: Such as "jazzy"; empty where that is unknown.
    """

    distro = ""

    def __init__(self, participant: RclpyParticipant, *, distro: str, patience: Patience) -> None:
        self._ours = RclpyTypes()
        super().__init__(self._ours, patience)
        self.distro = distro
        self._participant = participant
        self._services: dict[str, RclpyService] = {}

    @property
    def link(self) -> LinkName:
        """How we are connected."""
        return LinkName(LinkKind.RCLPY, self._participant.place)

    @property
    def is_open(self) -> bool:
        """True, with or without subscribers to our topics."""
        return True

    async def _start(self, tasks: TaskGroup) -> None:
        """Return when the participants have been found, or there are none."""
        await super()._start(tasks)
        self.start_soon(self._watch)
        if await wait_until(self._sees_others, within_s=FIRST_SIGN_S):
            with anyio.move_on_after(LONGEST_LOOK_S):
                await wait_until_quiet(self)

    async def _leave(self) -> None:
        for _, writer in self._advertised.values():
            await anyio.to_thread.run_sync(writer.flush)

    async def wait_until_connected(self) -> None:
        """Return at once, or when the first node of others is found."""
        if not await wait_until(self._sees_others, within_s=FIRST_SIGN_S):
            raise LinkError("No other node of ROS 2 has been found in our domain.", hint=HINT)

    # --- topics

    def _writers_of(self, topic: str) -> list[Endpoint]:
        infos = self._participant.node.get_publishers_info_by_topic(topic)
        return [_read_endpoint(each) for each in infos]

    def _readers_of(self, topic: str) -> list[Endpoint]:
        infos = self._participant.node.get_subscriptions_info_by_topic(topic)
        return [_read_endpoint(each) for each in infos if each.node_name != self._participant.name]

    def _quality(self, *, is_reliable: bool, is_latched: bool, depth: int) -> QoSProfile:
        reliability, durability = ReliabilityPolicy, DurabilityPolicy
        return QoSProfile(
            depth=depth,
            reliability=reliability.RELIABLE if is_reliable else reliability.BEST_EFFORT,
            durability=durability.TRANSIENT_LOCAL if is_latched else durability.VOLATILE,
        )

    def _read(
        self, topic: str, type_name: str, quality: QoSProfile, decode: Decode, take: Take
    ) -> RclpyReader:
        return RclpyReader(self._participant, topic, type_name, quality, decode, take)

    def _write_to(self, topic: str, type_name: str, quality: QoSProfile) -> RclpyWriter:
        return RclpyWriter(self._participant, topic, type_name, quality)

    # --- types

    def _check_type(self, type_name: str) -> None:
        find_message(type_name)

    def _learn(self, subscription: Subscription) -> None:
        """Raise `LinkError`: a type that is not installed here cannot be learned."""
        topic = subscription.topic
        for writer in self._writers_of(topic):
            find_message(writer.type_name)
        raise LinkError(f"A message on {topic} cannot be read.", hint="Check its publisher.")

    async def ask_type(self, endpoint: Endpoint) -> None:
        """Raise `LinkError` for a type that is not installed here."""
        find_message(endpoint.type_name)

    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:
        """Return the .msg texts of a type and of all within, as this machine's ROS has them."""
        return find_definitions(type_name)

    # --- services and actions

    async def _service(self, service: str, *, within_s: float) -> RclpyService:
        node = self._participant.node

        def types() -> list[str]:
            return list(dict(node.get_service_names_and_types()).get(service, []))

        if not await wait_until(lambda: bool(types()), within_s=within_s):
            raise nobody_serves(service)
        if service not in self._services:
            self._services[service] = RclpyService(
                self._participant, service, types()[0], types=self._ours
            )
        await self._services[service].wait_for_server(timeout_s=within_s)
        return self._services[service]

    def _note_servers(self, action: str) -> None:
        # A server that was killed and started again has the same name, and another publisher.
        keys = [each.key for each in self._writers_of(f"{action}/_action/feedback")]
        if keys or not self._services[f"{action}/_action/send_goal"].is_served:
            self._actions[action].note_servers(keys)

    # --- participants

    async def fetch_time_s(self) -> float | None:
        """Return the time of this machine: the machines of a ROS 2 system have the same."""
        return float(self._participant.node.get_clock().now().nanoseconds) / NANOSECONDS

    async def fetch_nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes but ours, as they are known now."""
        return self._nodes()

    def _nodes(self) -> tuple[str, ...]:
        found = self._participant.node.get_node_names_and_namespaces()
        names = {
            f"{namespace.rstrip('/')}/{name}"
            for name, namespace in found
            if name not in (UNNAMED, self._participant.name)
        }
        return tuple(sorted(names))

    async def fetch_node(self, node: str) -> NodeLinks:
        """Return the topics and services that a node publishes, subscribes to and serves."""
        namespace, _, name = node.rpartition("/")
        ours = self._participant.node
        if node not in self._nodes():
            raise unknown(node)
        asked = (
            ours.get_publisher_names_and_types_by_node,
            ours.get_subscriber_names_and_types_by_node,
            ours.get_service_names_and_types_by_node,
        )
        try:
            publishes, subscribes, serves = [ask(name, namespace or "/") for ask in asked]
        except (RuntimeError, NameValidationException) as error:
            raise unknown(node) from error
        return NodeLinks(
            publishes=_shown(publishes), subscribes=_shown(subscribes), serves=_shown(serves)
        )

    async def fetch_publishers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish on a topic."""
        check_name(topic, is_full=True)
        return self._nodes_of(self._participant.node.get_publishers_info_by_topic(topic))

    async def fetch_subscribers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that listen to a topic."""
        check_name(topic, is_full=True)
        return self._nodes_of(self._participant.node.get_subscriptions_info_by_topic(topic))

    def _topic_types(self) -> dict[str, str]:
        return {
            topic: bare_type(types[0])
            for topic, types in sorted(self._participant.node.get_topic_names_and_types())
            if types and not is_hidden(topic) and self._is_of_others(topic)
        }

    def _service_types(self) -> dict[str, str]:
        """Return the types of services that have a server: a mere client shows as a service too."""
        node, ours = self._participant.node, f"/{self._participant.name}/"
        return {
            service: types[0]
            for service, types in node.get_service_names_and_types()
            if types and node.count_services(service) and not service.startswith(ours)
        }

    def _is_of_others(self, topic: str) -> bool:
        node = self._participant.node
        # One after the other: most topics have a publisher.
        return bool(
            self._nodes_of(node.get_publishers_info_by_topic(topic))
            or self._nodes_of(node.get_subscriptions_info_by_topic(topic))
        )

    def _nodes_of(self, infos: Iterable[Any]) -> tuple[str, ...]:
        names = {
            f"{each.node_namespace.rstrip('/')}/{each.node_name}"
            for each in infos
            if each.node_name != self._participant.name
        }
        return tuple(sorted(names))

    async def _watch(self) -> None:
        while True:
            # What ROS cannot tell now is asked again.
            for subscription in list(self._subscriptions.values()):
                # An unreadable topic stays silent; its subscribers are told so.
                with suppress(LinkError), errors_of_ros("ROS does not tell who writes"):
                    self._begin(subscription)
            for action in list(self._actions):
                with suppress(LinkError), errors_of_ros("ROS does not tell who serves"):
                    self._note_servers(action)
            await anyio.sleep(WATCH_S)

    def _sees_others(self) -> bool:
        """Return True once a participant was found. Silent topics show later losses."""
        if self._found_s is None and self._nodes():
            self._found_s = anyio.current_time()
        return self._found_s is not None


def _read_endpoint(info: Any) -> Endpoint:  # noqa: ANN401 - rclpy has no types
    quality = info.qos_profile
    return Endpoint(
        key=bytes(info.endpoint_gid),
        type_name=info.topic_type,
        is_reliable=quality.reliability != ReliabilityPolicy.BEST_EFFORT,
        is_latched=quality.durability == DurabilityPolicy.TRANSIENT_LOCAL,
    )


def _shown(found: Iterable[tuple[str, Any]]) -> tuple[str, ...]:
    return tuple(sorted(name for name, _ in found if not is_hidden(name)))


async def wait_until_quiet(system: RosConnection) -> None:
    """Return when nothing new comes, and every node has endpoints: these come after its name."""
    graph, before = await system.fetch_graph(), None
    while graph != before or not await _shows_all_nodes(system):
        await anyio.sleep(QUIET_S)
        graph, before = await system.fetch_graph(), graph


async def _shows_all_nodes(system: RosConnection) -> bool:
    for node in await system.fetch_nodes():
        try:
            links = await system.fetch_node(node)
        except LinkError:
            return False
        if not (links.publishes or links.serves):
            return False
    return True


@asynccontextmanager
async def open_connection(
    *, domain_id: int | None, distro: str, variables: Mapping[str, str], patience: Patience
) -> AsyncGenerator[Ros2Connection]:
    """Keep a node of ours in a domain while the context lasts; see `open_ros2_connection`."""
    with plain_errors():
        async with (
            BlockingPortal() as portal,
            _open_participant(domain_id, portal, variables) as participant,
            keep_open(Ros2Connection(participant, distro=distro, patience=patience)) as connection,
        ):
            yield connection


@asynccontextmanager
async def _open_participant(
    domain_id: int | None, portal: BlockingPortal, variables: Mapping[str, str]
) -> AsyncGenerator[RclpyParticipant]:
    participant = RclpyParticipant(domain_id=domain_id, portal=portal, variables=variables)
    await participant.start()
    try:
        yield participant
    finally:
        with anyio.CancelScope(shield=True):
            await participant.aclose()
