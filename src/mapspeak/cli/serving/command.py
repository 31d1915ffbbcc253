"""`mapspeak serve`: a robot for MCP clients."""

import gc
import logging
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Collection, Coroutine, Generator, Mapping, Sequence
from contextlib import AsyncExitStack, ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import anyio
import click

from mapspeak.cli.serving.starting import RobotStart, open_session, read_starts
from mapspeak.cli.serving.viewing import DRAWING_OPTIONS, VIEW_OPTION, make_page, open_drawing
from mapspeak.cli.shared.options import (
    DEFAULT_WORLD,
    FILE,
    GUARD_OPTIONS,
    ROBOT_HELP,
    ROBOT_OPTIONS,
    SKILL_OPTIONS,
    GuardChoice,
    add_options,
    read_pose,
    read_representation,
    split_names,
)
from mapspeak.cli.shared.robots import RobotChoice
from mapspeak.errors import MapspeakError
from mapspeak.installation import shell_command

if TYPE_CHECKING:
    from mapspeak.cli.serving.viewing import LivePage
    from mapspeak.server.app import MapspeakServer
    from mapspeak.server.fleet import FleetServer
    from mapspeak.server.reports.representations import Representation
    from mapspeak.server.wire.calllog import CallNoting
    from mapspeak.session import Session

TOKEN_VARIABLE = "MAPSPEAK_HTTP_TOKEN"  # noqa: S105 - the variable's name, not a token
DEFAULT_HTTP = "127.0.0.1:8766"
SIMULATION = (
    *("ca_file", "seed", "clock", "has_detector"),
    *("state_log", "final_map", "known_map", "start"),
)
"""Options about how a robot is reached, or simulated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeOptions:
    """The options of `mapspeak serve`, as they were given, but for `robots`.

    Attributes:
        robots: Each robot as it is to be served, by its name.
    """

    robots: Mapping[str, RobotStart]
    http: str | None
    toolsets: tuple[str, ...] | None
    tools: tuple[str, ...] | None
    is_read_only: bool
    lease_s: float
    representation: "Representation | None"
    call_log: Path | None
    view: str | None
    has_markers: bool
    record: Path | None
    foxglove: str | None
    expose: tuple[str, ...]
    skill_files: tuple[Path, ...]


@click.command()
@click.option(
    "--robot",
    "robots",
    multiple=True,
    metavar="[NAME=]ROBOT",
    default=(f"sim:{DEFAULT_WORLD}",),
    show_default=True,
    help=f"{ROBOT_HELP} Several robots need a name each: --robot hall=ws://... --robot yard=...",
)
@click.option(
    "--robot-file",
    "robot_files",
    multiple=True,
    metavar="[NAME=]FILE",
    help="robot.yaml: what discovery does not find.",
)
@add_options(ROBOT_OPTIONS[2:])
@click.option(
    "--clock",
    type=click.Choice(["real", "virtual"]),
    default="real",
    show_default=True,
    help="virtual: simulated time passes only during calls, as fast as possible.",
)
@click.option("--detector", "has_detector", is_flag=True, help="Offer the simulated detector.")
@click.option(
    "--http",
    is_flag=False,
    flag_value=DEFAULT_HTTP,
    metavar="[HOST:PORT]",
    help=f"Streaming HTTP instead of stdio, at /mcp; {DEFAULT_HTTP} by default. GET "
    f"/health answers ok. On other addresses clients must send the bearer token in "
    f"{TOKEN_VARIABLE}.",
)
@click.option(
    "--toolsets",
    callback=split_names,
    default=None,
    help="Groups of tools, comma-separated (default: look,places,drive,paper); others are "
    "explore, routes, memory, ros, skills and missions. A + before any name adds to the default: "
    "+explore,routes.",
)
@click.option(
    "--tools", callback=split_names, default=None, help="Further single tools, comma-separated."
)
@add_options(SKILL_OPTIONS)
@click.option(
    "--read-only", "is_read_only", is_flag=True, help="Offer only tools that change nothing."
)
@click.option(
    "--memory",
    "--semantic-map",
    "semantic_maps",
    multiple=True,
    metavar="[NAME=]FILE|postgresql://...",
    help="The YAML file of remembered places, or a fleet's database. By default a simulated robot "
    "gets a temporary one, and other robots one per map in the data folder.",
)
@click.option(
    "--state-log", type=FILE, help="Write the simulator's truth here, as JSON lines, for scoring."
)
@click.option(
    "--final-map",
    type=FILE,
    help="Write the simulated robot's map here at exit, as map_server's .yaml and .pgm.",
)
@click.option(
    "--map",
    "known_map",
    type=FILE,
    help="A finished map (map_server's .yaml) in which the simulated robot localises itself.",
)
@click.option(
    "--start",
    callback=read_pose,
    metavar="X,Y,YAW_DEG",
    help="Initial pose of the simulated robot, in the frame of the world file.",
)
@click.option(
    "--lease-s",
    default=60.0,
    show_default=True,
    help="Over HTTP: stop a driving robot after this time without a request of its client.",
)
@click.option(
    "--representation",
    callback=read_representation,
    metavar="NAME",
    help="For evaluations: how look_at_map shows the map: picture-table (default), table, "
    "picture-rooms, picture-numbers, paper-picture or raw-grid.",
)
@click.option(
    "--call-log", type=FILE, help="Log every call and answer here, as JSON lines, with pictures."
)
@VIEW_OPTION
@add_options(DRAWING_OPTIONS)
@add_options(GUARD_OPTIONS)
def serve(robots: tuple[str, ...], **given: Any) -> None:  # noqa: ANN401 - click's options
    """Serve a robot, or several, to MCP clients, over stdio or streaming HTTP."""
    starts = read_starts(
        robots,
        RobotChoice(robot="", **{name: given.pop(name) for name in SIMULATION}),
        GuardChoice(audit=given.pop("audit"), control=given.pop("control")),
        robot_files=given.pop("robot_files"),
        semantic_maps=given.pop("semantic_maps"),
        policies=given.pop("policies"),
    )
    anyio.run(_serve, ServeOptions(robots=starts, **given))
    end_at_once()


def end_at_once() -> None:
    """End the process if threads still compute ahead of questions that will not be asked."""
    own = (threading.current_thread(), threading.main_thread())
    if any(not each.daemon for each in threading.enumerate() if each not in own):
        logging.shutdown()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)


async def _serve(options: ServeOptions) -> None:
    async with AsyncExitStack() as links:
        files = links.enter_context(ExitStack())
        scratch = TemporaryDirectory(prefix="mapspeak-", ignore_cleanup_errors=True)
        with _loading():
            from mapspeak.server.transport import serve_http, serve_stdio  # noqa: PLC0415

            served = await _open_all(options, links, files, Path(files.enter_context(scratch)))
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(_end_on_signal, served.sessions, files)
            for work in served.work:
                tasks.start_soon(work)
            try:
                await tasks.start(served.page.serve)
                what = ", ".join(start.choice.shown for start in options.robots.values())
                if options.http is None:
                    _tell_typist(what)
                    await serve_stdio(served.server)
                else:
                    token = os.environ.get(TOKEN_VARIABLE) or None
                    tell = partial(_tell_address, what)
                    await serve_http(served.server, options.http, token=token, on_ready=tell)
            finally:
                await _close_all(served.sessions)
                tasks.cancel_scope.cancel()


@contextmanager
def _loading() -> Generator[None]:
    """Keep what is loaded meanwhile out of all garbage collections.

    It stays for good. Collections would go through it again and again while it is loaded, a
    seventh of the time to start, and hold up a stop by a tenth of a second later.
    """
    gc.disable()
    try:
        yield
        gc.freeze()
    finally:
        gc.enable()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Served:
    """The opened robots, and what goes on in the background until they are closed."""

    sessions: "Collection[Session]"
    server: "MapspeakServer | FleetServer"
    page: "LivePage"
    work: Sequence[Callable[[], Coroutine[Any, Any, None]]]


async def _open_all(
    options: ServeOptions, links: AsyncExitStack, files: ExitStack, scratch: Path
) -> _Served:
    """Open every robot, and build its server and what draws it."""
    from mapspeak.server.fleet import FleetServer  # noqa: PLC0415
    from mapspeak.server.view.calls import CallFeed  # noqa: PLC0415
    from mapspeak.server.view.feed import ViewFeed  # noqa: PLC0415
    from mapspeak.server.view.replay import MAPS, MapLog  # noqa: PLC0415
    from mapspeak.server.wire.calllog import CallLog  # noqa: PLC0415

    # A client on stdio cannot vanish unnoticed: its end of the pipe closes.
    lease_s = math.inf if options.http is None else options.lease_s
    opened = {
        name: await open_session(name, start, links, files, scratch, lease_s=lease_s)
        for name, start in options.robots.items()
    }
    sessions = {name: session for name, (session, _) in opened.items()}
    call_log = None if options.call_log is None else CallLog(options.call_log)
    calls = {name: CallFeed(call_log and call_log.of(name)) for name in sessions}
    drawers, notes = open_drawing(
        opened,
        calls,
        files,
        has_markers=options.has_markers,
        record=options.record,
        foxglove=options.foxglove,
    )
    if call_log is not None:
        maps = call_log.pictures / MAPS
        notes = {name: MapLog(sessions[name], maps / name, note) for name, note in notes.items()}
    servers = {
        name: _build_server(session, options, notes[name]) for name, session in sessions.items()
    }
    feeds = {
        name: ViewFeed(session, calls[name], servers[name].book)
        for name, session in sessions.items()
    }
    return _Served(
        sessions=sessions.values(),
        server=next(iter(servers.values())) if list(servers) == [""] else FleetServer(servers),
        page=make_page(feeds, options.view, tells_token=options.http is not None),
        work=(
            *(session.keep_watch for session in sessions.values()),
            *(session.warm_memory for session in sessions.values()),
            *(server.keep_skills for server in servers.values()),
            *drawers,
        ),
    )


def _tell_address(what: str, url: str) -> None:
    click.echo(f"mapspeak: {what} at {url} (Ctrl-C ends it)", err=True)


def _tell_typist(what: str) -> None:
    """Tell a person in a terminal that the command waits for a client program."""
    if sys.stdin.isatty():
        other = shell_command("serve --http")
        click.echo(
            f"mapspeak: {what} for an MCP client on standard input (Ctrl-C ends it); "
            f"`{other}` serves it at an address.",
            err=True,
        )


def _build_server(
    session: "Session", options: ServeOptions, call_log: "CallNoting | None"
) -> "MapspeakServer":
    from mapspeak.server.app import DEFAULT_TOOLSETS, build_server  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.server.reports.representations import Representation  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.server.tools.ros.inquiry import require_ros  # noqa: PLC0415
    from mapspeak.skills.skillsfile import load_skills  # noqa: PLC0415

    sets = options.toolsets or ()
    is_added = any(name.startswith("+") for name in sets)
    named = tuple(name.removeprefix("+") for name in sets)
    toolsets = (*DEFAULT_TOOLSETS, *named) if is_added or not named else named
    tools = options.tools or ()
    require_ros(session, toolsets=(*toolsets, "ros" if options.expose else ""), tools=tools)
    return build_server(
        session,
        toolsets=toolsets,
        tools=tools,
        is_read_only=options.is_read_only,
        representation=options.representation or Representation.PICTURE_TABLE,
        call_log=call_log,
        expose=options.expose,
        skills=[each for path in options.skill_files for each in load_skills(path)],
    )


async def _end_on_signal(sessions: "Collection[Session]", files: ExitStack) -> None:
    with anyio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
        async for number in signals:
            await _close_all(sessions)
            try:
                files.close()
            except MapspeakError as error:
                click.echo(f"mapspeak: {error}", err=True)
            # A thread may wait for standard input for ever; there is nothing left to wait for.
            os._exit(128 + number)


async def _close_all(sessions: "Collection[Session]") -> None:
    """Leave every robot standing, all at once."""
    with anyio.CancelScope(shield=True):
        async with anyio.create_task_group() as tasks:
            for session in sessions:
                tasks.start_soon(session.close)
