"""A node of ROS 2 in this process, made of our own DDS: what links/dds is tested against.

It frames services as nodes on Cyclone DDS do, because that is what it is, or bare as those on Fast
DDS do, when a test asks for it.
"""

import os
import random
import socket
import struct
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

import anyio
from cyclonedds.qos import Policy, Qos

from mapspeak.links.cdr import HEADER_BYTES
from mapspeak.links.dds import DdsConnection, open_dds_connection
from mapspeak.links.dds.connection import LONG_NODES_TYPE
from mapspeak.links.dds.discovery import Framing
from mapspeak.links.dds.endpoints import (
    DISCOVERY_TOPIC,
    DISCOVERY_TYPE,
    Quality,
    RawReader,
    RawWriter,
    dds_topic,
    reply_topic,
    request_topic,
)
from mapspeak.links.dds.participant import DdsNetwork, DdsParticipant
from mapspeak.links.dds.types import HUMBLE, Types, build_type_book
from mapspeak.links.endpoints import Sample
from mapspeak.ros.definitions.types import hash_type
from mapspeak.ros.link import USUAL_PATIENCE, Patience

RELIABLE = Quality(is_reliable=True, is_latched=False, depth=10)
LATCHED = Quality(is_reliable=True, is_latched=True, depth=10)
BEST_EFFORT = Quality(is_reliable=False, is_latched=False, depth=10)
PATIENCE_S = 60.0
SET_BOOL = "std_srvs/srv/SetBool"
GID_BYTES, LONG_GID_BYTES = 16, 24
NUMBER_BYTES = struct.calcsize("<Qq")

Request = dict[str, Any]
Reply = Callable[[Request], None]


def some_network() -> DdsNetwork:
    """Gives a domain on this machine that nobody uses: each worker of pytest has its own dozen."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")) % 8
    dozen = range(1 + 12 * worker, 13 + 12 * worker)
    domains = random.sample(dozen, k=len(dozen))
    return DdsNetwork(domain_id=next(filter(_is_free, domains)), is_local=True)


def _is_free(domain_id: int) -> bool:
    """Tells whether the port of a domain's first participant is not taken."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", 7410 + 250 * domain_id))
        except OSError:
            return False
    return True


@dataclass(frozen=True, kw_only=True)
class Hashed(Quality):
    """Tells the hash of the type, as ROS 2 does since Iron."""

    type_hash: str

    @property
    def qos(self) -> Qos:
        told = Policy.Userdata(f"typehash={self.type_hash};".encode())
        return Qos(told, base=Quality.qos.__get__(self))


class DdsNode:
    """A node: publishes, listens, and serves what it is told to.

    Args:
        network: Where.
        name: Its own.
        distro: Of ROS 2, whose types it has; empty for a node that tells no hashes of them. One of
            Humble tells none either, and has longer ids.

    Attributes:
        heard: What came on each topic it listens to.
        types: Its own, to which a test may add.
    """

    def __init__(self, network: DdsNetwork, *, name: str = "/robot", distro: str = "") -> None:
        self.name = name
        self.participant = DdsParticipant(network)
        self.types = Types(distro=distro)
        self._has_long_ids = distro == HUMBLE
        self._book = build_type_book(distro) if distro and not self._has_long_ids else None
        self.heard: dict[str, list[Request]] = {}
        self._raw_writers: dict[str, tuple[str, RawWriter]] = {}
        self._raw_readers: list[RawReader] = []
        self._introduction = self.participant.write_to(
            DISCOVERY_TOPIC, DISCOVERY_TYPE, quality=LATCHED
        )

    def advertise(self, topic: str, type_name: str, *, quality: Quality = RELIABLE) -> None:
        raw_writer = self.participant.write_to(
            dds_topic(topic), type_name, quality=self._hashed(quality, type_name)
        )
        self._raw_writers[topic] = (type_name, raw_writer)
        self.introduce()

    def publish(self, topic: str, message: Request) -> None:
        type_name, raw_writer = self._raw_writers[topic]
        raw_writer.write(self.types.encode(type_name, message))

    def publish_hashed(self, topic: str, type_name: str, type_hash: str) -> None:
        """Advertises a topic and tells the hash of its type, as newer versions of ROS do."""
        quality = Hashed(is_reliable=True, is_latched=False, depth=10, type_hash=type_hash)
        raw_writer = self.participant.write_to(dds_topic(topic), type_name, quality=quality)
        self._raw_writers[topic] = (type_name, raw_writer)
        self.introduce()

    def listen(self, topic: str, type_name: str, *, quality: Quality = RELIABLE) -> None:
        heard = self.heard.setdefault(topic, [])
        self._read(dds_topic(topic), type_name, quality, heard.append)

    def serve(
        self,
        service: str,
        type_name: str,
        answer: Callable[[Request, Reply], None],
        *,
        framing: Framing = Framing.NUMBERED,
    ) -> None:
        """Serves: `answer` gets each request, and a function that replies, at once or later."""
        request_type, reply_type = f"{type_name}_Request", f"{type_name}_Response"
        replies = self.participant.write_to(
            reply_topic(service), reply_type, quality=self._hashed(RELIABLE, reply_type)
        )
        self._raw_writers[reply_topic(service)] = (reply_type, replies)
        skip = NUMBER_BYTES if framing is Framing.NUMBERED else 0

        def decode(data: bytes) -> tuple[bytes, Request]:
            number = data[HEADER_BYTES : HEADER_BYTES + skip]
            bare = data[:HEADER_BYTES] + data[HEADER_BYTES + skip :]
            return number, self.types.decode(request_type, bare)

        def take(request: tuple[bytes, Request]) -> None:
            number, arguments = request

            def reply(message: Request) -> None:
                data = self.types.encode(reply_type, message)
                replies.write(data[:HEADER_BYTES] + number + data[HEADER_BYTES:])

            answer(arguments, reply)

        self._raw_readers.append(
            self.participant.read(
                request_topic(service),
                request_type,
                quality=self._hashed(RELIABLE, request_type),
                decode=decode,
                take=lambda sample: take(_content(sample)),
            )
        )
        self.introduce()

    def stop_serving(self, service: str) -> None:
        topic = f"rr{service}Reply"
        _, raw_writer = self._raw_writers.pop(topic)
        raw_writer.close()

    def introduce(self) -> None:
        """Tells which readers and writers are this node's, as the middlewares of ROS do."""
        namespace, _, last = self.name.rpartition("/")
        writers = [
            raw_writer.writer for _, raw_writer in self._raw_writers.values() if raw_writer.writer
        ]
        readers = [raw_reader._reader for raw_reader in self._raw_readers if raw_reader._reader]
        node = {
            "node_namespace": namespace or "/",
            "node_name": last,
            "reader_gid_seq": [self._gid(reader.guid.bytes) for reader in readers],
            "writer_gid_seq": [self._gid(writer.guid.bytes) for writer in writers],
        }
        message = {"gid": self._gid(self.participant.key), "node_entities_info_seq": [node]}
        type_name = LONG_NODES_TYPE if self._has_long_ids else DISCOVERY_TYPE
        self._introduction.write(self.types.encode(type_name, message))

    def _gid(self, key: bytes) -> Request:
        return {"data": key.ljust(LONG_GID_BYTES if self._has_long_ids else GID_BYTES, b"\x00")}

    def _hashed(self, quality: Quality, type_name: str) -> Quality:
        if self._book is None:
            return quality
        return Hashed(
            is_reliable=quality.is_reliable,
            is_latched=quality.is_latched,
            depth=quality.depth,
            type_hash=hash_type(self._book, type_name),
        )

    def _read(
        self, topic: str, type_name: str, quality: Quality, take: Callable[[Request], None]
    ) -> None:
        self._raw_readers.append(
            self.participant.read(
                topic,
                type_name,
                quality=quality,
                decode=lambda data: self.types.decode(type_name, data),
                take=lambda sample: take(_content(sample)),
            )
        )
        self.introduce()


def _content(sample: Sample) -> Any:  # noqa: ANN401 - ROS JSON
    if sample.refusal is not None:
        raise sample.refusal
    return sample.content


@asynccontextmanager
async def open_dds_node(
    network: DdsNetwork, *, name: str = "/robot", distro: str = ""
) -> AsyncGenerator[DdsNode]:
    node = DdsNode(network, name=name, distro=distro)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(node.participant.run)
        try:
            yield node
        finally:
            node.participant.close()


@asynccontextmanager
async def open_here(
    network: DdsNetwork,
    *,
    framing: Framing = Framing.NUMBERED,
    patience: Patience = USUAL_PATIENCE,
) -> AsyncGenerator[DdsConnection]:
    """Connects to nodes in this process, which find each other at once.

    All of DDS here is Cyclone's: that a node is on Fast DDS can only be claimed.
    """
    async with open_dds_connection(
        network, framing_of=lambda _key: framing, patience=patience
    ) as connection:
        yield connection


async def until(is_so: Callable[[], object], *, within_s: float = 5.0) -> None:
    """Returns when something is so; DDS does not tell of everything that a test wants to know."""
    with anyio.fail_after(within_s):
        while not is_so():  # noqa: ASYNC110 - see above
            await anyio.sleep(0.01)


@asynccontextmanager
async def open_both(
    prepare: Callable[[DdsNode], None] = lambda node: node.introduce(),
    *,
    framing: Framing = Framing.NUMBERED,
    patience: Patience = USUAL_PATIENCE,
) -> AsyncGenerator[tuple[DdsNode, DdsConnection]]:
    network = some_network()
    with anyio.fail_after(PATIENCE_S):
        async with open_dds_node(network) as node:
            prepare(node)
            async with open_here(network, framing=framing, patience=patience) as connection:
                yield node, connection


def answer_set_bool(request: Request, reply: Reply) -> None:
    """Serves std_srvs/SetBool."""
    reply({"success": request["data"], "message": "as you wish"})
