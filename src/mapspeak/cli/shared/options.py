"""Shared by several commands: options, the user's folders, and the guard of a served robot."""

import math
import os
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mapspeak.geometry import Pose

if TYPE_CHECKING:
    from mapspeak.safety import Guard
    from mapspeak.server.reports.representations import Representation
    from mapspeak.spatial.areagraph import MapAnchor


Command = Callable[..., Any]
Decorator = Callable[[Command], Command]

INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it."""
DEFAULT_WORLD = "warehouse"

FILE = click.Path(path_type=Path)
SEED_OPTION = click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Seed of the simulated robot's noise.",
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
    click.option("--robot-file", type=FILE, help="robot.yaml: what discovery does not find."),
    click.option(
        "--ca-file", type=FILE, help="Certificates of the authority to trust for wss, as PEM."
    ),
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
    help="Latitude and longitude of the map's (0, 0), and the angle of its x axis from east.",
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


def require_finite(
    _context: click.Context, _parameter: click.Parameter, value: float | None
) -> float | None:
    """Return the number of an option; the range of one lets NaN pass."""
    if value is not None and not math.isfinite(value):
        raise click.BadParameter("the number has to be finite")
    return value


PRIVATE = 0o077
_umask_of_person: ContextVar[int | None] = ContextVar("umask_of_person", default=None)

CONTROL_OPTION = click.option(
    "--control",
    type=click.Path(path_type=Path, file_okay=False),
    help="The folder through which `mapspeak stop` reaches servers (default: in the user's data "
    "folder).",
)
SKILL_OPTIONS = (
    click.option(
        "--expose",
        multiple=True,
        metavar="PATTERN",
        help="Make tools of topics, services and actions of the robot while it "
        'offers them, such as "/gripper/*".',
    ),
    click.option(
        "--skills",
        "skill_files",
        type=FILE,
        multiple=True,
        help="skills.yaml: what else the robot can do, in its owner's words; each a tool. nav2 and "
        "move_base name ready-made ones.",
    ),
)

GUARD_OPTIONS = (
    click.option(
        "--policy",
        "policies",
        multiple=True,
        metavar="[NAME=]FILE",
        help="policy.yaml: limits, closed areas, approvals.",
    ),
    click.option(
        "--audit",
        type=FILE,
        help="The log of every command, as JSON lines (default: in the user's data folder).",
    ),
    CONTROL_OPTION,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardChoice:
    """The options of `mapspeak serve` about limits.

    Attributes:
        policy: The file; None for the defaults.
        audit: The log; None for the usual one.
        control: The folder; None for the usual one.
    """

    policy: Path | None = None
    audit: Path | None = None
    control: Path | None = None


def build_guard(choice: GuardChoice, *, robot: str, address: str = "") -> "Guard":
    """Build the guard of the commands to a robot.

    Args:
        robot: Its name in the log.
        address: Where it is; empty for one that no other program can reach.

    Raises:
        ConfigError: The policy has a mistake; names the line and the key.
    """
    from mapspeak.safety import (  # noqa: PLC0415 - heavy; help must be quick
        Approvals,
        AuditLog,
        Guard,
        Hold,
        Policy,
        WaitingRoom,
        load_policy,
    )

    control = control_folder(choice.control)
    return Guard(
        policy=Policy() if choice.policy is None else load_policy(choice.policy),
        audit=AuditLog(
            choice.audit or data_folder() / "audit.jsonl", wall_clock=wall_clock, robot=robot
        ),
        hold=Hold(control),
        approvals=Approvals(WaitingRoom(control / "approvals"), time.monotonic),
        wall_clock=wall_clock,
        robot=robot,
        address=address,
    )


@contextmanager
def keep_private() -> Generator[None]:
    """Write files that no other user can read, except within `usual_modes`."""
    if data_folder().is_dir():
        with suppress(PermissionError):
            data_folder().chmod(0o700)
    umask = os.umask(PRIVATE)
    told = _umask_of_person.set(umask)
    try:
        yield
    finally:
        _umask_of_person.reset(told)
        os.umask(umask)


@contextmanager
def usual_modes() -> Generator[None]:
    """Write files that the user named with the user's own permissions."""
    umask = _umask_of_person.get()
    if umask is None:
        yield
        return
    before = os.umask(umask)
    try:
        yield
    finally:
        os.umask(before)


def data_folder() -> Path:
    """Return the user's folder for mapspeak's data."""
    return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "mapspeak"


def control_folder(given: Path | None) -> Path:
    """Return the folder that servers and operators share."""
    return given or data_folder() / "control"


def wall_clock() -> datetime:
    """Return the operator's time, with its zone."""
    return datetime.now().astimezone()


def split_names(
    _context: click.Context, _parameter: click.Parameter, value: str | None
) -> tuple[str, ...] | None:
    """Read names with commas between them."""
    if value is None:
        return None
    return tuple(name.strip() for name in value.split(",") if name.strip())


def read_representation(
    _context: click.Context, _parameter: click.Parameter, value: str | None
) -> "Representation | None":
    """Read how look_at_map is to show the map."""
    if value is None:
        return None
    from mapspeak.server.reports.representations import Representation  # noqa: PLC0415 - heavy; help must be quick

    if value not in set(Representation):
        raise click.BadParameter(f"choose from {', '.join(Representation)}")
    return Representation(value)


def is_database(name: str) -> bool:
    """Return True for the address of a database, False for a file."""
    return name.startswith(("postgresql://", "postgres://"))
