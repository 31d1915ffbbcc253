"""The demo in every shipped world with several seeds: the paper's tasks, scored from the truth."""

import math
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.figure import Figure
from mapspeak.evaluation.trials import TrialResult, read_results, trial_folder
from mapspeak.simulator import read_state_log, world_names

__all__ = ["measure"]

SEEDS = range(5)
OF_RESULTS = {
    "driven_m": "m",
    "n_calls": "calls",
    "n_collisions": "bumps",
    "robot_s": "s",
    "wall_s": "s",
}


def measure() -> Iterator[Figure]:
    """Yield the figures of each run, and 1 or 0 for each task."""
    for world in world_names():
        for seed in SEEDS:
            yield from measure_demo(world, seed)


def measure_demo(world: str, seed: int) -> Iterator[Figure]:
    """Run the demo as a user does, and yield its figures."""
    run = f"{world} seed {seed}"
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "mapspeak", "demo", "--quiet", "--out", folder]
        subprocess.run(  # noqa: S603 - our own program
            [*command, "--world", world, "--seed", str(seed)], check=False, capture_output=True
        )
        results = read_results(Path(folder))
        for result in results:
            name = f"{run}: {result.trial.task} done"
            yield Figure(name=name, value=result.score.is_success, unit="")
            for figure, value in result.score.figures.items():
                if figure.startswith("coverage_"):
                    yield Figure(name=f"{run}: {figure}", value=value, unit="ratio")
        for figure, unit in OF_RESULTS.items():
            total = sum(getattr(result, figure) for result in results)
            yield Figure(name=f"{run}: {figure}", value=round(total, 3), unit=unit)
        yield Figure(name=f"{run}: slam_rmse_m", value=slam_rmse_m(Path(folder), results), unit="m")


def slam_rmse_m(folder: Path, results: tuple[TrialResult, ...]) -> float:
    """Return the root mean square error of the robot's own pose while it maps."""
    (explored,) = (result for result in results if result.trial.task == "explore")
    states = read_state_log(trial_folder(folder, explored.trial) / "state.jsonl")
    return round(math.sqrt(sum(state.slam_error_m**2 for state in states) / len(states)), 4)
