"""Area graphs as JSON of their own, and as GeoJSON (RFC 7946); the fields of all their files.

Without an anchor, GeoJSON's coordinates are metres in the map frame, which RFC 7946 knows only as
"prior arrangement": the member `mapspeak` says so. With one they are longitude and latitude.
"""

import json
import math
from collections.abc import Callable
from functools import partial
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.graph import (
    Area,
    AreaGraph,
    LatLon,
    MapAnchor,
    Passage,
    Polygon,
    signed_area_m2,
)
from mapspeak.spatial.rooms import Door, Region, RoomClass

FILE_VERSION = 1

Facts = dict[str, object]
Position = tuple[FiniteFloat, FiniteFloat]
RingPositions = Annotated[list[Position], Field(min_length=4)]
PolygonPositions = Annotated[list[RingPositions], Field(min_length=1)]
"""The outer ring first, then the holes: as RFC 7946 has it."""

PointOf = Callable[[Position], Point]
PositionOf = Callable[[Point], tuple[float, float]]


class GraphRecord(BaseModel):
    """A part of a file; what it does not know is left aside."""

    model_config = ConfigDict(frozen=True)


class AreaRecord(GraphRecord):
    """What files hold of an area: metres and radians in the map frame, but for its outlines."""

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
    polygons: list[PolygonPositions]

    def to_area(self, point_of: PointOf) -> Area:
        """Return the area again."""
        region = Region(
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
        polygons = tuple(_polygon_from(rings, point_of) for rings in self.polygons)
        return Area(region=region, polygons=polygons, text=self.reason)


class PassageRecord(GraphRecord):
    """What files hold of a passage: metres in the map frame, but for its line."""

    id: str
    at: Position
    width_m: FiniteFloat
    joins: tuple[str, str]
    line: tuple[Position, Position] | None

    def to_passage(self, point_of: PointOf) -> Passage:
        """Return the passage again."""
        door = Door(id=self.id, place=Point(*self.at), width_m=self.width_m, region_ids=self.joins)
        line = None if self.line is None else (point_of(self.line[0]), point_of(self.line[1]))
        return Passage(door=door, line=line)


def facts_of_area(area: Area) -> Facts:
    """Return the fields of an area, but its outlines, under their names in files."""
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


def facts_of_door(door: Door) -> Facts:
    """Return the fields of a door under their names in files."""
    return {
        "id": door.id,
        "at": position_of(door.place),
        "width_m": float(door.width_m),
        "joins": list(door.region_ids),
    }


def position_of(point: Point) -> tuple[float, float]:
    """Return x and y as files list them."""
    return float(point.x), float(point.y)


def refusal_of(error: ValidationError, form: str) -> MapError:
    """Return the first fault that was found in a file, with its place."""
    fault = error.errors()[0]
    place = ".".join(map(str, fault["loc"])) or "the whole of it"
    return MapError(
        f"This is no area graph as {form}: at {place!a}: {fault['msg']}.",
        hint=f"Write it anew with `{shell_command('map')}`, or mend that place.",
    )


def _polygon_from(rings: list[list[Position]], point_of: PointOf) -> Polygon:
    """Return a polygon from rings that may run either way round, as other programs leave them."""
    outer, *holes = (tuple(point_of(each) for each in ring) for ring in rings)
    return Polygon(
        outer=outer if signed_area_m2(outer) > 0 else outer[::-1],
        holes=tuple(hole if signed_area_m2(hole) < 0 else hole[::-1] for hole in holes),
    )


class _Document(GraphRecord):
    format: Literal["mapspeak area graph"]
    version: Literal[1]
    name: str
    areas: list[AreaRecord]
    passages: list[PassageRecord]


def to_json(graph: AreaGraph) -> str:
    """Return the area graph as JSON, with one line for each area and passage."""
    areas = [
        facts_of_area(area) | {"polygons": _polygon_positions(area, position_of)}
        for area in graph.areas
    ]
    passages = [
        facts_of_door(passage.door)
        | {"line": None if passage.line is None else [position_of(end) for end in passage.line]}
        for passage in graph.passages
    ]
    head = {"format": "mapspeak area graph", "version": FILE_VERSION, "frame": "map"}
    return _compose(head | {"name": graph.name}, areas=areas, passages=passages)


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
        areas=tuple(area.to_area(_point_at) for area in document.areas),
        passages=tuple(passage.to_passage(_point_at) for passage in document.passages),
    )


class _Anchor(GraphRecord):
    lat_deg: FiniteFloat
    lon_deg: FiniteFloat
    yaw_deg: FiniteFloat


class _Member(GraphRecord):
    version: Literal[1]
    name: str
    anchor: _Anchor | None


class _Geometry(GraphRecord):
    type: Literal["Polygon", "MultiPolygon", "LineString", "Point"]
    coordinates: list[object]


class _Feature(GraphRecord):
    type: Literal["Feature"]
    geometry: _Geometry | None
    properties: Facts

    def to_facts(self) -> Facts:
        """Return the fields with the outlines, or the line, still to be checked."""
        has = {} if self.geometry is None else {self.geometry.type: self.geometry.coordinates}
        polygons = [has["Polygon"]] if "Polygon" in has else has.get("MultiPolygon", [])
        return self.properties | {"polygons": polygons, "line": has.get("LineString")}


class _Collection(GraphRecord):
    type: Literal["FeatureCollection"]
    mapspeak: _Member
    features: list[_Feature]


def to_geojson(graph: AreaGraph, *, anchor: MapAnchor | None = None) -> str:
    """Return the area graph as GeoJSON.

    Args:
        anchor: Where on Earth the map lies; without one, coordinates are metres in the map frame.

    Raises:
        MapError: The map reaches too far from its anchor.
    """
    member: Facts = {"version": FILE_VERSION, "name": graph.name}
    if anchor is None:
        position: PositionOf = position_of
        member |= {"coordinates": "x and y in metres, in the map frame", "anchor": None}
    else:
        position = partial(_lon_lat_of, anchor=anchor)
        on_earth = {"lat_deg": anchor.lat_deg, "lon_deg": anchor.lon_deg, "yaw_deg": anchor.yaw_deg}
        member |= {"coordinates": "longitude and latitude of WGS 84, in degrees"}
        member |= {"anchor": on_earth}
    features = [_area_feature(area, position) for area in graph.areas]
    features += [_passage_feature(passage, position) for passage in graph.passages]
    return _compose({"type": "FeatureCollection", "mapspeak": member}, features=features)


def from_geojson(text: str) -> AreaGraph:
    """Read the area graph that `to_geojson` wrote, back to metres in the map frame.

    Raises:
        MapError: It is not GeoJSON, or no area graph.
    """
    areas, passages = [], []
    try:
        collection = _Collection.model_validate_json(text)
        for feature in collection.features:
            facts = feature.to_facts()
            if facts.get("feature") == "passage":
                passages.append(PassageRecord.model_validate(facts))
            else:
                areas.append(AreaRecord.model_validate(facts))
    except ValidationError as error:
        raise refusal_of(error, "GeoJSON") from error
    point_of = _point_at if (place := collection.mapspeak.anchor) is None else _point_on(place)
    return AreaGraph(
        name=collection.mapspeak.name,
        areas=tuple(area.to_area(point_of) for area in areas),
        passages=tuple(passage.to_passage(point_of) for passage in passages),
    )


def _lon_lat_of(point: Point, *, anchor: MapAnchor) -> tuple[float, float]:
    place = anchor.locate(point)
    return place.lon_deg, place.lat_deg


def _point_at(position: Position) -> Point:
    return Point(*position)


def _point_on(place: _Anchor) -> PointOf:
    yaw_rad = math.radians(place.yaw_deg)
    anchor = MapAnchor(lat_deg=place.lat_deg, lon_deg=place.lon_deg, yaw_rad=yaw_rad)
    return lambda position: anchor.point_at(LatLon(lat_deg=position[1], lon_deg=position[0]))


def _area_feature(area: Area, position: PositionOf) -> Facts:
    polygons = _polygon_positions(area, position)
    geometry: object = None
    if polygons:
        is_one = len(polygons) == 1
        coordinates = polygons[0] if is_one else polygons
        geometry = {"type": "Polygon" if is_one else "MultiPolygon", "coordinates": coordinates}
    return _feature(geometry, {"feature": "area"} | facts_of_area(area))


def _passage_feature(passage: Passage, position: PositionOf) -> Facts:
    geometry: Facts = {"type": "Point", "coordinates": position(passage.door.place)}
    if passage.line is not None:
        geometry = {"type": "LineString", "coordinates": [position(end) for end in passage.line]}
    return _feature(geometry, {"feature": "passage"} | facts_of_door(passage.door))


def _feature(geometry: object, properties: Facts) -> Facts:
    name = properties["id"]
    return {"type": "Feature", "id": name, "geometry": geometry, "properties": properties}


def _polygon_positions(area: Area, position: PositionOf) -> list[object]:
    return [
        [[position(point) for point in ring] for ring in polygon.rings] for polygon in area.polygons
    ]


def _compose(head: Facts, **lists: list[Facts]) -> str:
    """Return a JSON object whose long lists have one entry a line, for people and for diffs."""
    parts = [f"{_dump(key)}: {_dump(value)}" for key, value in head.items()]
    for key, entries in lists.items():
        lines = ",\n".join(f"  {_dump(entry)}" for entry in entries)
        parts.append(f"{_dump(key)}: [\n{lines}\n]" if lines else f"{_dump(key)}: []")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _dump(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
