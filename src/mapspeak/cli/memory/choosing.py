"""The memory to use: a file, the usual one of a robot, or a fleet's database."""

import re
import threading
from pathlib import Path

import click

from mapspeak.cli.shared.options import data_folder, is_database, usual_modes
from mapspeak.errors import ConfigError
from mapspeak.installation import say_install
from mapspeak.memory import MemoryStore, SemanticMap, SemanticMapStore
from mapspeak.memory.episodes.store import memory_folder

MEMORY_OPTION = click.option(
    "--memory",
    "--semantic-map",
    "semantic_map",
    metavar="FILE|postgresql://...",
    help="The semantic map file, or the database; the file in the user's data folder, if there is "
    "but one.",
)
JSON_OPTION = click.option("--json", "as_json", is_flag=True, help="As JSON.")


def find_memory(given: str | None) -> str:
    """Return the semantic map file, or the address of the database.

    Raises:
        ConfigError: None is given, and the data folder has none or several.
    """
    if given is not None:
        return given
    found = sorted(data_folder().glob("*.yaml"))
    if len(found) == 1:
        return str(found[0])
    names = ", ".join(map(str, found)) or f"none in {data_folder()}"
    raise ConfigError("It is not clear which memory.", hint=f"Name one: --memory; {names}.")


def open_memory(given: str | None) -> MemoryStore:
    """Open a memory that is there.

    Raises:
        ConfigError: It is not.
    """
    name = find_memory(given)
    if not is_database(name) and not Path(name).exists():
        raise ConfigError(f"There is no file {name}.", hint="Name one with --memory.")
    return open_store(name)


def open_store(name: str, *, map_id: str | None = None) -> MemoryStore:
    """Open a memory, which may have to be made yet.

    Args:
        name: A file, or the address of a PostgreSQL database.
        map_id: The map that the robot is on.

    Raises:
        ConfigError: The packages for the database are missing.
    """
    if not is_database(name):
        return SemanticMapStore(Path(name), map_id=map_id, looking=threading.Lock())
    try:
        from mapspeak.memory.postgres import PostgresStore, shown_address  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise ConfigError(
            "A memory in PostgreSQL needs packages that are missing.", hint=say_install("postgres")
        ) from error
    stem = shown_address(name).removeprefix("postgresql://")
    return PostgresStore(name, path=usual_memory(data_folder(), "", stem), map_id=map_id)


def read_places(store: MemoryStore) -> SemanticMap:
    """Read all places, and report oddities of the file on stderr."""
    places = store.read().present()
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


def keep_usual_memory(folder: Path, map_name: str, robot: str, *, address: str) -> str:
    """Return a served robot's own file, moved there from where older versions had it.

    Args:
        address: The robot's whole address, by which they named it.
    """
    path = usual_memory(folder, map_name, robot)
    rename_memory(usual_memory(folder, map_name, address), path)
    return str(path)


def rename_memory(old: Path, new: Path) -> None:
    """Move a memory that was named by the whole address of its robot, which may hold a password.

    Args:
        old: The file as it was named once.
        new: The file as it is named today.
    """
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
    """Write to a file, or to stdout.

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
