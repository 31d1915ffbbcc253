"""The area graph as osmAG: an OpenStreetMap file whose ways are areas and passages.

The tags are those of the indoor osmAG standard (2025) in its "semantic" variant, in which passages
name the areas they join; Hou, Feng, Zhang, Schwertfeger: "osmAG: Hierarchical Semantic Topometric
Area Graph Maps in the OSM Format for Mobile Robotics". What osmAG has no word for stands in tags
that begin with `mapspeak:`.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

from pydantic import FiniteFloat, ValidationError

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.anchor import MapAnchor
from mapspeak.spatial.areagraph.geojson import from_geojson
from mapspeak.spatial.areagraph.graph import Area, AreaGraph, Line, Passage, Polygon, Ring
from mapspeak.spatial.areagraph.osm_xml import (
    OsmDocument,
    OsmElement,
    OsmMember,
    read_osm_xml,
    write_osm_xml,
)
from mapspeak.spatial.areagraph.records import (
    FILE_VERSION,
    AreaRecord,
    GraphRecord,
    PassageRecord,
    from_json,
    polygon_from,
    refusal_of,
)
from mapspeak.spatial.rooms import RoomClass

OWN = "mapspeak:"
AREA_TYPES = {
    RoomClass.ROOM: "room",
    RoomClass.CORRIDOR: "corridor",
    RoomClass.OPEN_SPACE: "room",
}
LISTS = {"doors", "neighbours", "joins", "centre", "at"}
LEVEL = "0"

Tags = Mapping[str, str]


class _Root(GraphRecord):
    """The node at the map frame's (0, 0)."""

    version: int
    map: str
    yaw_deg: FiniteFloat


def to_osm(graph: AreaGraph, *, anchor: MapAnchor | None = None) -> str:
    """Return the area graph as osmAG.

    Args:
        graph: What is written.
        anchor: Where on Earth the map lies; without one, its (0, 0) is put at latitude 0,
            longitude 0.

    Raises:
        MapError: The map reaches too far from its anchor.
    """
    writer = _Writer(graph.name, anchor or MapAnchor())
    for area in graph.areas:
        writer.add_area(area)
    for passage in graph.passages:
        writer.add_passage(passage)
    return write_osm_xml(writer.document())


def from_osm(text: str) -> AreaGraph:
    """Read the area graph that `to_osm` wrote, also after it was edited in JOSM.

    Raises:
        MapError: It is not OSM XML, or no area graph of ours.
    """
    document = read_osm_xml(text)
    try:
        return _Assembler(document).graph()
    except ValidationError as error:
        raise refusal_of(error, "OSM") from error


class _Writer:
    """Gives out ids, one node for each point, so that neighbours share their corners."""

    def __init__(self, name: str, anchor: MapAnchor) -> None:
        self._anchor = anchor
        self._last_id = 0
        self._node_at: dict[Point, int] = {}
        self._nodes: list[OsmElement] = []
        self._ways: list[OsmElement] = []
        self._relations: list[OsmElement] = []
        own = {"version": FILE_VERSION, "map": name, "yaw_deg": anchor.yaw_deg}
        self._add_node(Point(0.0, 0.0), {"name": "root"} | _own_tags(own))

    def document(self) -> OsmDocument:
        return OsmDocument(
            nodes=tuple(self._nodes), ways=tuple(self._ways), relations=tuple(self._relations)
        )

    def add_area(self, area: Area) -> None:
        """Add the outline as a way; further rings as ways that a multipolygon holds together."""
        region = area.region
        tags = {
            "indoor": "room",
            "level": LEVEL,
            "name": area.id,
            "osmAG:type": "area",
            "osmAG:areaType": AREA_TYPES[region.room_class],
        } | _own_tags(AreaRecord.facts_of(area))
        if not area.polygons:
            self._add_node(region.widest, tags)
            return
        rings = [(ring, ring is each.outer) for each in area.polygons for ring in each.rings]
        members = []
        for number, (ring, is_outer) in enumerate(rings):
            way = self._add_way(ring, tags if number == 0 else {})
            members.append(OsmMember(type="way", ref=way, role="outer" if is_outer else "inner"))
        if len(members) > 1:
            tags = {"type": "multipolygon", f"{OWN}area": area.id}
            self._relations.append(
                OsmElement(id=self._next_id(), tags=tags, members=tuple(members))
            )

    def add_passage(self, passage: Passage) -> None:
        """Add the line as a way of two nodes, or the door as a node when there is no line."""
        door = passage.door
        first, second = door.region_ids
        tags = {
            "level": LEVEL,
            "name": passage.id,
            "osmAG:type": "passage",
            "osmAG:from": first,
            "osmAG:to": second,
        } | _own_tags(PassageRecord.facts_of(door))
        if passage.line is None:
            self._add_node(door.place, tags)
        else:
            self._add_way(passage.line, tags)

    def _add_node(self, point: Point, tags: Tags) -> int:
        node = OsmElement(id=self._next_id(), tags=tags, place=self._anchor.locate(point))
        self._nodes.append(node)
        return node.id

    def _add_way(self, points: Ring, tags: Tags) -> int:
        refs = tuple(self._node_for(point) for point in points)
        way = OsmElement(id=self._next_id(), tags=tags, refs=refs)
        self._ways.append(way)
        return way.id

    def _node_for(self, point: Point) -> int:
        if point not in self._node_at:
            self._node_at[point] = self._add_node(point, {})
        return self._node_at[point]

    def _next_id(self) -> int:
        self._last_id -= 1
        return self._last_id


class _Assembler:
    """Finds areas and passages among the elements of a file."""

    def __init__(self, document: OsmDocument) -> None:
        self._document = document
        self._root = _find_root(document.nodes)
        own = _Root.model_validate(_own_values(self._root.tags))
        place = self._root.place
        if own.version != FILE_VERSION or place is None:
            raise MapError(
                f"This area graph as OSM has version {own.version}.",
                hint=f"This mapspeak reads version {FILE_VERSION}; a newer one may read it.",
            )
        self._name = own.map
        self._anchor = MapAnchor(
            lat_deg=place.lat_deg, lon_deg=place.lon_deg, yaw_rad=math.radians(own.yaw_deg)
        )
        self._places = {node.id: node.place for node in document.nodes}
        self._ways = {way.id: way for way in document.ways}
        self._multipolygons = {
            each.tags[f"{OWN}area"]: each
            for each in document.relations
            if f"{OWN}area" in each.tags
        }

    def graph(self) -> AreaGraph:
        return AreaGraph(
            name=self._name,
            areas=tuple(self._area(each) for each in self._elements("area")),
            passages=tuple(self._passage(each) for each in self._elements("passage")),
        )

    def _elements(self, kind: str) -> Iterator[OsmElement]:
        """Return the elements of a kind, in the order in which they were written.

        Ids count down while writing; an editor keeps the order within ways, and within nodes.
        """
        elements = (*self._document.ways, *self._document.nodes)
        found = [each for each in elements if each.tags.get("osmAG:type") == kind]
        yield from sorted(found, key=lambda each: -each.id)

    def _area(self, element: OsmElement) -> Area:
        values = _own_values(element.tags) | {"id": element.tags.get("name", "")}
        record = AreaRecord.model_validate(values)
        relation = self._multipolygons.get(record.id)
        if relation is not None:
            polygons = self._polygons(relation.members)
        elif element.refs:
            polygons = (polygon_from([self._points(element.refs)]),)
        else:
            polygons = ()
        return Area(region=record.to_region(), polygons=polygons, text=record.reason)

    def _polygons(self, members: Iterable[OsmMember]) -> tuple[Polygon, ...]:
        """Return the polygons of a relation: every outer ring with the inner ones after it."""
        polygons: list[list[Ring]] = []
        for member in members:
            if member.type != "way" or member.ref not in self._ways:
                raise _say_missing(member.type, member.ref)
            ring = self._points(self._ways[member.ref].refs)
            if member.role == "inner" and polygons:
                polygons[-1].append(ring)
            else:
                polygons.append([ring])
        return tuple(polygon_from(rings) for rings in polygons)

    def _passage(self, element: OsmElement) -> Passage:
        tags = element.tags
        ends = [tags.get("osmAG:from", ""), tags.get("osmAG:to", "")]
        values = _own_values(tags) | {"id": tags.get("name", ""), "joins": ends}
        door = PassageRecord.model_validate(values).to_door()
        return Passage(door=door, line=self._line(element))

    def _line(self, element: OsmElement) -> Line | None:
        points = self._points(element.refs)
        return (points[0], points[-1]) if points else None

    def _points(self, refs: Iterable[int]) -> Ring:
        points = []
        for ref in refs:
            place = self._places.get(ref)
            if place is None:
                raise _say_missing("node", ref)
            points.append(self._anchor.point_at(place))
        return tuple(points)


def _find_root(nodes: Iterable[OsmElement]) -> OsmElement:
    for node in nodes:
        if node.tags.get("name") == "root" and f"{OWN}version" in node.tags:
            return node
    raise MapError(
        "This OSM file has no root node of ours, so nothing says where the map's (0, 0) lies.",
        hint=f"Give a file that `{shell_command('map --osm')}` wrote; other osmAG files lack "
        "what it needs.",
    )


def _own_tags(facts: Mapping[str, object]) -> dict[str, str]:
    """Return facts as tags; id and join are osmAG's name, from and to."""
    tags = {}
    for key, value in facts.items():
        if key in {"id", "joins"}:
            continue
        items = value if isinstance(value, list | tuple) else [value]
        tags[OWN + key] = ";".join(str(item) for item in items)
    return tags


def _own_values(tags: Tags) -> dict[str, object]:
    """Return the facts again, lists split and the rest as text."""
    values: dict[str, object] = {}
    for key, text in tags.items():
        if key.startswith(OWN):
            name = key.removeprefix(OWN)
            items: object = text.split(";") if text else []
            values[name] = items if name in LISTS else text
    return values


def _say_missing(kind: str, ref: int) -> MapError:
    return MapError(
        f"This area graph as OSM mentions a {kind!a} {ref} that is not there.",
        hint="Download or restore it in the editor, or write the file anew.",
    )


READERS: dict[str, Callable[[str], AreaGraph]] = {
    ".geojson": from_geojson,
    ".json": from_json,
    ".osm": from_osm,
}


def read_area_graph(path: Path) -> AreaGraph:
    """Read an area graph from a .json, .geojson or .osm file that mapspeak wrote.

    Raises:
        MapError: The file is missing, damaged or something else.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MapError(
            f"{path.name} is no file of an area graph.",
            hint=f"Give one that ends in {', '.join(READERS)}.",
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise MapError(
            f"{path} cannot be read: {error.strerror or error}.", hint="Check its path."
        ) from error
    except UnicodeError as error:
        raise MapError(f"{path.name} is not UTF-8 text.", hint="Save it as UTF-8.") from error
    return reader(text)
