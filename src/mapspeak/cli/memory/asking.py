"""`mapspeak memory find` and `check`: what words may mean, and what can be true on a map."""

import json
import sys
from pathlib import Path

import click

from mapspeak.cli.memory.choosing import JSON_OPTION, MEMORY_OPTION, open_memory, read_places
from mapspeak.cli.shared.options import FILE
from mapspeak.installation import say_install
from mapspeak.memory import SemanticMap
from mapspeak.memory.consistency.checking import check_memory
from mapspeak.memory.episodes.store import memory_folder
from mapspeak.memory.search.answer import EntryCandidate, Verdict, list_entries
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.meaningindex import TextVectors, find_model
from mapspeak.memory.things.finding import find_things
from mapspeak.server.text.findings import say_finding
from mapspeak.spatial.mapfiles import load_map
from mapspeak.spatial.rooms import find_rooms


@click.command()
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


@click.command()
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


def _findings(places: SemanticMap, map_file: Path) -> list[dict[str, object]]:

    grid = load_map(map_file).grid
    found = find_things(places, grid)
    findings = check_memory(places, found, rooms=find_rooms(grid))
    return [
        {"kind": str(each.kind), "sentence": say_finding(each), "waypoints": list(each.waypoints)}
        for each in findings
    ]


def _candidate(candidate: EntryCandidate) -> dict[str, object]:
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
