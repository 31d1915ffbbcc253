"""Which memory a command is about."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mapspeak.cli.guarding import data_folder
from mapspeak.cli.options import FILE
from mapspeak.errors import ConfigError

if TYPE_CHECKING:
    from mapspeak.semantic import SemanticMap, SemanticMapStore

__all__ = [
    "JSON_OPTION",
    "MEMORY_OPTION",
    "find_memory",
    "open_memory",
    "read_places",
    "write_out",
]

MEMORY_OPTION = click.option(
    "--semantic-map",
    type=FILE,
    help="The semantic map file; the one in the user's data folder, if there is but one.",
)
JSON_OPTION = click.option("--json", "as_json", is_flag=True, help="As JSON.")


def find_memory(given: Path | None) -> Path:
    """Gives the semantic map file.

    Raises:
        ConfigError: None is given, and the data folder has none or several.
    """
    if given is not None:
        return given
    found = sorted(data_folder().glob("*.yaml"))
    if len(found) == 1:
        return found[0]
    names = ", ".join(map(str, found)) or f"none in {data_folder()}"
    raise ConfigError("It is not clear which memory.", hint=f"Name one: --semantic-map; {names}.")


def open_memory(given: Path | None) -> "SemanticMapStore":
    """Opens a semantic map file that is there.

    Raises:
        ConfigError: It is not.
    """
    from mapspeak.semantic import SemanticMapStore  # noqa: PLC0415 - heavy; help must be quick

    path = find_memory(given)
    if not path.exists():
        raise ConfigError(f"There is no file {path}.", hint="Name one with --semantic-map.")
    return SemanticMapStore(path)


def read_places(store: "SemanticMapStore") -> "SemanticMap":
    """Reads all places, and says on stderr what is odd about the file."""
    places = store.read()
    for warning in places.warnings:
        click.echo(f"mapspeak: {warning}", err=True)
    return places


def write_out(text: str, out: Path | None) -> None:
    """Writes to a file, or to stdout.

    Raises:
        ConfigError: The file cannot be written.
    """
    if out is None:
        click.echo(text, nl=False)
        return
    try:
        out.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        message = f"--out: {out} cannot be written: {error.strerror or error}."
        raise ConfigError(
            message, hint="Name a file in a folder that can be written to."
        ) from error
