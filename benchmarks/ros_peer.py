"""Listing topics beside `ros-mcp`, both as MCP servers over stdio, on the same rosbridge server.

`ros-mcp` runs in an environment of its own: MAPSPEAK_ROS_MCP names its Python; without that the
one that runs this. Where it is not installed, only our own figures are given. The server is
mapspeak's own, once for each ROS; MAPSPEAK_ROSBRIDGE_URL names another one instead.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import click
from anyio.abc import Process
from anyio.streams.buffered import BufferedByteReceiveStream

from benchmarks.figure import Figure
from benchmarks.talking import HELLO
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.links.simulated import Clock, open_simulated_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.server.app import build_server
from mapspeak.session import Session
from mapspeak.simulator import Simulation, load_world

__all__ = ["measure"]

PEER_VARIABLE, URL_VARIABLE = "MAPSPEAK_ROS_MCP", "MAPSPEAK_ROSBRIDGE_URL"
MODULE = "ros_mcp.main"
LONGEST_LINE = 50_000_000
N_ASKED = 30
PAUSE_S = 0.05
KEPT_S = 1.1
"""After so long mapspeak asks the robot for its topics again."""
N_ASKED_ANEW = 5
OURS = {"ros_topics": {}, "ros_topic": {"topic": "/cmd_vel"}, "ros_nodes": {}}
THEIRS = {"get_topics": {}, "get_topic_details": {"topic": "/cmd_vel"}, "get_nodes": {}}
IN_SERVER = {"get_robot_pose": {}, "ros_topics": {}, "ros_read": {"topic": "/map"}}
Times = dict[str, list[float]]


def measure() -> Iterator[Figure]:
    """Return medians of wall time as a client sees them, and how many times faster ours is."""
    url = os.environ.get(URL_VARIABLE)
    if url is not None:
        yield from _figures("that rosbridge", anyio.run(_measure, url))
        return
    for dialect in Dialect:
        yield from _figures(dialect, anyio.run(_measure_own, dialect))


def _figures(where: str, times_ms: Times) -> Iterator[Figure]:
    medians_ms = {name: statistics.median(values) for name, values in times_ms.items()}
    for name, median_ms in medians_ms.items():
        yield Figure(name=f"{where}, {name}", value=median_ms, unit="ms")
    if "ros-mcp get_topics" in medians_ms:
        ratio = medians_ms["ros-mcp get_topics"] / medians_ms["mapspeak ros_topics"]
        yield Figure(name=f"{where}, topics listed faster", value=ratio, unit="times")


async def _measure_own(dialect: Dialect) -> Times:
    simulation = Simulation(load_world("warehouse"), seed=0)
    async with (
        open_simulated_robot(simulation, clock=Clock.REAL, has_detector=False) as robot,
        open_rosbridge_server(robot, dialect=dialect) as server,
    ):
        return await _measure(server.url)


async def _measure(url: str) -> Times:
    times_ms: Times = {}
    with tempfile.TemporaryDirectory() as folder:
        memory = Path(folder) / "semantic_map.yaml"
        await _measure_in_server(times_ms, url, memory)
        command = [sys.executable, "-m", "mapspeak", "serve", "--robot", url]
        async with _open([*command, "--toolsets", "ros", "--semantic-map", str(memory)]) as client:
            await _ask(times_ms, client.call, "mapspeak", OURS)
            await _ask_anew(times_ms, client)
    peer = _find_peer()
    if peer is not None:
        async with _open([*peer, "--transport", "stdio"]) as client:
            host, _, port = url.removeprefix("ws://").rpartition(":")
            await client.call("connect_to_robot", ip=host, port=int(port))
            await _ask(times_ms, client.call, "ros-mcp", THEIRS)
    return times_ms


async def _measure_in_server(times_ms: Times, url: str, memory: Path) -> None:
    """Time calls in the server's own process, of a robot whose map and pose are at hand."""
    async with open_rosbridge_robot(url) as robot:
        session = Session(robot, SemanticMapStore(memory), lease_s=60.0, ros=robot.connection)
        server = build_server(session, toolsets=("look", "ros"))
        await robot.fetch_map()

        async def call(tool: str, **arguments: Any) -> None:  # noqa: ANN401 - any JSON
            await server.call_tool(tool, arguments)

        await _ask(times_ms, call, "in the server", IN_SERVER)


async def _ask_anew(times_ms: Times, client: "_Client") -> None:
    for _ in range(N_ASKED_ANEW):
        await anyio.sleep(KEPT_S)
        started_s = time.perf_counter()
        await client.call("ros_topics")
        passed_ms = (time.perf_counter() - started_s) * 1e3
        times_ms.setdefault("mapspeak ros_topics, asked anew", []).append(passed_ms)


def _find_peer() -> list[str] | None:
    python = os.environ.get(PEER_VARIABLE) or sys.executable
    found = subprocess.run(  # noqa: S603 - the Python that the person named
        [python, "-c", "import ros_mcp.main"], capture_output=True, check=False
    )
    if found.returncode:
        click.echo(
            f"ros-mcp is not installed for {python} and left out; {PEER_VARIABLE} names a Python.",
            err=True,
        )
        return None
    return [python, "-m", MODULE]


async def _ask(
    times_ms: Times,
    call: Callable[..., Awaitable[None]],
    who: str,
    questions: Mapping[str, Mapping[str, Any]],
) -> None:
    for tool, arguments in questions.items():
        await call(tool, **arguments)
        for _ in range(N_ASKED):
            # Other work of the same server, such as the map's next version, gets its turn.
            await anyio.sleep(PAUSE_S)
            started_s = time.perf_counter()
            await call(tool, **arguments)
            times_ms.setdefault(f"{who} {tool}", []).append((time.perf_counter() - started_s) * 1e3)


class _Client:
    """A server process, spoken to in bare JSON lines so that no client's own time counts."""

    def __init__(self, process: Process) -> None:
        if process.stdin is None or process.stdout is None:
            raise RuntimeError("The server's standard streams are not pipes.")
        self._input = process.stdin
        self._output = BufferedByteReceiveStream(process.stdout)
        self._n_asked = 0

    async def ask(self, method: str, **params: object) -> Any:  # noqa: ANN401 - any JSON
        """Return the result of a request."""
        self._n_asked += 1
        await self.tell(method, id=self._n_asked, params=params)
        while True:
            line = await self._output.receive_until(b"\n", LONGEST_LINE)
            answer = json.loads(line)
            if answer.get("id") == self._n_asked and "method" not in answer:
                return answer["result"]

    async def tell(self, method: str, **more: object) -> None:
        """Send a message."""
        message = {"jsonrpc": "2.0", "method": method, **more}
        await self._input.send(json.dumps(message).encode() + b"\n")

    async def call(self, tool: str, **arguments: object) -> None:
        """Call a tool, which has to succeed."""
        result = await self.ask("tools/call", name=tool, arguments=arguments)
        if result.get("isError"):
            raise RuntimeError(f"{tool} failed: {result}")


@asynccontextmanager
async def _open(command: Sequence[str]) -> AsyncGenerator[_Client]:
    async with await anyio.open_process(command, stderr=subprocess.DEVNULL) as process:
        client = _Client(process)
        await client.ask("initialize", **HELLO)
        await client.tell("notifications/initialized")
        try:
            yield client
        finally:
            process.terminate()
