"""Print what every command says of itself.

A command keeps its option for help from the first time it is asked, so this is its own process:
what other tests asked before must not show.
"""

import sys

import click

from mapspeak.cli import cli


def main() -> None:
    """Print the help of the command line and of everything below it."""
    sys.stdout.write("\n\n".join(_help_of(cli, "mapspeak")) + "\n")


def _help_of(command: click.Command, name: str, parent: click.Context | None = None) -> list[str]:
    wide = {"terminal_width": 100, "max_content_width": 100, **command.context_settings}
    said = command.context_class(command, parent=parent, info_name=name, **wide)
    text = command.get_help(said)
    if not isinstance(command, click.Group):
        return [text]
    below = [(word, command.get_command(said, word)) for word in command.list_commands(said)]
    parts = [_help_of(one, word, said) for word, one in below if one is not None]
    return [text, *(part for each in parts for part in each)]


if __name__ == "__main__":
    main()
