"""`mapspeak simulate`: the simulated robot for other programs."""

import anyio
import click

from mapspeak.cli.options import SEED_OPTION, WORLD_OPTION

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
    help="Where rosbridge clients find it.",
)
@click.option("--ros", type=click.Choice(["1", "2"]), default="2", show_default=True)
@WORLD_OPTION
@SEED_OPTION
@click.option(
    "--send-action-goals-in-new-thread",
    "goals_in_new_thread",
    is_flag=True,
    help="A goal does not hold up its client's socket, as in rosbridge told so.",
)
def simulate(address: str, ros: str, world: str, seed: int, goals_in_new_thread: bool) -> None:  # noqa: FBT001 - a flag
    """Offer the simulated robot to any rosbridge client, as a robot with ROS 1 or ROS 2."""
    from mapspeak.links.simulated import Clock, open_simulated_robot  # noqa: PLC0415
    from mapspeak.ros.messages.fields import Dialect  # noqa: PLC0415
    from mapspeak.rosbridge_server import run_rosbridge_server  # noqa: PLC0415
    from mapspeak.simulator import Simulation, load_world  # noqa: PLC0415

    async def run() -> None:
        simulation = Simulation(load_world(world), seed=seed)
        async with open_simulated_robot(simulation, clock=Clock.REAL, has_detector=False) as robot:
            await run_rosbridge_server(
                robot,
                dialect=Dialect(f"ros{ros}"),
                address=address,
                goals_in_new_thread=goals_in_new_thread,
                say=lambda text: click.echo(text, err=True),
            )

    anyio.run(run)
