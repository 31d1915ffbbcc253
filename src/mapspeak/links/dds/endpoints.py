"""The names of ROS in DDS, and the discovery data of DataWriters and DataReaders."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader

from mapspeak.errors import LinkError
from mapspeak.links.endpoints import Decode, Sample, Take, full_type, understand
from mapspeak.ros.activity import News
from mapspeak.ros.port import EndQuality

TOPIC, REQUEST, REPLY = "rt", "rq", "rr"
DISCOVERY_TOPIC = "ros_discovery_info"
DISCOVERY_TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"


def dds_type(name: str) -> str:
    """Return "nav_msgs::msg::dds_::OccupancyGrid_" for "nav_msgs/msg/OccupancyGrid"."""
    package, kind, last = full_type(name).split("/")
    return f"{package}::{kind}::dds_::{last}_"


def ros_type(dds_name: str) -> str | None:
    """Return "nav_msgs/msg/OccupancyGrid"; None for a type that is not of ROS."""
    match dds_name.split("::"):
        case [package, kind, "dds_", last] if last.endswith("_"):
            return f"{package}/{kind}/{last[:-1]}"
        case _:
            return None


def dds_topic(topic: str) -> str:
    """Return "rt/map" for "/map"."""
    return f"{TOPIC}/{topic.lstrip('/')}"


def request_topic(service: str) -> str:
    """Return "rq/robot/get_parametersRequest" for "/robot/get_parameters"."""
    return f"{REQUEST}/{service.lstrip('/')}Request"


def reply_topic(service: str) -> str:
    """Return "rr/robot/get_parametersReply" for "/robot/get_parameters"."""
    return f"{REPLY}/{service.lstrip('/')}Reply"


def topic_of(dds_name: str) -> str | None:
    """Return "/map" for "rt/map"; None for a topic that is not of ROS."""
    return dds_name[len(TOPIC) :] if dds_name.startswith(f"{TOPIC}/") else None


def service_of(dds_name: str) -> str | None:
    """Return the service whose answers come on a topic of DDS; None where none do."""
    is_reply = dds_name.startswith(f"{REPLY}/") and dds_name.endswith("Reply")
    return dds_name[len(REPLY) : -len("Reply")] if is_reply else None


MOST_AT_ONCE = 256
NOT_READ = ViewState.Any | InstanceState.Any | SampleState.NotRead
LIFESPAN_NS = 1_000_000_000
"""A command that did not arrive in time must not reach the node that is started next."""
PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)


class RawMessage(IdlStruct):
    """A message as its bytes; it has no fields, so that DDS leaves them alone."""

    def __init__(self, data: bytes) -> None:
        self.data = data

    def serialize(self, *_arguments: object, **_options: object) -> bytes:
        """Return the bytes, which hold their own header."""
        return self.data

    @classmethod
    def deserialize(cls, data: bytes, *_arguments: object, **_options: object) -> "RawMessage":
        """Keep the bytes."""
        return cls(data)

    @classmethod
    def deserialize_key(cls, data: bytes, *_arguments: object, **_options: object) -> "RawMessage":
        """Keep the bytes, which only tell that a writer has gone."""
        return cls(data)


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality(EndQuality):
    """The part of DDS's quality of service that ROS uses most, with how many samples are kept."""

    depth: int

    @property
    def writers_qos(self) -> Qos:
        """As Cyclone DDS takes it for a writer."""
        return self.qos if self.is_latched else Qos(Policy.Lifespan(LIFESPAN_NS), base=self.qos)

    @property
    def qos(self) -> Qos:
        """As Cyclone DDS takes it for a reader."""
        reliable = Policy.Reliability.Reliable(max_blocking_time=100_000_000)
        return Qos(
            reliable if self.is_reliable else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal if self.is_latched else Policy.Durability.Volatile,
            Policy.History.KeepLast(self.depth),
            PLAIN_CDR,
        )


class RawReader:
    """A reader of one topic.

    Args:
        decode: Decodes a message.
        take: Takes what was decoded.
        end: Takes it from those that are listened to, and lets go of it.
    """

    def __init__(
        self,
        reader: DataReader[Any],
        decode: Decode,
        take: Take,
        end: Callable[["RawReader"], None],
    ) -> None:
        self._end = end
        self._reader: DataReader[Any] | None = reader
        self.condition = ReadCondition(reader, NOT_READ)
        self.decode = decode
        self.take = take

    def collect(self) -> list[Any]:
        """Take the samples that have arrived; none once closed."""
        if self._reader is None:
            return []
        try:
            return self._reader.take(MOST_AT_ONCE)
        except DDSException:
            return []

    def understand(self, sample: Any) -> Sample | None:  # noqa: ANN401 - without types
        """Decode a sample; None for one that only tells that a writer has gone."""
        if not isinstance(sample, RawMessage):
            return None
        info: Any = getattr(sample, "sample_info")  # noqa: B009 - set by the library, undeclared
        return understand(sample.data, self.decode, source_s=info.source_timestamp / 1e9)

    def close(self) -> None:
        """Read no longer."""
        self._end(self)

    def let_go(self) -> None:
        """Let go of DDS's reader."""
        del self.condition
        self._reader = None

    @property
    def is_open(self) -> bool:
        """False once closed."""
        return self._reader is not None


class EndpointReader(RawReader):
    """A reader of DDS's own topic about all writers, or about all readers."""

    def understand(self, sample: Any) -> Sample | None:  # noqa: ANN401 - without types
        """Return the sample as it is."""
        return Sample(content=sample, source_s=0.0)


class RawWriter:
    """A writer of one topic."""

    def __init__(
        self,
        writer: DataWriter[Any],
        raw_type: type[RawMessage],
        end: Callable[["RawWriter"], None],
    ) -> None:
        self._end = end
        self.writer: DataWriter[Any] | None = writer
        self._raw_type = raw_type
        self.n_matched = 0
        self._news = News()

    def write(self, data: bytes) -> None:
        """Send the bytes of one message."""
        if self.writer is None:
            raise LinkError("The connection is closed.", hint="Connect again.")
        try:
            self.writer.write(self._raw_type(data))
        except DDSException as error:
            raise LinkError(
                f"DDS did not send a message: {error}", hint="Try again; the network may be full."
            ) from error

    def close(self) -> None:
        """Write no longer."""
        self._end(self)

    def note_matched(self, n_matched: int) -> None:
        """Take in how many readers there are."""
        self.n_matched = n_matched
        self._news.tell()

    async def wait_for_reader(self, *, timeout_s: float) -> bool:
        """Wait for a reader until the time is over; return whether there is one."""
        return await self._news.wait_until(lambda: self.n_matched > 0, within_s=timeout_s)
