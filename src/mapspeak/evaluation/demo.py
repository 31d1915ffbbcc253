"""The demo: the paper's three tasks over MCP, by a script, scored from the simulator's truth."""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mcp.client import Client
from mcp.client.stdio import StdioServerParameters
from mcp.shared.exceptions import MCPError

from mapspeak.errors import LinkError
from mapspeak.evaluation.client import Ledger, ToolClient
from mapspeak.evaluation.page import Moment
from mapspeak.evaluation.policy import PolicyResult, ScriptedPolicy
from mapspeak.evaluation.recorder import Recorder, prepare_folder
from mapspeak.evaluation.results import DemoReport, write_results
from mapspeak.evaluation.scoring import Scorer
from mapspeak.simulator import load_world

__all__ = ["DemoOptions", "run_demo"]

ANSWER_WITHIN_S = 120.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DemoOptions:
    """What the demo was asked for.

    Attributes:
        world: A shipped world's name, or a world file.
        seed: Of the simulated robot's noise.
        folder: Where the results go.
    """

    world: str
    seed: int
    folder: Path


async def run_demo(options: DemoOptions, on_progress: Callable[[Moment], None]) -> DemoReport:
    """Runs the three tasks and writes everything; what was gathered is written in any case."""
    begun_s = time.perf_counter()
    world = load_world(options.world)
    folder = prepare_folder(options.folder)
    state_log = folder / "state.jsonl"
    for leftover in (state_log, folder / "semantic_map.yaml"):
        leftover.unlink(missing_ok=True)
    recorder = Recorder(folder, state_log, Scorer(world), on_progress)
    ledger = Ledger()
    result: PolicyResult | None = None
    try:
        async with Client(_server(options), read_timeout_seconds=ANSWER_WITHIN_S) as client:
            policy = ScriptedPolicy(ToolClient(client, ledger), recorder.take)
            result = await policy.run()
    except* MCPError as group:
        raise LinkError(
            "The server ended before the demo did.", hint="Its last words stand above."
        ) from group
    finally:
        report = DemoReport.of(
            options.world,
            options.seed,
            recorder=recorder,
            calls=ledger.calls,
            result=result,
            wall_time_s=time.perf_counter() - begun_s,
        )
        write_results(report, recorder, ledger.calls)
    return report


def _server(options: DemoOptions) -> StdioServerParameters:
    return StdioServerParameters(
        command=sys.executable,
        args=[
            "-m",
            "mapspeak",
            "serve",
            "--robot",
            f"sim:{options.world}",
            "--seed",
            str(options.seed),
            "--clock",
            "virtual",
            "--detector",
            "--tools",
            "explore",
            "--memory",
            str(options.folder / "semantic_map.yaml"),
            "--state-log",
            str(options.folder / "state.jsonl"),
            "--audit",
            str(options.folder / "audit.jsonl"),
            "--control",
            str(options.folder / "control"),
        ],
    )
