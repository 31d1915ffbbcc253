"""Memories in files: each format by its name, and two semantic map files as one."""

from collections.abc import Iterable
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

from mapspeak.errors import SemanticMapError
from mapspeak.memory.durable import DurableFile
from mapspeak.memory.episodes import BroughtOver, bring_over
from mapspeak.memory.events import Event
from mapspeak.memory.exchange.as_csv import from_csv, to_csv
from mapspeak.memory.exchange.as_geojson import from_geojson, to_geojson
from mapspeak.memory.exchange.as_osm import from_osm, to_osm
from mapspeak.memory.exchange.uniting import Union, unite
from mapspeak.memory.mapfile import (
    MapDocument,
    bound_to,
    parse_document,
    with_event,
    with_waypoint,
)
from mapspeak.memory.mapfile.store import SemanticMapStore
from mapspeak.memory.waypoint import SemanticMap, Waypoint
from mapspeak.spatial.areagraph import MapAnchor


class ExchangeFormat(StrEnum):
    """A format of other programs; its value is the ending of its files."""

    GEOJSON = "geojson"
    CSV = "csv"
    OSM = "osm"


def export_text(
    places: SemanticMap, form: ExchangeFormat, *, anchor: MapAnchor | None = None
) -> str:
    """Return a memory in another format.

    Args:
        places: What is written.
        form: How.
        anchor: Where on Earth the map lies, for the formats that can say it.

    Raises:
        SemanticMapError: The format has no place for an anchor.
        MapError: A place is too far from the anchor.
    """
    match form:
        case ExchangeFormat.GEOJSON:
            return to_geojson(places, anchor=anchor)
        case ExchangeFormat.OSM:
            return to_osm(places, anchor=anchor)
        case ExchangeFormat.CSV if anchor is None:
            return to_csv(places)
    message = "CSV has metres of the map alone, and no place for an anchor."
    raise SemanticMapError(message, hint="Leave the anchor away, or take geojson or osm.")


def import_text(text: str, form: ExchangeFormat) -> SemanticMap:
    """Read a memory that was exported.

    Raises:
        SemanticMapError: It is none in this format.
    """
    readers = {
        ExchangeFormat.GEOJSON: from_geojson,
        ExchangeFormat.OSM: from_osm,
        ExchangeFormat.CSV: from_csv,
    }
    return readers[form](text)


def merge_into(store: SemanticMapStore, second: SemanticMap) -> Union:
    """Join a memory into a semantic map file, all of it or nothing (see `unite`).

    Raises:
        SemanticMapError: The maps differ, or the file has a fault or cannot be written.
    """
    unions: list[Union] = []

    def change(document: MapDocument) -> MapDocument:
        unions.append(unite(document.to_map(), second))
        return _with_waypoints(document, unions[-1].changed, unions[-1].places.map_id)

    store.rewrite(change)
    return unions[-1]


def merge_files(first: Path, second: Path, *, out: Path) -> tuple[Union, BroughtOver]:
    """Write two semantic map files as one: the first with its comments, and what it lacks.

    Events of the second one get ids of their own; what is in both is there once. The observations
    of both come along, with their pictures.

    Raises:
        SemanticMapError: One cannot be read, the maps differ, or the new file is there already.
    """
    if out.exists():
        message = f"{out} is there already."
        raise SemanticMapError(message, hint="Name a file that is not, or remove it.")
    document, other = _read(first), _read(second)
    union = unite(document.to_map(), other.to_map())
    # All that the first file says besides places stays: comments, people's own keys.
    whole = _with_waypoints(document, union.changed, union.places.map_id)
    whole = _with_events(whole, [record.event for record in other.events.values()])
    # First, so that no file says what its observations lack.
    came = bring_over(first, second, to=out)
    SemanticMapStore(out).rewrite(lambda _: whole)
    return union, came


def _with_events(document: MapDocument, events: Iterable[Event]) -> MapDocument:
    """Add the events that are not there, whatever their ids are: those are given anew."""
    for event in events:
        nameless = replace(event, id="")
        if nameless not in (replace(each.event, id="") for each in document.events.values()):
            document, _ = with_event(document, nameless)
    return document


def _with_waypoints(
    document: MapDocument, places: Iterable[Waypoint], map_id: str | None
) -> MapDocument:
    if document.map_id is None and map_id is not None:
        document = bound_to(document, map_id)
    for place in places:
        document = with_waypoint(document, place)
    return document


def _read(path: Path) -> MapDocument:
    content, fingerprint = DurableFile(path, lock_timeout_s=0.0).read()
    if fingerprint is None:
        message = f"There is no file {path}."
        raise SemanticMapError(message, hint="Name a semantic map file, such as places.yaml.")
    return parse_document(content, source=str(path))
