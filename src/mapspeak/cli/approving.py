"""`mapspeak approve`: a person's word for what waits for it."""

from pathlib import Path

import click

from mapspeak.cli.guarding import CONTROL_OPTION, control_folder


@click.command()
@click.argument("wish_id", required=False)
@CONTROL_OPTION
def approve(wish_id: str | None, control: Path | None) -> None:
    """Approves a command that waits, once; without an id it lists what waits."""
    from mapspeak.safety import WaitingRoom  # noqa: PLC0415 - heavy; help must be quick

    room = WaitingRoom(control_folder(control) / "approvals")
    if wish_id is not None:
        click.echo(f"Approved: {room.approve(wish_id)}.")
        return
    waiting = room.list_waiting()
    for waiting_id, what in waiting.items():
        click.echo(f"{waiting_id}  {what}")
    if not waiting:
        click.echo("Nothing waits for approval.")
