"""What a ROS system is made of, as rclpy tells: the part of the port that only asks."""

from collections.abc import Iterable, Mapping
from typing import Any

from rclpy.exceptions import NameValidationException

from mapspeak.errors import LinkError
from mapspeak.links.rclpy.participant import RclpyParticipant
from mapspeak.links.rclpy.types import find_definitions
from mapspeak.ros.link import check_name
from mapspeak.ros.messages.fields import Dialect, bare_type
from mapspeak.ros.port import NodeLinks, RosGraph

UNNAMED = "_NODE_NAME_UNKNOWN_"
"""A node of which more is not known yet."""
SEND_GOAL = "/_action/send_goal"
NANOSECONDS = 1_000_000_000


class RclpyGraph:
    """Answers from what our node has discovered."""

    _participant: RclpyParticipant
    _distro: str

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are."""
        node = self._participant.node
        return RosGraph(
            dialect=Dialect.ROS2,
            distro=self._distro,
            types={
                topic: bare_type(types[0])
                for topic, types in sorted(node.get_topic_names_and_types())
                if types and not _is_hidden(topic) and self._is_of_others(topic)
            },
            actions=tuple(sorted(self._action_types())),
        )

    async def fetch_topics(self) -> Mapping[str, str]:
        """Return the type of each topic."""
        return (await self.fetch_graph()).types

    async def fetch_time_s(self) -> float | None:
        """Return the time of this machine: the machines of a ROS 2 system have the same."""
        return float(self._participant.node.get_clock().now().nanoseconds) / NANOSECONDS

    async def fetch_nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes but ours."""
        return self.nodes()

    def nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes but ours, as they are known now."""
        found = self._participant.node.get_node_names_and_namespaces()
        names = {
            f"{namespace.rstrip('/')}/{name}"
            for name, namespace in found
            if name not in (UNNAMED, self._participant.name)
        }
        return tuple(sorted(names))

    async def fetch_node(self, node: str) -> NodeLinks:
        """Return what a node publishes, subscribes to and serves."""
        namespace, _, name = node.rpartition("/")
        ours = self._participant.node
        if node not in self.nodes():
            raise _unknown(node)
        asked = (
            ours.get_publisher_names_and_types_by_node,
            ours.get_subscriber_names_and_types_by_node,
            ours.get_service_names_and_types_by_node,
        )
        try:
            publishes, subscribes, serves = [ask(name, namespace or "/") for ask in asked]
        except (RuntimeError, NameValidationException) as error:
            raise _unknown(node) from error
        return NodeLinks(
            publishes=_shown(publishes), subscribes=_shown(subscribes), serves=_shown(serves)
        )

    async def fetch_publishers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish on a topic."""
        check_name(topic)
        return self._nodes_of(self._participant.node.get_publishers_info_by_topic(topic))

    async def fetch_subscribers(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that listen to a topic."""
        check_name(topic)
        return self._nodes_of(self._participant.node.get_subscriptions_info_by_topic(topic))

    async def fetch_services(self) -> tuple[str, ...]:
        """Return the full names of all services but the parts of actions."""
        return tuple(sorted(name for name in self._service_types() if not _is_hidden(name)))

    async def fetch_service_type(self, service: str) -> str:
        """Return a service's type."""
        return _look_up(self._service_types(), service)

    async def fetch_action_type(self, action: str) -> str:
        """Return an action's type."""
        return _look_up(self._action_types(), action)

    async def fetch_definitions(self, type_name: str) -> Mapping[str, str]:
        """Return the .msg texts of a type and of all within, as this machine's ROS has them."""
        return find_definitions(type_name)

    def _service_types(self) -> dict[str, str]:
        """Return the types of what somebody serves: a mere client shows as a service too."""
        node, ours = self._participant.node, f"/{self._participant.name}/"
        return {
            service: types[0]
            for service, types in node.get_service_names_and_types()
            if types and node.count_services(service) and not service.startswith(ours)
        }

    def _action_types(self) -> dict[str, str]:
        return {
            service.removesuffix(SEND_GOAL): type_name.removesuffix("_SendGoal")
            for service, type_name in self._service_types().items()
            if service.endswith(SEND_GOAL)
        }

    def _is_of_others(self, topic: str) -> bool:
        node = self._participant.node
        # One after the other: most topics have somebody who writes them.
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


def _is_hidden(name: str) -> bool:
    return "/_" in name


def _shown(found: Iterable[tuple[str, Any]]) -> tuple[str, ...]:
    return tuple(sorted(name for name, _ in found if not _is_hidden(name)))


def _look_up(types: Mapping[str, str], name: str) -> str:
    if name not in types:
        raise _unknown(name)
    return bare_type(types[name])


def _unknown(name: str) -> LinkError:
    return LinkError(
        f"The robot knows no {name[:80]}.", hint="Ask for the list of what there is first."
    )
