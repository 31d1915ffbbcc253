"""The simulated robot: how much faster than life, how good its SLAM, how slow its camera."""

import math
import statistics
import time
from collections.abc import Iterator

from benchmarks.figure import Figure
from mapspeak.robot import GoalState
from mapspeak.simulator import Simulation, load_world, world_names
from mapspeak.spatial.frontiers import find_frontiers

__all__ = ["measure"]

N_DRIVES = 8
LONGEST_DRIVE_S = 120.0
N_PICTURES = 8


def measure() -> Iterator[Figure]:
    """Return the figures of each shipped world, driven to frontiers, nothing else counted."""
    for name in world_names():
        simulation = Simulation(load_world(name), seed=0)
        stepped_s, errors_m = _explore(simulation)
        factor = simulation.time_s / stepped_s
        yield Figure(name=f"{name}: times real time, SLAM included", value=factor, unit="")
        rmse_m = math.sqrt(statistics.fmean(error_m**2 for error_m in errors_m))
        yield Figure(name=f"{name}: SLAM error, RMSE", value=rmse_m * 1e3, unit="mm")
        yield Figure(name=f"{name}: driven", value=simulation.truth.driven_m, unit="m")
        simulation.take_picture()
        pictures_ms = [_time_ms(simulation) for _ in range(N_PICTURES)]
        camera_ms = statistics.median(pictures_ms)
        yield Figure(name=f"{name}: camera, 640 x 480", value=camera_ms, unit="ms")


def _explore(simulation: Simulation) -> tuple[float, list[float]]:
    """Drive to the best frontiers; return the seconds spent in stepping and the SLAM errors."""
    spent_s, errors_m = 0.0, []
    for _ in range(N_DRIVES):
        position = simulation.pose_in_map.point
        report = find_frontiers(simulation.map(), position, radius_m=0.3)
        if not report.frontiers:
            break
        goal_id = simulation.start_goal(report.frontiers[0].pose)
        until_s = simulation.time_s + LONGEST_DRIVE_S
        begun_s = time.perf_counter()
        while simulation.time_s < until_s:
            simulation.step()
            errors_m.append(simulation.truth.slam_error_m)
            if simulation.goal_status(goal_id).state is not GoalState.DRIVING:
                break
        spent_s += time.perf_counter() - begun_s
    return spent_s, errors_m


def _time_ms(simulation: Simulation) -> float:
    begun_s = time.perf_counter()
    simulation.take_picture()
    return (time.perf_counter() - begun_s) * 1e3
