"""Options that several commands have, and what is read from them."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mapspeak.geometry import Pose

if TYPE_CHECKING:
    from mapspeak.spatial.areagraph import MapAnchor

Command = Callable[..., Any]
Decorator = Callable[[Command], Command]

DEFAULT_WORLD = "warehouse"

FILE = click.Path(path_type=Path)
SEED_OPTION = click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of the simulated robot's noise.",
)
WORLD_OPTION = click.option(
    "--world", default=DEFAULT_WORLD, show_default=True, help="A world or world file."
)
ROBOT_HELP = (
    "sim[:WORLD], where WORLD is a shipped world, a world file or a map; the address of a "
    "rosbridge, such as ws://192.168.1.20:9090; or ros2[:DOMAIN] or dds[:DOMAIN] without one."
)
ROBOT_OPTIONS = (
    click.option("--robot", default=f"sim:{DEFAULT_WORLD}", show_default=True, help=ROBOT_HELP),
    click.option(
        "--robot-file", type=FILE, help="robot.yaml: what is not to be found by asking the robot."
    ),
    click.option("--ca-file", type=FILE, help="Whose certificates a wss robot may show, as PEM."),
    SEED_OPTION,
)


def _read_anchor(
    _context: click.Context, _parameter: click.Parameter, value: tuple[float, float, float] | None
) -> "MapAnchor | None":
    if value is None:
        return None
    from mapspeak.spatial.areagraph import MapAnchor  # noqa: PLC0415 - heavy; help must be quick

    lat_deg, lon_deg, yaw_deg = value
    return MapAnchor(lat_deg=lat_deg, lon_deg=lon_deg, yaw_rad=math.radians(yaw_deg))


ANCHOR_OPTION = click.option(
    "--anchor",
    type=(float, float, float),
    callback=_read_anchor,
    metavar="LAT LON YAW",
    help="Where on Earth the map's (0, 0) lies, and its x axis from east, in degrees.",
)


def add_options(options: Sequence[Decorator]) -> Decorator:
    """Return a decorator that adds several options, in their order."""

    def add(function: Command) -> Command:
        for option in reversed(options):
            function = option(function)
        return function

    return add


def read_pose(
    _context: click.Context, _parameter: click.Parameter, value: str | None
) -> Pose | None:
    """Return the pose that an option gives as X,Y,YAW_DEG."""
    if value is None:
        return None
    try:
        x, y, yaw_deg = (float(part) for part in value.split(","))
        pose = Pose(x, y, math.radians(yaw_deg))
    except ValueError:
        raise click.BadParameter("write three numbers, such as 2.5,1,90") from None
    if not pose.is_finite():
        raise click.BadParameter("the numbers have to be finite")
    return pose
