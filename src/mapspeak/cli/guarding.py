"""The guard of a served robot, and the files that servers and operators share."""

import os
import time
from collections.abc import Generator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mapspeak.cli.options import FILE

if TYPE_CHECKING:
    from mapspeak.safety import Guard

PRIVATE = 0o077
_umask_of_person: ContextVar[int | None] = ContextVar("umask_of_person", default=None)

CONTROL_OPTION = click.option(
    "--control",
    type=click.Path(path_type=Path, file_okay=False),
    help="The folder by which `mapspeak stop` reaches servers; in the user's data folder unless "
    "given.",
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
        help="The log of every command, as JSON lines; in the user's data folder unless given.",
    ),
    CONTROL_OPTION,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardChoice:
    """What `mapspeak serve` was told about limits.

    Attributes:
        policy: The file; None for the defaults.
        audit: The log; None for the usual one.
        control: The folder; None for the usual one.
    """

    policy: Path | None = None
    audit: Path | None = None
    control: Path | None = None


def build_guard(choice: GuardChoice, *, robot: str, address: str = "") -> "Guard":
    """Build what commands to a robot are held to.

    Args:
        choice: Of files.
        robot: What it is called in the log.
        address: Where it is; empty for one that nobody else can reach.

    Raises:
        ConfigError: The policy has a mistake; says the line and the key.
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
    """Let no other user read what is written meanwhile, but for what `usual_modes` is around."""
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
    """Write with the person's own permissions what the person has asked for by name."""
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
    """Return the user's folder for what mapspeak keeps."""
    return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "mapspeak"


def control_folder(given: Path | None) -> Path:
    """Return the folder that servers and operators share."""
    return given or data_folder() / "control"


def wall_clock() -> datetime:
    """Return the operator's time, with its zone."""
    return datetime.now().astimezone()
