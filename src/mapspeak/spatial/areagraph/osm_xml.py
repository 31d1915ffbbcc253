"""OpenStreetMap XML, version 0.6, as far as an area graph needs it: read safely, and written.

The standard library's expat expands entities that a document type declares, so a few lines can
become gigabytes. No OSM file has a document type: one that does is refused before it is read on.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Any
from xml.parsers import expat

from pydantic import BaseModel, Field, FiniteFloat, ValidationError

from mapspeak.errors import MapError
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.anchor import DEGREE_DECIMALS, LatLon

GENERATOR = "mapspeak"


@dataclass(frozen=True, slots=True, kw_only=True)
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

    nodes: tuple[OsmElement, ...]
    ways: tuple[OsmElement, ...]
    relations: tuple[OsmElement, ...]


def write_osm_xml(document: OsmDocument) -> str:
    """Return the file as JOSM reads it; all elements are new ones that no server knows."""
    lines = [
        "<?xml version='1.0' encoding='UTF-8'?>",
        f'<osm version="0.6" generator="{GENERATOR}">',
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
    reader = _Reader()
    try:
        reader.parser.Parse(text, True)  # noqa: FBT003 - expat's own way to say that this is all
    except expat.ExpatError as error:
        raise MapError(
            f"This is no area graph as OSM: line {error.lineno}: {expat.ErrorString(error.code)}.",
            hint=f"Write it anew with `{shell_command('map --osm')}`, or mend that line.",
        ) from error
    except UnicodeError as error:
        raise MapError(
            "This is no area graph as OSM: it is not Unicode text.", hint="Save it as UTF-8."
        ) from error
    return reader.document()


class _Member(BaseModel):
    type: str
    ref: int
    role: str = ""


class _Element(BaseModel):
    id: int
    lat: FiniteFloat | None = Field(None, ge=-90, le=90)
    lon: FiniteFloat | None = Field(None, ge=-180, le=180)
    action: str = ""
    visible: bool = True


class _Reader:
    """Gathers elements while expat reads; anything else in the file is left aside."""

    def __init__(self) -> None:
        self.parser = expat.ParserCreate()
        self.parser.StartDoctypeDeclHandler = _refuse_doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self._found: dict[str, list[OsmElement]] = {"node": [], "way": [], "relation": []}
        self._path: list[str] = []
        self._begin({})

    def document(self) -> OsmDocument:
        return OsmDocument(
            nodes=tuple(self._found["node"]),
            ways=tuple(self._found["way"]),
            relations=tuple(self._found["relation"]),
        )

    def _begin(self, attributes: dict[str, str]) -> None:
        self._attributes = attributes
        self._tags: dict[str, str] = {}
        self._refs: list[int] = []
        self._members: list[OsmMember] = []

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._path.append(name)
        if len(self._path) == 1 and name != "osm":
            raise MapError(
                f"This is no area graph as OSM: it begins with {name!a}.",
                hint=f"Give a file that `{shell_command('map --osm')}` wrote.",
            )
        if len(self._path) == 2:
            self._begin(attributes)
        elif len(self._path) == 3:
            try:
                self._add(name, attributes)
            except (KeyError, ValueError) as error:
                raise self._refusal(name) from error

    def _add(self, name: str, attributes: dict[str, str]) -> None:
        """Add a part to the element that is open."""
        if name == "tag":
            self._tags[attributes["k"]] = attributes["v"]
        elif name == "nd":
            self._refs.append(int(attributes["ref"]))
        elif name == "member":
            member = _Member.model_validate(attributes)
            self._members.append(OsmMember(type=member.type, ref=member.ref, role=member.role))

    def _end(self, name: str) -> None:
        self._path.pop()
        if len(self._path) != 1 or name not in self._found:
            return
        try:
            record = _Element.model_validate(self._attributes)
        except ValidationError as error:
            raise self._refusal(name) from error
        if record.action == "delete" or not record.visible:
            return
        if name == "node" and (record.lat is None or record.lon is None):
            raise self._refusal(name)
        self._found[name].append(self._element(record))

    def _element(self, record: _Element) -> OsmElement:
        has_place = record.lat is not None and record.lon is not None
        return OsmElement(
            id=record.id,
            tags=self._tags,
            place=LatLon(record.lat or 0.0, record.lon or 0.0) if has_place else None,
            refs=tuple(self._refs),
            members=tuple(self._members),
        )

    def _refusal(self, name: str) -> MapError:
        return MapError(
            f"This is no area graph as OSM: line {self.parser.CurrentLineNumber}: "
            f"{name!a} lacks an attribute, or has one that cannot be.",
            hint="Nodes have id, lat and lon; ways and relations an id; tags k and v.",
        )


def _refuse_doctype(*_: Any) -> None:  # noqa: ANN401 - expat's arguments; none is looked at
    raise MapError(
        "This OSM file declares a document type, which no OSM file does and which can be harmful.",
        hint="Remove the line with <!DOCTYPE if you trust the file.",
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
