"""`mapspeak demo`: the paper's three tasks, carried out and scored."""

import sys
from pathlib import Path

import anyio
import click

from mapspeak.cli.options import SEED_OPTION, WORLD_OPTION

__all__ = ["demo"]


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
    """Carries out the paper's three tasks on the simulated robot, over MCP, and scores them."""
    from mapspeak.evaluation.demo import DemoOptions, run_demo  # noqa: PLC0415
    from mapspeak.evaluation.progress import show_progress  # noqa: PLC0415

    options = DemoOptions(
        world=world, seed=seed, folder=folder or Path("out") / f"demo-{Path(world).stem}-{seed}"
    )
    with show_progress(is_quiet=is_quiet) as on_progress:
        report = anyio.run(run_demo, options, on_progress)
    click.echo(report.summary())
    click.echo(f"Everything is in {options.folder}/report.html")
    sys.exit(0 if report.is_success else 1)
