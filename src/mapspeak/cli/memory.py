"""`mapspeak memory`: the remembered places without a robot, also for other programs and people."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mapspeak.cli.episodes import (
    JSON_OPTION,
    MEMORY_OPTION,
    episodes,
    find_memory,
    open_memory,
    open_store,
    read_places,
    write_out,
)
from mapspeak.cli.options import ANCHOR_OPTION, FILE
from mapspeak.errors import ConfigError, SemanticMapError, say_cause
from mapspeak.installation import say_install, shell_command

if TYPE_CHECKING:
    from mapspeak.memory import SemanticMap, Waypoint
    from mapspeak.memory.exchange.uniting import Union
    from mapspeak.memory.search.answer import EntryCandidate
    from mapspeak.spatial.areagraph import MapAnchor


@click.command()
@click.option("--out", type=FILE, help="The file, such as hall.geojson; stdout without.")
@ANCHOR_OPTION
@MEMORY_OPTION
def export(out: Path | None, anchor: "MapAnchor | None", semantic_map: str | None) -> None:
    """Write the places as GeoJSON."""
    from mapspeak.memory.exchange.geojson import (  # noqa: PLC0415 - heavy; help must be quick
        to_geojson,
    )

    if out is not None and out.suffix.lower() not in (".geojson", ".json"):
        raise ConfigError(f"--out {out} is no GeoJSON file.", hint="End its name in .geojson.")
    places = read_places(open_memory(semantic_map))
    write_out(to_geojson(places, anchor=anchor), out)
    if out is not None:
        click.echo(f"{len(places.waypoints)} places written to {out}.")


@click.command("import")
@click.argument("file", type=FILE)
@MEMORY_OPTION
def import_(file: Path, semantic_map: str | None) -> None:
    """Join exported, perhaps edited GeoJSON into the semantic map file: all of it or nothing."""
    from mapspeak.memory.exchange.geojson import (  # noqa: PLC0415 - heavy; help must be quick
        from_geojson,
    )
    from mapspeak.memory.exchange.uniting import merge_into  # noqa: PLC0415

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
    from mapspeak.memory.exchange.uniting import (  # noqa: PLC0415 - heavy; help must be quick
        merge_files,
    )

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
    from mapspeak.memory.exchange.copying import (  # noqa: PLC0415 - heavy; help must be quick
        copy_memory,
    )

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
    from mapspeak.memory.store import forgetting  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.server.text.recall import say_forgotten  # noqa: PLC0415 - likewise

    store, words = open_memory(semantic_map), " ".join(name)
    if undo:
        done = forgetting.restore(store, words)
    elif store.read().present().find_waypoint(words) is not None:
        done = forgetting.forget_place(store, words)
    else:
        done = forgetting.forget_label(store, words)
    click.echo(say_forgotten(done, words, is_undo=undo))
    sys.exit(0 if done.places or done.n_landmarks else 1)


def _tell(union: "Union", path: Path) -> None:
    for finding in union.findings:
        click.echo(finding)
    n_changed, n_all = len(union.changed), len(union.places.waypoints)
    click.echo(f"{n_changed} places new or changed, {n_all} in {path}.")


@click.group()
def memory() -> None:
    """Look at, check and share a memory of places: a semantic map file and its episodes."""


@memory.command("list")
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


@memory.command()
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


@memory.command()
@click.argument("words", nargs=-1, required=True)
@click.option("--limit", type=click.IntRange(1, 100), default=5, show_default=True)
@MEMORY_OPTION
@JSON_OPTION
def find(
    words: tuple[str, ...],
    limit: int,
    semantic_map: str | None,
    as_json: bool,  # noqa: FBT001 - a flag
) -> None:
    """Find the places and things that WORDS may mean.

    Ends with 1 when nothing of the kind is remembered.
    """
    from mapspeak.memory.episodes.store import (  # noqa: PLC0415 - heavy; help must be quick
        memory_folder,
    )
    from mapspeak.memory.search.answer import Verdict, list_entries  # noqa: PLC0415
    from mapspeak.memory.search.index import EntryIndex  # noqa: PLC0415
    from mapspeak.memory.search.meaningindex import TextVectors, find_model  # noqa: PLC0415

    store = open_memory(semantic_map)
    places = read_places(store)
    model = find_model()
    kept = memory_folder(store.path) / "vectors.npz"
    vectors = None if model is None else TextVectors(model, kept=kept)
    answer = EntryIndex(list_entries(places), vectors=vectors).find(" ".join(words), limit=limit)
    if vectors is not None:
        vectors.keep()
    if as_json:
        found = {
            "query": answer.query,
            "verdict": answer.verdict,
            "candidates": [_candidate(each) for each in answer.candidates],
        }
        click.echo(json.dumps(found, ensure_ascii=False, indent=2))
    else:
        click.echo(f"{answer.verdict.replace('_', ' ')}: {answer.understood}")
        for each in map(_candidate, answer.candidates):
            place = f" at {each['place']}" if each["place"] else ""
            click.echo(f"  {each['score']:.2f}  {each['name']}{place}: {each['text']}")
        if answer.limits:
            click.echo(f"{answer.limits} To change that: {say_install('semantic')}")
    sys.exit(1 if answer.verdict is Verdict.NOT_REMEMBERED else 0)


@memory.command()
@click.option("--map", "map_file", type=FILE, help="A map_server .yaml that the places are on.")
@MEMORY_OPTION
@JSON_OPTION
def check(map_file: Path | None, semantic_map: str | None, as_json: bool) -> None:  # noqa: FBT001 - a flag
    """Check the file, and with --map whether what it says can be true on that map.

    Ends with 0 when nothing is odd, with 1 when something is, with 2 when the file has a fault.
    """
    places = open_memory(semantic_map).read()
    findings: list[dict[str, object]] = [
        {"kind": "file", "sentence": text, "waypoints": []} for text in places.warnings
    ]
    if map_file is not None:
        findings += _findings(places, map_file)
    if as_json:
        click.echo(json.dumps(findings, ensure_ascii=False, indent=2))
    else:
        for finding in findings:
            click.echo(f"{finding['kind']}: {finding['sentence']}")
        on = "" if map_file is None else f" on {map_file}"
        n_findings = "1 finding" if len(findings) == 1 else f"{len(findings)} findings"
        n_places = "1 place" if len(places.waypoints) == 1 else f"{len(places.waypoints)} places"
        click.echo(f"{n_places} looked at{on}, {n_findings}.")
    sys.exit(1 if findings else 0)


for command in (copy, episodes, export, forget, import_, merge):
    memory.add_command(command)


def _findings(places: "SemanticMap", map_file: Path) -> list[dict[str, object]]:
    from mapspeak.memory.consistency.checking import (  # noqa: PLC0415 - heavy; help must be quick
        check_memory,
    )
    from mapspeak.memory.things.finding import find_things  # noqa: PLC0415
    from mapspeak.server.text.findings import say_finding  # noqa: PLC0415
    from mapspeak.spatial.mapfiles import load_map  # noqa: PLC0415
    from mapspeak.spatial.rooms import find_rooms  # noqa: PLC0415

    grid = load_map(map_file).grid
    found = find_things(places, grid)
    findings = check_memory(places, found, rooms=find_rooms(grid))
    return [
        {"kind": str(each.kind), "sentence": say_finding(each), "waypoints": list(each.waypoints)}
        for each in findings
    ]


def _named(name: str, places: "SemanticMap") -> "Waypoint":
    import difflib  # noqa: PLC0415 - only for a mistake

    from mapspeak.memory.quoting import quote_name  # noqa: PLC0415

    place = places.find_waypoint(name)
    if place is None:
        names = [each.name for each in places.waypoints]
        near = ", ".join(map(quote_name, difflib.get_close_matches(name, names, cutoff=0.5)))
        hint = f"Near to it: {near}." if near else f"See `{shell_command('memory list')}`."
        raise SemanticMapError(f"No place is called {quote_name(name)}.", hint=hint)
    return place


def _line(place: "Waypoint") -> str:
    pose = place.pose
    seen = ", ".join(landmark.label for landmark in place.landmarks)
    parts = (
        f"{place.name}  ({pose.x:.2f}, {pose.y:.2f}) m, {pose.yaw_deg:.0f} deg",
        place.room_id or "",
        "" if place.recorded_at is None else f"{place.recorded_at:%Y-%m-%d %H:%M}",
        seen,
    )
    return "  ".join(filter(None, parts))


def _facts_of(places: "SemanticMap") -> dict[str, object]:
    return {"map": places.map_id, "waypoints": [_facts(place) for place in places.waypoints]}


def _facts(place: "Waypoint") -> dict[str, object]:
    from mapspeak.memory.exchange.geojson import facts_of, place_of  # noqa: PLC0415 - heavy

    point, facts = place_of(place), facts_of(place)
    return {"name": facts.pop("name"), "x_m": point.x, "y_m": point.y} | facts


def _candidate(candidate: "EntryCandidate") -> dict[str, object]:
    entry = candidate.entry
    return {
        "name": entry.name,
        "kind": str(entry.kind),
        "place": entry.place,
        "score": round(candidate.score_ratio, 3),
        "field": str(candidate.field),
        "text": candidate.text,
        "words": [each.found_word for each in candidate.evidence],
    }
