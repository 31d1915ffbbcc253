"""A rosbridge server as a program: an address to read, and a signal to wait for."""

import signal
from collections.abc import Callable

import anyio

from mapspeak.errors import ConfigError
from mapspeak.links.rosbridge.server.serving import open_rosbridge_server
from mapspeak.robot import Robot
from mapspeak.ros.messages import Dialect

DEFAULT_HOST = "127.0.0.1"


async def run_rosbridge_server(
    robot: Robot,
    *,
    dialect: Dialect,
    address: str,
    goals_in_new_thread: bool,
    say: Callable[[str], None],
) -> None:
    """Offers a robot as a rosbridge server until the process is interrupted or told to end.

    Args:
        robot: As for `open_rosbridge_server`, as are the others.
        dialect: Which ROS to be.
        address: PORT or HOST:PORT; without a host this machine alone reaches it.
        goals_in_new_thread: A goal does not hold up its client's further operations.
        say: Told one line when clients may come.

    Raises:
        ConfigError: The address is none, or cannot be listened on.
    """
    host, port = _parse_address(address)
    with anyio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
        async with open_rosbridge_server(
            robot, dialect=dialect, host=host, port=port, goals_in_new_thread=goals_in_new_thread
        ) as server:
            robot_name, map_name = robot.description.name, robot.description.map_name
            say(f"mapspeak: {robot_name} in {map_name}, {dialect.upper()}: {server.url}")
            async for _ in signals:
                return


def _parse_address(address: str) -> tuple[str, int]:
    host, _, port = address.rpartition(":")
    if not (port.isdecimal() and port.isascii() and int(port) < 65536):
        raise ConfigError(
            f"{address!r} is no address to serve on.", hint="Give PORT or HOST:PORT, as 9090."
        )
    return host.strip("[]") or DEFAULT_HOST, int(port)
