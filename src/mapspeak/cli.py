"""The command line: the only reader of flags, and the only place that chooses a link."""

import math
import os
import re
import shutil
import signal
import sys
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import anyio
import click

from mapspeak import __version__
from mapspeak.errors import ConfigError, MapError, MapspeakError

if TYPE_CHECKING:
    from mapspeak.robot import Robot
    from mapspeak.server.mapcommand import MapJob
    from mapspeak.session import Session

__all__ = ["main"]

DEFAULT_WORLD = "warehouse"
TOKEN_VARIABLE = "MAPSPEAK_HTTP_TOKEN"  # noqa: S105 - the variable's name, not a token
DEFAULT_HTTP = "127.0.0.1:8766"


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeOptions:
    """What `mapspeak serve` was asked for."""

    robot: str
    seed: int
    clock: str
    has_detector: bool
    http: str | None
    toolsets: tuple[str, ...]
    tools: tuple[str, ...]
    is_read_only: bool
    semantic_map: Path | None
    state_log: Path | None
    lease_s: float


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="mapspeak")
@click.pass_context
def cli(context: click.Context) -> None:
    """A robot's map, eyes and memory of places for any language model, over MCP.

    Without a command it serves the simulated robot over stdio, as an MCP client expects.
    """
    if context.invoked_subcommand is None:
        context.invoke(serve)


def _split_names(
    _context: click.Context, _parameter: click.Parameter, value: str | None
) -> tuple[str, ...] | None:
    if value is None:
        return None
    return tuple(name.strip() for name in value.split(",") if name.strip())


@cli.command()
@click.option(
    "--robot",
    default=f"sim:{DEFAULT_WORLD}",
    show_default=True,
    help="sim[:WORLD], where WORLD is a shipped world or a world file.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of the simulated robot's noise.",
)
@click.option(
    "--clock",
    type=click.Choice(["real", "virtual"]),
    default="real",
    show_default=True,
    help="virtual: simulated time passes only during calls, as fast as it computes.",
)
@click.option("--detector", "has_detector", is_flag=True, help="Offer the simulated detector.")
@click.option(
    "--http",
    is_flag=False,
    flag_value=DEFAULT_HTTP,
    default=None,
    metavar="[HOST:PORT]",
    help=f"Streaming HTTP instead of stdio; {DEFAULT_HTTP} unless said otherwise.",
)
@click.option(
    "--toolsets", callback=_split_names, default=None, help="Groups of tools, comma-separated."
)
@click.option("--tools", callback=_split_names, default=None, help="Single tools besides.")
@click.option("--read-only", "is_read_only", is_flag=True, help="No tool that changes anything.")
@click.option(
    "--semantic-map",
    type=click.Path(path_type=Path),
    default=None,
    help="The YAML file of remembered places; one per map in the user's data folder unless given.",
)
@click.option(
    "--state-log",
    type=click.Path(path_type=Path),
    default=None,
    help="Write the simulator's truth here as JSON lines; for scoring only.",
)
@click.option(
    "--lease-s",
    default=60.0,
    show_default=True,
    help="Over HTTP, a driving robot is stopped when no client was heard for so long.",
)
def serve(
    robot: str,
    seed: int,
    clock: str,
    has_detector: bool,  # noqa: FBT001 - a flag
    http: str | None,
    toolsets: tuple[str, ...] | None,
    tools: tuple[str, ...] | None,
    is_read_only: bool,  # noqa: FBT001 - a flag
    semantic_map: Path | None,
    state_log: Path | None,
    lease_s: float,
) -> None:
    """Serves a robot to MCP clients, over stdio or streaming HTTP."""
    from mapspeak.server import DEFAULT_TOOLSETS  # noqa: PLC0415 - heavy; help must be quick

    options = ServeOptions(
        robot=robot,
        seed=seed,
        clock=clock,
        has_detector=has_detector,
        http=http,
        toolsets=DEFAULT_TOOLSETS if toolsets is None else toolsets,
        tools=tools or (),
        is_read_only=is_read_only,
        semantic_map=semantic_map,
        state_log=state_log,
        lease_s=lease_s,
    )
    anyio.run(_serve, options)


async def _serve(options: ServeOptions) -> None:
    from mapspeak.semantic import SemanticMapStore  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.server import build_server, serve_http, serve_stdio  # noqa: PLC0415
    from mapspeak.session import Session  # noqa: PLC0415

    async with _open_robot(options) as robot, anyio.create_task_group() as tasks:
        map_name = robot.description.map_name
        path = options.semantic_map or _usual_semantic_map(map_name)
        # A client on stdio cannot vanish unnoticed: its end of the pipe closes.
        lease_s = math.inf if options.http is None else options.lease_s
        session = Session(robot, SemanticMapStore(path, map_id=map_name), lease_s=lease_s)
        server = build_server(
            session,
            toolsets=options.toolsets,
            tools=options.tools,
            is_read_only=options.is_read_only,
        )
        tasks.start_soon(_end_on_signal, session)
        tasks.start_soon(session.keep_watch)
        try:
            if options.http is None:
                await serve_stdio(server)
            else:
                await serve_http(server, options.http, token=os.environ.get(TOKEN_VARIABLE) or None)
        finally:
            await session.close()
            tasks.cancel_scope.cancel()


@asynccontextmanager
async def _open_robot(options: ServeOptions) -> AsyncGenerator["Robot"]:
    from mapspeak.links.simulated import Clock, open_simulated_robot  # noqa: PLC0415
    from mapspeak.simulator import Simulation, StateLog, load_world  # noqa: PLC0415

    kind, _, world = options.robot.partition(":")
    if kind != "sim":
        raise ConfigError(
            f"There is no link for the robot {options.robot!r}.",
            hint="Use sim, sim:WORLD, or sim:PATH to a world file.",
        )
    simulation = Simulation(load_world(world or DEFAULT_WORLD), seed=options.seed)
    log = StateLog(simulation, options.state_log) if options.state_log else None
    try:
        async with open_simulated_robot(
            simulation,
            clock=Clock(options.clock),
            has_detector=options.has_detector,
            after_step=log.note if log else None,
        ) as robot:
            yield robot
    finally:
        if log is not None:
            log.close()


async def _end_on_signal(session: "Session") -> None:
    with anyio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
        async for number in signals:
            await session.close()
            # A thread may wait for standard input for ever; there is nothing left to wait for.
            os._exit(128 + number)


def _usual_semantic_map(map_name: str) -> Path:
    """Gives a file that stays when an MCP client starts the server in another folder."""
    folder = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "mapspeak"
    return folder / f"{re.sub(r'[^A-Za-z0-9_.-]+', '_', map_name)}.yaml"


@cli.command()
@click.option("--world", default=DEFAULT_WORLD, show_default=True, help="A world or world file.")
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of the simulated robot's noise.",
)
@click.option(
    "--out",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=None,
    help="Where the results go; out/demo-WORLD-SEED unless given.",
)
@click.option("--quiet", "is_quiet", is_flag=True, help="Print the result only.")
def demo(
    world: str,
    seed: int,
    folder: Path | None,
    is_quiet: bool,  # noqa: FBT001 - a flag
) -> None:
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


@cli.command("map")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--resolution",
    "resolution_m",
    type=click.FloatRange(min=0, min_open=True),
    default=None,
    help="Metres per pixel, for bare pictures: 0 occupied, 205 unknown, 254 free.",
)
@click.option("--out", "picture", type=click.Path(path_type=Path), help="The annotated PNG.")
@click.option("--json", "facts", type=click.Path(path_type=Path), help="All facts as JSON.")
@click.option("--rooms", "labels", type=click.Path(path_type=Path), help="16-bit label picture.")
@click.option("--graph", type=click.Path(path_type=Path), help="The area graph as JSON.")
@click.option("--geojson", type=click.Path(path_type=Path), help="The area graph as GeoJSON.")
@click.option("--osm", type=click.Path(path_type=Path), help="The area graph as osmAG, for JOSM.")
@click.option(
    "--anchor",
    type=(float, float, float),
    default=None,
    metavar="LAT LON YAW",
    help="Where on Earth the map's (0, 0) lies, and its x axis from east, in degrees.",
)
def map_command(
    files: tuple[Path, ...],
    resolution_m: float | None,
    anchor: tuple[float, float, float] | None,
    picture: Path | None,
    facts: Path | None,
    labels: Path | None,
    graph: Path | None,
    geojson: Path | None,
    osm: Path | None,
) -> None:
    """Shows map_server maps, or bare pictures, as a robot's map is shown; no robot is needed.

    FILES are .yaml files, pictures, folders of them, or quoted patterns such as
    "maps/**/map.yaml". With several maps, --out, --json, --rooms, --graph, --geojson and --osm
    name folders.
    """
    from mapspeak.server.mapcommand import Output, find_maps, plan_jobs  # noqa: PLC0415
    from mapspeak.spatial.areagraph import MapAnchor  # noqa: PLC0415

    wanted = {
        Output.PICTURE: picture,
        Output.FACTS: facts,
        Output.LABELS: labels,
        Output.GRAPH: graph,
        Output.GEOJSON: geojson,
        Output.OSM: osm,
    }
    place = None
    if anchor is not None:
        lat_deg, lon_deg, yaw_deg = anchor
        place = MapAnchor(lat_deg=lat_deg, lon_deg=lon_deg, yaw_rad=math.radians(yaw_deg))
    jobs = plan_jobs(
        find_maps(files),
        resolution_m=resolution_m,
        anchor=place,
        outputs={output: path for output, path in wanted.items() if path is not None},
    )
    n_failed = _show_maps(jobs)
    if n_failed and len(jobs) > 1:
        click.echo(f"{n_failed} of {len(jobs)} maps could not be read.", err=True)
    sys.exit(1 if n_failed else 0)


def _show_maps(jobs: "list[MapJob]") -> int:
    """Shows one map after the other, and gives how many could not be."""
    from mapspeak.server.mapcommand import show_map  # noqa: PLC0415 - heavy; help must be quick

    n_failed = 0
    tell = _tell_watcher if len(jobs) > 1 and sys.stderr.isatty() else _tell_nobody
    for number, job in enumerate(jobs, start=1):
        tell(f"{number} of {len(jobs)}: {job.file}")
        try:
            said, is_error = show_map(job), False
        except MapError as error:
            said, is_error = f"mapspeak: {job.file}: {error}", True
        tell("")
        click.echo(said, err=is_error)
        n_failed += is_error
    return n_failed


def _tell_watcher(text: str) -> None:
    """Shows a line in place of the one before it."""
    width = shutil.get_terminal_size().columns - 1
    click.echo(f"\r\x1b[2K{text[:width]}", nl=False, err=True)


def _tell_nobody(_text: str) -> None:
    """Leaves a log or a pipe as it is."""


def main() -> None:
    """Runs the command line; what went wrong on purpose is said in one line, without a trace."""
    try:
        cli()
    except* MapspeakError as group:
        for error in _leaves(group):
            click.echo(f"mapspeak: {error}", err=True)
        sys.exit(2)


def _leaves(group: BaseExceptionGroup[MapspeakError]) -> list[MapspeakError]:
    leaves: list[MapspeakError] = []
    for error in group.exceptions:
        leaves += _leaves(error) if isinstance(error, BaseExceptionGroup) else [error]
    return leaves
