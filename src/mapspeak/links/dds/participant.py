"""Our member of a DDS domain: its readers and writers of bytes, and the thread that listens.

DDS wakes no event loop, so one thread waits for all readers. It decodes, which may take a while for
a picture, and hands over to the event loop, and waits until that has taken it: where the loop is
busy, DDS keeps the newest samples and forgets the rest.
"""

import logging
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import quoteattr

import anyio
from anyio import from_thread, to_thread
from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import DDSException, DDSStatus, GuardCondition, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from mapspeak.errors import LinkError
from mapspeak.links.dds.endpoints import (
    EndpointReader,
    Quality,
    RawMessage,
    RawReader,
    RawWriter,
    dds_type,
)
from mapspeak.links.endpoints import Decode, Sample, Take
from mapspeak.ros.link import environment_with

logger = logging.getLogger(__name__)

CONFIGURATION_VARIABLE = "CYCLONEDDS_URI"
FOR_EVER_NS = 2**63 - 1
MOST_PARTICIPANTS = 100
"""On one machine that are looked for, where they cannot be found by multicast."""
CALL_EVERY_S = 2
"""A robot that is started again is found so soon; the library's own choice is eight seconds."""
FAST_DDS_VENDOR = "1.15"


@dataclass(frozen=True, slots=True, kw_only=True)
class DdsNetwork:
    """A domain, and how its members are found.

    Attributes:
        is_local: Members are on this machine only, as with
            ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.
        peers: Addresses of other machines that multicast does not reach, as in ROS_STATIC_PEERS.
        cyclonedds_uri: Further settings of Cyclone DDS, as in CYCLONEDDS_URI.
    """

    domain_id: int = 0
    is_local: bool = False
    peers: Sequence[str] = ()
    cyclonedds_uri: str = ""

    @property
    def configuration(self) -> str:
        """All that Cyclone DDS is told, as in CYCLONEDDS_URI.

        A robot on this machine that keeps to itself listens to no multicast: it is looked for at
        the ports it would have, and looks for us at such. Fast DDS describes its types in a way
        that Cyclone DDS finds fault with; we know them by name.
        """
        peers = "".join(f"<Peer address={quoteattr(each)}/>" for each in ("localhost", *self.peers))
        local = '<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>'
        return (
            f"{self.cyclonedds_uri}{',' if self.cyclonedds_uri else ''}"
            '<CycloneDDS><Domain id="any">'
            f"<General>{local if self.is_local else ''}</General>"
            "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
            f"<MaxAutoParticipantIndex>{MOST_PARTICIPANTS}</MaxAutoParticipantIndex>"
            f"<SPDPInterval>{CALL_EVERY_S} s</SPDPInterval><Peers>{peers}</Peers></Discovery>"
            f"<Compatibility><IgnoreTypeInformation>{FAST_DDS_VENDOR}</IgnoreTypeInformation>"
            "</Compatibility></Domain></CycloneDDS>"
        )


class DdsParticipant:
    """Our member of a domain.

    Raises:
        LinkError: DDS cannot be started.
    """

    def __init__(self, network: DdsNetwork) -> None:
        try:
            # The library reads its configuration there, and when a process enters a domain only.
            with environment_with({CONFIGURATION_VARIABLE: network.configuration}):
                self._participant = DomainParticipant(network.domain_id)
            self._publisher = Publisher(self._participant)
            self._waitset = WaitSet(self._participant)
            self._closing = GuardCondition(self._participant)
        except DDSException as error:
            raise LinkError(
                f"DDS cannot enter domain {network.domain_id}: {error}",
                hint="Check CYCLONEDDS_URI and the network; another program may hold its ports.",
            ) from error
        self._waitset.attach(self._closing)
        self._lock = threading.Lock()
        self._topics: dict[tuple[str, str], tuple[Topic[Any], type[RawMessage]]] = {}
        self._raw_readers: list[RawReader] = []
        self._raw_writers: list[RawWriter] = []
        self._is_closing = False

    @property
    def key(self) -> bytes:
        """The common prefix of the ids of all our readers and writers: twelve bytes."""
        return bytes(self._participant.guid.bytes[:12])

    def watch_endpoints(self, take_writer: Take, take_reader: Take) -> None:
        """Tell of every reader and writer in the domain, those that are there and that come."""
        for topic, take in (
            (BuiltinTopicDcpsPublication, take_writer),
            (BuiltinTopicDcpsSubscription, take_reader),
        ):
            reader = BuiltinDataReader(self._participant, topic)
            self._keep(EndpointReader(reader, bytes, take, self._end_reading))

    def read(
        self, topic: str, type_name: str, *, quality: Quality, decode: Decode, take: Take
    ) -> RawReader:
        """Begin to read a topic.

        Args:
            topic: As DDS names it, such as rt/map.
            type_name: As ROS names it, such as "nav_msgs/msg/OccupancyGrid".
            quality: The QoS asked of the writers; one that offers less does not match.
            decode: Called in another thread.
            take: Called in the event loop.
        """
        try:
            known, _ = self._topic(topic, type_name)
            reader = DataReader(self._participant, known, quality.qos)
            return self._keep(RawReader(reader, decode, take, self._end_reading))
        except DDSException as error:
            raise _unusable(topic, type_name, error) from error

    def write_to(self, topic: str, type_name: str, *, quality: Quality) -> RawWriter:
        """Begin to write on a topic; see `read`."""
        try:
            known, raw_type = self._topic(topic, type_name)
            writer = DataWriter(self._publisher, known, quality.writers_qos)
        except DDSException as error:
            raise _unusable(topic, type_name, error) from error
        raw_writer = RawWriter(writer, raw_type, self._end_writing)
        with self._lock:
            self._raw_writers.append(raw_writer)
            writer.set_status_mask(DDSStatus.PublicationMatched)
            self._waitset.attach(writer)
        return raw_writer

    def _end_reading(self, raw_reader: RawReader) -> None:
        with self._lock:
            if raw_reader in self._raw_readers:
                self._raw_readers.remove(raw_reader)
                self._waitset.detach(raw_reader.condition)
                raw_reader.let_go()

    def _end_writing(self, raw_writer: RawWriter) -> None:
        with self._lock:
            if raw_writer in self._raw_writers and raw_writer.writer is not None:
                self._raw_writers.remove(raw_writer)
                self._waitset.detach(raw_writer.writer)
                raw_writer.writer = None

    async def flush(self, *, timeout_s: float) -> None:
        """Return when all that was written has arrived, or the time is over."""
        limit_ns = int(timeout_s * 1e9)
        with suppress(DDSException):
            await to_thread.run_sync(self._publisher.wait_for_acks, limit_ns)

    async def run(self) -> None:
        """Listen until `close` is called, and leave the domain then."""
        try:
            await to_thread.run_sync(self._listen, limiter=anyio.CapacityLimiter(1))
        finally:
            self._leave()

    def close(self) -> None:
        """End the listening, and with it `run`."""
        self._is_closing = True
        with suppress(DDSException):
            self._closing.set(True)

    def _keep(self, raw_reader: RawReader) -> RawReader:
        with self._lock:
            self._raw_readers.append(raw_reader)
            self._waitset.attach(raw_reader.condition)
        return raw_reader

    def _topic(self, topic: str, type_name: str) -> tuple[Topic[Any], type[RawMessage]]:
        known = self._topics.get((topic, type_name))
        if known is not None:
            return known
        raw_type: Any = make_idl_struct(
            "Raw", dds_type(type_name), {}, dataclassify=False, bases=(RawMessage,)
        )
        made = self._topics[topic, type_name] = (
            Topic(self._participant, topic, raw_type),
            raw_type,
        )
        return made

    # --- in the thread

    def _listen(self) -> None:
        while not self._is_closing:
            self._waitset.wait(FOR_EVER_NS)
            # The lock is not held while the event loop is waited for: it takes it too.
            with self._lock:
                collected = [(raw_reader, raw_reader.collect()) for raw_reader in self._raw_readers]
                matched = [
                    (raw_writer, _count_readers(raw_writer)) for raw_writer in self._raw_writers
                ]
            heard = [
                (raw_reader, understood)
                for raw_reader, samples in collected
                for sample in samples
                if (understood := raw_reader.understand(sample)) is not None
            ]
            if not self._is_closing:
                from_thread.run_sync(_hand_over, heard, matched)

    def _leave(self) -> None:
        with self._lock:
            for raw_reader in self._raw_readers:
                raw_reader.let_go()
            for raw_writer in self._raw_writers:
                raw_writer.writer = None
            self._raw_readers, self._raw_writers = [], []
        # All that is ours goes with it, whatever still refers to it in Python.
        self._participant.__del__()


def _hand_over(heard: list[tuple[RawReader, Sample]], matched: list[tuple[RawWriter, int]]) -> None:
    for raw_writer, n_matched in matched:
        if n_matched != raw_writer.n_matched:
            raw_writer.note_matched(n_matched)
    for raw_reader, sample in heard:
        if not raw_reader.is_open:
            continue
        try:
            raw_reader.take(sample)
        except Exception:
            # A fault of ours; one odd message must not cost the robot its connection.
            logger.exception("What the robot said could not be taken in")


def _count_readers(raw_writer: RawWriter) -> int:
    if raw_writer.writer is None:
        return 0
    # Reading the status also lets the wait begin anew.
    status = raw_writer.writer.get_publication_matched_status()  # type: ignore[no-untyped-call]
    return int(status.current_count)


def _unusable(topic: str, type_name: str, error: DDSException) -> LinkError:
    return LinkError(
        f"{topic} cannot be used as {type_name}: {error}",
        hint="A topic has one type: look it up on the robot.",
    )
