"""What mapspeak computes before it answers, in a fresh interpreter each time."""

import resource
import statistics
import subprocess
import sys
from collections.abc import Iterator

from benchmarks.figure import Figure

__all__ = ["measure"]

N_RUNS = 5

PROGRAMS = {
    "Python alone": "pass",
    "the command line": "import mapspeak.cli",
    "the MCP SDK": "import mcp.server.mcpserver",
    "a server until its client hangs up": "import mapspeak.cli; mapspeak.cli.cli(['serve'])",
}


def measure() -> Iterator[Figure]:
    """Return the median CPU time to start each program and end it again."""
    for name, program in PROGRAMS.items():
        _run(program)  # once for the file cache
        times_ms = [_run(program) for _ in range(N_RUNS)]
        yield Figure(name=name, value=statistics.median(times_ms), unit="ms")


def _run(program: str) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(  # noqa: S603 - our own programs
        [sys.executable, "-c", program], stdin=subprocess.DEVNULL, check=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime) * 1e3
