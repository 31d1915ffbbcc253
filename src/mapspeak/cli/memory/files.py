"""Which memory a command is about."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mapspeak.cli.guarding import data_folder, usual_modes
from mapspeak.cli.options import FILE
from mapspeak.errors import ConfigError

if TYPE_CHECKING:
    from mapspeak.semantic import SemanticMap, SemanticMapStore

MEMORY_OPTION = click.option(
    "--memory",
    "--semantic-map",
    "semantic_map",
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
    raise ConfigError("It is not clear which memory.", hint=f"Name one: --memory; {names}.")


def open_memory(given: Path | None) -> "SemanticMapStore":
    """Opens a semantic map file that is there.

    Raises:
        ConfigError: It is not.
    """
    from mapspeak.semantic import SemanticMapStore  # noqa: PLC0415 - heavy; help must be quick

    path = find_memory(given)
    if not path.exists():
        raise ConfigError(f"There is no file {path}.", hint="Name one with --memory.")
    return SemanticMapStore(path)


def read_places(store: "SemanticMapStore") -> "SemanticMap":
    """Reads all places, and says on stderr what is odd about the file."""
    places = store.read()
    for warning in places.warnings:
        click.echo(f"mapspeak: {warning}", err=True)
    return places


def usual_memory(folder: Path, map_name: str, robot: str) -> Path:
    """Return the file of a robot's memory; the same one whatever folder the server is started in.

    Args:
        folder: Where memories lie.
        map_name: Of the robot's map; empty where it does not say.
        robot: The robot as it is shown, whose file it is then.
    """
    return folder / f"{re.sub(r'[^A-Za-z0-9_.-]+', '_', map_name or robot)}.yaml"


def rename_memory(old: Path, new: Path) -> None:
    """Move a memory that was named by the whole address of its robot, which may hold a password.

    Args:
        old: The file as it was named once.
        new: The file as it is named today.
    """
    from mapspeak.semantic.episodes import memory_folder  # noqa: PLC0415 - heavy

    if old == new or not old.exists():
        return
    # Secrets must not reach a log either, so the old name is not shown.
    if new.exists():
        click.echo(
            f"mapspeak: a memory in {old.parent} is named by this robot's whole address and is not "
            f"used: {new.name} is. Remove it: its name may hold a password.",
            err=True,
        )
        return
    old.chmod(0o600)
    for before, after in ((memory_folder(old), memory_folder(new)), (old, new)):
        if before.exists():
            before.rename(after)
    old.with_name(f".{old.name}.lock").unlink(missing_ok=True)
    click.echo(f"mapspeak: this robot's memory is now {new}.", err=True)


def write_out(text: str, out: Path | None) -> None:
    """Writes to a file, or to stdout.

    Raises:
        ConfigError: The file cannot be written.
    """
    if out is None:
        click.echo(text, nl=False)
        return
    try:
        with usual_modes():
            out.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        message = f"--out: {out} cannot be written: {error.strerror or error}."
        raise ConfigError(
            message, hint="Name a file in a folder that can be written to."
        ) from error
