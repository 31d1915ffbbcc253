"""How long a user waits before mapspeak answers, in a fresh interpreter each time."""

import statistics
import subprocess
import sys
import time
from collections.abc import Iterator

from benchmarks.figure import Figure

__all__ = ["measure"]

N_RUNS = 5

PROGRAMS = {
    "Python alone": "pass",
    "the command line": "import mapspeak.cli",
    "the server": "import mapspeak.server",
}


def measure() -> Iterator[Figure]:
    """Return the median time to start each program and end it again."""
    for name, program in PROGRAMS.items():
        _run(program)  # once for the file cache
        times_ms = [_run(program) for _ in range(N_RUNS)]
        yield Figure(name=name, value=statistics.median(times_ms), unit="ms")


def _run(program: str) -> float:
    started_s = time.perf_counter()
    subprocess.run([sys.executable, "-c", program], check=True)  # noqa: S603 - our own programs
    return (time.perf_counter() - started_s) * 1e3
