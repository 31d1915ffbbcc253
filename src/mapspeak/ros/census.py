"""Publishers, subscribers and servers: asked of every node, as ROS has no list of them."""

from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.port import NodeLinks, OwnEnds, RosConnection

Answer = TypeVar("Answer")


@dataclass(frozen=True, slots=True, kw_only=True)
class Nodes:
    """The nodes at one end of a topic; the one that is there for us is told apart.

    Attributes:
        others: All but that one.
        ours: None where we are not there.
    """

    others: tuple[str, ...]
    ours: str | None


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

    def subscribers_of(self, topic: str) -> Nodes:
        """Return the subscribers of a topic."""
        found = [name for name, links in self.links.items() if topic in links.subscribes]
        return _tell_apart(found, self.own, is_ours=topic in self.own.subscribes)


async def take_census(connection: RosConnection, nodes: Iterable[str]) -> Census:
    """Ask every node, some at once: one question for each, instead of two for each topic."""
    told = await ask_each(sorted(nodes), connection.fetch_node)
    # One may have ended since it was listed.
    links = {node: each for node, each in told.items() if not isinstance(each, LinkError)}
    mute = tuple(node for node in told if node not in links)
    return Census(links=links, mute=mute, own=connection.own_ends)


async def ask_each(
    names: Iterable[str], ask: Callable[[str], Awaitable[Answer]], *, at_once: int = 8
) -> dict[str, Answer | LinkError]:
    """Ask about each of some names, some at once; return each answer, or why there is none."""
    answers: dict[str, Answer | LinkError] = {}
    limiter = anyio.CapacityLimiter(at_once)
    listed = list(dict.fromkeys(names))

    async def ask_one(name: str) -> None:
        async with limiter:
            try:
                answers[name] = await ask(name)
            except LinkError as error:
                answers[name] = error

    async with anyio.create_task_group() as tasks:
        for name in listed:
            tasks.start_soon(ask_one, name)
    return {name: answers[name] for name in listed}


async def fetch_publishers(connection: RosConnection, topic: str) -> Nodes:
    """Return the publishers of one topic."""
    own, found = connection.own_ends, await connection.fetch_publishers(topic)
    return _tell_apart(found, own, is_ours=topic in own.publishes)


async def fetch_subscribers(connection: RosConnection, topic: str) -> Nodes:
    """Return the subscribers of one topic."""
    own, found = connection.own_ends, await connection.fetch_subscribers(topic)
    return _tell_apart(found, own, is_ours=topic in own.subscribes)


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
