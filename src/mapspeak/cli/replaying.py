"""`mapspeak replay`: an audit log as people read it."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mapspeak.cli.options import FILE

if TYPE_CHECKING:
    from mapspeak.safety import AuditLine


@click.command()
@click.argument("file", type=FILE)
@click.option("--refused", "only_refused", is_flag=True, help="Only what was refused.")
def replay(file: Path, only_refused: bool) -> None:  # noqa: FBT001 - a flag
    """Shows an audit log: who wanted what, what became of it, and why."""
    from mapspeak.safety import read_audit  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.semantic.waypoint import clean_line  # noqa: PLC0415

    n_shown = n_refused = 0
    run = ""
    for line in read_audit(file):
        n_refused += line.verdict == "refused"
        if only_refused and line.verdict != "refused":
            continue
        if line.run != run:
            run = line.run
            click.echo(clean_line(f"--- server {run} {line.robot}"))
        click.echo(clean_line(_say(line)))
        n_shown += 1
    click.echo(f"{n_shown} lines shown; {n_refused} commands were refused.")


def _say(line: "AuditLine") -> str:
    robot_s = "-" if line.robot_s is None else f"{line.robot_s:.1f} s"
    who = " by ".join(filter(None, (line.tool, line.client))) or "mapspeak"
    what = f" {line.what}" if line.what and line.event == "decision" else ""
    verdict = line.verdict or line.event
    said = f": {line.said}" if line.said else ""
    return f"{line.wall_time[:23]}  {robot_s:>9}  #{line.number} {who}:{what} -> {verdict}{said}"
