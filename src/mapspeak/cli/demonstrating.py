"""`mapspeak demo`: the paper's three tasks, carried out and scored."""

import sys
from collections.abc import Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import anyio
import click

from mapspeak.cli.guarding import usual_modes
from mapspeak.cli.keys import StopKeys, stop_keys
from mapspeak.cli.options import SEED_OPTION, WORLD_OPTION

if TYPE_CHECKING:
    from mapspeak.evaluation.page import Moment
    from mapspeak.safety import Hold


@click.command()
@WORLD_OPTION
@SEED_OPTION
@click.option(
    "--out",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    help="Where the results go; out/demo-WORLD-SEED unless given.",
)
@click.option("--quiet", "is_quiet", is_flag=True, help="Print the result only.")
def demo(world: str, seed: int, folder: Path | None, is_quiet: bool) -> None:  # noqa: FBT001 - a flag
    """Carries out the paper's three tasks on the simulated robot, over MCP, and scores them.

    In a terminal, space or s stops the robot and r lets it go on.
    """
    from mapspeak.evaluation.demo import DemoOptions, run_demo  # noqa: PLC0415
    from mapspeak.evaluation.progress import show_progress  # noqa: PLC0415
    from mapspeak.safety import Hold  # noqa: PLC0415

    options = DemoOptions(
        world=world, seed=seed, folder=folder or Path("out") / f"demo-{Path(world).stem}-{seed}"
    )
    hold = Hold(options.folder / "control")
    with show_progress(is_quiet=is_quiet) as show, _keys_of(hold) as keys:

        def on_progress(moment: "Moment") -> None:
            show(moment)
            if keys is not None:
                keys.wait_until_released()

        with usual_modes():
            report = anyio.run(run_demo, options, on_progress)
    click.echo(report.summary())
    click.echo(f"Everything is in {options.folder}/report.html")
    sys.exit(0 if report.is_success else 1)


@contextmanager
def _keys_of(hold: "Hold") -> "Generator[StopKeys | None]":
    """Listens for keys; the demo's own robot is held by nothing that was before or stays after."""
    hold.lift()
    try:
        with stop_keys(hold, tell=partial(click.echo, err=True)) as keys:
            yield keys
    finally:
        hold.lift()
