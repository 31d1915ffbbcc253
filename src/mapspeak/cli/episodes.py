"""`mapspeak memory episodes`: what was observed, when, from where; and which memory is meant."""

import json
import re
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mapspeak.cli.options import data_folder, usual_modes, wall_clock
from mapspeak.errors import ConfigError
from mapspeak.installation import say_install

if TYPE_CHECKING:
    from mapspeak.memory import MemoryStore, SemanticMap
    from mapspeak.memory.episodes.observation import EpisodeMatch, EpisodeQuery, Rank
    from mapspeak.memory.episodes.store import EpisodeStore


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


def open_memory(given: str | None) -> "MemoryStore":
    """Open a memory that is there.

    Raises:
        ConfigError: It is not.
    """
    name = find_memory(given)
    if not is_database(name) and not Path(name).exists():
        raise ConfigError(f"There is no file {name}.", hint="Name one with --memory.")
    return open_store(name)


def open_store(name: str, *, map_id: str | None = None) -> "MemoryStore":
    """Open a memory, which may have to be made yet.

    Args:
        name: A file, or the address of a PostgreSQL database.
        map_id: The map that the robot is on.

    Raises:
        ConfigError: The packages for the database are missing.
    """
    if not is_database(name):
        from mapspeak.memory import SemanticMapStore  # noqa: PLC0415 - heavy; help must be quick

        return SemanticMapStore(Path(name), map_id=map_id)
    try:
        from mapspeak.memory.postgres import (  # noqa: PLC0415 - an extra, and heavy
            PostgresStore,
            shown_address,
        )
    except ImportError as error:
        raise ConfigError(
            "A memory in PostgreSQL needs packages that are missing.", hint=say_install("postgres")
        ) from error
    stem = shown_address(name).removeprefix("postgresql://")
    return PostgresStore(name, path=usual_memory(data_folder(), "", stem), map_id=map_id)


def is_database(name: str) -> bool:
    """Return True for the address of a database, False for a file."""
    return name.startswith(("postgresql://", "postgres://"))


def read_places(store: "MemoryStore") -> "SemanticMap":
    """Read all places, and say on stderr what is odd about the file."""
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
    from mapspeak.memory.episodes.store import memory_folder  # noqa: PLC0415 - heavy

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


_AGE = re.compile(r"(\d+(?:\.\d+)?)(m|h|d)")
_CLOCK = re.compile(r"(\d{1,2}):(\d\d)")
_UNITS = {"m": "minutes", "h": "hours", "d": "days"}
ORDERS = ("newest", "oldest", "best", "nearest")
KINDS = ("picture", "record", "note")


def read_time(text: str) -> datetime:
    """Return a moment, in the zone of this machine where none is said."""
    try:
        if age := _AGE.fullmatch(text):
            return wall_clock() - timedelta(**{_UNITS[age[2]]: float(age[1])})
        if clock := _CLOCK.fullmatch(text):
            hour, minute = int(clock[1]), int(clock[2])
            return wall_clock().replace(hour=hour, minute=minute, second=0, microsecond=0)
        time = datetime.fromisoformat(text)
    except (ValueError, OverflowError) as error:
        said = f"{text!r} is no time: write 2026-11-20, 2026-11-20T09:30, 09:30 or 2h."
        raise click.BadParameter(said) from error
    return time if time.tzinfo else time.astimezone()


def read_place(text: str) -> tuple[float, ...]:
    """Return x and y in metres of the map frame, and the radius in metres where it is said."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in (2, 3):
        said = f"{text!r} is no place: write x,y or x,y,radius in metres, as 4.2,-1,3."
        raise click.BadParameter(said)
    return numbers


@click.command()
@click.option("--words", help="What it is about.")
@click.option(
    "--near", type=read_place, metavar="X,Y[,RADIUS]", help="Around a place of the map, in metres."
)
@click.option(
    "--near-words",
    help="Around where this was seen, and without it; in the same span of time.",
)
@click.option("--room", help="Made in this room or corridor.")
@click.option(
    "--since", type=read_time, metavar="TIME", help="A date, a time, or an age such as 90m, 2h, 3d."
)
@click.option("--until", type=read_time, metavar="TIME", help="Likewise.")
@click.option("--label", help="A thing seen.")
@click.option("--kind", type=click.Choice(KINDS))
@click.option("--order", type=click.Choice(ORDERS), help="Follows from the rest if left away.")
@click.option("--limit", type=click.IntRange(1, 1000), default=20, show_default=True)
@click.option("--offset", type=click.IntRange(min=0), default=0, show_default=True)
@MEMORY_OPTION
@JSON_OPTION
def episodes(semantic_map: str | None, as_json: bool, **asked: Any) -> None:  # noqa: ANN401, FBT001 - click's options
    """List observations that pass every filter, each with the reason why."""
    from mapspeak.memory.episodes.store import EpisodeStore, memory_folder  # noqa: PLC0415 - heavy

    store = EpisodeStore(memory_folder(open_memory(semantic_map).path))
    query = _query(**asked)
    page = store.find(query, rank=_rank(store) if asked["words"] or asked["near_words"] else None)
    if as_json:
        rows = [_facts(match, store) for match in page.matches]
        found = {"n_matches": page.n_matches, "matches": rows}
        click.echo(json.dumps(found, ensure_ascii=False, indent=2))
        return
    if page.anchor is not None:
        click.echo(f"Near to: {_line(page.anchor)}")
    for match in page.matches:
        click.echo(_line(match))
    more = "" if page.next_page is None else f"; more with --offset {page.next_page.offset}"
    click.echo(f"{len(page.matches)} of {page.n_matches} observations{more}.")


def _query(
    *,
    near: tuple[float, ...] | None,
    near_words: str | None,
    room: str | None,
    kind: str | None,
    order: str | None,
    **same: Any,  # noqa: ANN401 - what a query calls as the command line does
) -> "EpisodeQuery":
    from mapspeak.geometry import Point  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.memory.episodes.observation import (  # noqa: PLC0415
        EpisodeOrder,
        EpisodeQuery,
        ObservationKind,
    )

    if near is not None and near_words is not None:
        raise click.UsageError("Give --near or --near-words, not both.")
    place: Point | EpisodeQuery | None = None if near is None else Point(near[0], near[1])
    if near_words is not None:
        place = EpisodeQuery(words=near_words, since=same["since"], until=same["until"])
    return EpisodeQuery(
        near=place,
        radius_m=near[2] if near is not None and len(near) == 3 else None,
        room_id=room,
        kind=None if kind is None else ObservationKind(kind),
        order=None if order is None else EpisodeOrder(order),
        **same,
    )


def _rank(store: "EpisodeStore") -> "Rank | None":
    """Compare meanings where a model is installed; else words are compared."""
    from mapspeak.memory.episodes.textindex import (  # noqa: PLC0415 - heavy; help must be quick
        VectorRank,
    )
    from mapspeak.memory.search.meaningindex import find_model  # noqa: PLC0415

    model = find_model()
    return None if model is None else VectorRank(store.database, model)


def _line(match: "EpisodeMatch") -> str:
    from mapspeak.server.text.memory import say_reasons  # noqa: PLC0415 - heavy

    seen, reasons = match.observation, "; ".join(say_reasons(match))
    said = seen.text.replace("\n", " ") or ", ".join(seen.labels)
    parts = (
        f"{seen.recorded_at:%Y-%m-%d %H:%M:%S}",
        f"({seen.pose.x:.2f}, {seen.pose.y:.2f})",
        seen.room_id or "",
        str(seen.kind),
        said,
        seen.picture or "",
        f"[{reasons}]" if reasons else "",
    )
    return "  ".join(filter(None, parts))


def _facts(match: "EpisodeMatch", store: "EpisodeStore") -> dict[str, object]:
    from mapspeak.server.text.memory import say_reasons  # noqa: PLC0415 - heavy

    seen = match.observation
    path = store.picture_path(seen)
    return {
        "id": seen.id,
        "recorded_at": seen.recorded_at.isoformat(),
        "stamp_s": seen.stamp_s,
        "map": seen.map_id,
        "x_m": seen.pose.x,
        "y_m": seen.pose.y,
        "yaw_deg": seen.pose.yaw_deg,
        "room": seen.room_id,
        "kind": str(seen.kind),
        "text": seen.text,
        "labels": list(seen.labels),
        "picture": None if path is None else str(path),
        "score": match.score_ratio,
        "distance_m": match.distance_m,
        "reasons": say_reasons(match),
    }
