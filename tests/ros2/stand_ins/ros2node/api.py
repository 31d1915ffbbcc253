"""Nodes, and what each publishes, hears and offers."""

from collections.abc import Callable
from typing import Any, NamedTuple


class NodeName(NamedTuple):
    name: str
    namespace: str
    full_name: str


class Endpoint(NamedTuple):
    name: str
    types: list[str]


def get_node_names(*, node: Any, include_hidden_nodes: bool = False) -> list[NodeName]:  # noqa: ANN401
    return [
        NodeName(name, namespace, f"{namespace.rstrip('/')}/{name}")
        for name, namespace in node.get_node_names_and_namespaces()
        if include_hidden_nodes or not name.startswith("_")
    ]


def get_absolute_node_name(name: str) -> str | None:
    return f"/{name.lstrip('/')}" if name else None


def get_publisher_info(*, node: Any, remote_node_name: str) -> list[Endpoint]:  # noqa: ANN401
    return _endpoints(node.get_publisher_names_and_types_by_node, remote_node_name)


def get_subscriber_info(*, node: Any, remote_node_name: str) -> list[Endpoint]:  # noqa: ANN401
    return _endpoints(node.get_subscriber_names_and_types_by_node, remote_node_name)


def get_service_server_info(*, node: Any, remote_node_name: str) -> list[Endpoint]:  # noqa: ANN401
    return _endpoints(node.get_service_names_and_types_by_node, remote_node_name)


def _endpoints(
    find: Callable[[str, str], list[tuple[str, list[str]]]], node: str
) -> list[Endpoint]:
    namespace, _, name = node.rpartition("/")
    return [Endpoint(*found) for found in find(name, namespace or "/")]
