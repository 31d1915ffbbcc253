"""The area graph as osmAG: an OpenStreetMap file whose ways are areas and passages.

The tags are those of the indoor osmAG standard (2025) in its "semantic" variant, in which passages
name the areas they join; Hou, Feng, Zhang, Schwertfeger: "osmAG: Hierarchical Semantic Topometric
Area Graph Maps in the OSM Format for Mobile Robotics". What osmAG has no word for stands in tags
that begin with `mapspeak:`.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from pydantic import FiniteFloat, ValidationError

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.anchor import MapAnchor
from mapspeak.spatial.areagraph.graph import Area, AreaGraph, Passage, Ring
from mapspeak.spatial.areagraph.jsonforms import (
    FILE_VERSION,
    AreaRecord,
    Facts,
    GraphRecord,
    PassageRecord,
    facts_of_area,
    facts_of_door,
    from_geojson,
    from_json,
    refusal_of,
)
from mapspeak.spatial.areagraph.osm_xml import (
    OsmDocument,
    OsmElement,
    OsmMember,
    read_osm_xml,
    write_osm_xml,
)
from mapspeak.spatial.rooms import RoomClass

OWN = "mapspeak:"
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
    return write_osm_xml(writer.document)


class _Writer:
    """Gives out ids, one node for each point, so that neighbours share their corners."""

    def __init__(self, name: str, anchor: MapAnchor) -> None:
        self.document = OsmDocument(nodes=[])
        self._anchor = anchor
        self._ids = itertools.count(-1, -1)
        self._node_at: dict[Point, int] = {}
        own: Facts = {"version": FILE_VERSION, "map": name, "yaw_deg": anchor.yaw_deg}
        self._add_node(Point(0.0, 0.0), {"name": "root"} | _own_tags(own))

    def add_area(self, area: Area) -> None:
        """Add the outline as a way; further rings as ways that a multipolygon holds together."""
        region = area.region
        tags = {
            "indoor": "room",
            "level": LEVEL,
            "name": area.id,
            "osmAG:type": "area",
            # To osmAG an open space is a room.
            "osmAG:areaType": "corridor" if region.room_class is RoomClass.CORRIDOR else "room",
        } | _own_tags(facts_of_area(area))
        if not area.polygons:
            self._add_node(region.widest, tags)
            return
        members: list[OsmMember] = []
        for polygon in area.polygons:
            for ring in polygon.rings:
                way = self._add_way(ring, {} if members else tags)
                role = "outer" if ring is polygon.outer else "inner"
                members.append(OsmMember("way", way, role))
        if len(members) > 1:
            tags = {"type": "multipolygon", f"{OWN}area": area.id}
            relation = OsmElement(id=next(self._ids), tags=tags, members=tuple(members))
            self.document.relations.append(relation)

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
        } | _own_tags(facts_of_door(door))
        if passage.line is None:
            self._add_node(door.place, tags)
        else:
            self._add_way(passage.line, tags)

    def _add_node(self, point: Point, tags: Tags) -> int:
        node = OsmElement(id=next(self._ids), tags=tags, place=self._anchor.locate(point))
        self.document.nodes.append(node)
        return node.id

    def _add_way(self, points: Ring, tags: Tags) -> int:
        for point in points:
            if point not in self._node_at:
                self._node_at[point] = self._add_node(point, {})
        refs = tuple(self._node_at[point] for point in points)
        way = OsmElement(id=next(self._ids), tags=tags, refs=refs)
        self.document.ways.append(way)
        return way.id


def from_osm(text: str) -> AreaGraph:
    """Read the area graph that `to_osm` wrote, also after it was edited in JOSM.

    Raises:
        MapError: It is not OSM XML, or no area graph of ours.
    """
    document = read_osm_xml(text)
    try:
        return _Reader(document).read()
    except ValidationError as error:
        raise refusal_of(error, "OSM") from error


class _Reader:
    """Finds areas and passages among the elements of a file."""

    def __init__(self, document: OsmDocument) -> None:
        root = next(
            (
                n
                for n in document.nodes
                if n.tags.get("name") == "root" and OWN + "version" in n.tags
            ),
            None,
        )
        if root is None or root.place is None:
            raise MapError(
                "This OSM file has no root node of ours, so nothing says where the map's (0, 0) "
                "lies.",
                hint=f"Give a file that `{shell_command('map --osm')}` wrote; other osmAG files "
                "lack what it needs.",
            )
        own = _Root.model_validate(_own_values(root.tags))
        if own.version != FILE_VERSION:
            raise MapError(
                f"This area graph as OSM has version {own.version}.",
                hint=f"This mapspeak reads version {FILE_VERSION}; a newer one may read it.",
            )
        lat_deg, lon_deg = root.place.lat_deg, root.place.lon_deg
        yaw_rad = math.radians(own.yaw_deg)
        self._name = own.map
        self._anchor = MapAnchor(lat_deg=lat_deg, lon_deg=lon_deg, yaw_rad=yaw_rad)
        self._places = {node.id: node.place for node in document.nodes}
        self._ways = {way.id: way for way in document.ways}
        self._members = {each.tags.get(OWN + "area"): each.members for each in document.relations}
        # Ids count down while writing; an editor keeps the order within ways, and within nodes.
        self._elements = sorted((*document.ways, *document.nodes), key=lambda each: -each.id)

    def read(self) -> AreaGraph:
        found: dict[str, list[OsmElement]] = {"area": [], "passage": []}
        for element in self._elements:
            found.get(element.tags.get("osmAG:type", ""), []).append(element)
        return AreaGraph(
            name=self._name,
            areas=tuple(self._read_area(each) for each in found["area"]),
            passages=tuple(self._read_passage(each) for each in found["passage"]),
        )

    def _read_area(self, element: OsmElement) -> Area:
        name = element.tags.get("name", "")
        polygons = [[element.refs]] if element.refs else []
        if name in self._members:
            polygons = self._find_rings(self._members[name])
        positions = [[self._find_positions(refs) for refs in rings] for rings in polygons]
        facts = _own_values(element.tags) | {"id": name, "polygons": positions}
        return AreaRecord.model_validate(facts).to_area(lambda position: Point(*position))

    def _find_rings(self, members: Iterable[OsmMember]) -> list[list[tuple[int, ...]]]:
        """Return the nodes of a relation's polygons: every outer ring, the inner ones after it."""
        polygons: list[list[tuple[int, ...]]] = []
        for member in members:
            if member.type != "way" or member.ref not in self._ways:
                raise _say_missing(member.type, member.ref)
            ring = self._ways[member.ref].refs
            if member.role == "inner" and polygons:
                polygons[-1].append(ring)
            else:
                polygons.append([ring])
        return polygons

    def _read_passage(self, element: OsmElement) -> Passage:
        tags, ends = element.tags, self._find_positions(element.refs)
        facts = _own_values(tags) | {
            "id": tags.get("name", ""),
            "joins": [tags.get("osmAG:from", ""), tags.get("osmAG:to", "")],
            "line": [ends[0], ends[-1]] if ends else None,
        }
        return PassageRecord.model_validate(facts).to_passage(lambda position: Point(*position))

    def _find_positions(self, refs: Iterable[int]) -> list[tuple[float, float]]:
        positions = []
        for ref in refs:
            place = self._places.get(ref)
            if place is None:
                raise _say_missing("node", ref)
            point = self._anchor.point_at(place)
            positions.append((point.x, point.y))
        return positions


def _own_tags(facts: Facts) -> dict[str, str]:
    """Return facts as tags; id and join are osmAG's name, from and to."""
    tags = {}
    for key, value in facts.items():
        if key not in {"id", "joins"}:
            items = value if isinstance(value, list | tuple) else [value]
            tags[OWN + key] = ";".join(str(item) for item in items)
    return tags


def _own_values(tags: Tags) -> Facts:
    """Return the facts again, lists split and the rest as text."""
    own = {key.removeprefix(OWN): text for key, text in tags.items() if key.startswith(OWN)}
    return {
        key: (text.split(";") if text else []) if key in LISTS else text
        for key, text in own.items()
    }


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
