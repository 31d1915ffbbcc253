"""What the rosbridge link bears: 20,000 spoilt frames, and 1,000 lost connections during a drive.

The robot at the other end is the scripted one of the test suite, on loopback.
"""

import gc
import random
import sys
import time
import tracemalloc
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import anyio
import anyio.lowlevel
import numpy as np
from numpy.typing import NDArray

from benchmarks.figure import Figure
from mapspeak.errors import MapspeakError
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import RosbridgeClient, open_rosbridge_robot
from mapspeak.links.rosbridge.protocol.codec import to_cbor, to_json
from mapspeak.links.rosbridge.protocol.conversation import Conversation, FrameRefused, ServerEvent
from mapspeak.robot import GoalState
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import read_grid, write_grid
from mapspeak.ros.robot import RosRobot
from mapspeak.spatial import OccupancyGrid

__all__ = ["measure"]

N_FRAMES = 20_000
N_RECONNECTIONS = 1_000
N_SETTLING = 100
"""Reconnections before which nothing is compared: caches fill."""
SLOW_S = 1.0
PATIENCE_S = 30.0
GOAL_ID = bytes(range(16))
EXECUTING, SUCCEEDED = 2, 4
SPLINTERS = (
    b"NaN", b"-Infinity", b"[[[[", b'"', b"\\u0000", b"1e999", b'{"op":',
    b"\xc2\x5b\xff", b"\xd8\x1c", b"\x9b" + b"\xff" * 8,
)  # fmt: skip
QUICK = Patience(first_pause_s=0.001, longest_pause_s=0.01)


def measure() -> Iterator[Figure]:
    """Return counts of what went wrong, which should be zero, and what was left behind."""
    yield from _measure_frames()
    tracemalloc.start()
    for name, value in anyio.run(_reconnect).items():
        yield Figure(name=f"{N_RECONNECTIONS} reconnections, {name}", value=value, unit="")
    tracemalloc.stop()


def _measure_frames() -> Iterator[Figure]:
    chance = random.Random(7)  # noqa: S311 - repeatable, not secret
    cells = np.random.default_rng(1).choice(np.array([-1, 0, 100], dtype=np.int8), (60, 60))
    message = write_grid(OccupancyGrid(cells=cells, resolution_m=0.05), dialect=Dialect.ROS2)
    whole = _operations(message)
    texts, binaries = [to_json(each) for each in whole], [to_cbor(each) for each in whole]
    conversation = Conversation(max_bytes=2_000_000)
    n_crashes = n_hangs = n_wrong = n_refused = 0
    for number in range(N_FRAMES):
        is_text = bool(number % 2)
        receive = partial(conversation.receive, is_text=is_text)
        frames = texts if is_text else binaries
        started_s = time.perf_counter()
        try:
            event = receive(_spoil(chance.choice(frames), chance))
            n_refused += isinstance(event, FrameRefused)
            _read(event)
            # A good frame after a bad one must mean what it says.
            read = _read(receive(frames[0]))
            n_wrong += read is None or not np.array_equal(read, cells)
        except Exception as error:  # noqa: BLE001 - counting what must never happen
            n_crashes += 1
            sys.stderr.write(f"{type(error).__name__}: {error}\n")
        n_hangs += time.perf_counter() - started_s > SLOW_S
    for name, value in (
        ("refused with a reason", n_refused),
        ("crashes", n_crashes),
        ("slower than 1 s", n_hangs),
        ("wrong values of the next whole frame", n_wrong),
    ):
        yield Figure(name=f"{N_FRAMES} spoilt frames, {name}", value=value, unit="")


def _operations(message: dict[str, object]) -> list[dict[str, object]]:
    return [
        {"op": "publish", "topic": "/map", "msg": message},
        {"op": "publish", "topic": "/x", "msg": {"a": [1.5, None], "b": "ü\\/\n"}},
        {"op": "service_response", "id": "a", "values": {}, "result": True},
        {"op": "action_result", "id": "g", "status": 4, "result": True, "values": {}},
        {"op": "action_feedback", "id": "g", "values": {"d": 1}},
        {"op": "status", "level": "error", "msg": "x"},
        {"op": "fragment", "id": "1", "num": 0, "total": 2.4, "data": '{"op"'},
    ]


def _spoil(frame: bytes, chance: random.Random) -> bytes:
    spoilt = bytearray(frame)
    for _ in range(chance.choice((1, 1, 2, 5))):
        place = chance.randrange(len(spoilt) + 1)
        match chance.randrange(5):
            case 0 if spoilt:
                spoilt[place - 1] = chance.randrange(256)
            case 1:
                del spoilt[place : place + chance.randrange(1, 20)]
            case 2:
                spoilt[place:place] = chance.randbytes(chance.randrange(1, 6))
            case 3:
                del spoilt[place:]
            case _:
                spoilt[place:place] = chance.choice(SPLINTERS)
    return bytes(spoilt)


def _read(event: object) -> NDArray[np.int8] | None:
    """Read what may be a map; what is none has to be said by an error of ours."""
    if isinstance(event, ServerEvent) and event.key == "/map":
        try:
            return read_grid(event.values).cells
        except MapspeakError:
            return None
    return None


async def _reconnect() -> dict[str, float]:
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from rosbridge_robot import ScriptedRobot  # noqa: PLC0415 - of the test suite
    from rosbridge_script import running  # noqa: PLC0415

    scripted = ScriptedRobot()
    grid = OccupancyGrid(cells=np.zeros((60, 60), dtype=np.int8), resolution_m=0.05)
    scripted.latched["/map"] = scripted.map_message(grid)
    async with (
        running(scripted.server) as server,
        open_rosbridge_robot(server.url, patience=QUICK) as robot,
    ):
        await robot.fetch_map()
        goal_id = await robot.send_goal(Pose(1.0, 1.0))
        await scripted.tell_status(GOAL_ID, EXECUTING)
        before = {}
        n_answered = 0
        for number in range(N_RECONNECTIONS):
            with anyio.fail_after(PATIENCE_S):
                await scripted.until(lambda: _is_restored(scripted))
            n_answered += bool(await robot.connection.call_service("/rosapi/get_time"))
            if number == N_SETTLING:
                before = _what_is_held()
            await server.drop_all()
            server.visitors = [each for each in server.visitors if not each.is_gone]
        with anyio.fail_after(PATIENCE_S):
            await scripted.until(lambda: _is_restored(scripted))
            await scripted.tell_status(GOAL_ID, SUCCEEDED)
            state = await _end_of(robot, goal_id)
        after = _what_is_held()
        client = robot.connection
        return {
            "made": client.n_connections - 1 if isinstance(client, RosbridgeClient) else 0,
            "calls without an answer": N_RECONNECTIONS - n_answered,
            "goals lost": int(state is not GoalState.ARRIVED),
            **{f"{name} more than before": after[name] - before[name] for name in before},
        }


def _is_restored(scripted: object) -> bool:
    """Return True when both sockets are there and the states of goals are subscribed to."""
    visitors = scripted.server.present  # type: ignore[attr-defined]  # of the test suite
    return len(visitors) == 2 and any(
        operation["topic"].endswith("status")
        for visitor in visitors
        for operation in visitor.asked("subscribe")
    )


def _what_is_held() -> dict[str, float]:
    gc.collect()
    return {
        "file descriptors": sum(1 for _ in Path("/proc/self/fd").iterdir()),
        "tasks": len(anyio.get_running_tasks()),
        "kB held": tracemalloc.get_traced_memory()[0] / 1e3,
    }


async def _end_of(robot: RosRobot, goal_id: str) -> GoalState:
    while True:
        try:
            state = (await robot.fetch_goal_status(goal_id)).state
            if state.is_final:
                return state
        except MapspeakError:
            pass
        await anyio.lowlevel.checkpoint()
