"""What rosbridge costs: decoding maps beside the bare decoders, and answers during a drive.

The drive is that of the simulated robot behind mapspeak's own rosbridge server, in one process and
over loopback, with pictures taken all the while.
"""

import statistics
import time
from collections.abc import Awaitable, Callable, Iterator

import anyio
import cbor2
import numpy as np
import orjson

from benchmarks.figure import Figure
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.links.rosbridge.protocol.codec import to_cbor, to_json
from mapspeak.links.rosbridge.protocol.conversation import Conversation, ServerEvent
from mapspeak.links.simulated import Clock, open_simulated_robot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import read_grid, write_grid
from mapspeak.ros.robot import RosRobot
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.simulator import Simulation, load_world
from mapspeak.spatial import OccupancyGrid

__all__ = ["measure"]

SIDES = (384, 1000, 4000)
N_RUNS = 5
N_ASKED = 40
N_STOPS = 5
PAUSE_S = 0.05
AHEAD = Pose(3.0, 0.0)


def measure() -> Iterator[Figure]:
    """Return CPU times of decoding, and wall times of answers."""
    for side in SIDES:
        yield from _measure_decoding(side)
    for dialect in Dialect:
        for what, values_ms in anyio.run(_drive, dialect).items():
            for name, value in (("median", statistics.median(values_ms)), ("most", max(values_ms))):
                yield Figure(name=f"{dialect}, {what}, {name}", value=value, unit="ms")


def _measure_decoding(side: int) -> Iterator[Figure]:
    cells = np.random.default_rng(1).choice(np.array([-1, 0, 100], dtype=np.int8), (side, side))
    message = write_grid(OccupancyGrid(cells=cells, resolution_m=0.05), dialect=Dialect.ROS2)
    frame = {"op": "publish", "topic": "/map", "msg": message}
    binary, text = to_cbor(frame), to_json(frame)
    conversation = Conversation()

    def grid_of(event: object) -> OccupancyGrid:
        match event:
            case ServerEvent(values=heard):
                return read_grid(heard)
            case _:
                raise TypeError(event)

    size = f"map of {side} x {side}"
    for name, decode in (
        ("CBOR, bare cbor2", lambda: cbor2.loads(binary, tag_hook=_array_of)),
        ("CBOR to a grid", lambda: grid_of(conversation.receive(binary, is_text=False))),
        ("JSON, bare orjson", lambda: orjson.loads(text)),
        ("JSON to a grid", lambda: grid_of(conversation.receive(text, is_text=True))),
    ):
        yield Figure(name=f"{size}, {name}", value=_best_ms(decode), unit="ms")


def _array_of(value: cbor2.CBORTag, _immutable: object) -> object:
    return np.frombuffer(value.value, dtype=np.int8)


def _best_ms(work: Callable[[], object]) -> float:
    times_s = []
    for _ in range(N_RUNS):
        started_s = time.process_time()
        work()
        times_s.append(time.process_time() - started_s)
    return min(times_s) * 1e3


async def _drive(dialect: Dialect) -> dict[str, list[float]]:
    """Ask for everything while the robot drives and looks."""
    times_ms: dict[str, list[float]] = {}
    simulation = Simulation(load_world("warehouse"), seed=0)
    async with (
        open_simulated_robot(simulation, clock=Clock.REAL, has_detector=False) as simulated,
        open_rosbridge_server(simulated, dialect=dialect) as server,
        open_rosbridge_robot(f"ws://127.0.0.1:{server.port}") as robot,
        anyio.create_task_group() as tasks,
    ):
        await robot.fetch_picture()
        await _note(times_ms, "first map", robot.fetch_map)
        tasks.start_soon(_look_all_the_while, robot)
        goal_id = await robot.send_goal(AHEAD)
        for _ in range(N_ASKED):
            await _note(times_ms, "pose", robot.fetch_pose)
            await _note(times_ms, "map again", robot.fetch_map)
            await _note(times_ms, "state of the drive", lambda: robot.fetch_goal_status(goal_id))
            await _note(times_ms, "topics", lambda: robot.connection.call_service("/rosapi/topics"))
            await anyio.sleep(PAUSE_S)
        for _ in range(N_STOPS):
            await robot.send_goal(AHEAD)
            await anyio.sleep(PAUSE_S)
            await _note(times_ms, "stop", robot.stop)
        tasks.cancel_scope.cancel()
    return times_ms


async def _look_all_the_while(robot: RosRobot) -> None:
    while True:
        await robot.fetch_picture()


async def _note(
    times_ms: dict[str, list[float]], what: str, ask: Callable[[], Awaitable[object]]
) -> None:
    started_s = time.perf_counter()
    await ask()
    times_ms.setdefault(what, []).append((time.perf_counter() - started_s) * 1e3)
