"""A map from a publisher in another process to an `OccupancyGrid`: over rclpy, DDS and rosbridge.

It needs rclpy: `.venv-ros2/bin/python -m benchmarks.run ros2`, after `./run test-ros2` has made it.
The real rosbridge is measured where MAPSPEAK_ROSBRIDGE_SOURCE names its sources.
"""

import multiprocessing
import os
import random
import statistics
import sys
import time
from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import anyio
import click
import numpy as np

from benchmarks.figure import Figure
from mapspeak.errors import LinkError
from mapspeak.links.rclpy import open_ros2_connection
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import read_grid, write_grid
from mapspeak.ros.port import RosConnection
from mapspeak.spatial import OccupancyGrid

__all__ = ["measure"]

SIDES = (384, 1000, 4000)
ROSBRIDGE_SIDES = (384, 1000)
"""What rosbridge sends with its own limit for the size of a message."""
N_RUNS = 9
PATIENCE_S = 60.0
PAUSE_S = 0.5
TOPIC, TYPE = "/map", "nav_msgs/msg/OccupancyGrid"
DOMAINS = range(1, 102)
"""Those whose ports no outgoing connection of Linux takes."""

Connect = Callable[[int], AbstractAsyncContextManager[RosConnection]]


def measure() -> Iterator[Figure]:
    """Return wall times with all that lies between, and CPU times of reading alone."""
    if find_spec("rclpy") is None:
        click.echo("ros2: not measured, for this Python has no rclpy: see its module.", err=True)
        return
    for side in SIDES:
        for name, connect in _ways(side):
            what = f"{side}x{side}, latched by another process, subscribed to read over {name}"
            yield from _figures(what, anyio.run(_ask, side, connect))
    for side in SIDES:
        walls_ms, cpus_ms = anyio.run(_receive, _map(side))
        yield from _figures(f"{side}x{side}, published here to read over rclpy", walls_ms)
        yield Figure(
            name=f"{side}x{side}, CPU of reading alone over rclpy, median",
            value=statistics.median(cpus_ms),
            unit="ms",
        )


def _figures(what: str, values_ms: list[float]) -> Iterator[Figure]:
    for name, value in (("median", statistics.median(values_ms)), ("most", max(values_ms))):
        yield Figure(name=f"{what}, {name}", value=value, unit="ms")


def _ways(side: int) -> Iterator[tuple[str, Connect]]:
    """Return what such a map can be had over, here."""
    yield "rclpy", _over_rclpy
    if find_spec("cyclonedds") is not None:
        yield "DDS", _over_dds
    if "MAPSPEAK_ROSBRIDGE_SOURCE" in os.environ and side in ROSBRIDGE_SIDES:
        yield "rosbridge", _over_rosbridge


def _over_rclpy(domain_id: int) -> AbstractAsyncContextManager[RosConnection]:
    return open_ros2_connection(domain_id=domain_id)


def _over_dds(domain_id: int) -> AbstractAsyncContextManager[RosConnection]:
    from mapspeak.links.dds import DdsNetwork, open_dds_connection  # noqa: PLC0415 - optional

    return open_dds_connection(DdsNetwork(domain_id=domain_id, is_local=True))


@asynccontextmanager
async def _over_rosbridge(domain_id: int) -> AsyncGenerator[RosConnection]:
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from ros2.robot_process import ros_environment  # noqa: PLC0415 - of the tests
    from ros2.rosbridge_process import start_rosbridge  # noqa: PLC0415

    source = Path(os.environ["MAPSPEAK_ROSBRIDGE_SOURCE"])
    environment = ros_environment() | {"ROS_DOMAIN_ID": str(domain_id)}
    with start_rosbridge(source, environment) as url:
        async with open_client(RobotAddress(url=url)) as client:
            yield client


def _map(side: int) -> OccupancyGrid:
    cells = np.random.default_rng(1).choice(np.array([-1, 0, 100], dtype=np.int8), (side, side))
    return OccupancyGrid(cells=cells, resolution_m=0.05)


async def _receive(grid: OccupancyGrid) -> tuple[list[float], list[float]]:
    from mapspeak.links.rclpy.types import RclpyTypes, find_message  # noqa: PLC0415

    domain_id = _enter_domain()
    types = RclpyTypes()
    message = types.encode(TYPE, write_grid(grid, dialect=Dialect.ROS2))
    walls_ms: list[float] = []
    cpus_ms: list[float] = []
    with _publisher(find_message(TYPE), domain_id) as publish, anyio.fail_after(PATIENCE_S):
        async with open_ros2_connection(domain_id=domain_id) as connection:
            maps = connection.subscribe(TOPIC)
            publish(message)
            await maps.wait_for_more_than(0, timeout_s=PATIENCE_S)
            for _ in range(N_RUNS):
                n_before, before_s = maps.n_received, time.perf_counter()
                publish(message)
                heard = await maps.wait_for_more_than(n_before, timeout_s=PATIENCE_S)
                read_grid(heard)
                walls_ms.append((time.perf_counter() - before_s) * 1e3)
                before_s = time.thread_time()
                read_grid(types.decode(TYPE, message))
                cpus_ms.append((time.thread_time() - before_s) * 1e3)
    return walls_ms, cpus_ms


async def _ask(side: int, connect: Connect) -> list[float]:
    """Return how long a map takes to come that another process published long ago."""
    domain_id = _enter_domain()
    processes = multiprocessing.get_context("spawn")
    is_there, is_over = processes.Event(), processes.Event()
    publisher = processes.Process(target=_offer, args=(side, domain_id, is_there, is_over))
    publisher.start()
    asked_ms: list[float] = []
    try:
        is_there.wait(PATIENCE_S)
        with anyio.fail_after(PATIENCE_S):
            async with connect(domain_id) as connection:
                while not await _is_published(connection):  # noqa: ASYNC110 - elsewhere
                    await anyio.sleep(PAUSE_S)
                for _ in range(N_RUNS):
                    await anyio.sleep(PAUSE_S)
                    before_s = time.perf_counter()
                    maps = connection.subscribe(TOPIC)
                    read_grid(await maps.wait_for_more_than(0, timeout_s=PATIENCE_S))
                    asked_ms.append((time.perf_counter() - before_s) * 1e3)
                    connection.unsubscribe(maps)
    finally:
        is_over.set()
        publisher.join()
    return asked_ms


async def _is_published(connection: RosConnection) -> bool:
    try:
        return bool(await connection.fetch_publishers(TOPIC))
    except LinkError:
        return False


def _offer(side: int, domain_id: int, is_there: Any, is_over: Any) -> None:  # noqa: ANN401
    """Publish a map from one event until the other; a process of its own."""
    from mapspeak.links.rclpy.types import RclpyTypes, find_message  # noqa: PLC0415

    with _publisher(find_message(TYPE), domain_id) as publish:
        publish(RclpyTypes().encode(TYPE, write_grid(_map(side), dialect=Dialect.ROS2)))
        is_there.set()
        is_over.wait()


def _enter_domain() -> int:
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    return random.choice(DOMAINS)  # noqa: S311 - no secret


@contextmanager
def _publisher(message_class: Any, domain_id: int) -> Iterator[Any]:  # noqa: ANN401 - rclpy has no types
    """Return a node that publishes latched maps and does nothing else."""
    import rclpy  # noqa: PLC0415 - not everywhere
    from rclpy.context import Context  # noqa: PLC0415
    from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: PLC0415

    context = Context()
    rclpy.init(args=[], context=context, domain_id=domain_id)
    node = rclpy.create_node("map_server", context=context, enable_rosout=False)
    quality = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    try:
        yield node.create_publisher(message_class, TOPIC, quality).publish
    finally:
        node.destroy_node()
        context.try_shutdown()
