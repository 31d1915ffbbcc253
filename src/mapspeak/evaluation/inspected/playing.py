"""A described ROS system on the wire: a rosbridge server on a port of this machine."""

from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from typing import Any

import anyio

from mapspeak.evaluation.inspected.system import InspectedSystem, OfferedService, Stream
from mapspeak.ros.messages import Dialect
from mapspeak.rosbridge_server import (
    Hub,
    Interfaces,
    Parameters,
    RosSystem,
    Service,
    Topic,
    add_parameter_services,
    add_rosapi,
    serve_system,
)

__all__ = ["play"]

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
        played.services.add(_offer(each, interfaces))
    parameters = Parameters(
        system.dialect, {node: dict(values) for node, values in system.parameters.items()}
    )
    _use_own_clock(system, parameters)
    if system.dialect is Dialect.ROS2:
        add_parameter_services(played.services, parameters, interfaces)
    add_rosapi(played, parameters, clock)
    return played


def _use_own_clock(system: InspectedSystem, parameters: Parameters) -> None:
    """Say of all nodes that they do not run by /clock, which is not there."""
    if system.dialect is Dialect.ROS1:
        parameters.put("/use_sim_time", value=False)
    else:
        for node in system.parameters:
            parameters.put(f"{node}:use_sim_time", value=False)


def _topics_of(system: InspectedSystem) -> list[Topic]:
    topics = [
        Topic(
            name=name,
            type=system.type_of(name),
            is_latched=any(each.topic == name and each.rate_hz is None for each in system.streams),
            publishers=system.publishers_of(name),
            subscribers=system.hearers_of(name),
        )
        for name in system.topics
    ]
    if system.dialect is Dialect.ROS1:
        # The node of that name, which keeps the log, runs beside every master.
        nodes = system.nodes
        topics.append(Topic(name=ROSOUT, type=LOG, publishers=nodes, subscribers=(ROSOUT,)))
    return topics


def _offer(offered: OfferedService, interfaces: Interfaces) -> Service:
    async def answer(_request: dict[str, Any]) -> dict[str, Any]:
        return interfaces.fill(f"{offered.type}_Response", {})

    request = f"{offered.type}_Request"
    return Service(
        name=offered.service,
        type=offered.type,
        node=offered.node,
        answer=interfaces.filled(request, answer),
    )


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
    message = stream.content.write(now_s - stream.lag_s, played.dialect)
    played.hub.publish(stream.topic, played.interfaces.fill(stream.type, message))
