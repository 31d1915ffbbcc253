"""What rclpy costs: a map from a publisher, here and in another process, to an `OccupancyGrid`.

It needs rclpy: `.venv-ros2/bin/python -m benchmarks.run ros2`, after `./run test-ros2` has made it.
"""

import multiprocessing
import os
import random
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import anyio
import click
import numpy as np

from benchmarks.figure import Figure
from mapspeak.links.ros2 import open_ros2_connection
from mapspeak.ros.messages import Dialect, read_grid, write_grid
from mapspeak.spatial import OccupancyGrid

__all__ = ["measure"]

SIDES = (384, 1000, 4000)
N_RUNS = 9
PATIENCE_S = 30.0
PAUSE_S = 0.5
TOPIC, TYPE = "/map", "nav_msgs/msg/OccupancyGrid"
DOMAINS = range(1, 102)
"""Those whose ports no outgoing connection of Linux takes."""


def measure() -> Iterator[Figure]:
    """Gives wall times with all that lies between, and CPU times of reading alone."""
    if find_spec("rclpy") is None:
        click.echo("ros2: not measured, for this Python has no rclpy: see its module.", err=True)
        return
    for side in SIDES:
        asked_ms = anyio.run(_ask, side)
        walls_ms, cpus_ms = anyio.run(_receive, _map(side))
        for what, values_ms in (
            ("latched by another process, subscribed to read", asked_ms),
            ("published here to read", walls_ms),
        ):
            for name, value in (("median", statistics.median(values_ms)), ("most", max(values_ms))):
                yield Figure(name=f"{side}x{side}, {what}, {name}", value=value, unit="ms")
        yield Figure(
            name=f"{side}x{side}, CPU of reading alone, median",
            value=statistics.median(cpus_ms),
            unit="ms",
        )


def _map(side: int) -> OccupancyGrid:
    cells = np.random.default_rng(1).choice(np.array([-1, 0, 100], dtype=np.int8), (side, side))
    return OccupancyGrid(cells=cells, resolution_m=0.05)


async def _receive(grid: OccupancyGrid) -> tuple[list[float], list[float]]:
    from mapspeak.links.ros2.reading import read_message  # noqa: PLC0415 - needs rclpy
    from mapspeak.links.ros2.types import find_message  # noqa: PLC0415
    from mapspeak.links.ros2.writing import write_message  # noqa: PLC0415

    domain_id = _enter_domain()
    message = write_message(find_message(TYPE), write_grid(grid, dialect=Dialect.ROS2))
    walls_ms: list[float] = []
    cpus_ms: list[float] = []
    with _publisher(find_message(TYPE), domain_id) as publish, anyio.fail_after(PATIENCE_S):
        async with open_ros2_connection(domain_id=domain_id) as connection:
            maps = connection.subscribe(TOPIC, is_bulky=True)
            publish(message)
            await maps.wait_for_more_than(0, timeout_s=PATIENCE_S)
            for _ in range(N_RUNS):
                n_before, before_s = maps.n_received, time.perf_counter()
                publish(message)
                heard = await maps.wait_for_more_than(n_before, timeout_s=PATIENCE_S)
                read_grid(heard)
                walls_ms.append((time.perf_counter() - before_s) * 1e3)
                before_s = time.thread_time()
                read_grid(read_message(message))
                cpus_ms.append((time.thread_time() - before_s) * 1e3)
    return walls_ms, cpus_ms


async def _ask(side: int) -> list[float]:
    """Gives how long a map takes to come that another process published long ago."""
    domain_id = _enter_domain()
    processes = multiprocessing.get_context("spawn")
    is_over = processes.Event()
    publisher = processes.Process(target=_offer, args=(side, domain_id, is_over))
    publisher.start()
    asked_ms: list[float] = []
    try:
        with anyio.fail_after(PATIENCE_S):
            async with open_ros2_connection(domain_id=domain_id) as connection:
                while not await connection.fetch_publishers(TOPIC):  # noqa: ASYNC110 - see there
                    await anyio.sleep(PAUSE_S)
                for _ in range(N_RUNS):
                    await anyio.sleep(PAUSE_S)
                    before_s = time.perf_counter()
                    maps = connection.subscribe(TOPIC, is_bulky=True)
                    read_grid(await maps.wait_for_more_than(0, timeout_s=PATIENCE_S))
                    asked_ms.append((time.perf_counter() - before_s) * 1e3)
                    connection.unsubscribe(maps)
    finally:
        is_over.set()
        publisher.join()
    return asked_ms


def _offer(side: int, domain_id: int, is_over: Any) -> None:  # noqa: ANN401 - an event
    """Publishes a map until it is told that nobody wants it any more; a process of its own."""
    from mapspeak.links.ros2.types import find_message  # noqa: PLC0415 - needs rclpy
    from mapspeak.links.ros2.writing import write_message  # noqa: PLC0415

    message_class = find_message(TYPE)
    with _publisher(message_class, domain_id) as publish:
        publish(write_message(message_class, write_grid(_map(side), dialect=Dialect.ROS2)))
        is_over.wait()


def _enter_domain() -> int:
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    return random.choice(DOMAINS)  # noqa: S311 - no secret


@contextmanager
def _publisher(message_class: Any, domain_id: int) -> Iterator[Any]:  # noqa: ANN401 - rclpy has no types
    """A node that publishes latched maps and does nothing else."""
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
