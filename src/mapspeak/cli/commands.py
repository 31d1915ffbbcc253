"""All commands, and how errors are shown."""

import signal
import sys
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from importlib import import_module
from types import FrameType
from typing import Any

import click

from mapspeak import __version__
from mapspeak.cli.shared.options import INTERRUPTED, keep_private
from mapspeak.errors import MapspeakError, say_nearest

COMMANDS: Mapping[str, tuple[str, str]] = {
    "approve": ("operating:approve", "agree to a command that waits for a person's word"),
    "demo": ("simulating:demo", "watch a script do three tasks with the simulated robot"),
    "doctor": (
        "checkup:doctor",
        "check a robot: what was found, what is missing, how to start it",
    ),
    "eval": ("evaluating:evaluate", "run and score tasks in simulated worlds"),
    "map": ("mapping:map_command", "show map files as a model sees a map; no robot is needed"),
    "memory": ("commands:memory", "look at, edit, check and share what a robot remembers"),
    "release": ("operating:release", "let held robots drive again"),
    "replay": ("operating:replay", "show an audit log: who wanted what, and what became of it"),
    "serve": ("serving.command:serve", "offer a robot to a language model, over MCP"),
    "simulate": ("simulating:simulate", "offer the simulated robot to any rosbridge client"),
    "skills": ("skills:skills", "check, list and try what else a robot can do: skills.yaml"),
    "stop": ("operating:stop", "stop every robot that is served from here, and hold it"),
    "view": (
        "serving.viewing:view",
        "show a running server in the browser, or replay what is over",
    ),
}
"""The module and summary of each command; a module is imported when its command runs."""


MEMORY_COMMANDS: Mapping[str, tuple[str, str]] = {
    "check": ("memory.queries:check", "check the file, and on a map whether it can be true"),
    "copy": ("memory.places:copy", "copy a memory into an empty one, file or database"),
    "episodes": ("memory.queries:episodes", "list what was observed, when and from where"),
    "export": ("memory.places:export", "write the places as GeoJSON"),
    "find": ("memory.queries:find", "find the places and things that words may mean"),
    "forget": ("memory.places:forget", "forget a place, or all landmarks of a label; or undo it"),
    "import": ("memory.places:import_", "join exported, perhaps edited GeoJSON into the memory"),
    "list": ("memory.places:list_", "list all places"),
    "merge": ("memory.places:merge", "join two files and their observations into a new one"),
    "show": ("memory.places:show", "show all that is known of a place"),
}


class CommandGroup(click.Group):
    """Commands by name, each imported when it is wanted."""

    def __init__(self, *, table: Mapping[str, tuple[str, str]], **settings: Any) -> None:  # noqa: ANN401 - click's own
        super().__init__(**settings)
        self._table = table

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - as in click
        """Return the names of all commands."""
        return list(self._table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - as in click
        """Import a command; return None for an unknown name."""
        if cmd_name not in self._table:
            return None
        module, _, name = self._table[cmd_name][0].partition(":")
        command: click.Command = getattr(import_module(f"mapspeak.cli.{module}"), name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that is named first; suggest names where there is none of it."""
        name = args[0]
        if name not in self._table and (near := say_nearest(name, self._table)):
            raise click.UsageError(f"No such command {name!r}. {near}".rstrip(), ctx)
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:  # noqa: ANN401 - as in click
        """Run the command; say in a line that Ctrl-C has stopped it."""
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, click.Abort):
            click.echo("Stopped.", err=True)
            ctx.exit(INTERRUPTED)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - as in click
        """Write what each command does, without importing it."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, what) for name, (_, what) in self._table.items()])


@click.group(cls=CommandGroup, table=MEMORY_COMMANDS)
def memory() -> None:
    """Look at, check and share a memory of places: a semantic map file and its episodes."""


@click.group(
    cls=CommandGroup,
    table=COMMANDS,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="mapspeak")
@click.pass_context
def cli(context: click.Context) -> None:
    """Give any language model a robot's map, eyes and memory of places, over MCP.

    Without a command it serves the simulated robot over stdio, as an MCP client expects.
    """
    if context.invoked_subcommand is None:
        from mapspeak.cli.serving.command import serve  # noqa: PLC0415 - only where it is wanted

        context.invoke(serve)


def main() -> None:
    """Run the command line; print a `MapspeakError` in one line, without a trace."""
    errors: list[MapspeakError] = []
    try:
        with keep_private(), _interrupted_by_sigterm():
            cli()
    except* MapspeakError as group:
        errors = _leaves(group)
    for error in errors:
        click.echo(f"mapspeak: {error}", err=True)
    if errors:  # not in the clause above, where Python 3.11.2 wraps the exit into a group
        sys.exit(2)


@contextmanager
def _interrupted_by_sigterm() -> Generator[None]:
    """Let SIGTERM end what goes on as Ctrl-C does, with nothing left running or out of order."""

    def interrupt(_number: int, frame: FrameType | None) -> None:
        handler = signal.getsignal(signal.SIGINT)
        # A shell's background jobs ignore SIGINT.
        (handler if callable(handler) else signal.default_int_handler)(signal.SIGINT, frame)

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _leaves(group: BaseExceptionGroup[MapspeakError]) -> list[MapspeakError]:
    leaves: list[MapspeakError] = []
    for error in group.exceptions:
        leaves += _leaves(error) if isinstance(error, BaseExceptionGroup) else [error]
    return leaves
