"""Processes that write a semantic map at once, or die while they do; a program of its own.

    python crashing_writers.py at_once FILE
    python crashing_writers.py at_every_step FILE
    python crashing_writers.py at_any_moment FILE

It forks, which a test runner with threads must not. It prints what was acknowledged, as JSON.
"""

import json
import os
import random
import signal
import sys
from collections.abc import Callable
from itertools import count
from pathlib import Path

from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore, Waypoint

N_EACH = 50
N_KILLS = 12


def write(path: Path, name: str) -> None:
    """Writes one waypoint, from a store that knows nothing yet."""
    store = SemanticMapStore(path, map_id="b1", lock_timeout_s=30.0)
    store.write(Waypoint(name=name, pose=Pose(1.0, 2.0, 0.0), description=f"This is {name}."))


def start(work: Callable[[], None]) -> int:
    """Starts a process that does some work, and gives its id."""
    process_id = os.fork()
    if process_id == 0:
        work()
        os._exit(0)
    return process_id


def has_finished(process_id: int) -> bool:
    """Waits for a process; True when it was not killed."""
    status = os.waitpid(process_id, 0)[1]
    return status == 0


def at_once(path: Path) -> list[str]:
    """Two processes write as fast as they can."""
    names = [[f"{side} {i}" for i in range(N_EACH)] for side in ("left", "right")]

    def work(mine: list[str]) -> None:
        for name in mine:
            write(path, name)

    process_ids = [start(lambda mine=mine: work(mine)) for mine in names]  # type: ignore[misc]
    finished = [has_finished(process_id) for process_id in process_ids]
    assert finished == [True, True]
    return [name for mine in names for name in mine]


def at_every_step(path: Path) -> list[str]:
    """One process after the other dies, each a step further into its write."""
    acknowledged = []
    for n_steps in count(1):
        name = f"step {n_steps}"
        process_id = start(lambda name=name, n=n_steps: write_and_die(path, name, n))  # type: ignore[misc]
        if has_finished(process_id):
            acknowledged.append(name)
            break
        write(path, f"after {n_steps}")
        acknowledged.append(f"after {n_steps}")
    return acknowledged


def write_and_die(path: Path, name: str, n_steps: int) -> None:
    """Writes, and dies at the n-th thing that Python asks of the system with this file."""
    steps = count(1)

    def die(event: str, _arguments: tuple[object, ...]) -> None:
        if event.startswith(("open", "os.", "fcntl.")) and next(steps) == n_steps:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(die)
    write(path, name)


def at_any_moment(path: Path) -> list[str]:
    """Processes that write all the time are killed from outside."""
    chance = random.Random(7)  # noqa: S311 - no secret
    acknowledged: list[str] = []
    for life in range(N_KILLS):
        reading, writing = os.pipe()
        process_id = start(lambda life=life, end=writing: write_forever(path, life, end))  # type: ignore[misc]
        os.close(writing)
        with os.fdopen(reading) as lines:
            acknowledged += [lines.readline().strip() for _ in range(chance.randrange(1, 4))]
            for _ in range(chance.randrange(100_000)):
                pass
            os.kill(process_id, signal.SIGKILL)
            acknowledged += [line.strip() for line in lines if line.endswith("\n")]
        has_finished(process_id)
    return acknowledged


def write_forever(path: Path, life: int, end: int) -> None:
    """Writes waypoint after waypoint, and tells of each that was acknowledged."""
    for i in count():
        write(path, f"life {life} {i}")
        os.write(end, f"life {life} {i}\n".encode())


if __name__ == "__main__":
    scenario, file = sys.argv[1:]
    print(json.dumps(globals()[scenario](Path(file))))  # noqa: T201 - this is a program
