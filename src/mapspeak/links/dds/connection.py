"""A ROS 2 domain over DDS as a connection, and the robot behind it opened."""

import logging
from collections.abc import AsyncGenerator, Mapping
from contextlib import asynccontextmanager
from functools import partial
from typing import Any
from weakref import WeakSet

import anyio
from anyio.abc import TaskGroup

from mapspeak.errors import LinkError
from mapspeak.links.dds.discovery import DdsEndpoint, Discovery, FramingOf, framing_by_vendor
from mapspeak.links.dds.endpoints import (
    DISCOVERY_TOPIC,
    DISCOVERY_TYPE,
    Quality,
    RawReader,
    RawWriter,
    dds_topic,
    reply_topic,
    request_topic,
)
from mapspeak.links.dds.participant import DdsNetwork, DdsParticipant
from mapspeak.links.dds.services import DdsService
from mapspeak.links.dds.types import HUMBLE, Types
from mapspeak.links.endpoints import (
    ARRIVAL_S,
    FIRST_SIGN_S,
    LONGEST_LOOK_S,
    SERVICE_PART,
    Decode,
    Sample,
    Take,
    nobody_serves,
    unknown,
)
from mapspeak.links.native import SEND_GOAL, NativeLink
from mapspeak.ros.activity import Subscription
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.link import USUAL_PATIENCE, Patience
from mapspeak.ros.port import LinkKind, LinkName, NodeLinks, RosGraph, keep_open
from mapspeak.ros.robot import NOTHING_SAID, RosRobot, build_ros_robot

logger = logging.getLogger(__name__)

QUIET_S = 0.4
"""Time without a new participant, after which discovery counts as complete."""
TIME_S = 2.0
"""Longest wait for a node to tell the time."""
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 30.0
"""Before a node that did not tell a type is asked for it again."""
ASKED_FOR_TIME = "/get_parameter_types"
DESCRIBE = "get_type_description"
DESCRIBE_TYPE = "type_description_interfaces/srv/GetTypeDescription"
NODES_QUALITY = Quality(is_reliable=True, is_latched=True, depth=1000)
LONG_NODES_TYPE = "rmw_dds_common/LongParticipantEntitiesInfo"
HINT = (
    "Check that the robot runs ROS 2 on Fast DDS or Cyclone DDS, that its ROS_DOMAIN_ID is this "
    "one (--robot dds:DOMAIN), and that the network lets multicast pass; else name the robot's "
    "address in ROS_STATIC_PEERS."
)


class DdsConnection(NativeLink):
    """One ROS 2 system, as a member of its DDS domain sees it.

    A topic gets a new reader for each new writer: Fast DDS serves a reader that comes after its
    writer at once, and may take three seconds to serve an earlier one.

    Args:
        framing_of: Tells how a node frames services, by the id of its writer.

    Raises:
        LinkError: DDS cannot be started.
    """

    reads_anew = True
    server_s = 1.0

    def __init__(self, network: DdsNetwork, *, framing_of: FramingOf, patience: Patience) -> None:
        self.network = network
        self.types = Types()
        super().__init__(self.types, patience)
        self._participant = DdsParticipant(network)
        self.discovery = Discovery(
            self._participant.key, on_change=self._note_change, framing_of=framing_of
        )
        self._services: dict[str, DdsService] = {}
        self._n_mute = 0
        self._learned = WeakSet[Subscription]()
        """Those of whose type the robot was asked already."""

    @property
    def link(self) -> LinkName:
        """How we are connected."""
        reach = ", on this machine only" if self.network.is_local else ""
        return LinkName(LinkKind.DDS, f"ROS domain {self.network.domain_id}{reach}")

    @property
    def is_open(self) -> bool:
        """True while a node of ROS is there."""
        return not self.discovery.is_empty

    @property
    def distro(self) -> str:
        """Humble by its longer ids; empty for all others."""
        return HUMBLE if self.discovery.has_long_ids else ""

    async def _start(self, tasks: TaskGroup) -> None:
        """Enter the domain, and return when its participants have been found."""
        await super()._start(tasks)
        self._participant.watch_endpoints(self.discovery.take_writer, self.discovery.take_reader)
        tasks.start_soon(self._participant.run)
        await self.wait_until_connected()
        # Fast DDS sends latched samples at once to a reader that knows the writer already, and
        # otherwise within three seconds. So no topic is read before a writer is found.
        self._participant.read(
            DISCOVERY_TOPIC,
            DISCOVERY_TYPE,
            quality=NODES_QUALITY,
            decode=self._decode_nodes,
            take=self._take_nodes,
        )
        with anyio.move_on_after(LONGEST_LOOK_S):
            is_news = True
            while is_news:
                with anyio.move_on_after(QUIET_S) as quiet:
                    await self.discovery.news.wait()
                is_news = not quiet.cancelled_caught

    async def _leave(self) -> None:
        if self._advertised:
            await self._participant.flush(timeout_s=ARRIVAL_S)
        self._participant.close()

    async def wait_until_connected(self) -> None:
        """Return at once, or when a node is there again."""
        if not await self.discovery.news.wait_until(
            lambda: not self.discovery.is_empty, within_s=FIRST_SIGN_S
        ):
            raise LinkError(
                f"No node of ROS 2 was found in DDS domain {self.network.domain_id} within "
                f"{FIRST_SIGN_S:g} s.",
                hint=HINT,
            )

    # --- topics

    def _writers_of(self, topic: str) -> list[DdsEndpoint]:
        return self.discovery.writers_of(dds_topic(topic))

    def _readers_of(self, topic: str) -> list[DdsEndpoint]:
        return self.discovery.readers_of(dds_topic(topic))

    def _quality(self, *, is_reliable: bool, is_latched: bool, depth: int) -> Quality:
        return Quality(is_reliable=is_reliable, is_latched=is_latched, depth=depth)

    def _read(
        self, topic: str, type_name: str, quality: Quality, decode: Decode, take: Take
    ) -> RawReader:
        return self._participant.read(
            dds_topic(topic), type_name, quality=quality, decode=decode, take=take
        )

    def _write_to(self, topic: str, type_name: str, quality: Quality) -> RawWriter:
        return self._participant.write_to(dds_topic(topic), type_name, quality=quality)

    # --- types

    def _learn(self, subscription: Subscription) -> None:
        """Ask for a type that we do not know, or know in another version, until it is told once."""
        if subscription not in self._learned:
            self._learned.add(subscription)
            self.start_soon(partial(self._learn_and_renew, subscription))

    async def _learn_and_renew(self, subscription: Subscription) -> None:
        # A node's services may be found after its topics, and a busy node may answer too late.
        topic, pause_s = subscription.topic, FIRST_PAUSE_S
        while subscription.n_users:
            try:
                # Whoever writes now: the node that was asked before may have gone.
                for writer in self._writers_of(topic)[:1]:
                    await self.ask_type(writer)
                    self.renew(subscription)
                    return
            except LinkError as error:
                if pause_s == FIRST_PAUSE_S:
                    logger.warning("%s cannot be read: %s", topic, error)
            await anyio.sleep(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)

    async def ask_type(self, endpoint: DdsEndpoint) -> None:
        """Ask the node behind a reader or writer of a topic for its type."""
        service = f"{self.discovery.node_with(endpoint.key)}/{DESCRIBE}"
        if not endpoint.type_hash or self.discovery.server_of(service) is None:
            raise self.types.refusal(endpoint.type_name)
        request = {
            "type_name": endpoint.type_name,
            "type_hash": endpoint.type_hash,
            "include_type_sources": False,
        }
        answer = await self.call_service(service, request, type_name=DESCRIBE_TYPE)
        self.types.take_description(answer)

    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:
        """Return the .msg texts of a type and of all within: ours, or those that a node tells.

        Nodes find a type by its hash, and DDS tells no hash by which they find that of a service.
        """
        known = self.types.definitions(type_name)
        for endpoint in () if known else self.discovery.with_type(type_name):
            name = endpoint.type_name
            try:
                if not (self.types.knows(name) or SERVICE_PART.search(name)):
                    await self.ask_type(endpoint)
            except LinkError:
                continue
        return known or self.types.definitions(type_name)

    # --- services and actions

    async def _service(self, service: str, *, within_s: float) -> DdsService:
        """Find who serves: right after opening, others are still found bit by bit.

        Who serves it is found by its answers; what it takes is told by who reads the requests.
        """
        await self.discovery.news.wait_until(
            lambda: (
                self.discovery.server_of(service) is not None
                and bool(self.discovery.readers_of(request_topic(service)))
            ),
            within_s=within_s,
        )
        server = self.discovery.server_of(service)
        if server is None:
            raise nobody_serves(service)
        type_name = SERVICE_PART.sub("", server.type_name)
        for part in ("Request", "Response"):
            if not self.types.knows(f"{type_name}_{part}"):
                raise self.types.refusal(f"{type_name}_{part}")
        if service not in self._services:
            self._services[service] = DdsService(
                self._participant, service, type_name, framing=server.framing, types=self.types
            )
        return self._services[service]

    def _note_servers(self, action: str) -> None:
        servers = self.discovery.writers_of(reply_topic(action + SEND_GOAL))
        self._actions[action].note_servers([each.key for each in servers])

    # --- participants

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are."""
        await self.wait_until_connected()
        return await super().fetch_graph()

    async def fetch_time_s(self) -> float | None:
        """Return robot time: when some node answered a question that costs it nothing."""
        servers = sorted(each for each in self.discovery.services if each.endswith(ASKED_FOR_TIME))
        if not servers:
            return None
        asked = servers[self._n_mute % len(servers)]
        try:
            return (await self._call(asked, {"names": []}, timeout_s=TIME_S)).source_s
        except LinkError:
            # The node may be stuck: another one is asked the next time.
            self._n_mute += 1
            return None

    async def fetch_nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes."""
        return tuple(sorted(self.discovery.nodes))

    async def fetch_node(self, node: str) -> NodeLinks:
        """Return the topics and services that a node publishes, subscribes to and serves."""
        keys = self.discovery.nodes.get(node)
        if keys is None:
            raise unknown(node)
        return self.discovery.links_of(keys)

    async def fetch_publishers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish on a topic."""
        return self.discovery.nodes_with(self._writers_of(topic))

    async def fetch_subscribers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that listen to a topic."""
        return self.discovery.nodes_with(self._readers_of(topic))

    def _topic_types(self) -> dict[str, str]:
        return self.discovery.topics

    def _service_types(self) -> dict[str, str]:
        return {
            service: SERVICE_PART.sub("", server.type_name)
            for service, server in self.discovery.services.items()
        }

    def _note_change(self, dds_name: str) -> None:
        if self.discovery.is_empty:
            self._found_s = None
        elif self._found_s is None:
            self._found_s = anyio.current_time()
        for each in self.discovery.ends_of(dds_name):
            self.types.take_hash(each.type_name, each.type_hash)
        for subscription in self._subscriptions.values():
            if dds_topic(subscription.topic) == dds_name:
                self._begin(subscription)
        for action in self._actions:
            if reply_topic(action + SEND_GOAL) == dds_name:
                self._note_servers(action)
        for service, asked in self._services.items():
            if reply_topic(service) == dds_name:
                server = self.discovery.server_of(service)
                asked.note_server(None if server is None else server.framing)

    def _decode_nodes(self, data: bytes) -> dict[str, Any]:
        try:
            return self.types.decode(DISCOVERY_TYPE, data)
        except LinkError:
            return self.types.decode(LONG_NODES_TYPE, data)

    def _take_nodes(self, sample: Sample) -> None:
        if sample.refusal is not None:
            return
        self.discovery.take_nodes(sample)
        if self.discovery.has_long_ids:
            self.types.take_humble()


@asynccontextmanager
async def open_dds_connection(
    network: DdsNetwork,
    *,
    framing_of: FramingOf = framing_by_vendor,
    patience: Patience = USUAL_PATIENCE,
) -> AsyncGenerator[DdsConnection]:
    """Keep us in a domain while the context lasts; see `DdsConnection`.

    Raises:
        LinkError: DDS cannot be started, or the domain is empty.
    """
    made = DdsConnection(network, framing_of=framing_of, patience=patience)
    async with keep_open(made) as connection:
        yield connection


@asynccontextmanager
async def open_dds_robot(
    network: DdsNetwork,
    *,
    overrides: RobotOverrides = NOTHING_SAID,
    patience: Patience = USUAL_PATIENCE,
) -> AsyncGenerator[RosRobot]:
    """Offer the ROS 2 robot in a DDS domain while the context lasts.

    Leaving the context does not stop the robot: call `stop` before if wanted.

    Raises:
        LinkError: No robot is found there, or it does not say what it offers.
    """
    async with open_dds_connection(network, patience=patience) as connection:
        yield await build_ros_robot(connection, overrides=overrides)
