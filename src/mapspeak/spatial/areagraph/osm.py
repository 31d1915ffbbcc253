"""The area graph as osmAG: an OpenStreetMap file whose ways are areas and passages.

The tags are those of the indoor osmAG standard (2025) in its "semantic" variant, in which passages
name the areas they join; Hou, Feng, Zhang, Schwertfeger: "osmAG: Hierarchical Semantic Topometric
Area Graph Maps in the OSM Format for Mobile Robotics". What osmAG has no word for stands in tags
that begin with `mapspeak:`.

Expat expands entities that a document type declares, so a few lines can become gigabytes. No OSM
file has a document type: one that does is refused before it is read on.
"""

import itertools
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from pydantic import BaseModel, Field, FiniteFloat, ValidationError

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.graph import (
    DEGREE_DECIMALS,
    Area,
    AreaGraph,
    LatLon,
    MapAnchor,
    Passage,
    Ring,
)
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


class _Node(BaseModel):
    lat: FiniteFloat = Field(ge=-90, le=90)
    lon: FiniteFloat = Field(ge=-180, le=180)


def to_osm(graph: AreaGraph, *, anchor: MapAnchor | None = None) -> str:
    """Return the area graph as osmAG; to JOSM all elements are new ones that no server knows.

    Args:
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
    root = ET.Element("osm", version="0.6", generator="mapspeak")
    root.extend([*writer.nodes, *writer.ways, *writer.relations])
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n"


class _Writer:
    """Gives out ids, one node for each point, so that neighbours share their corners."""

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
            "level": LEVEL,
            "name": area.id,
            "osmAG:type": "area",
            # To osmAG an open space is a room.
            "osmAG:areaType": "corridor" if region.room_class is RoomClass.CORRIDOR else "room",
        } | _own_tags(facts_of_area(area))
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


def from_osm(text: str) -> AreaGraph:
    """Read the area graph that `to_osm` wrote, also after it was edited in JOSM.

    Raises:
        MapError: It is not OSM XML, or no area graph of ours.
    """
    root = _parse(text)
    try:
        return _Reader(root).read()
    except ValidationError as error:
        raise refusal_of(error, "OSM") from error


class _TreeBuilder(ET.TreeBuilder):
    def doctype(self, _name: str, _pubid: str | None, _system: str | None) -> None:
        raise MapError(
            "This OSM file declares a document type, which no OSM file does and which can be "
            "harmful.",
            hint="Remove the line with <!DOCTYPE if you trust the file.",
        )


def _parse(text: str) -> ET.Element:
    parser = ET.XMLParser(target=_TreeBuilder())  # noqa: S314 - it refuses document types
    try:
        parser.feed(text)
        root: ET.Element = parser.close()
    except ET.ParseError as error:
        raise MapError(
            f"This is no area graph as OSM: {error}.",
            hint=f"Write it anew with `{shell_command('map --osm')}`, or mend that line.",
        ) from error
    except UnicodeError as error:
        raise MapError(
            "This is no area graph as OSM: it is not Unicode text.", hint="Save it as UTF-8."
        ) from error
    if root.tag != "osm":
        raise MapError(
            f"This is no area graph as OSM: it begins with {root.tag!a}.",
            hint=f"Give a file that `{shell_command('map --osm')}` wrote.",
        )
    return root


class _Reader:
    """Finds areas and passages among the elements of a file."""

    def __init__(self, root: ET.Element) -> None:
        self._tagged: list[tuple[int, Tags]] = []
        self._places: dict[int, LatLon] = {}
        self._refs: dict[int, list[int]] = {}
        self._members: dict[str | None, list[tuple[str, int, str]]] = {}
        for kind in ("way", "node", "relation"):
            for element in root.iterfind(kind):
                # An editor leaves what was deleted in the file.
                if element.get("action") != "delete" and element.get("visible") != "false":
                    self._take(element)
        self._name, self._anchor = self._find_root()

    def _take(self, element: ET.Element) -> None:
        try:
            number = int(element.attrib["id"])
            tags = {tag.attrib["k"]: tag.attrib["v"] for tag in element.findall("tag")}
            if element.tag == "relation":
                self._members[tags.get(OWN + "area")] = [
                    (part.attrib["type"], int(part.attrib["ref"]), part.get("role", ""))
                    for part in element.findall("member")
                ]
                return
            if element.tag == "node":
                node = _Node.model_validate(element.attrib)
                self._places[number] = LatLon(node.lat, node.lon)
            else:
                self._refs[number] = [int(part.attrib["ref"]) for part in element.findall("nd")]
        except (KeyError, ValueError) as error:
            raise MapError(
                f"This is no area graph as OSM: the {element.tag} {element.get('id', '')!a}, or a "
                "part of it, lacks an attribute, or has one that cannot be.",
                hint="Nodes have id, lat and lon; ways and relations an id; tags k and v.",
            ) from error
        self._tagged.append((number, tags))

    def _find_root(self) -> tuple[str, MapAnchor]:
        """Return the map's name, and where on Earth it lies."""
        for number, tags in self._tagged:
            if tags.get("name") == "root" and OWN + "version" in tags and number in self._places:
                break
        else:
            raise MapError(
                "This OSM file has no root node of ours, so nothing says where the map's (0, 0) "
                "lies.",
                hint=f"Give a file that `{shell_command('map --osm')}` wrote; other osmAG files "
                "lack what it needs.",
            )
        own, place = _Root.model_validate(_own_values(tags)), self._places[number]
        if own.version != FILE_VERSION:
            raise MapError(
                f"This area graph as OSM has version {own.version}.",
                hint=f"This mapspeak reads version {FILE_VERSION}; a newer one may read it.",
            )
        yaw_rad = math.radians(own.yaw_deg)
        return own.map, MapAnchor(lat_deg=place.lat_deg, lon_deg=place.lon_deg, yaw_rad=yaw_rad)

    def read(self) -> AreaGraph:
        """Return all that the file tells."""
        areas, passages = [], []
        # Ids count down while writing; an editor keeps the order within ways, and within nodes.
        for number, tags in sorted(self._tagged, key=lambda each: -each[0]):
            refs = self._refs.get(number, [])
            if tags.get("osmAG:type") == "area":
                areas.append(self._read_area(tags, refs))
            elif tags.get("osmAG:type") == "passage":
                passages.append(self._read_passage(tags, refs))
        return AreaGraph(name=self._name, areas=tuple(areas), passages=tuple(passages))

    def _read_area(self, tags: Tags, refs: list[int]) -> Area:
        name = tags.get("name", "")
        polygons = [[refs]] if refs else []
        if name in self._members:
            polygons = self._find_rings(self._members[name])
        positions = [[self._find_positions(ring) for ring in rings] for rings in polygons]
        facts = _own_values(tags) | {"id": name, "polygons": positions}
        return AreaRecord.model_validate(facts).to_area(lambda position: Point(*position))

    def _find_rings(self, members: Iterable[tuple[str, int, str]]) -> list[list[list[int]]]:
        """Return the nodes of a relation's polygons: every outer ring, the inner ones after it."""
        polygons: list[list[list[int]]] = []
        for kind, ref, role in members:
            if kind != "way" or ref not in self._refs:
                raise _say_missing(kind, ref)
            if role == "inner" and polygons:
                polygons[-1].append(self._refs[ref])
            else:
                polygons.append([self._refs[ref]])
        return polygons

    def _read_passage(self, tags: Tags, refs: list[int]) -> Passage:
        ends = self._find_positions(refs)
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
