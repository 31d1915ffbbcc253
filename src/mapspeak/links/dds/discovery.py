"""The participants of the domain: readers and writers from DDS, nodes from ROS."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any
from uuid import UUID

from cyclonedds.core import InstanceState
from cyclonedds.qos import Policy

from mapspeak.links.dds.endpoints import (
    reply_topic,
    ros_type,
    service_of,
    topic_of,
)
from mapspeak.links.endpoints import Endpoint, Sample, is_hidden, whole_type
from mapspeak.ros.activity import News
from mapspeak.ros.messages.fields import Message, bare_type
from mapspeak.ros.port import NodeLinks

TYPE_HASH = re.compile(rb"typehash=(RIHS\d+_[0-9a-f]+)")
PREFIX_BYTES = 12
CYCLONE_VENDOR = b"\x01\x10"
UNNAMED = "/_NODE_NAME_UNKNOWN_"


class Framing(Enum):
    """The header before a service's request and answer."""

    BARE = auto()
    NUMBERED = auto()


@dataclass(frozen=True, slots=True, kw_only=True)
class DdsEndpoint(Endpoint):
    """A reader or a writer of another participant.

    Attributes:
        type_hash: Of its type, since ROS 2 Iron; empty before.
    """

    topic: str
    type_hash: str
    framing: Framing


FramingOf = Callable[[bytes], Framing]


def framing_by_vendor(key: bytes) -> Framing:
    """Tell how a node frames services: ids in DDS begin with the vendor of the library."""
    return Framing.NUMBERED if key.startswith(CYCLONE_VENDOR) else Framing.BARE


class Discovery:
    """Keeps the participants of the domain, without our own.

    Args:
        on_change: Is called with the DDS topic whose readers or writers have changed.
        framing_of: Tells how a node frames services, by the id of its writer.
    """

    def __init__(
        self, own_key: bytes, *, on_change: Callable[[str], None], framing_of: FramingOf
    ) -> None:
        self._framing_of = framing_of
        self._own_key = own_key
        self._on_change = on_change
        self._writers: dict[bytes, DdsEndpoint] = {}
        self._readers: dict[bytes, DdsEndpoint] = {}
        self._nodes: dict[bytes, dict[str, tuple[bytes, ...]]] = {}
        self.news = News()
        """Told when a participant has come or gone."""
        self.has_long_ids = False
        """True for Humble and before."""

    # --- incoming samples

    def take_writer(self, sample: Sample) -> None:
        """Take in DDS discovery data of a writer."""
        self._take(sample.content, self._writers)

    def take_reader(self, sample: Sample) -> None:
        """Take in DDS discovery data of a reader."""
        self._take(sample.content, self._readers)

    def take_nodes(self, sample: Sample) -> None:
        """Take in which nodes a participant has, as the middlewares of ROS tell each other."""
        message = sample.content
        prefix = bytes(message["gid"]["data"][:PREFIX_BYTES])
        self.has_long_ids = len(message["gid"]["data"]) > len(UUID(int=0).bytes)
        self._nodes[prefix] = dict(_read_node(node) for node in message["node_entities_info_seq"])
        self._tell("")

    def _take(self, endpoint: Any, known: dict[bytes, DdsEndpoint]) -> None:  # noqa: ANN401
        key = endpoint.key.bytes
        if endpoint.sample_info.instance_state != InstanceState.Alive:
            gone = known.pop(key, None)
            if gone is not None:
                self._tell(gone.topic)
            return
        type_name = ros_type(endpoint.type_name or "")
        if type_name is None or key.startswith(self._own_key):
            return
        found = _read_endpoint(endpoint, type_name, self._framing_of(key))
        if known.get(key) != found:
            known[key] = found
            self._tell(found.topic)

    def _tell(self, topic: str) -> None:
        self._on_change(topic)
        self.news.tell()

    # --- the known graph

    @property
    def is_empty(self) -> bool:
        """True without any ROS node."""
        return not self._writers

    def writers_of(self, topic: str) -> list[DdsEndpoint]:
        """Return the writers on a topic of DDS."""
        return [each for each in self._writers.values() if each.topic == topic]

    def readers_of(self, topic: str) -> list[DdsEndpoint]:
        """Return the readers of a topic of DDS."""
        return [each for each in self._readers.values() if each.topic == topic]

    def ends_of(self, topic: str) -> list[DdsEndpoint]:
        """Return the writers on a topic of DDS, then its readers."""
        return [*self.writers_of(topic), *self.readers_of(topic)]

    def with_type(self, type_name: str) -> list[DdsEndpoint]:
        """Return the readers and writers of a type: of a message, a service or an action."""
        bare = bare_type(type_name)
        return [
            each
            for each in self._everybody()
            if bare in map(bare_type, (each.type_name, whole_type(each.type_name)))
        ]

    @property
    def topics(self) -> dict[str, str]:
        """The types of all topics that `ros2 topic list` shows, as "package/Type"."""
        found: dict[str, str] = {}
        for each in self._everybody():
            topic = topic_of(each.topic)
            if topic is not None and not is_hidden(topic):
                found.setdefault(topic, bare_type(each.type_name))
        return found

    @property
    def services(self) -> dict[str, DdsEndpoint]:
        """The servers of each service, those that are parts of actions too."""
        found: dict[str, DdsEndpoint] = {}
        for each in self._writers.values():
            service = service_of(each.topic)
            if service is not None:
                found[service] = each
        return found

    def server_of(self, service: str) -> DdsEndpoint | None:
        """Return the server of a service; None where there is none."""
        return next(iter(self.writers_of(reply_topic(service))), None)

    @property
    def nodes(self) -> dict[str, tuple[bytes, ...]]:
        """The ids of all readers and writers of each node, by its full name."""
        alive = {each.key[:PREFIX_BYTES] for each in self._everybody()}
        found: dict[str, tuple[bytes, ...]] = {}
        for prefix, nodes in self._nodes.items():
            if prefix in alive:
                found |= nodes
        return found

    def links_of(self, keys: tuple[bytes, ...]) -> NodeLinks:
        """Return the topics and services of the node with these readers and writers."""
        written = [self._writers[key].topic for key in keys if key in self._writers]
        read = [self._readers[key].topic for key in keys if key in self._readers]
        return NodeLinks(
            publishes=_names(map(topic_of, written)),
            subscribes=_names(map(topic_of, read)),
            serves=_names(map(service_of, written)),
        )

    def node_with(self, key: bytes) -> str | None:
        """Return the full name of the node that has a reader or writer."""
        return next((name for name, keys in self.nodes.items() if key in keys), None)

    def nodes_with(self, endpoints: list[DdsEndpoint]) -> tuple[str, ...]:
        """Return the full names of the nodes that have some readers or writers.

        Names come seconds after readers and writers: until then, ROS has this name for a node.
        """
        return _names(self.node_with(each.key) or UNNAMED for each in endpoints)

    def _everybody(self) -> Iterator[DdsEndpoint]:
        yield from self._writers.values()
        yield from self._readers.values()


def _names(found: Iterator[str | None]) -> tuple[str, ...]:
    return tuple(sorted({name for name in found if name is not None}))


def _read_endpoint(endpoint: Any, type_name: str, framing: Framing) -> DdsEndpoint:  # noqa: ANN401
    qos = endpoint.qos
    described = qos[Policy.Userdata]
    found = TYPE_HASH.search(described.data) if described is not None else None
    return DdsEndpoint(
        key=endpoint.key.bytes,
        topic=endpoint.topic_name,
        type_name=type_name,
        is_reliable=qos[Policy.Reliability] != Policy.Reliability.BestEffort,
        is_latched=qos[Policy.Durability] not in (None, Policy.Durability.Volatile),
        type_hash=found[1].decode() if found else "",
        framing=framing,
    )


def _read_node(node: Message) -> tuple[str, tuple[bytes, ...]]:
    name = f"{node['node_namespace'].rstrip('/')}/{node['node_name']}"
    ids = (*node["reader_gid_seq"], *node["writer_gid_seq"])
    return name, tuple(bytes(each["data"][:16]) for each in ids)
