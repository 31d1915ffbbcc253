"""The topics there are; a part of a name that begins with an underscore hides it."""

from typing import Any

Named = list[tuple[str, list[str]]]


def get_topic_names_and_types(*, node: Any, include_hidden_topics: bool = False) -> Named:  # noqa: ANN401
    return [
        (name, types)
        for name, types in node.get_topic_names_and_types()
        if include_hidden_topics or "/_" not in name
    ]


def get_topic_names(*, node: Any, include_hidden_topics: bool = False) -> list[str]:  # noqa: ANN401
    found = get_topic_names_and_types(node=node, include_hidden_topics=include_hidden_topics)
    return [name for name, _ in found]
