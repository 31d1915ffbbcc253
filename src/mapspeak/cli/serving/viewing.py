"""`mapspeak view`, and what shows served robots: the live page, RViz, Foxglove, a file."""

from collections.abc import Callable, Coroutine, Mapping
from contextlib import ExitStack
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
import getpass
import socket
import sys
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import anyio
from anyio.abc import TaskStatus

from mapspeak.cli.shared.options import CONTROL_OPTION, control_folder, usual_modes
from mapspeak.errors import LinkError, MapspeakError

if TYPE_CHECKING:
    from mapspeak.server.view.feed import ViewFeed
    from mapspeak.server.view.keys import PageKeys, ViewDesk, ViewRequest

DEFAULT_VIEW = "127.0.0.1:8767"
VIEW_OPTION = click.option(
    "--view",
    is_flag=False,
    flag_value=DEFAULT_VIEW,
    metavar="[HOST:PORT]",
    help=f"A live page for a browser on this machine: map, camera, calls, stop, approval; at "
    f"{DEFAULT_VIEW} unless said otherwise. `mapspeak view` opens one for any running server.",
)
LOOK_S = 0.3
"""Wall time between two checks for requests of the page."""
WAIT_S = 5.0
"""Wall time until a page that could not be served is tried again."""
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


@dataclass(frozen=True, slots=True, kw_only=True)
class LivePage:
    """The live page of a server: served from the start, or on the first request.

    Attributes:
        feeds: The feeds it shows, by the robot's name.
        address: Where it is; None for the usual place once it is asked for.
        desk: Where people ask for it.
        keys: The people who may command from it.
    """

    feeds: "Mapping[str, ViewFeed]"
    address: str | None
    desk: "ViewDesk"
    keys: "PageKeys"
    _urls: list[str] = field(default_factory=list)

    async def serve(self, *, task_status: TaskStatus[None]) -> None:
        """Serve it until cancelled.

        Raises:
            ConfigError: It cannot be served where it was wanted.
        """
        from mapspeak.server.view.site import serve_view  # noqa: PLC0415 - only for the page

        is_wanted = anyio.Event()
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._answer, is_wanted)
            if self.address is None:
                task_status.started()
                await is_wanted.wait()

            def tell(url: str) -> None:
                self._urls.append(url)
                if self.address is not None:
                    click.echo(f"mapspeak: live page at {url}", err=True)
                    task_status.started()

            while self.address is None:
                # A request for the page must never end the server of a robot.
                try:
                    where = _find_free(DEFAULT_VIEW)
                    await serve_view(self.feeds, where, keys=self.keys, on_ready=tell)
                except ConfigError as error:
                    click.echo(f"mapspeak: no live page: {error}", err=True)
                    await anyio.sleep(WAIT_S)
            await serve_view(self.feeds, self.address, keys=self.keys, on_ready=tell)

    async def _answer(self, is_wanted: anyio.Event) -> None:
        """Tell those who ask where the page is, once it is there."""
        while True:
            for request in self.desk.find_requests():
                is_wanted.set()
                if self._urls:
                    robots = ", ".join(map(_name_of, self.feeds.values()))
                    self.desk.answer(request, self.keys, robots=robots, url=self._urls[-1])
            await anyio.sleep(LOOK_S)


def _name_of(feed: "ViewFeed") -> str:
    try:
        return feed.session.robot.description.name
    except LinkError:
        return "a robot that is not there yet"


def _find_free(address: str) -> str:
    """Return an address, or another port there where a program has it."""
    host, _, port = address.rpartition(":")
    for wanted in (int(port), 0):
        try:
            with socket.create_server((host, wanted)) as free:
                return f"{host}:{free.getsockname()[1]}"
        except OSError:
            continue
    return address


def make_page(
    feeds: "Mapping[str, ViewFeed]", address: str | None, *, tells_token: bool
) -> LivePage:
    """Return the live page of some robots.

    Args:
        address: Where the page is wanted; None for nowhere yet.
        tells_token: The terminal is a person's own, and no client's log.
    """
    from mapspeak.server.view.keys import PageKeys, ViewDesk  # noqa: PLC0415 - heavy; help must be quick

    def tell_token(token: str) -> None:
        if address is not None and tells_token:
            click.echo(f"mapspeak: token to command from the live page, once: {token}", err=True)

    guards = [feed.session.guard for feed in feeds.values() if feed.session.guard is not None]
    return LivePage(
        feeds=feeds,
        address=address,
        desk=ViewDesk(guards[0].hold.folder if guards else control_folder(None)),
        keys=PageKeys(tell_token),
    )


@click.command()
@click.argument("run", required=False, type=click.Path(path_type=Path))
@click.option(
    "--map", "map_file", type=FILE, help="The map on which a log is shown: map_server's .yaml."
)
@CONTROL_OPTION
@click.option(
    "--wait-s", default=4.0, show_default=True, help="How long to wait for servers to answer."
)
@click.option("--no-open", is_flag=True, help="Say where it is, and open no browser.")
def view(
    run: Path | None, map_file: Path | None, control: Path | None, wait_s: float, *, no_open: bool
) -> None:
    """Show a running server in the browser, or replay what is over.

    RUN is a call log (--call-log), an audit log (--audit), or the folder of a demo, of an
    evaluation or of one of its trials. Its replay is written beside it, as a page that needs no
    server. Without RUN every server of this machine is asked for its live page.
    """
    has_terminal = sys.stdin.isatty() and sys.stdout.isatty()
    if run is not None:
        page = write_replay(run, map_file)
        addresses = {str(page): page.resolve().as_uri()}
    else:
        addresses = _ask_servers(control_folder(control), wait_s, with_key=has_terminal)
    for said, url in addresses.items():
        click.echo(said)
        if has_terminal and not no_open:
            click.launch(url)


def write_replay(run: Path, map_file: Path | None) -> Path:
    """Write the replay of a log, a trial or a whole run, and return its page.

    Raises:
        ConfigError: It is none of these, or its page cannot be written.
    """
    if not run.exists():
        raise ConfigError(f"There is no {run}.", hint="Name the file of a log, or a run's folder.")
    with usual_modes():
        try:
            return _write_log(run, map_file) if run.is_file() else _write_run(run)
        except OSError as error:
            raise ConfigError(
                f"The replay cannot be written: {error}.", hint="Check who may write there."
            ) from error


def _write_log(log: Path, map_file: Path | None) -> Path:
    from mapspeak.server.view.pages import build_replay_page  # noqa: PLC0415 - heavy
    from mapspeak.server.view.replay import replay_log  # noqa: PLC0415
    from mapspeak.spatial.mapfiles import load_map  # noqa: PLC0415

    grid = None if map_file is None else load_map(map_file).grid
    page = log.with_suffix(".html")
    page.write_bytes(build_replay_page(f"mapspeak: {log.name}", replay_log(log, grid)))
    return page


def _write_run(folder: Path) -> Path:
    from mapspeak.evaluation.report.page import write_page  # noqa: PLC0415 - heavy
    from mapspeak.evaluation.report.replay import REPLAY, ReplayWriter  # noqa: PLC0415
    from mapspeak.evaluation.trials import RESULT, read_result, read_results, say_fault  # noqa: PLC0415

    if (folder / RESULT).exists():
        try:
            result = read_result(folder / RESULT)
        except ValueError as error:
            raise ConfigError(
                f"{folder / RESULT} is no result: {say_fault(error)}.",
                hint="Name the folder of a trial that came to its end.",
            ) from error
        ReplayWriter().write(result, folder)
        return folder / REPLAY
    results = read_results(folder)
    if not results:
        raise ConfigError(
            f"{folder} holds no run of a demo or an evaluation.",
            hint="Name the folder that was given as --out, or the file of a log.",
        )
    return write_page(folder, results)


def _ask_servers(control: Path, wait_s: float, *, with_key: bool) -> dict[str, str]:
    """Return the pages of running servers: what to say of each, and its address.

    Raises:
        MapspeakError: None has answered.
    """
    from mapspeak.server.view.keys import ViewRequest  # noqa: PLC0415 - heavy

    try:
        request = ViewRequest.leave(control, getpass.getuser())
    except OSError as error:
        raise ConfigError(
            f"{control} cannot be written: {error.strerror}.", hint="Name the server's --control."
        ) from error
    try:
        found = _wait_for_pages(request, wait_s)
    finally:
        request.withdraw()
    if not found:
        raise MapspeakError(
            f"No server has answered within {wait_s:g} s.",
            hint=f"Start one: {shell_command('serve --http --view')}; or name its --control.",
        )
    fragment = f"#key={request.key}" if with_key else ""
    if not with_key:
        click.echo(
            "To look and to stop; in a terminal of yours it also lets you command.", err=True
        )
    return {f"{robots}: {url}{fragment}": f"{url}{fragment}" for url, robots in found.items()}


def _wait_for_pages(request: "ViewRequest", wait_s: float) -> dict[str, str]:
    """Return the pages that have answered when no more come, by their addresses."""
    deadline_s, found = time.monotonic() + wait_s, dict[str, str]()
    while time.monotonic() < deadline_s:
        time.sleep(LOOK_S)
        before, found = found, dict(request.answers())
        if found and len(found) == len(before):
            break
    return found


def open_drawing(
    opened: "Mapping[str, tuple[Session, RosConnection | None]]",
    notes: "Mapping[str, CallNoting | None]",
    files: ExitStack,
    *,
    has_markers: bool,
    record: Path | None,
    foxglove: str | None,
) -> "tuple[list[Callable[[], Coroutine[Any, Any, None]]], dict[str, CallNoting | None]]":
    """Return what draws the robots in the background, and where the calls of each are noted.

    Args:
        opened: The session and the ROS of each robot, by its name.
        notes: Where the calls of each are noted without a drawing.
        files: Closes what is opened.
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
    recorders = _open_recorders(record, foxglove, files)
    if not recorders:
        return drawers, dict(notes)
    from mapspeak.server.view.calls import CallFeed  # noqa: PLC0415 - heavy
    from mapspeak.server.view.recording import SessionRecord  # noqa: PLC0415 - optional

    calls = {name: CallFeed(notes[name]) for name in opened}
    for name, (session, _) in opened.items():
        drawers.append(SessionRecord(session, recorders, calls[name], name=name).run)
    return drawers, {**calls}


def _open_recorders(
    record: Path | None, foxglove: str | None, files: ExitStack
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
        recorders.append(files.enter_context(record_to(record)))
    if foxglove is not None:
        host, port = parse_address(foxglove)
        if not is_loopback(host):
            raise ConfigError(
                f"{host} can be reached from other machines, and Foxglove asks for no password.",
                hint="Serve it on 127.0.0.1, and reach it through an SSH tunnel.",
            )
        recorders.append(files.enter_context(serve_foxglove(host, port)))
        click.echo(f"mapspeak: for Foxglove at ws://{foxglove}", err=True)
    return recorders
