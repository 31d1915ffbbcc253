"""OpenStreetMap XML, version 0.6, as far as an area graph needs it: read safely, and written.

Expat expands entities that a document type declares, so a few lines can become gigabytes. No OSM
file has a document type: one that does is refused before it is read on.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from html import escape

from pydantic import BaseModel, Field, FiniteFloat

from mapspeak.errors import MapError
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.anchor import DEGREE_DECIMALS, LatLon


@dataclass(frozen=True, slots=True)
class OsmMember:
    """A part of a relation.

    Attributes:
        type: "node", "way" or "relation".
    """

    type: str
    ref: int
    role: str


@dataclass(frozen=True, slots=True, kw_only=True)
class OsmElement:
    """A node, a way or a relation.

    Attributes:
        id: Negative in files that no OSM server knows.
        place: Of a node; else None.
        refs: Of a way, the ids of its nodes.
    """

    id: int
    tags: Mapping[str, str] = field(default_factory=dict)
    place: LatLon | None = None
    refs: tuple[int, ...] = ()
    members: tuple[OsmMember, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class OsmDocument:
    """Everything in a file, in its order."""

    nodes: list[OsmElement]
    ways: list[OsmElement] = field(default_factory=list)
    relations: list[OsmElement] = field(default_factory=list)


def write_osm_xml(document: OsmDocument) -> str:
    """Return the file as JOSM reads it; all elements are new ones that no server knows."""
    lines = [
        "<?xml version='1.0' encoding='UTF-8'?>",
        '<osm version="0.6" generator="mapspeak">',
        *(line for node in document.nodes for line in _element_lines("node", node)),
        *(line for way in document.ways for line in _element_lines("way", way)),
        *(line for each in document.relations for line in _element_lines("relation", each)),
        "</osm>",
    ]
    return "\n".join(lines) + "\n"


def read_osm_xml(text: str) -> OsmDocument:
    """Read a file; elements that were deleted in an editor are left out.

    Raises:
        MapError: It is not XML, declares a document type, or has elements that OSM does not allow.
    """
    root = _parse(text)
    if root.tag != "osm":
        raise MapError(
            f"This is no area graph as OSM: it begins with {root.tag!a}.",
            hint=f"Give a file that `{shell_command('map --osm')}` wrote.",
        )
    found: dict[str, list[OsmElement]] = {"node": [], "way": [], "relation": []}
    for each in root:
        is_deleted = each.get("action") == "delete" or each.get("visible") == "false"
        if each.tag not in found or is_deleted:
            continue
        try:
            found[each.tag].append(_element(each))
        except (KeyError, ValueError) as error:
            raise MapError(
                f"This is no area graph as OSM: the {each.tag} {each.get('id', '')!a}, or a part "
                "of it, lacks an attribute, or has one that cannot be.",
                hint="Nodes have id, lat and lon; ways and relations an id; tags k and v.",
            ) from error
    return OsmDocument(nodes=found["node"], ways=found["way"], relations=found["relation"])


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
    return root


class _Node(BaseModel):
    lat: FiniteFloat = Field(ge=-90, le=90)
    lon: FiniteFloat = Field(ge=-180, le=180)


def _element(element: ET.Element) -> OsmElement:
    place = None
    if element.tag == "node":
        node = _Node.model_validate(element.attrib)
        place = LatLon(node.lat, node.lon)
    return OsmElement(
        id=int(element.attrib["id"]),
        tags={tag.attrib["k"]: tag.attrib["v"] for tag in element.findall("tag")},
        place=place,
        refs=tuple(int(part.attrib["ref"]) for part in element.findall("nd")),
        members=tuple(
            OsmMember(part.attrib["type"], int(part.attrib["ref"]), part.get("role", ""))
            for part in element.findall("member")
        ),
    )


def _element_lines(name: str, element: OsmElement) -> Iterable[str]:
    attributes = f'id="{element.id}" action="modify" visible="true"'
    if element.place is not None:
        lat, lon = element.place.lat_deg, element.place.lon_deg
        attributes += f' lat="{lat:.{DEGREE_DECIMALS}f}" lon="{lon:.{DEGREE_DECIMALS}f}"'
    parts = [
        *(f'<nd ref="{ref}"/>' for ref in element.refs),
        *(f'<member type="{m.type}" ref="{m.ref}" role="{m.role}"/>' for m in element.members),
        *(f'<tag k="{_quoted(key)}" v="{_quoted(text)}"/>' for key, text in element.tags.items()),
    ]
    if not parts:
        return [f"  <{name} {attributes}/>"]
    return [f"  <{name} {attributes}>", *(f"    {part}" for part in parts), f"  </{name}>"]


def _quoted(text: str) -> str:
    """Return a text as it stands between quotes; a bare line break there would read as a space."""
    return escape(text).replace("\n", "&#10;")
