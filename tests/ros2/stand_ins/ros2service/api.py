"""The services there are; a part of a name that begins with an underscore hides it."""

from typing import Any

Named = list[tuple[str, list[str]]]


def get_service_names_and_types(*, node: Any, include_hidden_services: bool = False) -> Named:  # noqa: ANN401
    return [
        (name, types)
        for name, types in node.get_service_names_and_types()
        if include_hidden_services or "/_" not in name
    ]


def get_service_names(*, node: Any, include_hidden_services: bool = False) -> list[str]:  # noqa: ANN401
    found = get_service_names_and_types(node=node, include_hidden_services=include_hidden_services)
    return [name for name, _ in found]
