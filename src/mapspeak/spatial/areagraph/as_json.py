"""The area graph as JSON of its own: everything in metres in the map frame."""

import json
from typing import Literal

from pydantic import ValidationError

from mapspeak.geometry import Point
from mapspeak.spatial.areagraph.graph import Area, AreaGraph, Passage
from mapspeak.spatial.areagraph.records import (
    FILE_VERSION,
    AreaRecord,
    PassageRecord,
    PolygonPositions,
    Position,
    Record,
    polygon_from,
    position_of,
    refusal_of,
)

FORMAT = "mapspeak area graph"


class _Area(AreaRecord):
    polygons: list[PolygonPositions]

    def to_area(self) -> Area:
        polygons = tuple(
            polygon_from([tuple(Point(*each) for each in ring) for ring in rings])
            for rings in self.polygons
        )
        return Area(region=self.to_region(), polygons=polygons)


class _Passage(PassageRecord):
    line: tuple[Position, Position] | None

    def to_passage(self) -> Passage:
        line = None if self.line is None else (Point(*self.line[0]), Point(*self.line[1]))
        return Passage(door=self.to_door(), line=line)


class _Document(Record):
    format: Literal["mapspeak area graph"]
    version: Literal[1]
    name: str
    areas: list[_Area]
    passages: list[_Passage]


def to_json(graph: AreaGraph) -> str:
    """Gives the area graph as JSON, with one line for each area and passage."""
    areas = [
        AreaRecord.facts_of(area.region)
        | {"polygons": [[_positions(ring) for ring in each.rings] for each in area.polygons]}
        for area in graph.areas
    ]
    passages = [
        PassageRecord.facts_of(passage.door)
        | {"line": None if passage.line is None else _positions(passage.line)}
        for passage in graph.passages
    ]
    head = {"format": FORMAT, "version": FILE_VERSION, "frame": "map", "name": graph.name}
    return compose(head, areas=areas, passages=passages)


def from_json(text: str) -> AreaGraph:
    """Reads the area graph that `to_json` wrote.

    Raises:
        MapError: It is not JSON, or no area graph.
    """
    try:
        document = _Document.model_validate_json(text)
    except ValidationError as error:
        raise refusal_of(error, "JSON") from error
    return AreaGraph(
        name=document.name,
        areas=tuple(area.to_area() for area in document.areas),
        passages=tuple(passage.to_passage() for passage in document.passages),
    )


def compose(head: dict[str, object], **lists: list[dict[str, object]]) -> str:
    """Gives a JSON object whose long lists have one entry a line, for people and for diffs."""
    parts = [f"{_dump(key)}: {_dump(value)}" for key, value in head.items()]
    for key, entries in lists.items():
        lines = ",\n".join(f"  {_dump(entry)}" for entry in entries)
        parts.append(f"{_dump(key)}: [\n{lines}\n]" if lines else f"{_dump(key)}: []")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _dump(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _positions(points: tuple[Point, ...]) -> list[tuple[float, float]]:
    return [position_of(point) for point in points]
