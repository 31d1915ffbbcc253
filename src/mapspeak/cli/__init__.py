"""The command line: the only reader of flags, and the only place that chooses a link."""

from mapspeak.cli.commands import cli, main

__all__ = ["cli", "main"]
