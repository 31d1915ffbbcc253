"""A server process as benchmarks speak to it."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

__all__ = ["HELLO", "ServerProcess"]

HELLO = {
    "protocolVersion": "2025-06-18",
    "capabilities": {},
    "clientInfo": {"name": "benchmark", "version": "1"},
}


class ServerProcess:
    """A server with a simulated robot, spoken to in bare JSON lines: no client's time counts.

    Args:
        arguments: Of `mapspeak serve`, besides a clock that stands still between calls.
    """

    def __init__(self, *arguments: str) -> None:
        self._started_s = time.perf_counter()
        self._process = subprocess.Popen(  # noqa: S603 - our own program
            [sys.executable, "-m", "mapspeak", "serve", "--clock", "virtual", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._n_asked = 0

    def begin(self) -> float:
        """Shake hands; return the milliseconds from the process's start to the server's answer."""
        _, took_ms = self.ask("initialize", HELLO)
        self.tell("notifications/initialized")
        return took_ms

    def call(self, tool: str, **arguments: object) -> tuple[dict[str, Any], float]:
        """Call a tool; return the result and the milliseconds that it took."""
        return self.ask("tools/call", {"name": tool, "arguments": arguments})

    def ask(self, method: str, parameters: dict[str, Any]) -> tuple[dict[str, Any], float]:
        """Return the answer and the milliseconds until it came; the first since the start."""
        begun_s = time.perf_counter() if self._n_asked else self._started_s
        self._n_asked += 1
        self.tell(method, id=self._n_asked, params=parameters)
        assert self._process.stdout is not None  # noqa: S101 - it is a pipe
        answer = json.loads(self._process.stdout.readline())
        return answer["result"], (time.perf_counter() - begun_s) * 1e3

    def tell(self, method: str, **fields: object) -> None:
        """Send a message that asks for nothing unless it has an id."""
        assert self._process.stdin is not None  # noqa: S101 - it is a pipe
        line = json.dumps({"jsonrpc": "2.0", "method": method, **fields})
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def cpu_s(self) -> float:
        """Return the seconds of CPU that the process has used, where Linux tells."""
        fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def peak_mb(self) -> float:
        """Return the most memory that the process has held at once, where Linux tells."""
        status = Path(f"/proc/{self._process.pid}/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) / 1e3

    def close(self) -> None:
        """End the server as clients do, and wait for it."""
        assert self._process.stdin is not None  # noqa: S101 - it is a pipe
        with self._process:
            self._process.stdin.close()
            self._process.wait(timeout=300)
