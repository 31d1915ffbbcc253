"""Publishers, subscribers and servers: asked of every node, as ROS has no list of them."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.port import NodeLinks, OwnEnds, RosConnection
from mapspeak.server.text.wording import list_some

MOST_AT_ONCE = 8
MOST_NODES = 20
OURS = " (mapspeak)"


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

    def say(self) -> str:
        """Name them, with a mark on ours."""
        ours = () if self.ours is None else (self.ours,)
        named = mark_ours(sorted((*self.others, *ours)), ours)
        return list_some(named, most=MOST_NODES) or "nobody"

    def count(self) -> str:
        """Say how many others there are, and whether we are there too."""
        if self.ours is None:
            return str(len(self.others) or "nobody")
        return f"{len(self.others)} and mapspeak" if self.others else "mapspeak alone"


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
        return _tell_apart(found, self.own.node if topic in self.own.publishes else "")

    def hearers_of(self, topic: str) -> Nodes:
        """Return the subscribers of a topic."""
        found = [name for name, links in self.links.items() if topic in links.subscribes]
        return _tell_apart(found, self.own.node if topic in self.own.hears else "")


async def take_census(connection: RosConnection, nodes: Iterable[str]) -> Census:
    """Ask every node, some at once: one question for each, instead of two for each topic."""
    links: dict[str, NodeLinks] = {}
    limiter = anyio.CapacityLimiter(MOST_AT_ONCE)
    asked = sorted(nodes)

    async def ask(node: str) -> None:
        async with limiter:
            try:
                links[node] = await connection.fetch_node(node)
            except LinkError:
                return  # It may have ended since it was listed; the answer names it.

    async with anyio.create_task_group() as tasks:
        for node in asked:
            tasks.start_soon(ask, node)
    return Census(
        links={node: links[node] for node in asked if node in links},
        mute=tuple(node for node in asked if node not in links),
        own=connection.own_ends,
    )


async def fetch_publishers(connection: RosConnection, topic: str) -> Nodes:
    """Return the publishers of one topic."""
    own = connection.own_ends
    return _tell_apart(
        await connection.fetch_publishers(topic), own.node if topic in own.publishes else ""
    )


async def fetch_hearers(connection: RosConnection, topic: str) -> Nodes:
    """Return the subscribers of one topic."""
    own = connection.own_ends
    return _tell_apart(
        await connection.fetch_subscribers(topic), own.node if topic in own.hears else ""
    )


async def find_server(connection: RosConnection, service: str) -> str | None:
    """Return the node that offers a service; first those whose name the service's begins with."""
    nodes = await connection.fetch_nodes()
    likely = [node for node in nodes if service.startswith(f"{node.rstrip('/')}/")]
    others = [node for node in nodes if node not in likely]
    for asked in (likely, others):
        census = await take_census(connection, asked)
        found = [node for node, links in census.links.items() if service in links.serves]
        if found:
            return found[0]
    return None


def mark_ours(names: Iterable[str], ours: Collection[str]) -> list[str]:
    """Return names, with a mark on those that are our own doing."""
    return [f"{name}{OURS}" if name in ours else name for name in names]


def _tell_apart(nodes: Iterable[str], own_node: str) -> Nodes:
    listed = list(nodes)
    ours = next((each for each in listed if own_node and each.endswith(f"/{own_node}")), None)
    return Nodes(others=tuple(each for each in listed if each != ours), ours=ours)
