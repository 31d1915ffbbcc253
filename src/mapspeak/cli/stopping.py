"""`mapspeak stop` and `mapspeak release`: the operator's word, past any client and any model."""

import sys
import time
from pathlib import Path

import click

from mapspeak.cli.guarding import CONTROL_OPTION, control_folder, wall_clock
from mapspeak.installation import shell_command

# Nothing heavier may be imported here: a stop waits for it.
from mapspeak.safety.hold import Hold

POLL_S = 0.01


@click.command()
@CONTROL_OPTION
@click.option("--reason", default="mapspeak stop", show_default=True, help="For the log.")
@click.option(
    "--wait-s", default=2.0, show_default=True, help="How long to wait for servers to answer."
)
def stop(control: Path | None, reason: str, wait_s: float) -> None:
    """Stops every robot that is served from here, and holds it until `mapspeak release`.

    Ends with 1 when a robot has not answered, or none; the hold is there all the same.
    """
    hold = Hold(control_folder(control))
    stopped, unanswered = hold_robots(hold, reason=" ".join(reason.split()), wait_s=wait_s)
    if stopped:
        click.echo(
            f"Stopped and held: {', '.join(stopped)}. `{shell_command('release')}` lets them go on."
        )
    if stopped and not unanswered:
        return
    said = "no server has answered"
    if unanswered:
        said = f"NOT KNOWN TO STAND: {', '.join(unanswered)}; no answer that it stopped"
    click.echo(
        f"Held, but {said} within {wait_s:g} s. If a robot moves, press its own stop button.",
        err=True,
    )
    sys.exit(1)


@click.command()
@CONTROL_OPTION
def release(control: Path | None) -> None:
    """Lets robots that were held by `mapspeak stop`, or by a client's stop, drive again."""
    was_held = Hold(control_folder(control)).lift()
    click.echo("Released." if was_held else "Nothing was held.")


def hold_robots(
    hold: Hold, *, reason: str, wait_s: float
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Hold every robot of a folder; return those that stopped, and those that did not say so.

    Args:
        hold: Of that folder.
        reason: For the log.
        wait_s: How long to wait for answers, in wall time.

    Raises:
        ConfigError: The hold cannot be written.
    """
    hold.put(reason, at=wall_clock())
    _wait_for_answers(hold, wait_s=wait_s)
    failed = tuple(f"{robot} ({failure})" for robot, failure in hold.failures())
    return hold.answers(), (*failed, *hold.unanswered())


def _wait_for_answers(hold: Hold, *, wait_s: float) -> None:
    """Return when every robot that is served has stopped, or after so long."""
    deadline_s = time.monotonic() + wait_s
    while time.monotonic() < deadline_s:
        if hold.answers() and not hold.unanswered() and not hold.failures():
            return
        time.sleep(POLL_S)
