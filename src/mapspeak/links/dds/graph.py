"""What a ROS system is made of, as DDS and its nodes tell: the part of the port that only asks."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

from mapspeak.errors import LinkError
from mapspeak.links.dds.discovery import Endpoint
from mapspeak.links.dds.endpoints import SERVICE_PART, Sample, is_hidden
from mapspeak.links.dds.topics import DdsTopics
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import NodeLinks, RosGraph

DESCRIBE = "get_type_description"
DESCRIBE_TYPE = "type_description_interfaces/srv/GetTypeDescription"
ASKED_FOR_TIME = "/get_parameter_types"
PATIENCE_S = 2.0


class DdsGraph(DdsTopics):
    """Answers from what was discovered, and what nodes tell of their types and their time."""

    @abstractmethod
    async def wait_until_connected(self) -> None:
        """Return at once, or when somebody is there again."""

    @abstractmethod
    async def ask(self, service: str, arguments: Mapping[str, Any], *, timeout_s: float) -> Sample:
        """Return what a service answers, and when it did."""

    async def learn(self, endpoint: Endpoint, *wanted: str) -> None:
        """Make types known: does nothing where they are, else asks the node behind an endpoint.

        Nodes find a type by its hash, and DDS tells no hash by which they find that of a service.
        """
        unknown = [name for name in wanted if not self.types.knows(name)]
        if unknown and SERVICE_PART.search(unknown[0]):
            raise self.types.refusal(unknown[0])
        if unknown:
            await self.ask_type(endpoint)

    async def ask_type(self, endpoint: Endpoint) -> None:
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

    # --- the questions of the port

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are."""
        await self.wait_until_connected()
        return RosGraph(
            dialect=Dialect.ROS2,
            distro="humble" if self.discovery.has_long_ids else "",
            types=self.discovery.topics,
            actions=tuple(sorted(self.discovery.actions)),
        )

    async def fetch_topics(self) -> Mapping[str, str]:
        """Return the type of each topic."""
        return (await self.fetch_graph()).types

    async def fetch_time_s(self) -> float | None:
        """Return robot time: when some node answered a question that costs it nothing."""
        servers = sorted(
            service for service in self.discovery.services if service.endswith(ASKED_FOR_TIME)
        )
        if not servers:
            return None
        try:
            return (await self.ask(servers[0], {"names": []}, timeout_s=PATIENCE_S)).source_s
        except LinkError:
            return None

    async def fetch_nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes."""
        return tuple(sorted(self.discovery.nodes))

    async def fetch_node(self, node: str) -> NodeLinks:
        """Return what a node publishes, subscribes to and serves."""
        keys = self.discovery.nodes.get(node)
        if keys is None:
            raise _unknown(node)
        return self.discovery.links_of(keys)

    async def fetch_publishers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish on a topic."""
        return self.discovery.publishers(topic)

    async def fetch_subscribers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that listen to a topic."""
        return self.discovery.subscribers(topic)

    async def fetch_services(self) -> tuple[str, ...]:
        """Return the full names of all services but the parts of actions."""
        return tuple(sorted(name for name in self.discovery.services if not is_hidden(name)))

    async def fetch_service_type(self, service: str) -> str:
        """Return a service's type."""
        return _known(self.discovery.service_type(service), service)

    async def fetch_action_type(self, action: str) -> str:
        """Return an action's type."""
        return _known(self.discovery.actions.get(action), action)

    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:
        """Return the .msg texts of a type and of all within: ours, or those that a node tells."""
        known = self.types.definitions(type_name)
        if known:
            return known
        for endpoint in self.discovery.with_type(type_name):
            try:
                await self.learn(endpoint, endpoint.type_name)
            except LinkError:
                continue
        return self.types.definitions(type_name)


def _known(found: str | None, name: str) -> str:
    if found is None:
        raise _unknown(name)
    return found


def _unknown(name: str) -> LinkError:
    return LinkError(
        f"The robot knows no {name[:80]}.",
        hint="Ask for the list of what there is first.",
    )
