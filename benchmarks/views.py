"""What the pictures of an exploration show, led by a script and by `explore` for the camera.

First by a script: a look at the map, the first frontier, a drive, a look, and so on. Judged on the
true plan: how much wall that no picture has shown yet is in the picture of a stop, beside what the
best heading from there would have shown. A stop where a drive was given up on is counted apart: the
robot never turned to where it was to look.

Then `explore` that covers the walls with the camera, beside `explore` of the map alone: its metres,
and the walls in its pictures, of those in sight of where a robot with 10 cm of room stands.
"""

import re
import statistics
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import anyio
import click
import numpy as np
from mcp.client import Client
from mcp_types import TextContent

from benchmarks.figure import Figure
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration.explorer import Explorer
from mapspeak.driving.exploration.progress import Bounds, ExplorationState
from mapspeak.links.simulated import SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.server.tools.explore import Covered
from mapspeak.server.tools.sightings import look_ahead
from mapspeak.session import Session
from mapspeak.simulator import BODY_RADIUS_M, Simulation, load_world
from mapspeak.spatial.fieldofview import (
    CameraView,
    look_all_around,
    mask_pictured,
    measure_pictured,
    ray_at,
)
from mapspeak.spatial.paths import clearance_m

__all__ = ["main", "measure"]

WORLDS = ("office", "warehouse", "clinic_2", "school_1")
MOST_GOALS = 60
WAIT_S = 25
ROOMY_M = BODY_RADIUS_M + 0.1
ENOUGH_RATIO = 0.7
LEAST_WALL_M = 1.0
"""Where even the best picture would show less, nothing is left to be shown."""
FIRST_FRONTIER = re.compile(r"^## Frontiers.*\n.*\n(F\d+) \|", re.MULTILINE)


@dataclass
class Judge:
    """Knows the plan, and where the pictures were taken in truth."""

    simulation: Simulation
    half_view_rad: float
    views: list[CameraView] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    n_blocked: int = 0

    def note(self, *, has_arrived: bool) -> None:
        """Take in the picture that was just taken."""
        pose, plan = self.simulation.truth.pose, self.simulation.truth.floor.solid
        around = look_all_around(plan, pose.point)
        new_m = around.wall_m_by_heading(self.half_view_rad, but=mask_pictured(plan, self.views))
        self.views.append(CameraView(pose, self.half_view_rad))
        if not has_arrived:
            self.n_blocked += 1
        elif new_m.max() >= LEAST_WALL_M:
            self.ratios.append(float(new_m[ray_at(pose.yaw_rad)] / new_m.max()))

    @property
    def pictured_ratio(self) -> float:
        """The share of the walls in sight of where a robot can stand that the pictures show."""
        floor = self.simulation.truth.floor
        points = np.array([[at.x, at.y] for at in floor.viewpoints])
        is_roomy = clearance_m(floor.solid)[floor.solid.cells_at(points)] >= ROOMY_M
        return measure_pictured(
            floor.solid, mask_pictured(floor.solid, self.views), points[is_roomy]
        )


async def explore(world: str, folder: Path, seed: int) -> Judge:
    """Explore a world until no frontier is left."""
    simulation = Simulation(load_world(world), seed=seed)
    robot = SoloRobot(simulation, has_detector=True)
    memory = SemanticMapStore(folder / "memory.yaml", map_id=robot.description.map_name)
    session = Session(robot, memory, lease_s=60.0, find_model=lambda: None)
    fov_rad = (await robot.fetch_picture()).horizontal_fov_rad or 0.0
    judge = Judge(simulation, fov_rad / 2)
    async with Client(build_server(session, toolsets=("look", "places", "drive"))) as client:

        async def call(tool: str, **arguments: object) -> str:
            result = await client.call_tool(tool, arguments)
            return "\n".join(each.text for each in result.content if isinstance(each, TextContent))

        for _ in range(MOST_GOALS):
            frontier = FIRST_FRONTIER.search(await call("look_at_map"))
            if frontier is None:
                break
            told = await call("navigate_to", place=frontier[1], wait_s=WAIT_S)
            while '"driving"' in told:
                told = await call("wait_for_goal", wait_s=WAIT_S)
            await call("look_through_camera")
            judge.note(has_arrived='"arrived"' in told)
    return judge


async def cover(world: str, folder: Path, seed: int, covered: Covered) -> Judge:
    """Let the robot explore a world by itself."""
    simulation = Simulation(load_world(world), seed=seed)
    robot = SoloRobot(simulation, has_detector=True)
    memory = SemanticMapStore(folder / "memory.yaml", map_id=robot.description.map_name)
    session = Session(robot, memory, lease_s=60.0, find_model=lambda: None)
    fov_rad = (await robot.fetch_picture()).horizontal_fov_rad or 0.0
    judge = Judge(simulation, fov_rad / 2)

    async def look() -> None:
        await look_ahead(session)
        judge.views.append(CameraView(simulation.truth.pose, judge.half_view_rad))

    explorer = Explorer(session, look=look)
    bounds, state = Bounds(for_camera=covered is Covered.CAMERA), ExplorationState.DRIVING
    while not state.is_end:
        progress = await explorer.advance(bounds, wait_s=WAIT_S, on_trip=_tell_nobody)
        state = progress.state
    return judge


async def _tell_nobody(_report: DriveReport) -> None:
    """Take what is told at the end."""


def measure_covering(worlds: tuple[str, ...], seed: int) -> Iterator[Figure]:
    """Explore some buildings for the map and for the camera."""
    for world in worlds:
        with tempfile.TemporaryDirectory() as folder:
            plain = anyio.run(cover, world, Path(folder, "map"), seed, Covered.MAP)
            judge = anyio.run(cover, world, Path(folder, "camera"), seed, Covered.CAMERA)
        ratio = judge.simulation.truth.driven_m / plain.simulation.truth.driven_m
        name = f"{world}: explore for the camera"
        yield Figure(name=f"{name}, metres of plain explore", value=ratio, unit="")
        yield Figure(name=f"{name}, walls pictured", value=judge.pictured_ratio, unit="")
        yield Figure(name=f"{name}, pictures", value=len(judge.views), unit="")


def measure(worlds: tuple[str, ...] = WORLDS, seed: int = 7) -> Iterator[Figure]:
    """Explore some buildings, and judge every picture."""
    yield from measure_covering(worlds, seed)
    for world in worlds:
        with tempfile.TemporaryDirectory() as folder:
            judge = anyio.run(explore, world, Path(folder), seed)
        n_good = sum(each >= ENOUGH_RATIO for each in judge.ratios)
        stops = f"stops of {len(judge.ratios)} with {ENOUGH_RATIO:.0%} of the best view"
        yield Figure(name=f"{world}: {stops}", value=n_good / len(judge.ratios), unit="")
        median = statistics.median(judge.ratios)
        yield Figure(name=f"{world}: shown of the best view, median", value=median, unit="")
        yield Figure(name=f"{world}: drives that were blocked", value=judge.n_blocked, unit="")
        yield Figure(name=f"{world}: walls pictured", value=judge.pictured_ratio, unit="")


@click.command()
@click.argument("worlds", nargs=-1)
@click.option("--seed", default=7, show_default=True)
def main(worlds: tuple[str, ...], seed: int) -> None:
    """Judge the pictures of some worlds."""
    for figure in measure(worlds or WORLDS, seed):
        click.echo(f"{figure.name}: {figure.value:.3f}")


if __name__ == "__main__":
    main()
