"""Drawings of served robots beside their tools and the live page: RViz, Foxglove, a file."""

from collections.abc import Callable, Coroutine, Mapping
from contextlib import AsyncExitStack
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mapspeak.cli.shared.options import FILE
from mapspeak.errors import ConfigError
from mapspeak.installation import say_install, shell_command

if TYPE_CHECKING:
    from mapspeak.ros.port import RosConnection
    from mapspeak.server.view.recording import Recorder
    from mapspeak.server.wire.calllog import CallNoting
    from mapspeak.session import Session

DEFAULT_FOXGLOVE = "127.0.0.1:8765"
MARKERS_OPTION = click.option(
    "--markers",
    "has_markers",
    is_flag=True,
    help="Publish rooms, doors, frontiers, places, things, closed areas and the path on the "
    "robot's ROS, for RViz: /mapspeak/markers (visualization_msgs/MarkerArray, latched).",
)
DRAWING_OPTIONS = (
    MARKERS_OPTION,
    click.option(
        "--record",
        type=FILE,
        help="Record map, pose, camera, markers, calls and audit as MCAP (the extra foxglove).",
    ),
    click.option(
        "--foxglove",
        is_flag=False,
        flag_value=DEFAULT_FOXGLOVE,
        metavar="[HOST:PORT]",
        help=f"Show the same live in Foxglove on this machine; at {DEFAULT_FOXGLOVE} by default.",
    ),
)


def open_drawing(
    opened: "Mapping[str, tuple[Session, RosConnection | None]]",
    notes: "Mapping[str, CallNoting | None]",
    links: AsyncExitStack,
    *,
    has_markers: bool,
    record: Path | None,
    foxglove: str | None,
) -> "tuple[list[Callable[[], Coroutine[Any, Any, None]]], dict[str, CallNoting | None]]":
    """Return what draws the robots in the background, and where the calls of each are noted.

    Args:
        opened: The session and the ROS of each robot, by its name.
        notes: Where the calls of each are noted without a drawing.
        links: Closes what is opened.
        has_markers: Publish markers on the robot's ROS.
        record: A file (MCAP) to record to.
        foxglove: An address of this machine at which Foxglove is served.

    Raises:
        ConfigError: A robot has no ROS, or what is chosen cannot be opened.
    """
    drawers: list[Callable[[], Coroutine[Any, Any, None]]] = []
    if has_markers:
        from mapspeak.server.view.marking import MarkerPublisher  # noqa: PLC0415 - heavy

        for name, (session, ros) in opened.items():
            if ros is None:
                raise ConfigError(
                    "--markers needs a robot with ROS: there is nothing to publish on.",
                    hint=f"`{shell_command('simulate --rosbridge --markers')}` is one; --foxglove "
                    "and --record show the simulated robot without ROS.",
                )
            drawers.append(MarkerPublisher(session, ros, name=name).run)
    recorders = _open_recorders(record, foxglove, links)
    if not recorders:
        return drawers, dict(notes)
    from mapspeak.server.view.calls import CallFeed  # noqa: PLC0415 - heavy
    from mapspeak.server.view.recording import SessionRecord  # noqa: PLC0415 - optional

    calls = {name: CallFeed(notes[name]) for name in opened}
    for name, (session, _) in opened.items():
        drawers.append(SessionRecord(session, recorders, calls[name], name=name).run)
    return drawers, {**calls}


def _open_recorders(
    record: Path | None, foxglove: str | None, links: AsyncExitStack
) -> "list[Recorder]":
    if record is None and foxglove is None:
        return []
    if find_spec("foxglove") is None:
        raise ConfigError(
            "--record and --foxglove need a package that is not installed.",
            hint=f"Install it: {say_install('foxglove')}",
        )
    from mapspeak.server.view.recording import record_to, serve_foxglove  # noqa: PLC0415 - optional
    from mapspeak.server.wire.access import is_loopback, parse_address  # noqa: PLC0415 - heavy

    recorders = []
    if record is not None:
        recorders.append(links.enter_context(record_to(record)))
    if foxglove is not None:
        host, port = parse_address(foxglove)
        if not is_loopback(host):
            raise ConfigError(
                f"{host} can be reached from other machines, and Foxglove asks for no password.",
                hint="Serve it on 127.0.0.1, and reach it through an SSH tunnel.",
            )
        recorders.append(links.enter_context(serve_foxglove(host, port)))
        click.echo(f"mapspeak: for Foxglove at ws://{foxglove}", err=True)
    return recorders
