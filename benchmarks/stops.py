"""Goals that navigation accepts late: does the robot stand after a stop, or once it was told to?

Over rosbridge on ROS 1 in this process; over rosbridge 2.1, rclpy and DDS with a robot on real
ROS 2, which needs `.venv-ros2/bin/python -m benchmarks.run stops`, after `./run test-ros2` has made
it, and for rosbridge MAPSPEAK_ROSBRIDGE_SOURCE. All in real time, each link beside the others.
"""

import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterator
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

import anyio
import anyio.to_thread
import click
from mcp.client import Client

from benchmarks.figure import Figure
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.robot import RosRobot
from mapspeak.server.app import build_server
from mapspeak.session import Session

__all__ = ["measure"]

DELAYS_S = (1.0, 5.0, 7.0, 20.0)
TOOLS = ("navigate_to", "ros_send_goal")
N_ROUNDS = int(os.environ.get("MAPSPEAK_BENCH_ROUNDS", "1"))
WATCHED_S = 4.0
"""So long the robot is watched after navigation has accepted the goal."""
SLOWER = 1.25
STILL_M = 0.2
SPEED_MPS = 0.5
ENDS_X = (2.0, 38.0)
LANE_Y = 2.25
STOPPED = frozenset({"rejected", "lost", "cancelled", "aborted", "blocked", "preempted"})
ROOM = "\n".join(["#" * 80, *["#" + "." * 78 + "#"] * 8, "#" * 80])
"""40 m by 5 m, with cells of half a metre."""
START_XY = (1.0, LANE_Y)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rig:
    """A robot that accepts goals late, and what a client asks it through."""

    robot: RosRobot
    set_delay: Callable[[float], Awaitable[None]]
    fetch_driven_m: Callable[[], Awaitable[float]]
    come_home: Callable[[], Awaitable[None]]
    action: str
    goal_field: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """One goal: how it was told to end, and how far the robot drove after that."""

    link: str
    tool: str
    delay_s: float
    is_stopped: bool
    state: str
    moved_m: float

    @property
    def is_right(self) -> bool:
        """True when words and wheels agree."""
        return self.moved_m < STILL_M or not (self.is_stopped or self.state in STOPPED)


def measure() -> Iterator[Figure]:
    """Count the runs in which the robot stood after a stop, or after an answer that says so."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    runs: list[_Run] = anyio.run(_measure_all)
    for run in runs:
        if not run.is_right:
            click.echo(f"NOT RIGHT: {run}", err=True)
    for link, is_stopped in product(dict.fromkeys(run.link for run in runs), (False, True)):
        chosen = [run for run in runs if (run.link, run.is_stopped) == (link, is_stopped)]
        states = Counter(run.state for run in chosen)
        said = ", ".join(f"{n} {state}" for state, n in states.most_common())
        what = f"{link}, {'stopped before' if is_stopped else 'no stop'} ({said})"
        n_right = sum(run.is_right for run in chosen)
        yield Figure(
            name=f"{what}: words and wheels agree", value=n_right, unit=f"of {len(chosen)}"
        )
        still_m = [run.moved_m for run in chosen if run.is_stopped or run.state in STOPPED]
        yield Figure(name=f"{what}: farthest after it", value=max(still_m, default=0.0), unit="m")
    yield Figure(
        name="all links, delays and tools: words and wheels agree",
        value=sum(run.is_right for run in runs),
        unit=f"of {len(runs)}",
    )


async def _measure_all() -> list[_Run]:
    runs: list[_Run] = []
    async with AsyncExitStack() as rigs:
        # One after another: starting a program holds up the others' discovery.
        opened = [(link, await rigs.enter_async_context(open_rig())) for link, open_rig in _links()]
        async with anyio.create_task_group() as tasks:
            for link, rig in opened:
                tasks.start_soon(_measure_link, link, rig, runs)
    return runs


def _links() -> Iterator[tuple[str, Callable[[], AbstractAsyncContextManager[_Rig]]]]:
    yield "rosbridge, ROS 1", _on_ros1
    if find_spec("rclpy") is None:
        click.echo("stops: ROS 2 is not measured, for this Python has no rclpy.", err=True)
        return
    yield "rclpy", partial(_on_ros2, "rclpy")
    if find_spec("cyclonedds") is not None:
        yield "DDS", partial(_on_ros2, "dds")
    if "MAPSPEAK_ROSBRIDGE_SOURCE" in os.environ:
        yield "rosbridge 2.1", partial(_on_ros2, "rosbridge")


async def _measure_link(link: str, rig: _Rig, runs: list[_Run]) -> None:
    cases = product(range(N_ROUNDS), DELAYS_S, TOOLS, (False, True))
    for number, delay_s, tool, is_stopped in cases:
        run = await _run(rig, link=link, tool=tool, delay_s=delay_s, is_stopped=is_stopped)
        click.echo(f"{number + 1}: {run}", err=True)
        runs.append(run)
        await rig.come_home()


async def _run(rig: _Rig, *, link: str, tool: str, delay_s: float, is_stopped: bool) -> _Run:
    """Send a goal that is accepted late, stop it or not, and watch what the robot does."""
    with tempfile.TemporaryDirectory() as folder:
        memory = SemanticMapStore(Path(folder) / "map.yaml")
        session = Session(
            rig.robot,
            memory,
            lease_s=3600.0,
            ros=rig.robot.connection,
            find_model=lambda: None,
        )
        server = build_server(session, toolsets=("drive", "ros"))
        await rig.set_delay(delay_s)
        async with Client(server) as client:
            begun_s = anyio.current_time()
            async with anyio.create_task_group() as tasks:
                tasks.start_soon(_send, rig, client, tool)
                if is_stopped:
                    await anyio.sleep(delay_s / 2.0)
                    stopped = await client.call_tool("stop_robot", {})
                    if stopped.is_error:
                        raise RuntimeError(_text(stopped))
            driven_m = await rig.fetch_driven_m()
            state = await _ask(client, tool)
            # On a busy machine navigation takes longer than it is told to.
            await anyio.sleep_until(begun_s + SLOWER * delay_s + WATCHED_S)
            moved_m = await rig.fetch_driven_m() - driven_m
            state = state if state in STOPPED else await _ask(client, tool)
            await client.call_tool("stop_robot", {})
    return _Run(
        link=link,
        tool=tool,
        delay_s=delay_s,
        is_stopped=is_stopped,
        state=state,
        moved_m=round(moved_m, 3),
    )


async def _send(rig: _Rig, client: Client, tool: str) -> None:
    here_x = (await rig.robot.fetch_pose()).pose.x
    x, y = max(ENDS_X, key=lambda end: abs(end - here_x)), LANE_Y
    if tool == "navigate_to":
        await client.call_tool(tool, {"x": x, "y": y, "wait_s": 0})
        return
    pose = {"position": {"x": x, "y": y}, "orientation": {"w": 1.0}}
    goal = {rig.goal_field: {"header": {"frame_id": "map"}, "pose": pose}}
    await client.call_tool(tool, {"action": rig.action, "goal": goal, "wait_s": 0})


async def _ask(client: Client, tool: str) -> str:
    """Return how the latest goal stands, as the model is told."""
    if tool == "navigate_to":
        said = _text(await client.call_tool("wait_for_goal", {"wait_s": 0}))
        try:
            return str(json.loads(said)["state"])
        except ValueError:
            # A drive that was stopped before it began is none.
            return "cancelled" if "sent anywhere yet" in said else said
    said = _text(await client.call_tool("ros_goal_status", {}))
    if "No goal has been sent" in said:
        return "cancelled"
    return said.partition("): ")[2].partition(" ")[0] or said


def _text(result: Any) -> str:  # noqa: ANN401
    return "\n".join(part.text for part in result.content if hasattr(part, "text"))


@asynccontextmanager
async def _on_ros1() -> AsyncGenerator[_Rig]:
    from drawing import grid_from_text  # noqa: PLC0415 - of the tests
    from faulty_bridge import open_faulty_bridge  # noqa: PLC0415
    from mapspeak.geometry import Pose  # noqa: PLC0415

    home = Pose(*START_XY)
    grid = grid_from_text(ROOM, resolution_m=0.5)
    async with (
        open_faulty_bridge(Dialect.ROS1, grid=grid, pose=home, speed_mps=SPEED_MPS) as bridge,
        open_rosbridge_robot(bridge.url) as robot,
    ):

        async def set_delay(delay_s: float) -> None:
            bridge.robot.faults.acceptance_s = delay_s

        async def fetch_driven_m() -> float:
            return bridge.robot.base.driven_m

        async def come_home() -> None:
            bridge.robot.base.pose = home
            await anyio.sleep(1.0)

        yield _Rig(
            robot=robot,
            set_delay=set_delay,
            fetch_driven_m=fetch_driven_m,
            come_home=come_home,
            action="/move_base",
            goal_field="target_pose",
        )


@asynccontextmanager
async def _on_ros2(link: str) -> AsyncGenerator[_Rig]:
    from mapspeak.geometry import Pose  # noqa: PLC0415
    from ros2.robot_process import open_robot_process, ros_environment  # noqa: PLC0415

    environment = ros_environment()
    with open_robot_process(
        ROOM, pose=Pose(*START_XY), speed_mps=SPEED_MPS, environment=environment
    ) as process:
        async with _open_link(link, environment) as robot:

            async def tell() -> dict[str, Any]:
                return await anyio.to_thread.run_sync(process.tell)

            async def set_delay(delay_s: float) -> None:
                await anyio.to_thread.run_sync(lambda: process.set_faults(acceptance_s=delay_s))

            async def fetch_driven_m() -> float:
                return float((await tell())["driven_m"])

            async def come_home() -> None:
                # There is room enough to drive on.
                await anyio.sleep(1.0)

            yield _Rig(
                robot=robot,
                set_delay=set_delay,
                fetch_driven_m=fetch_driven_m,
                come_home=come_home,
                action="/navigate_to_pose",
                goal_field="pose",
            )


@asynccontextmanager
async def _open_link(link: str, environment: dict[str, str]) -> AsyncGenerator[RosRobot]:
    if link == "rclpy":
        from mapspeak.links.rclpy import open_ros2_robot  # noqa: PLC0415 - needs rclpy

        for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "AMENT_PREFIX_PATH", "ROS_DISTRO"):
            os.environ[name] = environment[name]
        async with open_ros2_robot(domain_id=int(environment["ROS_DOMAIN_ID"])) as robot:
            yield robot
    elif link == "dds":
        from mapspeak.cli.shared.robots import read_network  # noqa: PLC0415
        from mapspeak.links.dds import open_dds_robot  # noqa: PLC0415 - optional

        async with open_dds_robot(read_network("", environment)) as robot:
            yield robot
    else:
        from ros2.rosbridge_process import start_rosbridge  # noqa: PLC0415

        source = Path(os.environ["MAPSPEAK_ROSBRIDGE_SOURCE"])
        with start_rosbridge(source, environment) as url:
            await anyio.sleep(3.0)
            async with open_rosbridge_robot(url) as robot:
                yield robot
