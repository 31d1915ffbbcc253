"""What an MCP client waits for and pays for: first answer, tool list, one look at the map."""

import json
import statistics
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.figure import Figure
from benchmarks.talking import ServerProcess

__all__ = ["measure"]

N_RUNS = 5


def measure() -> Iterator[Figure]:
    """Return medians over fresh server processes, and sizes of what they send."""
    runs = [_talk() for _ in range(N_RUNS)]
    for name, unit in (
        ("initialize answered after start", "ms"),
        ("CPU until then", "ms"),
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
        server = ServerProcess("--semantic-map", str(Path(folder) / "semantic_map.yaml"))
        figures = {"initialize answered after start": server.begin()}
        figures["CPU until then"] = server.cpu_s() * 1e3
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
