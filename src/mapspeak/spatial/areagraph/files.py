"""Area graphs as files: JSON of our own, which is read back, GeoJSON (RFC 7946), and osmAG.

Without an anchor, GeoJSON's coordinates are metres in the map frame, which RFC 7946 knows only as
"prior arrangement": the member `mapspeak` says so. With one they are longitude and latitude.

osmAG is OpenStreetMap XML whose ways are areas and passages. The tags are those of the indoor
osmAG standard (2025) in its "semantic" variant, in which passages name the areas they join; Hou,
Feng, Zhang, Schwertfeger: "osmAG: Hierarchical Semantic Topometric Area Graph Maps in the OSM
Format for Mobile Robotics". Fields without an osmAG tag get tags that begin with `mapspeak:`.
"""

import itertools
import json
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, Field, FiniteFloat, ValidationError

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.graph import (
    DEGREE_DECIMALS,
    Area,
    AreaGraph,
    MapAnchor,
    Passage,
    Polygon,
    Ring,
)
from mapspeak.spatial.rooms import Door, Region, RoomClass

FILE_VERSION = 1

Facts = dict[str, object]
Position = tuple[FiniteFloat, FiniteFloat]
RingPositions = Annotated[list[Position], Field(min_length=4)]
PolygonPositions = Annotated[list[RingPositions], Field(min_length=1)]
"""The outer ring first, then the holes: as RFC 7946 has it."""

PositionOf = Callable[[Point], tuple[float, float]]


class AreaRecord(BaseModel):
    """An area as written in a file."""

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
    doors: tuple[str, ...]
    neighbours: tuple[str, ...]
    polygons: list[PolygonPositions]

    def to_area(self) -> Area:
        """Return the area of the polygon."""
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
            door_ids=self.doors,
            neighbour_ids=self.neighbours,
        )
        rings = ([tuple(Point(*each) for each in ring) for ring in part] for part in self.polygons)
        polygons = tuple(Polygon(outer=outer, holes=tuple(holes)) for outer, *holes in rings)
        return Area(region=region, polygons=polygons, text=self.reason)


class _PassageRecord(BaseModel):
    id: str
    at: Position
    width_m: FiniteFloat
    certainty: FiniteFloat = 1.0
    joins: tuple[str, str]
    line: tuple[Position, Position] | None

    def to_passage(self) -> Passage:
        door = Door(
            id=self.id,
            place=Point(*self.at),
            width_m=self.width_m,
            region_ids=self.joins,
            certainty=self.certainty,
        )
        line = None if self.line is None else (Point(*self.line[0]), Point(*self.line[1]))
        return Passage(door=door, line=line)


class _Document(BaseModel):
    format: Literal["mapspeak area graph"]
    version: Literal[1]
    name: str
    areas: list[AreaRecord]
    passages: list[_PassageRecord]


def to_json(graph: AreaGraph) -> str:
    """Return the area graph as JSON, with one line for each area and passage."""
    areas = [
        _facts_of_area(area) | {"polygons": _polygon_positions(area, _position_of)}
        for area in graph.areas
    ]
    passages = [
        _facts_of_door(passage.door)
        | {"line": None if passage.line is None else [_position_of(end) for end in passage.line]}
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
        fault = error.errors()[0]
        place = ".".join(map(str, fault["loc"])) or "the whole of it"
        raise MapError(
            f"This is no area graph as JSON: at {place!a}: {fault['msg']}.",
            hint=f"Write it anew with `{shell_command('map')}`, or mend that place.",
        ) from error
    return AreaGraph(
        name=document.name,
        areas=tuple(area.to_area() for area in document.areas),
        passages=tuple(passage.to_passage() for passage in document.passages),
    )


def to_geojson(graph: AreaGraph, *, anchor: MapAnchor | None = None) -> str:
    """Return the area graph as GeoJSON.

    Args:
        anchor: Where on Earth the map lies; without one, coordinates are metres in the map frame.

    Raises:
        MapError: The map reaches too far from its anchor.
    """
    position = _position_of
    member: Facts = {"version": FILE_VERSION, "name": graph.name}
    if anchor is None:
        member |= {"coordinates": "x and y in metres, in the map frame", "anchor": None}
    else:

        def position(point: Point) -> tuple[float, float]:
            place = anchor.locate(point)
            return place.lon_deg, place.lat_deg

        on_earth = {"lat_deg": anchor.lat_deg, "lon_deg": anchor.lon_deg, "yaw_deg": anchor.yaw_deg}
        member |= {"coordinates": "longitude and latitude of WGS 84, in degrees"}
        member |= {"anchor": on_earth}
    features = [_area_feature(area, position) for area in graph.areas]
    features += [_passage_feature(passage, position) for passage in graph.passages]
    return _compose({"type": "FeatureCollection", "mapspeak": member}, features=features)


def _facts_of_area(area: Area) -> Facts:
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
        "centre": _position_of(region.widest),
        "clearance_m": float(region.clearance_m),
        "doors": list(region.door_ids),
        "neighbours": list(region.neighbour_ids),
    }


def _facts_of_door(door: Door) -> Facts:
    return {
        "id": door.id,
        "at": _position_of(door.place),
        "width_m": float(door.width_m),
        "certainty": float(door.certainty),
        "joins": list(door.region_ids),
    }


def _position_of(point: Point) -> tuple[float, float]:
    return float(point.x), float(point.y)


def _polygon_positions(area: Area, position: PositionOf) -> list[object]:
    return [
        [[position(point) for point in ring] for ring in polygon.rings] for polygon in area.polygons
    ]


def _area_feature(area: Area, position: PositionOf) -> Facts:
    polygons = _polygon_positions(area, position)
    geometry: Facts | None = None
    if len(polygons) == 1:
        geometry = {"type": "Polygon", "coordinates": polygons[0]}
    elif polygons:
        geometry = {"type": "MultiPolygon", "coordinates": polygons}
    return _feature(geometry, {"feature": "area"} | _facts_of_area(area))


def _passage_feature(passage: Passage, position: PositionOf) -> Facts:
    geometry: Facts = {"type": "Point", "coordinates": position(passage.door.place)}
    if passage.line is not None:
        geometry = {"type": "LineString", "coordinates": [position(end) for end in passage.line]}
    return _feature(geometry, {"feature": "passage"} | _facts_of_door(passage.door))


def _feature(geometry: Facts | None, properties: Facts) -> Facts:
    name = properties["id"]
    return {"type": "Feature", "id": name, "geometry": geometry, "properties": properties}


def _compose(head: Facts, **lists: list[Facts]) -> str:
    """Return a JSON object whose long lists have one entry a line, for people and for diffs."""
    parts = [f"{_dump(key)}: {_dump(value)}" for key, value in head.items()]
    for key, entries in lists.items():
        lines = ",\n".join(f"  {_dump(entry)}" for entry in entries)
        parts.append(f"{_dump(key)}: [\n{lines}\n]" if lines else f"{_dump(key)}: []")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _dump(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


OWN = "mapspeak:"

Tags = Mapping[str, str]


def to_osm(graph: AreaGraph, *, anchor: MapAnchor | None = None) -> str:
    """Return the area graph as osmAG; in JOSM all elements are new, unknown to any server.

    Args:
        anchor: Where on Earth the map lies; without one, its (0, 0) is put at latitude 0,
            longitude 0.

    Raises:
        MapError: The map reaches too far from its anchor.
    """
    writer = _OsmWriter(graph.name, anchor or MapAnchor())
    for area in graph.areas:
        writer.add_area(area)
    for passage in graph.passages:
        writer.add_passage(passage)
    root = ET.Element("osm", version="0.6", generator="mapspeak")
    root.extend([*writer.nodes, *writer.ways, *writer.relations])
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n"


class _OsmWriter:
    """Assigns ids, one node per point, so that neighbours share their corners."""

    def __init__(self, name: str, anchor: MapAnchor) -> None:
        self.nodes: list[ET.Element] = []
        self.ways: list[ET.Element] = []
        self.relations: list[ET.Element] = []
        self._anchor = anchor
        self._ids = itertools.count(-1, -1)
        self._node_at: dict[Point, str] = {}
        own: Facts = {"version": FILE_VERSION, "map": name, "yaw_deg": anchor.yaw_deg}
        self._add_node(Point(0.0, 0.0), {"name": "root"} | _own_tags(own))

    def add_area(self, area: Area) -> None:
        """Add the outline as a way; further rings as ways that a multipolygon holds together."""
        region = area.region
        tags = {
            "indoor": "room",
            "level": "0",
            "name": area.id,
            "osmAG:type": "area",
            # osmAG treats an open space as a room.
            "osmAG:areaType": "corridor" if region.room_class is RoomClass.CORRIDOR else "room",
        } | _own_tags(_facts_of_area(area))
        if not area.polygons:
            self._add_node(region.widest, tags)
            return
        members: list[ET.Element] = []
        for polygon in area.polygons:
            for ring in polygon.rings:
                way = self._add_way(ring, {} if members else tags)
                role = "outer" if ring is polygon.outer else "inner"
                members.append(ET.Element("member", type="way", ref=way, role=role))
        if len(members) > 1:
            tags = {"type": "multipolygon", f"{OWN}area": area.id}
            self.relations.append(self._element("relation", tags, members))

    def add_passage(self, passage: Passage) -> None:
        """Add the line as a way of two nodes, or the door as a node when there is no line."""
        first, second = passage.door.region_ids
        tags = {
            "level": "0",
            "name": passage.id,
            "osmAG:type": "passage",
            "osmAG:from": first,
            "osmAG:to": second,
        } | _own_tags(_facts_of_door(passage.door))
        if passage.line is None:
            self._add_node(passage.door.place, tags)
        else:
            self._add_way(passage.line, tags)

    def _add_node(self, point: Point, tags: Tags) -> str:
        place = self._anchor.locate(point)
        node = self._element("node", tags)
        node.set("lat", f"{place.lat_deg:.{DEGREE_DECIMALS}f}")
        node.set("lon", f"{place.lon_deg:.{DEGREE_DECIMALS}f}")
        self.nodes.append(node)
        return node.attrib["id"]

    def _add_way(self, points: Ring, tags: Tags) -> str:
        for point in points:
            if point not in self._node_at:
                self._node_at[point] = self._add_node(point, {})
        refs = [ET.Element("nd", ref=self._node_at[point]) for point in points]
        way = self._element("way", tags, refs)
        self.ways.append(way)
        return way.attrib["id"]

    def _element(self, kind: str, tags: Tags, parts: Iterable[ET.Element] = ()) -> ET.Element:
        element = ET.Element(kind, id=str(next(self._ids)), action="modify", visible="true")
        element.extend(parts)
        element.extend(ET.Element("tag", k=key, v=text) for key, text in tags.items())
        return element


def _own_tags(facts: Facts) -> dict[str, str]:
    """Return facts as tags; id and join are osmAG's name, from and to."""
    tags = {}
    for key, value in facts.items():
        if key not in {"id", "joins"}:
            items = value if isinstance(value, list | tuple) else [value]
            tags[OWN + key] = ";".join(str(item) for item in items)
    return tags
