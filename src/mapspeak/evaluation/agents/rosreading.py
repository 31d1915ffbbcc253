"""What the ros tools answer, read into values."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from mapspeak.evaluation.client import ToolClient

__all__ = ["RosReader", "TopicReading"]

OURSELVES = "/rosbridge_websocket"
FIELD = re.compile(r"^(\w+): (\S+)", re.MULTILINE)
PARAMETER = re.compile(r"^(\w+): (-?[\d.]+)(?: |$)", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicReading:
    """What ros_topic tells.

    Attributes:
        name: Of the topic.
        publishers: Nodes; the one through which we look is left out.
        hearers: Likewise.
        fields: The types of the messages' own fields, by name.
    """

    name: str
    publishers: tuple[str, ...]
    hearers: tuple[str, ...]
    fields: Mapping[str, str]


class RosReader:
    """Calls the ros tools in a script's name.

    Args:
        tools: Where calls go.
    """

    def __init__(self, tools: ToolClient) -> None:
        self._tools = tools

    async def list_topics(self, type_ending: str = "") -> list[str]:
        """Return the topics, or those whose type ends so."""
        text = (await self._tools.demand("ros_topics")).text
        lines = [line.split() for line in text.splitlines()[1:]]
        return [
            line[0] for line in lines if line[1].endswith(f"/{type_ending}" * bool(type_ending))
        ]

    async def list_nodes(self) -> list[str]:
        """Return the nodes."""
        return (await self._tools.demand("ros_nodes")).text.splitlines()[1:]

    async def list_services(self, part: str) -> list[str]:
        """Return the services with a word in their names."""
        return (await self._tools.demand("ros_services", filter=part)).text.splitlines()[1:]

    async def fetch_topic(self, topic: str) -> TopicReading:
        """Return who publishes a topic, who hears it, and of what fields."""
        text = (await self._tools.demand("ros_topic", topic=topic)).text
        return TopicReading(
            name=topic,
            publishers=_nodes("published by", text),
            hearers=_nodes("heard by", text),
            fields=dict(FIELD.findall(text.partition("heard by: ")[2].partition("\n")[2])),
        )

    async def fetch_heard(self, node: str) -> list[str]:
        """Return the topics that a node hears."""
        text = (await self._tools.demand("ros_node", node=node)).text
        match = re.search(r"^hears: (.*)$", text, re.MULTILINE)
        return match[1].split(", ") if match else []

    async def fetch_parameters(self, node: str) -> dict[str, str]:
        """Return a node's parameters that are numbers, as they are written."""
        text = (await self._tools.demand("ros_parameters", node=node)).text
        return dict(PARAMETER.findall(text))

    async def fetch_service_type(self, service: str) -> str:
        """Return the type of a service."""
        text = (await self._tools.demand("ros_service", service=service)).text
        return text.splitlines()[0].split()[1]

    async def fetch_time_s(self) -> float:
        """Return the robot's time; 0 where it does not say."""
        text = (await self._tools.demand("ros_overview")).text
        match = re.search(r"robot time (\d+(?:\.\d+)?) s", text)
        return float(match[1]) if match else 0.0

    async def read(self, topic: str, **how: object) -> str | None:
        """Return what ros_read says of a topic; None where nothing came."""
        answer = await self._tools.call("ros_read", topic=topic, **how)
        return None if answer.is_error else answer.text


def _nodes(what: str, text: str) -> tuple[str, ...]:
    match = re.search(rf"^{what}: (.*)$", text, re.MULTILINE)
    # What a node does for us is marked behind its name.
    named = [each.partition(" ")[0] for each in match[1].split(", ")] if match else []
    return tuple(each for each in named if each.startswith("/") and each != OURSELVES)
