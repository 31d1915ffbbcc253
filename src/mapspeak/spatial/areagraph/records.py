"""Area graphs as JSON of their own, in one vocabulary for all files."""

import json
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.graph import Area, AreaGraph, Passage, Polygon, Ring, signed_area_m2
from mapspeak.spatial.rooms import Door, Region, RoomClass

FILE_VERSION = 1

Position = tuple[FiniteFloat, FiniteFloat]
RingPositions = Annotated[list[Position], Field(min_length=4)]
PolygonPositions = Annotated[list[RingPositions], Field(min_length=1)]
"""The outer ring first, then the holes: as RFC 7946 has it."""


class GraphRecord(BaseModel):
    """A part of a file; what it does not know is left aside."""

    model_config = ConfigDict(frozen=True)


class AreaRecord(GraphRecord):
    """What is known about an area besides its outline: metres and radians in the map frame."""

    id: str
    label: int
    kind: RoomClass
    reason: str
    floor_area_m2: FiniteFloat
    free_area_m2: FiniteFloat
    length_m: FiniteFloat
    width_m: FiniteFloat
    heading_rad: FiniteFloat
    centre: Position
    clearance_m: FiniteFloat
    doors: list[str]
    neighbours: list[str]

    @classmethod
    def facts_of(cls, area: Area) -> dict[str, object]:
        """Return the fields of an area under their names in files."""
        region = area.region
        return {
            "id": region.id,
            "label": region.index,
            "kind": str(region.room_class),
            "reason": area.text,
            "floor_area_m2": float(region.floor_area_m2),
            "free_area_m2": float(region.free_area_m2),
            "length_m": float(region.length_m),
            "width_m": float(region.width_m),
            "heading_rad": float(region.heading_rad),
            "centre": position_of(region.widest),
            "clearance_m": float(region.clearance_m),
            "doors": list(region.door_ids),
            "neighbours": list(region.neighbour_ids),
        }

    def to_region(self) -> Region:
        """Return the region again."""
        return Region(
            id=self.id,
            index=self.label,
            room_class=self.kind,
            free_area_m2=self.free_area_m2,
            floor_area_m2=self.floor_area_m2,
            length_m=self.length_m,
            width_m=self.width_m,
            heading_rad=self.heading_rad,
            widest=Point(*self.centre),
            clearance_m=self.clearance_m,
            door_ids=tuple(self.doors),
            neighbour_ids=tuple(self.neighbours),
        )


class PassageRecord(GraphRecord):
    """What is known about a passage besides its line: metres in the map frame."""

    id: str
    at: Position
    width_m: FiniteFloat
    joins: tuple[str, str]

    @classmethod
    def facts_of(cls, door: Door) -> dict[str, object]:
        """Return the fields of a door under their names in files."""
        return {
            "id": door.id,
            "at": position_of(door.place),
            "width_m": float(door.width_m),
            "joins": list(door.region_ids),
        }

    def to_door(self) -> Door:
        """Return the door again."""
        return Door(id=self.id, place=Point(*self.at), width_m=self.width_m, region_ids=self.joins)


def position_of(point: Point) -> tuple[float, float]:
    """Return x and y as files list them."""
    return float(point.x), float(point.y)


def polygon_from(rings: list[Ring]) -> Polygon:
    """Return a polygon from rings that may run either way round, as other programs leave them."""
    outer, *holes = rings
    return Polygon(
        outer=outer if signed_area_m2(outer) > 0 else outer[::-1],
        holes=tuple(hole if signed_area_m2(hole) < 0 else hole[::-1] for hole in holes),
    )


def refusal_of(error: ValidationError, form: str) -> MapError:
    """Return the first fault that was found in a file, with its place."""
    fault = error.errors()[0]
    place = ".".join(map(str, fault["loc"])) or "the whole of it"
    return MapError(
        f"This is no area graph as {form}: at {place!a}: {fault['msg']}.",
        hint=f"Write it anew with `{shell_command('map')}`, or mend that place.",
    )


FORMAT = "mapspeak area graph"


class _Area(AreaRecord):
    polygons: list[PolygonPositions]

    def to_area(self) -> Area:
        polygons = tuple(
            polygon_from([tuple(Point(*each) for each in ring) for ring in rings])
            for rings in self.polygons
        )
        return Area(region=self.to_region(), polygons=polygons, text=self.reason)


class _Passage(PassageRecord):
    line: tuple[Position, Position] | None

    def to_passage(self) -> Passage:
        line = None if self.line is None else (Point(*self.line[0]), Point(*self.line[1]))
        return Passage(door=self.to_door(), line=line)


class _Document(GraphRecord):
    format: Literal["mapspeak area graph"]
    version: Literal[1]
    name: str
    areas: list[_Area]
    passages: list[_Passage]


def to_json(graph: AreaGraph) -> str:
    """Return the area graph as JSON, with one line for each area and passage."""
    areas = [
        AreaRecord.facts_of(area)
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
    """Read the area graph that `to_json` wrote.

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
    """Return a JSON object whose long lists have one entry a line, for people and for diffs."""
    parts = [f"{_dump(key)}: {_dump(value)}" for key, value in head.items()]
    for key, entries in lists.items():
        lines = ",\n".join(f"  {_dump(entry)}" for entry in entries)
        parts.append(f"{_dump(key)}: [\n{lines}\n]" if lines else f"{_dump(key)}: []")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _dump(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _positions(points: tuple[Point, ...]) -> list[tuple[float, float]]:
    return [position_of(point) for point in points]
