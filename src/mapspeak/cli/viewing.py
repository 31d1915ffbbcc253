"""The live page of served robots, and who is told of it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import click
from anyio.abc import TaskStatus

if TYPE_CHECKING:
    from mapspeak.server.calllog import CallLog
    from mapspeak.server.view.feed import ViewFeed
    from mapspeak.session import Session

DEFAULT_VIEW = "127.0.0.1:8767"
VIEW_OPTION = click.option(
    "--view",
    is_flag=False,
    flag_value=DEFAULT_VIEW,
    metavar="[HOST:PORT]",
    help=f"A live page for a browser on this machine: map, camera, calls, stop, approval; at "
    f"{DEFAULT_VIEW} unless said otherwise.",
)


def watch_calls(
    sessions: "Mapping[str, Session]", call_log: "CallLog | None"
) -> "dict[str, ViewFeed]":
    """Return what the live page is told of each robot and the calls for it."""
    from mapspeak.server.view.calls import CallFeed  # noqa: PLC0415 - only for the live page
    from mapspeak.server.view.feed import ViewFeed  # noqa: PLC0415 - only for the live page

    return {name: ViewFeed(session, CallFeed(call_log)) for name, session in sessions.items()}


async def show_live(
    feeds: "Mapping[str, ViewFeed]", address: str, *, task_status: TaskStatus[None]
) -> None:
    """Serve the live page until cancelled; tell its address and its token on the terminal.

    Raises:
        ConfigError: It cannot be served there.
    """
    from mapspeak.server.view.serving import serve_view  # noqa: PLC0415 - only for the live page

    def tell(url: str) -> None:
        click.echo(f"mapspeak: live page at {url}", err=True)
        task_status.started()

    def tell_token(token: str) -> None:
        click.echo(f"mapspeak: token to command from the live page, once: {token}", err=True)

    await serve_view(feeds, address, tell_token=tell_token, on_ready=tell)
