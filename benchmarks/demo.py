"""The demo in every shipped world with several seeds: the paper's tasks, scored from the truth."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.figure import Figure
from mapspeak.simulator import world_names

__all__ = ["measure"]

SEEDS = range(5)
COLUMNS = {
    "coverage_recall": "ratio",
    "coverage_paper_ratio": "ratio",
    "coverage_precision": "ratio",
    "path_length_m": "m",
    "n_goals": "drives",
    "n_tool_calls": "calls",
    "collisions": "bumps",
    "slam_rmse_m": "m",
    "sim_time_s": "s",
    "wall_time_s": "s",
}


def measure() -> Iterator[Figure]:
    """Gives the figures of each run, and 1 or 0 for each task."""
    for world in world_names():
        for seed in SEEDS:
            report = run_demo(world, seed)
            run = f"{world} seed {seed}"
            yield Figure(name=f"{run}: Task 2 right", value=report["task2"]["success"], unit="")
            yield Figure(name=f"{run}: Task 3 right", value=report["task3"]["success"], unit="")
            for column, unit in COLUMNS.items():
                yield Figure(name=f"{run}: {column}", value=report[column], unit=unit)


def run_demo(world: str, seed: int) -> dict[str, Any]:
    """Runs the demo as a user does, and gives its report."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "mapspeak", "demo", "--quiet", "--out", folder]
        subprocess.run(  # noqa: S603 - our own program
            [*command, "--world", world, "--seed", str(seed)], check=False, capture_output=True
        )
        report: dict[str, Any] = json.loads((Path(folder) / "report.json").read_text())
        return report
