"""`mapspeak memory episodes`, `find`, `check`: what was seen, what words mean, what can be true."""

import json
import math
import re
import sys
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import click

from mapspeak.cli.memory.choosing import JSON_OPTION, MEMORY_OPTION, open_memory, read_places
from mapspeak.cli.shared.options import FILE, wall_clock
from mapspeak.geometry import Point
from mapspeak.installation import say_install
from mapspeak.memory import SemanticMap
from mapspeak.memory.consistency.checking import check_memory
from mapspeak.memory.episodes.observation import (
    EpisodeMatch,
    EpisodeOrder,
    EpisodeQuery,
    ObservationKind,
    Rank,
)
from mapspeak.memory.episodes.store import EpisodeStore, memory_folder
from mapspeak.memory.episodes.textindex import VectorRank
from mapspeak.memory.search.answer import EntryCandidate, Verdict, list_entries
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.meaningindex import TextVectors, find_model
from mapspeak.memory.things.finding import find_things
from mapspeak.server.text.episodes import say_reasons
from mapspeak.server.text.findings import say_finding
from mapspeak.spatial.mapfiles import load_map
from mapspeak.spatial.rooms import find_rooms

_AGE = re.compile(r"(\d+(?:\.\d+)?)(m|h|d)")
_CLOCK = re.compile(r"(\d{1,2}):(\d\d)")
_UNITS = {"m": "minutes", "h": "hours", "d": "days"}


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
    if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
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
@click.option("--kind", type=click.Choice([str(each) for each in ObservationKind]))
@click.option(
    "--order",
    type=click.Choice([str(each) for each in EpisodeOrder]),
    help="Follows from the rest if left away.",
)
@click.option("--limit", type=click.IntRange(1, 1000), default=20, show_default=True)
@click.option("--offset", type=click.IntRange(min=0), default=0, show_default=True)
@MEMORY_OPTION
@JSON_OPTION
def episodes(semantic_map: str | None, as_json: bool, **asked: Any) -> None:  # noqa: ANN401, FBT001 - click's options
    """List observations that pass every filter, each with the reason why."""
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
    label: str | None,
    **same: Any,  # noqa: ANN401 - what a query calls as the command line does
) -> EpisodeQuery:
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
        labels=() if label is None else (label,),
        **same,
    )


def _rank(store: EpisodeStore) -> Rank | None:
    """Compare meanings where a model is installed; else words are compared."""
    model = find_model()
    return None if model is None else VectorRank(store.database, model)


def _line(match: EpisodeMatch) -> str:
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


def _facts(match: EpisodeMatch, store: EpisodeStore) -> dict[str, object]:
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
