"""What an MCP client waits for and pays for: first answer, tool list, one look at the map."""

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.figure import Figure

__all__ = ["measure"]

N_RUNS = 5
HELLO = {
    "protocolVersion": "2025-06-18",
    "capabilities": {},
    "clientInfo": {"name": "benchmark", "version": "1"},
}


def measure() -> Iterator[Figure]:
    """Gives medians over fresh server processes, and sizes of what they send."""
    runs = [_talk() for _ in range(N_RUNS)]
    for name, unit in (
        ("initialize answered after start", "ms"),
        ("first look_at_map", "ms"),
        ("second look_at_map", "ms"),
        ("get_robot_pose", "ms"),
        ("first look_through_camera", "ms"),
        ("second look_through_camera", "ms"),
    ):
        yield Figure(name=name, value=statistics.median(run[name] for run in runs), unit=unit)
    yield Figure(name="tool list", value=runs[0]["tool list"], unit="bytes")
    yield Figure(name="look_at_map text", value=runs[0]["look_at_map text"], unit="characters")


def _talk() -> dict[str, float]:
    with tempfile.TemporaryDirectory() as folder:
        server = _Server(Path(folder))
        figures = {"initialize answered after start": server.ask("initialize", HELLO)[1]}
        server.tell("notifications/initialized")
        listed, _ = server.ask("tools/list", {})
        figures["tool list"] = len(json.dumps(listed, separators=(",", ":")))
        looked, figures["first look_at_map"] = server.call("look_at_map")
        figures["look_at_map text"] = len(looked["content"][0]["text"])
        _, figures["second look_at_map"] = server.call("look_at_map")
        _, figures["get_robot_pose"] = server.call("get_robot_pose")
        _, figures["first look_through_camera"] = server.call("look_through_camera")
        _, figures["second look_through_camera"] = server.call("look_through_camera")
        server.close()
        return figures


class _Server:
    """A server process, spoken to in bare JSON lines so that no client's own time counts."""

    def __init__(self, folder: Path) -> None:
        self._started_s = time.perf_counter()
        memory = ["--semantic-map", str(folder / "semantic_map.yaml")]
        self._process = subprocess.Popen(  # noqa: S603 - our own program
            [sys.executable, "-m", "mapspeak", "serve", "--clock", "virtual", *memory],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._n_asked = 0

    def call(self, tool: str) -> tuple[dict[str, Any], float]:
        return self.ask("tools/call", {"name": tool, "arguments": {}})

    def ask(self, method: str, parameters: dict[str, Any]) -> tuple[dict[str, Any], float]:
        """Gives the answer and the milliseconds until it came; the first since the start."""
        begun_s = time.perf_counter() if self._n_asked else self._started_s
        self._n_asked += 1
        self.tell(method, id=self._n_asked, params=parameters)
        assert self._process.stdout is not None  # noqa: S101 - it is a pipe
        answer = json.loads(self._process.stdout.readline())
        return answer["result"], (time.perf_counter() - begun_s) * 1e3

    def tell(self, method: str, **fields: Any) -> None:  # noqa: ANN401 - JSON
        assert self._process.stdin is not None  # noqa: S101 - it is a pipe
        line = json.dumps({"jsonrpc": "2.0", "method": method, **fields})
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def close(self) -> None:
        assert self._process.stdin is not None  # noqa: S101 - it is a pipe
        self._process.stdin.close()
        self._process.wait(timeout=30)
