"""Serving the live page beside the clients, on this machine alone."""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from functools import partial

import anyio
import uvicorn

from mapspeak.errors import ConfigError
from mapspeak.server.view.feed import ViewFeed
from mapspeak.server.view.keys import PageKeys
from mapspeak.server.view.site import build_site
from mapspeak.server.wire.doors import (
    HostGuard,
    ReadyServer,
    find_security,
    is_loopback,
    listen,
    parse_address,
)


async def serve_view(
    feeds: Mapping[str, ViewFeed],
    address: str,
    *,
    keys: PageKeys,
    on_ready: Callable[[str], None] = lambda _: None,
) -> None:
    """Serve the live page of some robots until cancelled.

    Args:
        feeds: Of each robot, by its name.
        address: HOST:PORT on this machine.
        keys: The keys that may command.
        on_ready: Called with the page's address once it answers.

    Raises:
        ConfigError: The address is no HOST:PORT of this machine, or it is taken.
    """
    host, port = parse_address(address)
    if not is_loopback(host):
        raise ConfigError(
            f"{host} can be reached from other machines; the live page is for this one.",
            hint="Serve it on 127.0.0.1, and reach it from elsewhere through an SSH tunnel: "
            f"ssh -L {port}:127.0.0.1:{port} ROBOT.",
        )
    site = HostGuard(build_site(feeds, keys), find_security(host, port))
    config = uvicorn.Config(site, log_level="warning", timeout_graceful_shutdown=1, lifespan="off")
    with listen(host, port) as listener:
        shown = f"[{host}]" if ":" in host else host
        page = _PageServer(config, partial(on_ready, f"http://{shown}:{port}/"))
        async with anyio.create_task_group() as tasks:
            for feed in feeds.values():
                tasks.start_soon(feed.watch)
            await page.serve(sockets=[listener])
            tasks.cancel_scope.cancel()


class _PageServer(ReadyServer):
    """Leaves signals to the robot's server, which makes the robot stand first."""

    @contextmanager
    def capture_signals(self) -> Generator[None]:
        """Capture none."""
        yield
