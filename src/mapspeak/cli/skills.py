"""`mapspeak skills`: check, list and try the skills in the owner's skills.yaml."""

import math
import sys
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import anyio
import click

from mapspeak.cli.serving.starting import RobotStart, open_session
from mapspeak.cli.shared.options import (
    DEFAULT_WORLD,
    FILE,
    GUARD_OPTIONS,
    ROBOT_HELP,
    GuardChoice,
    add_options,
)
from mapspeak.cli.shared.robots import RobotChoice
from mapspeak.errors import ConfigError, SkillError

if TYPE_CHECKING:
    from mapspeak.server.tools.skills.book import SkillBook
    from mapspeak.skill import SkillSpec
    from mapspeak.skills.skillsfile import OwnersEntry

ROBOT_OPTION = click.option(
    "--robot", default=f"sim:{DEFAULT_WORLD}", show_default=True, help=ROBOT_HELP
)
AT_ROBOT_OPTION = click.option("--robot", help=f"Check it at this robot too. {ROBOT_HELP}")
SKILLS_FILE = click.argument("file", type=FILE)


@click.group()
def skills() -> None:
    """Check, list and try skills: what a robot can do besides driving, in its owner's words."""


@skills.command("check")
@SKILLS_FILE
@AT_ROBOT_OPTION
def check(file: Path, robot: str | None) -> None:
    """Say whether FILE is right, and with --robot whether the robot offers what it calls."""
    entries = _load(file)
    if robot is None:
        click.echo(f"{file}: {len(entries)} skills, no mistake.")
        return
    _run(_check, entries, robot)


@skills.command("list")
@SKILLS_FILE
def list_skills(file: Path) -> None:
    """List the skills of FILE with what they take."""
    from mapspeak.skills.arguments import say_wanted  # noqa: PLC0415 - heavy; help must be quick

    for each in _load(file):
        spec = each.spec
        click.echo(f"{spec.name}: {spec.description or each.target or each.calls}")
        for name, schema in spec.parameters.items():
            default = f", {schema['default']!r} if left out" if "default" in schema else ""
            click.echo(f"  {name}: {say_wanted(schema)}{default}")


@skills.command("try")
@SKILLS_FILE
@click.argument("name")
@click.argument("arguments", nargs=-1, metavar="[NAME=VALUE]...")
@ROBOT_OPTION
@add_options(GUARD_OPTIONS[1:])
@click.option("--policy", type=FILE, help="policy.yaml: limits, closed areas, approvals.")
def try_skill(
    file: Path, name: str, arguments: tuple[str, ...], robot: str, **limits: Path | None
) -> None:
    """Run the skill NAME of FILE once, as a model would, and say how it ended.

    Exit status: 1 unless it succeeded.
    """
    _run(_try, _load(file), name, arguments, robot, GuardChoice(**limits))


def _run(work: Callable[..., Awaitable[None]], *arguments: object) -> None:
    """Do work whose words lead to no tools of a model."""
    from mapspeak.server.text.offered import offering  # noqa: PLC0415 - heavy; help must be quick

    with offering(()):
        anyio.run(work, *arguments)


def _load(file: Path) -> "tuple[OwnersEntry, ...]":
    from mapspeak.skills.skillsfile import load_skills  # noqa: PLC0415 - heavy; help must be quick

    return load_skills(file)


@asynccontextmanager
async def _open(
    entries: "tuple[OwnersEntry, ...]", robot: str, guard: GuardChoice
) -> "AsyncGenerator[SkillBook]":
    from mapspeak.server.tools.ros.goals import RosAccess  # noqa: PLC0415
    from mapspeak.server.tools.skills.book import SkillBook  # noqa: PLC0415

    start = RobotStart(choice=RobotChoice(robot=robot), memory=None, guard=guard)
    async with AsyncExitStack() as links:
        files = links.enter_context(ExitStack())
        scratch = Path(files.enter_context(TemporaryDirectory(prefix="mapspeak-")))
        session, _ = await open_session("", start, links, files, scratch, lease_s=math.inf)
        if session.ros is not None:
            await session.ros.wait_until_connected()
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(session.keep_watch)
            book = SkillBook(session, RosAccess(session), entries)
            tasks.start_soon(book.runs.keep_going, anyio.sleep_forever)
            await anyio.lowlevel.checkpoint()
            try:
                yield book
            finally:
                with anyio.CancelScope(shield=True):
                    await session.close()
            tasks.cancel_scope.cancel()


async def _check(entries: "tuple[OwnersEntry, ...]", robot: str) -> None:
    async with _open(entries, robot, GuardChoice()) as book:
        faults = {each.spec.name: await book.check_entry(each) for each in entries}
    for name, fault in faults.items():
        click.echo(f"{name}: {fault or 'offered'}")
    if wrong := [name for name, fault in faults.items() if fault]:
        raise ConfigError(
            f"{len(wrong)} of {len(faults)} skills cannot be run at {robot}.",
            hint="Correct them, or start what offers them.",
        )


async def _try(
    entries: "tuple[OwnersEntry, ...]",
    name: str,
    arguments: tuple[str, ...],
    robot: str,
    guard: GuardChoice,
) -> None:
    from mapspeak.server.text.skills import say_run  # noqa: PLC0415
    from mapspeak.skill import SkillState  # noqa: PLC0415

    async with _open(entries, robot, guard) as book:
        skill = book.find(name)
        given = _read_values(skill.spec, arguments)
        run = await book.runs.begin(skill, given, wait_s=skill.spec.timeout_s)
        click.echo(say_run(run))
    if run.state is not SkillState.SUCCEEDED:
        sys.exit(1)


def _read_values(spec: "SkillSpec", arguments: tuple[str, ...]) -> dict[str, Any]:
    """Return arguments written as NAME=VALUE, as what their parameters hold."""
    from mapspeak.skills.steps import parse_tree  # noqa: PLC0415

    given: dict[str, Any] = {}
    for each in arguments:
        name, equals, value = (part.strip() for part in each.partition("="))
        if not equals:
            raise SkillError(f"{each[:60]!r} is no value.", hint="Write NAME=VALUE.")
        is_text = spec.parameters.get(name, {}).get("type", "string") == "string"
        given[name] = value if is_text else parse_tree(value)
    return given
