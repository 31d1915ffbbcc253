"""`mapspeak serve`: a robot for MCP clients."""

import math
import os
import re
import signal
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import anyio
import click

from mapspeak.cli.guarding import GUARD_OPTIONS, GuardChoice, build_guard, data_folder
from mapspeak.cli.options import FILE, ROBOT_OPTIONS, add_options
from mapspeak.cli.robots import RobotChoice, find_connection, open_robot

if TYPE_CHECKING:
    from mapspeak.session import Session

__all__ = ["serve", "usual_semantic_map"]

TOKEN_VARIABLE = "MAPSPEAK_HTTP_TOKEN"  # noqa: S105 - the variable's name, not a token
DEFAULT_HTTP = "127.0.0.1:8766"


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeOptions:
    """What `mapspeak serve` was asked for."""

    robot: RobotChoice
    http: str | None
    toolsets: tuple[str, ...]
    tools: tuple[str, ...]
    is_read_only: bool
    semantic_map: Path | None
    lease_s: float
    guard: GuardChoice


def _split_names(
    _context: click.Context, _parameter: click.Parameter, value: str | None
) -> tuple[str, ...] | None:
    if value is None:
        return None
    return tuple(name.strip() for name in value.split(",") if name.strip())


@click.command()
@add_options(ROBOT_OPTIONS)
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
    type=FILE,
    help="The YAML file of remembered places; one per map in the user's data folder unless given.",
)
@click.option(
    "--state-log", type=FILE, help="Write the simulator's truth here, as JSON lines, for scoring."
)
@click.option(
    "--lease-s",
    default=60.0,
    show_default=True,
    help="Over HTTP, a driving robot is stopped when no client was heard for so long.",
)
@add_options(GUARD_OPTIONS)
def serve(
    robot: str,
    robot_file: Path | None,
    ca_file: Path | None,
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
    policy: Path | None,
    audit: Path | None,
    control: Path | None,
) -> None:
    """Serves a robot to MCP clients, over stdio or streaming HTTP."""
    from mapspeak.server import DEFAULT_TOOLSETS  # noqa: PLC0415 - heavy; help must be quick

    options = ServeOptions(
        robot=RobotChoice(
            robot=robot,
            robot_file=robot_file,
            ca_file=ca_file,
            seed=seed,
            clock=clock,
            has_detector=has_detector,
            state_log=state_log,
        ),
        http=http,
        toolsets=DEFAULT_TOOLSETS if toolsets is None else toolsets,
        tools=tools or (),
        is_read_only=is_read_only,
        semantic_map=semantic_map,
        lease_s=lease_s,
        guard=GuardChoice(policy=policy, audit=audit, control=control),
    )
    anyio.run(_serve, options)


async def _serve(options: ServeOptions) -> None:
    from mapspeak.semantic import SemanticMapStore  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.server import build_server, serve_http, serve_stdio  # noqa: PLC0415
    from mapspeak.server.tools import require_ros  # noqa: PLC0415
    from mapspeak.session import Session  # noqa: PLC0415

    guard = build_guard(options.guard, robot=options.robot.robot)
    async with open_robot(options.robot) as robot, anyio.create_task_group() as tasks:
        map_name = robot.description.map_name
        path = options.semantic_map or usual_semantic_map(map_name, options.robot.robot)
        # A client on stdio cannot vanish unnoticed: its end of the pipe closes.
        lease_s = math.inf if options.http is None else options.lease_s
        memory = SemanticMapStore(path, map_id=map_name or None)
        ros = find_connection(robot, options.robot)
        session = Session(robot, memory, lease_s=lease_s, guard=guard, ros=ros)
        require_ros(session, toolsets=options.toolsets, tools=options.tools)
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


async def _end_on_signal(session: "Session") -> None:
    with anyio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
        async for number in signals:
            await session.close()
            # A thread may wait for standard input for ever; there is nothing left to wait for.
            os._exit(128 + number)


def usual_semantic_map(map_name: str, robot: str) -> Path:
    """Gives a file that stays when an MCP client starts the server in another folder.

    Args:
        map_name: Of the robot's map; empty where it does not say.
        robot: The robot's address, whose file it is then.
    """
    name = map_name or robot
    return data_folder() / f"{re.sub(r'[^A-Za-z0-9_.-]+', '_', name)}.yaml"
