"""Publishers, subscribers and servers: asked of every node, as ROS has no list of them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.port import NodeLinks, OwnEnds, RosConnection

MOST_AT_ONCE = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Nodes:
    """The nodes at one end of a topic; the one that is there for us is told apart.

    Attributes:
        others: All but that one.
        ours: None where we are not there.
    """

    others: tuple[str, ...]
    ours: str | None

    @property
    def is_empty(self) -> bool:
        """True without any node, ours included."""
        return not self.others and self.ours is None

    @property
    def is_ours_alone(self) -> bool:
        """True when only our node is there."""
        return not self.others and self.ours is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Census:
    """The topics and services of all nodes.

    Attributes:
        links: By the nodes' names.
        mute: Nodes that did not answer.
        own: Our own part of it.
    """

    links: Mapping[str, NodeLinks]
    mute: tuple[str, ...]
    own: OwnEnds

    def publishers_of(self, topic: str) -> Nodes:
        """Return the publishers of a topic."""
        found = [name for name, links in self.links.items() if topic in links.publishes]
        return _tell_apart(found, self.own, is_ours=topic in self.own.publishes)

    def hearers_of(self, topic: str) -> Nodes:
        """Return the subscribers of a topic."""
        found = [name for name, links in self.links.items() if topic in links.subscribes]
        return _tell_apart(found, self.own, is_ours=topic in self.own.hears)


async def take_census(connection: RosConnection, nodes: Iterable[str]) -> Census:
    """Ask every node, some at once: one question for each, instead of two for each topic."""
    links: dict[str, NodeLinks | None] = dict.fromkeys(sorted(nodes))
    limiter = anyio.CapacityLimiter(MOST_AT_ONCE)

    async def ask(node: str) -> None:
        async with limiter:
            try:
                links[node] = await connection.fetch_node(node)
            except LinkError:
                return  # It may have ended since it was listed; the answer names it.

    async with anyio.create_task_group() as tasks:
        for node in links:
            tasks.start_soon(ask, node)
    return Census(
        links={node: each for node, each in links.items() if each is not None},
        mute=tuple(node for node, each in links.items() if each is None),
        own=connection.own_ends,
    )


async def fetch_publishers(connection: RosConnection, topic: str) -> Nodes:
    """Return the publishers of one topic."""
    own, found = connection.own_ends, await connection.fetch_publishers(topic)
    return _tell_apart(found, own, is_ours=topic in own.publishes)


async def fetch_hearers(connection: RosConnection, topic: str) -> Nodes:
    """Return the subscribers of one topic."""
    own, found = connection.own_ends, await connection.fetch_subscribers(topic)
    return _tell_apart(found, own, is_ours=topic in own.hears)


async def find_server(connection: RosConnection, service: str) -> str | None:
    """Return the node that offers a service; first those whose name the service's begins with."""
    nodes = await connection.fetch_nodes()
    likely = [node for node in nodes if service.startswith(f"{node.rstrip('/')}/")]
    for asked in (likely, [node for node in nodes if node not in likely]):
        census = await take_census(connection, asked)
        for node, links in census.links.items():
            if service in links.serves:
                return node
    return None


def _tell_apart(nodes: Iterable[str], own: OwnEnds, *, is_ours: bool) -> Nodes:
    listed = list(nodes)
    is_there = is_ours and own.node
    ours = next((each for each in listed if is_there and each.endswith(f"/{own.node}")), None)
    return Nodes(others=tuple(each for each in listed if each != ours), ours=ours)
