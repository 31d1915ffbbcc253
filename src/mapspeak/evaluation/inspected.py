"""A robot's ROS to be inspected: described as values, put out of order on purpose, and played.

`robot.yaml` says what it consists of in good order, and what is drawn. The description is the truth
of the questions that are asked of it: an agent that inspects it sees only what a rosbridge server
says on the wire.
"""

from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from functools import cache, partial
from importlib import resources
from string import Template
from types import SimpleNamespace
from typing import Any

import anyio
import numpy as np
from ruamel.yaml import YAML

from mapspeak.geometry import Pose
from mapspeak.ros.messages.fields import Dialect, Message, write_header
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import FrameTransform, write_transforms
from mapspeak.rosbridge_server import (
    Hub,
    Interfaces,
    Parameters,
    RosSystem,
    Topic,
    add_parameter_services,
    add_rosapi,
    serve_system,
)
from mapspeak.spatial import OccupancyGrid


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stream:
    """A publisher of one node on one topic; types are written as "package/Type".

    Attributes:
        values: The fields of each message that differ from their defaults.
        frame_id: Of the header with each stamp; None for a message without a header.
        transforms: Content of tf messages, in place of `values`; each has its own stamp.
        rate_hz: Messages per second of the wall clock; 0 for a dead stream, None for one latched
            message.
        lag_s: Lag of its stamps behind the robot's clock.
    """

    node: str
    topic: str
    type: str
    values: Message = field(default_factory=dict)
    frame_id: str | None = None
    transforms: tuple[FrameTransform, ...] = ()
    rate_hz: float | None
    lag_s: float = 0.0

    def message(self, stamp_s: float, dialect: Dialect) -> Message:
        """Return the message of a time by the robot's clock."""
        if self.transforms:
            stamped = [replace(each, stamp_s=stamp_s) for each in self.transforms]
            return write_transforms(stamped, dialect=dialect)
        if self.frame_id is None:
            return self.values
        return {"header": write_header(self.frame_id, stamp_s, dialect=dialect), **self.values}


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedService:
    """One service of a node; its answer is always empty.

    Attributes:
        deed: What it is for, in a question's words.
    """

    node: str
    service: str
    type: str
    deed: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class InspectedSystem:
    """The whole ROS graph of the robot.

    Attributes:
        started_s: The robot's clock at the beginning.
        subscriptions: The topics that each node subscribes to, with the types that it expects.
        services: Offered services, besides those of every ROS.
        parameters: Values by nodes and their own names; each node is named here.
        types: The definitions of custom types, by "package/Type".
    """

    dialect: Dialect
    started_s: float
    streams: tuple[Stream, ...]
    subscriptions: Mapping[str, Mapping[str, str]]
    services: tuple[OfferedService, ...] = ()
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    types: Mapping[str, str] = field(default_factory=dict)

    @property
    def nodes(self) -> tuple[str, ...]:
        """All nodes by name."""
        offering = {each.node for each in self.streams} | {each.node for each in self.services}
        return tuple(sorted(offering | {*self.subscriptions} | {*self.parameters}))

    @property
    def topics(self) -> dict[str, str]:
        """The types of all topics that are published or subscribed to, in the order of names."""
        types: dict[str, str] = {}
        for wanted in self.subscriptions.values():
            types.update(wanted)
        types.update((each.topic, each.type) for each in self.streams)
        return dict(sorted(types.items()))

    def publishers_of(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that publish a topic, by name."""
        return tuple(sorted({each.node for each in self.streams if each.topic == topic}))

    def subscribers_of(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that subscribe to a topic, by name."""
        return tuple(sorted(node for node, wanted in self.subscriptions.items() if topic in wanted))

    def stream_on(self, topic: str) -> Stream:
        """Return the stream on a topic that has one."""
        return next(each for each in self.streams if each.topic == topic)

    def stream_to(self, child: str) -> Stream:
        """Return the stream that carries the transform to a frame."""
        return next(
            stream
            for stream in self.streams
            if any(each.child == child for each in stream.transforms)
        )

    def with_stream(self, stream: Stream, **changes: Any) -> "InspectedSystem":  # noqa: ANN401 - fields of Stream
        """Return the system with one of its streams changed."""
        changed = (replace(each, **changes) if each is stream else each for each in self.streams)
        return replace(self, streams=tuple(changed))

    def without_node(self, node: str) -> "InspectedSystem":
        """Return the system without a node and all that it does."""
        return replace(
            self,
            streams=tuple(each for each in self.streams if each.node != node),
            subscriptions={each: told for each, told in self.subscriptions.items() if each != node},
            services=tuple(each for each in self.services if each.node != node),
            parameters={each: told for each, told in self.parameters.items() if each != node},
        )


ROSOUT = "/rosout"
LOG = "rosgraph_msgs/Log"


@asynccontextmanager
async def play(system: InspectedSystem) -> AsyncGenerator[str]:
    """Play a system, in real time, while the context lasts; return the address of its rosbridge."""
    begun_s = anyio.current_time()

    def clock() -> float:
        return system.started_s + anyio.current_time() - begun_s

    played = _build(system, clock)
    for stream in system.streams:
        if stream.rate_hz is None:
            _publish(played, stream, clock())
    async with anyio.create_task_group() as tasks:
        for stream in system.streams:
            if stream.rate_hz:
                tasks.start_soon(_keep_publishing, played, stream, stream.rate_hz, clock)
        async with serve_system(played) as server:
            yield server.url
        tasks.cancel_scope.cancel()


def _build(system: InspectedSystem, clock: Callable[[], float]) -> RosSystem:
    interfaces = Interfaces(system.dialect, more=system.types)
    played = RosSystem(Hub(_topics_of(system)), interfaces, dialect=system.dialect)
    for each in system.services:
        played.offer_typed(
            each.service,
            each.type,
            node=each.node,
            answer=partial(_answer_emptily, interfaces, f"{each.type}_Response"),
        )
    parameters = Parameters(
        system.dialect, {node: dict(values) for node, values in system.parameters.items()}
    )
    # No node runs by /clock, which is not there; ROS 1 says that once for all.
    is_ros2 = system.dialect is Dialect.ROS2
    for prefix in [f"{node}:" for node in system.parameters] if is_ros2 else ["/"]:
        parameters.put(f"{prefix}use_sim_time", value=False)
    if is_ros2:
        add_parameter_services(played, parameters)
    add_rosapi(played, parameters, clock)
    return played


def _topics_of(system: InspectedSystem) -> list[Topic]:
    topics = [
        Topic(
            name=name,
            type=kind,
            is_latched=any(each.topic == name and each.rate_hz is None for each in system.streams),
            publishers=system.publishers_of(name),
            subscribers=system.subscribers_of(name),
        )
        for name, kind in system.topics.items()
    ]
    if system.dialect is Dialect.ROS1:
        # The node of that name, which keeps the log, runs beside every master.
        nodes = system.nodes
        topics.append(Topic(name=ROSOUT, type=LOG, publishers=nodes, subscribers=(ROSOUT,)))
    return topics


def _answer_emptily(
    interfaces: Interfaces, response: str, _request: dict[str, Any]
) -> dict[str, Any]:
    return interfaces.fill(response, {})


async def _keep_publishing(
    played: RosSystem, stream: Stream, rate_hz: float, clock: Callable[[], float]
) -> None:
    """Publish in step with the clock: what a busy machine has held up comes all the same."""
    due_s = anyio.current_time()
    while True:
        await anyio.sleep_until(due_s)
        due_s += 1.0 / rate_hz
        if played.hub.is_wanted(stream.topic):
            _publish(played, stream, clock())


def _publish(played: RosSystem, stream: Stream, now_s: float) -> None:
    message = stream.message(now_s - stream.lag_s, played.dialect)
    played.hub.publish(stream.topic, played.interfaces.fill(stream.type, message))


Names = SimpleNamespace
"""Names of the parts of one robot's ROS."""
TRANSFORMS = "tf2_msgs/TFMessage"
FIRST_S, LAST_S = 1_700_000_000, 1_760_000_000
"""Robots that run by the time of day have such clocks."""
LOCAL_CELLS = 60
SLOWEST_HZ, FASTER = 3.0, 8.0
"""Of laser scanners, and how many times as fast the fastest is."""
N_BEAMS = 90


@cache
def _read_parts() -> tuple[Mapping[str, Sequence[str]], Any]:
    """Return what parts may be called, and the whole in which `$` stands before what is drawn."""
    text = resources.files(__package__).joinpath("robot.yaml").read_text(encoding="utf-8")
    names, parts = YAML(typ="safe", pure=True).load_all(text)
    return names, parts


def _fill(told: Any, drawn: Mapping[str, object]) -> Any:  # noqa: ANN401 - a tree of YAML
    """Return a tree with what was drawn in its places."""
    if isinstance(told, dict):
        return {_fill(key, drawn): _fill(value, drawn) for key, value in told.items()}
    if isinstance(told, list):
        return [_fill(value, drawn) for value in told]
    if not isinstance(told, str):
        return told
    whole = drawn.get(told[1:]) if told.startswith("$") else None
    return Template(told).substitute(drawn) if whole is None else whole


def draw_names(random: np.random.Generator) -> Names:
    """Draw what everything is called."""
    return Names(**{part: _one(random, choices) for part, choices in _read_parts()[0].items()})


def draw_system(
    random: np.random.Generator, names: Names, grid: OccupancyGrid, *, dialect: Dialect
) -> InspectedSystem:
    """Draw a system in which everything is as it should be."""
    charge_ratio = round(float(random.uniform(0.06, 0.96)), 2)
    figures = {
        # Evenly on a logarithmic scale, so that no one figure is near to most of them.
        "laser_hz": round(2 * SLOWEST_HZ * FASTER ** random.random()) / 2,
        "ranges_m": [round(float(random.uniform(1.0, 6.0)), 2)] * N_BEAMS,
        "range_m": round(float(random.uniform(0.3, 3.0)), 2),
        "charge_ratio": charge_ratio,
        "voltage": round(22.0 + 4.0 * charge_ratio, 2),
    }
    told = _fill(_read_parts()[1], {**vars(names), **figures})
    local = OccupancyGrid(
        cells=np.zeros((LOCAL_CELLS, LOCAL_CELLS), dtype=np.int8), resolution_m=0.05
    )
    grids = {names.map: grid, f"{names.navigator}/local_costmap": local}
    streams = tuple(_stream(row, grids.get(row["topic"]), dialect) for row in told["streams"])
    types = {stream.topic: stream.type for stream in streams}
    system = InspectedSystem(
        dialect=dialect,
        started_s=float(random.integers(FIRST_S, LAST_S)),
        streams=streams,
        subscriptions={
            node: {topic: types[topic] for topic in topics}
            for node, topics in told["subscriptions"].items()
        },
        services=tuple(_draw_service(random, **row) for row in told["services"]),
        types={names.device_type: _draw_type(random, told["measured"], told["kinds"])},
    )
    numbers = {
        name: round(float(random.uniform(low, high)), places)
        for name, (low, high, places) in told["navigation"].items()
    }
    parameters: dict[str, dict[str, Any]] = {node: {} for node in system.nodes}
    parameters[names.navigator] = {**numbers, "global_frame": "map"}
    parameters[names.laser] = {"frame_id": names.laser_frame, "angle_compensate": True}
    return replace(system, parameters=parameters)


def _stream(row: dict[str, Any], grid: OccupancyGrid | None, dialect: Dialect) -> Stream:
    transforms = tuple(
        FrameTransform(
            parent_from_child=Pose(x, y, yaw_rad), parent=parent, child=child, stamp_s=0.0
        )
        for parent, child, x, y, yaw_rad in row.pop("transforms", ())
    )
    values = row.pop("values", {}) if grid is None else write_grid(grid, dialect=dialect)
    usual = {"type": TRANSFORMS, "rate_hz": None}
    return Stream(**{**usual, **row}, values=values, transforms=transforms)


def _draw_service(
    random: np.random.Generator,
    *,
    node: str,
    names: Sequence[str],
    types: Sequence[str],
    deed: str,
) -> OfferedService:
    return OfferedService(
        node=node, service=f"{node}/{_one(random, names)}", type=_one(random, types), deed=deed
    )


def _draw_type(random: np.random.Generator, measured: Sequence[str], kinds: Sequence[str]) -> str:
    """Draw the text of a message type: five fields, of which two are of one kind."""
    names = [measured[at] for at in random.permutation(len(measured))[:5].tolist()]
    drawn = [kinds[at] for at in random.permutation(len(kinds))[:4].tolist()]
    rows = zip((*drawn, drawn[0]), names, strict=True)
    return "\n".join(f"{kind} {name}" for kind, name in rows)


def _one(random: np.random.Generator, choices: Sequence[str]) -> str:
    return choices[int(random.integers(len(choices)))]
