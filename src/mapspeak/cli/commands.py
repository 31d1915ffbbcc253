"""All commands, and what becomes of errors."""

import sys

import click

from mapspeak import __version__
from mapspeak.cli.demonstrating import demo
from mapspeak.cli.evaluating import evaluate
from mapspeak.cli.examining import doctor
from mapspeak.cli.guarding import keep_private
from mapspeak.cli.mapping import map_command
from mapspeak.cli.memory import memory
from mapspeak.cli.operating import approve, release, replay, stop
from mapspeak.cli.serving import serve
from mapspeak.cli.simulating import simulate
from mapspeak.errors import MapspeakError


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="mapspeak")
@click.pass_context
def cli(context: click.Context) -> None:
    """Give any language model a robot's map, eyes and memory of places, over MCP.

    Without a command it serves the simulated robot over stdio, as an MCP client expects.
    """
    if context.invoked_subcommand is None:
        context.invoke(serve)


COMMANDS = {
    demo: "watch a script do three tasks with the simulated robot",
    serve: "offer a robot to a language model, over MCP",
    doctor: "check a robot: what was found, what is missing, how to start it",
    map_command: "show map files as a model sees a map; no robot is needed",
    memory: "look at, edit, check and share what a robot remembers",
    stop: "stop every robot that is served from here, and hold it",
    release: "let held robots drive again",
    approve: "agree to a command that waits for a person's word",
    replay: "show an audit log: who wanted what, and what became of it",
    simulate: "offer the simulated robot to any rosbridge client",
    evaluate: "run and score tasks in simulated worlds",
}
for command, what in COMMANDS.items():
    command.short_help = what
    cli.add_command(command)


def main() -> None:
    """Run the command line; what went wrong on purpose is said in one line, without a trace."""
    errors: list[MapspeakError] = []
    try:
        with keep_private():
            cli()
    except* MapspeakError as group:
        errors = _leaves(group)
    for error in errors:
        click.echo(f"mapspeak: {error}", err=True)
    if errors:  # not in the clause above, where Python 3.11.2 wraps the exit into a group
        sys.exit(2)


def _leaves(group: BaseExceptionGroup[MapspeakError]) -> list[MapspeakError]:
    leaves: list[MapspeakError] = []
    for error in group.exceptions:
        leaves += _leaves(error) if isinstance(error, BaseExceptionGroup) else [error]
    return leaves
