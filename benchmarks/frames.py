"""Frames of a rosbridge: large maps, and mutated frames, while another call is made regularly.

Two servers run on the loopback, one that sends the frames and one behind the other call, so that
only our client is measured. MAPSPEAK_FRAMES and MAPSPEAK_SEED set how many mutated frames, and
which.
"""

import multiprocessing
import os
import random
import resource
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

import anyio
import cbor2
import click
import numpy as np
import orjson
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from benchmarks.figure import Figure
from benchmarks.mutations import Frame, mutate, pieces_of, seed_frames
from mapspeak.links.rosbridge import RobotAddress, RosbridgeClient, open_client
from mapspeak.ros.messages.grids import read_grid

__all__ = ["measure"]

N_FRAMES_VARIABLE, SEED_VARIABLE = "MAPSPEAK_FRAMES", "MAPSPEAK_SEED"
SIDE = 4_000
"""Cells of the large map: 16 million in all."""
PIECE_CHARACTERS = 10_000_000
PAUSE_S, IDLE_S = 0.02, 5.0
WHOLE_EVERY = 20
"""One frame in so many is as it should be: garbage alone costs the connection."""
FRAMES, DONE = "/frames", "/done"
PROCESSES = multiprocessing.get_context("spawn")


def measure() -> Iterator[Figure]:
    """Return the longest wait of another call, and the peak of memory."""
    n_frames = int(os.environ.get(N_FRAMES_VARIABLE, "100000"))
    seed = int(os.environ.get(SEED_VARIABLE, "0"))
    click.echo(f"seed {seed}", err=True)
    plans = {"nothing": (NOTHING, 0, seed)}
    plans |= {f"16 million cells as {kind}": (kind, 0, seed) for kind in MAPS}
    plans[f"{n_frames} mutated frames"] = (MUTATED, n_frames, seed)
    for name, plan in plans.items():
        # In a process of its own: a peak of memory is of the whole life of a process.
        seen = _measure_in_process(*plan)
        yield Figure(name=f"{name}, taken", value=seen["n_taken"], unit="frames")
        yield Figure(name=f"{name}, refused", value=seen["n_refused"], unit="frames")
        yield Figure(name=f"{name}, all", value=seen["all_s"], unit="s")
        yield Figure(name=f"{name}, longest wait", value=seen["longest_ms"], unit="ms")
        yield Figure(name=f"{name}, most own time", value=seen["longest_own_ms"], unit="ms")
        yield Figure(name=f"{name}, peak memory", value=seen["peak_mb"], unit="MB")
        yield Figure(name=f"{name}, connections", value=seen["n_connections"], unit="")


@dataclass(slots=True)
class Waits:
    """How long each of the other calls took."""

    waits_ms: list[float] = field(default_factory=list)
    own_ms: list[float] = field(default_factory=list)
    """Processor time of all our threads meanwhile: what others on this machine do is left out."""

    async def go_on(self, client: RosbridgeClient) -> None:
        while True:
            begun_s, own_s = time.perf_counter(), time.process_time()
            await client.call_service("/echo", {})
            self.waits_ms.append((time.perf_counter() - begun_s) * 1e3)
            self.own_ms.append((time.process_time() - own_s) * 1e3)
            await anyio.sleep(PAUSE_S)


def _measure_in_process(kind: str, n_frames: int, seed: int) -> dict[str, float]:
    results, to_results = PROCESSES.Pipe(duplex=False)
    with _running(_send_frames, kind, n_frames, seed) as url, _running(_echo) as other_url:
        client = PROCESSES.Process(target=_listen_to, args=(to_results, url, other_url, kind))
        client.start()
        to_results.close()
        seen: dict[str, float] = results.recv()
        client.join()
    return seen


@contextmanager
def _running(peer: Callable[..., None], *arguments: object) -> Generator[str]:
    """Run a server in a process of its own, and return its address."""
    ports, to_ports = PROCESSES.Pipe(duplex=False)
    process = PROCESSES.Process(target=peer, args=(to_ports, *arguments), daemon=True)
    process.start()
    yield f"ws://127.0.0.1:{ports.recv()}"
    process.terminate()
    process.join()


def _listen_to(results: Connection, url: str, other_url: str, kind: str) -> None:
    results.send(anyio.run(_listen, url, other_url, kind))


async def _listen(url: str, other_url: str, kind: str) -> dict[str, float]:
    """Subscribe, and call another service until all frames have come."""
    waits, begun_s = Waits(), time.perf_counter()
    async with (
        open_client(RobotAddress(url=url)) as client,
        open_client(RobotAddress(url=other_url)) as other,
        anyio.create_task_group() as tasks,
    ):
        tasks.start_soon(waits.go_on, other)
        done = client.subscribe(DONE)
        taken = client.subscribe(FRAMES)
        await done.wait_for_more_than(0, timeout_s=3_600.0)
        if kind in MAPS and taken.latest is not None:
            # As the keeper of maps does it, in the event loop.
            read_grid(taken.latest)
        await anyio.sleep(IDLE_S if kind == NOTHING else 10 * PAUSE_S)
        tasks.cancel_scope.cancel()
    return {
        "n_taken": taken.n_received,
        "n_refused": client.n_frames_refused,
        "all_s": time.perf_counter() - begun_s,
        "longest_ms": max(waits.waits_ms),
        "longest_own_ms": max(waits.own_ms),
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "n_connections": client.n_connections,
    }


# --- the servers ------------------------------------------------------------------------------


def _echo(ports: Connection) -> None:
    async def answer(client: ServerConnection) -> None:
        with suppress(ConnectionClosed):
            async for text in client:
                asked = orjson.loads(text)
                if asked["op"] == "call_service":
                    told = {"op": "service_response", "id": asked["id"], "values": {}}
                    await client.send(orjson.dumps(told), text=True)

    anyio.run(_serve, answer, ports)


def _send_frames(ports: Connection, kind: str, n_frames: int, seed: int) -> None:
    frames = iter(MAPS[kind]()) if kind in MAPS else _mutated(n_frames, seed)

    async def send(client: ServerConnection) -> None:
        with suppress(ConnectionClosed):
            async for text in client:
                asked = orjson.loads(text)
                if asked["op"] != "subscribe" or asked["topic"] != FRAMES:
                    continue
                # Goes on where the last connection ended.
                for is_text, data in frames:
                    await client.send(data, text=is_text)
                done = {"op": "publish", "topic": DONE, "msg": {}}
                await client.send(orjson.dumps(done), text=True)

    anyio.run(_serve, send, ports)


async def _serve(handle: Callable[[ServerConnection], Any], ports: Connection) -> None:
    async with serve(handle, "127.0.0.1", 0, compression=None) as server:
        ports.send(next(iter(server.sockets)).getsockname()[1])
        await anyio.sleep_forever()


def _mutated(n_frames: int, seed: int) -> Iterator[Frame]:
    chance = random.Random(seed)  # noqa: S311 - no secret
    seeds = seed_frames(FRAMES)
    whole = (True, orjson.dumps({"op": "publish", "topic": FRAMES, "msg": {"data": 1}}))
    for number in range(n_frames):
        frame, other = chance.choice(seeds), chance.choice(seeds)
        yield whole if number % WHOLE_EVERY == 0 else mutate(frame, other, chance)


# --- large maps -------------------------------------------------------------------------------


def _cells() -> np.ndarray[Any, np.dtype[np.int8]]:
    values = np.array([-1, 0, 100], dtype=np.int8)
    return np.random.default_rng(0).choice(values, size=SIDE * SIDE)


def _publication(data: object) -> Mapping[str, object]:
    pose = {"position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    info = {"width": SIDE, "height": SIDE, "resolution": 0.05, "origin": pose}
    header = {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "map"}
    return {"op": "publish", "topic": FRAMES, "msg": {"header": header, "info": info, "data": data}}


def _map_as_text() -> bytes:
    # With a blank after each comma, as Python's json writes it.
    numbers = ", ".join(map(str, _cells().tolist())).encode()
    return orjson.dumps(_publication("@")).replace(b'"@"', b"[" + numbers + b"]")


def _map_as_cbor() -> list[Frame]:
    return [(False, cbor2.dumps(_publication(cbor2.CBORTag(72, _cells().tobytes()))))]


def _map_in_fragments() -> list[Frame]:
    return [(True, piece) for piece in pieces_of(_map_as_text().decode(), PIECE_CHARACTERS)]


NOTHING, MUTATED = "nothing", "mutated"
MAPS: dict[str, Callable[[], list[Frame]]] = {
    "JSON": lambda: [(True, _map_as_text())],
    "CBOR": _map_as_cbor,
    "fragments": _map_in_fragments,
    "a bomb of empty lists": lambda: [(True, b'{"op": [' + b"[]," * 20_000_000 + b"[]]}")],
}
