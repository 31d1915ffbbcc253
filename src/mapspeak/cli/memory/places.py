"""`mapspeak memory`: the remembered places without a robot, also for other programs and people."""

import difflib
import json
import sys
from pathlib import Path

import click

from mapspeak.cli.memory.choosing import (
    JSON_OPTION,
    MEMORY_OPTION,
    find_memory,
    open_memory,
    open_store,
    read_places,
    write_out,
)
from mapspeak.cli.shared.options import ANCHOR_OPTION, FILE
from mapspeak.errors import ConfigError, SemanticMapError, say_cause
from mapspeak.installation import shell_command
from mapspeak.memory import SemanticMap, Waypoint
from mapspeak.memory.exchange.copying import copy_memory
from mapspeak.memory.exchange.geojson import facts_of, from_geojson, place_of, to_geojson
from mapspeak.memory.exchange.uniting import Union, merge_files, merge_into
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.store import forgetting
from mapspeak.server.text.recall import say_forgotten
from mapspeak.spatial.areagraph import MapAnchor


@click.command()
@click.option("--out", type=FILE, help="The file, such as hall.geojson; stdout without.")
@ANCHOR_OPTION
@MEMORY_OPTION
def export(out: Path | None, anchor: MapAnchor | None, semantic_map: str | None) -> None:
    """Write the places as GeoJSON."""
    if out is not None and out.suffix.lower() not in (".geojson", ".json"):
        raise ConfigError(f"--out {out} is no GeoJSON file.", hint="End its name in .geojson.")
    places = read_places(open_memory(semantic_map))
    is_known = [places.frames.bring(each, None) is not None for each in places.waypoints]
    n_left = 0 if anchor is None else is_known.count(False)
    write_out(to_geojson(places, anchor=anchor), out)
    if n_left:
        click.echo(f"{n_left} places of other maps are left out: nothing tells where.", err=True)
    if out is not None:
        click.echo(f"{len(places.waypoints) - n_left} places written to {out}.")


@click.command("import")
@click.argument("file", type=FILE)
@MEMORY_OPTION
def import_(file: Path, semantic_map: str | None) -> None:
    """Join exported, perhaps edited GeoJSON into the semantic map file: all of it or nothing."""
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeError) as error:
        raise ConfigError(
            f"{file} cannot be read: {say_cause(error)}.", hint="Check its path."
        ) from error
    store = open_store(find_memory(semantic_map))
    _tell(merge_into(store, from_geojson(text)), store.path)


@click.command()
@click.argument("first", type=FILE)
@click.argument("second", type=FILE)
@click.option("--out", type=FILE, required=True, help="The new file; must not be there yet.")
def merge(first: Path, second: Path, out: Path) -> None:
    """Join two semantic map files of one map, and their observations, into a new one."""
    union, came = merge_files(first, second, out=out)
    _tell(union, out)
    click.echo(f"{came.n_observations} observations and {came.n_pictures} pictures came along.")


@click.command()
@click.argument("source")
@click.argument("target")
def copy(source: str, target: str) -> None:
    """Copy a memory's places, events and frames into an empty one.

    SOURCE and TARGET are files or postgresql:// addresses.
    """
    copied = copy_memory(open_memory(source), open_store(target))
    click.echo(
        f"{copied.n_places} places, {copied.n_events} events and {copied.n_frames} frames copied."
    )


@click.command()
@click.argument("name", nargs=-1, required=True)
@click.option("--undo", is_flag=True, help="Remember it again.")
@MEMORY_OPTION
def forget(name: tuple[str, ...], undo: bool, semantic_map: str | None) -> None:  # noqa: FBT001 - a flag
    """Forget the place NAME, or every landmark of that label; kept in the file as `gone`."""
    store, words = open_memory(semantic_map), " ".join(name)
    if undo:
        done = forgetting.restore(store, words)
    elif store.read().present().find_waypoint(words) is not None:
        done = forgetting.forget_place(store, words)
    else:
        done = forgetting.forget_label(store, words)
    click.echo(say_forgotten(done, words, is_undo=undo))
    sys.exit(0 if done.places or done.n_landmarks else 1)


def _tell(union: Union, path: Path) -> None:
    for finding in union.findings:
        click.echo(finding)
    n_changed, n_all = len(union.changed), len(union.places.waypoints)
    click.echo(f"{n_changed} places new or changed, {n_all} in {path}.")


@click.command("list")
@MEMORY_OPTION
@JSON_OPTION
def list_(semantic_map: str | None, as_json: bool) -> None:  # noqa: FBT001 - a flag
    """List all places."""
    places = read_places(open_memory(semantic_map))
    if as_json:
        click.echo(json.dumps(_facts_of(places), ensure_ascii=False, indent=2))
        return
    for place in places.waypoints:
        click.echo(_line(place))
    click.echo(f"{len(places.waypoints)} places on the map {places.map_id or 'that nobody named'}.")


@click.command()
@click.argument("name", nargs=-1, required=True)
@MEMORY_OPTION
@JSON_OPTION
def show(name: tuple[str, ...], semantic_map: str | None, as_json: bool) -> None:  # noqa: FBT001 - a flag
    """Show all that is known of the place NAME."""
    facts = _facts(_named(" ".join(name), read_places(open_memory(semantic_map))))
    if as_json:
        click.echo(json.dumps(facts, ensure_ascii=False, indent=2))
        return
    for key, value in facts.items():
        items = value if isinstance(value, list) else []
        # Lines of one text are set in, so that none reads like another fact.
        said = str(value).replace("\n", "\n  ")
        click.echo(f"{key}:" if items else f"{key}: {said}")
        for item in items:
            parts = item if isinstance(item, dict) else {"": item}
            click.echo("  - " + ", ".join(f"{k}: {v}".removeprefix(": ") for k, v in parts.items()))


def _named(name: str, places: SemanticMap) -> Waypoint:

    place = places.find_waypoint(name)
    if place is None:
        names = [each.name for each in places.waypoints]
        near = ", ".join(map(quote_name, difflib.get_close_matches(name, names, cutoff=0.5)))
        hint = f"Near to it: {near}." if near else f"See `{shell_command('memory list')}`."
        raise SemanticMapError(f"No place is called {quote_name(name)}.", hint=hint)
    return place


def _line(place: Waypoint) -> str:
    pose = place.pose
    seen = ", ".join(landmark.label for landmark in place.landmarks)
    parts = (
        f"{place.name}  ({pose.x:.2f}, {pose.y:.2f}) m, {pose.yaw_deg:.0f} deg",
        place.room_id or "",
        "" if place.recorded_at is None else f"{place.recorded_at:%Y-%m-%d %H:%M}",
        seen,
    )
    return "  ".join(filter(None, parts))


def _facts_of(places: SemanticMap) -> dict[str, object]:
    return {"map": places.map_id, "waypoints": [_facts(place) for place in places.waypoints]}


def _facts(place: Waypoint) -> dict[str, object]:

    point, facts = place_of(place), facts_of(place)
    return {"name": facts.pop("name"), "x_m": point.x, "y_m": point.y} | facts
