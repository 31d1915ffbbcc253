"""`mapspeak simulate` and `mapspeak demo`: the simulated robot for other programs, and at work."""

import math
import shutil
import signal
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import anyio
import click

from mapspeak.cli.operating import StopKeys, Tell, stop_keys
from mapspeak.cli.serving.viewing import MARKERS_OPTION, VIEW_OPTION
from mapspeak.cli.shared.options import SEED_OPTION, WORLD_OPTION, usual_modes
from mapspeak.errors import ConfigError

if TYPE_CHECKING:
    from mapspeak.evaluation.runs.showing import TrialBar
    from mapspeak.evaluation.trials import TrialResult, Turn
    from mapspeak.robot import Robot
    from mapspeak.safety import Hold


DEFAULT_ROSBRIDGE = "127.0.0.1:9090"


@click.command()
@click.option(
    "--rosbridge",
    "address",
    is_flag=False,
    flag_value=DEFAULT_ROSBRIDGE,
    default=DEFAULT_ROSBRIDGE,
    show_default=True,
    metavar="[[HOST:]PORT]",
    help="Address for rosbridge clients.",
)
@click.option("--ros", type=click.Choice(["1", "2"]), default="2", show_default=True)
@WORLD_OPTION
@SEED_OPTION
@click.option(
    "--send-action-goals-in-new-thread",
    "goals_in_new_thread",
    is_flag=True,
    help="As the parameter of that name in rosbridge: a goal does not block its client's socket.",
)
@MARKERS_OPTION
def simulate(
    address: str,
    ros: str,
    world: str,
    seed: int,
    goals_in_new_thread: bool,  # noqa: FBT001 - a flag
    has_markers: bool,  # noqa: FBT001 - a flag
) -> None:
    """Offer the simulated robot to any rosbridge client, as a robot with ROS 1 or ROS 2."""
    from mapspeak.links.simulated import Clock, open_simulated_robot  # noqa: PLC0415
    from mapspeak.ros.messages.fields import Dialect  # noqa: PLC0415
    from mapspeak.rosbridge_server import open_rosbridge_server  # noqa: PLC0415
    from mapspeak.simulator import Simulation, load_world  # noqa: PLC0415

    host, port = _parse_address(address)

    async def run() -> None:
        simulation = Simulation(load_world(world), seed=seed)
        async with (
            open_simulated_robot(simulation, clock=Clock.REAL, has_detector=False) as robot,
            open_rosbridge_server(
                robot,
                dialect=Dialect(f"ros{ros}"),
                host=host,
                port=port,
                goals_in_new_thread=goals_in_new_thread,
                skilled=robot,
            ) as server,
            anyio.create_task_group() as tasks,
        ):
            if has_markers:
                tasks.start_soon(_publish_markers, robot, server.url)
            offered = f"{robot.description.name} in {robot.description.map_name}, ROS{ros}"
            with anyio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
                click.echo(f"mapspeak: {offered}: {server.url}", err=True)
                async for _ in signals:
                    tasks.cancel_scope.cancel()

    anyio.run(run)


async def _publish_markers(robot: "Robot", url: str) -> None:
    """Be a client of the simulated robot's own rosbridge that remembers nothing."""
    from mapspeak.links.rosbridge import RobotAddress, open_client  # noqa: PLC0415
    from mapspeak.memory import SemanticMapStore  # noqa: PLC0415
    from mapspeak.server.view.marking import MarkerPublisher  # noqa: PLC0415
    from mapspeak.session import Session  # noqa: PLC0415

    with TemporaryDirectory(prefix="mapspeak-") as scratch:
        session = Session(robot, SemanticMapStore(Path(scratch) / MEMORY), lease_s=math.inf)
        async with open_client(RobotAddress(url=url)) as connection:
            await MarkerPublisher(session, connection).run()


def _parse_address(address: str) -> tuple[str, int]:
    """Read PORT or HOST:PORT; without a host this machine alone reaches it."""
    host, _, port = address.rpartition(":")
    if not (port.isdecimal() and port.isascii() and int(port) < 65536):
        raise ConfigError(
            f"{address!r} is no address to serve on.", hint="Give PORT or HOST:PORT, as 9090."
        )
    return host.strip("[]") or "127.0.0.1", int(port)


MEMORY = "semantic_map.yaml"
"""What the robot remembers, of the last trial also beside the report, where it is soon found."""


@click.command()
@WORLD_OPTION
@SEED_OPTION
@click.option(
    "--out",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for the results (default: out/demo-WORLD-SEED).",
)
@VIEW_OPTION
@click.option("--quiet", "is_quiet", is_flag=True, help="Print the result only.")
def demo(
    world: str,
    seed: int,
    folder: Path | None,
    view: str | None,
    is_quiet: bool,  # noqa: FBT001 - a flag
) -> None:
    """Let a script do the paper's three tasks on the simulated robot, over MCP, and score them.

    It is what `mapspeak eval --worlds WORLD --trials 1` does, for you to watch. In a terminal,
    space or s stops the robot and r lets it go on.
    """
    from rich.console import Console  # noqa: PLC0415 - heavy; help must be quick

    from mapspeak.evaluation.report.page import write_page  # noqa: PLC0415
    from mapspeak.evaluation.runs.inspectlog import write_log  # noqa: PLC0415
    from mapspeak.evaluation.runs.showing import TrialBar, say_result  # noqa: PLC0415

    folder = folder or Path("out") / f"demo-{Path(world).stem}-{seed}"
    console = Console(soft_wrap=True, highlight=False)
    with TrialBar(is_quiet=is_quiet) as bar, usual_modes():
        results = _run_trials(world, seed, folder, bar, view)
        page = write_page(folder, results)
        write_log(folder, results, {})
    for result in results:
        console.print(say_result(result))
    click.echo(f"Everything can be replayed in {page}")
    sys.exit(0 if all(result.score.is_success for result in results) else 1)


def _run_trials(
    world: str, seed: int, folder: Path, bar: "TrialBar", view: str | None
) -> "list[TrialResult]":
    """Run the trials one after the other in this process, each with a server over stdio."""
    from mapspeak.evaluation.agent import ServerAccess  # noqa: PLC0415
    from mapspeak.evaluation.runs.attempt import attempt  # noqa: PLC0415
    from mapspeak.evaluation.runs.plan import RunOptions, plan_run  # noqa: PLC0415
    from mapspeak.evaluation.runs.runner import make_jobs, writing_to  # noqa: PLC0415
    from mapspeak.evaluation.trials import clear_trial  # noqa: PLC0415
    from mapspeak.safety import Hold  # noqa: PLC0415

    options = RunOptions(worlds=(world,), n_trials=1, seed=seed, folder=folder)
    worlds = options.load_worlds()
    plan = plan_run(options, worlds)
    hold = Hold(folder / "control")
    results = []
    with writing_to(folder), _keys_of(hold, bar.tell) as keys:
        for job in make_jobs(options, plan, worlds):
            bar.begin(job.trial.task)
            trials_folder = clear_trial(folder, job.trial)
            result = attempt(
                folder,
                job.trial,
                worlds[job.trial.world],
                job.after,
                connection=ServerAccess.STDIO,
                control=hold.folder,
                view=view,
                on_turn=_watch(bar, keys),
            )
            results.append(result)
            memory = trials_folder / MEMORY
            if memory.exists():
                shutil.copyfile(memory, folder / MEMORY)
    return results


def _watch(bar: "TrialBar", keys: StopKeys | None) -> "Callable[[Turn], None]":
    def on_turn(turn: "Turn") -> None:
        bar.note(turn)
        if keys is not None:
            keys.wait_until_released()

    return on_turn


@contextmanager
def _keys_of(hold: "Hold", tell: Tell) -> "Generator[StopKeys | None]":
    """Listen for keys; the demo's own robot is held by nothing that was before or stays after."""
    hold.lift()
    try:
        with stop_keys(hold, tell=tell) as keys:
            yield keys
    finally:
        hold.lift()
