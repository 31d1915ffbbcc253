"""The memory as osmAG: an OpenStreetMap file whose nodes are places, for JOSM.

It has the root node of the area graph's osmAG, so that both can be laid over each other. osmAG has
no word for what is known of a place: that stands in tags that begin with `mapspeak:`, a list as one
tag for each item, `mapspeak:functional_landmarks:1:label`. What the format cannot hold are comments
and people's own keys.
"""

import math
from collections.abc import Iterator, Mapping

from pydantic import BaseModel, FiniteFloat, ValidationError

from mapspeak.errors import MapError, SemanticMapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.memory.exchange.records import (
    FILE_VERSION,
    Facts,
    facts_of,
    map_from,
    place_of,
    refusal_of,
)
from mapspeak.memory.waypoint import SemanticMap
from mapspeak.spatial.areagraph import MapAnchor
from mapspeak.spatial.areagraph.osm_xml import (
    OsmDocument,
    OsmElement,
    read_osm_xml,
    write_osm_xml,
)

OWN = "mapspeak:"
LEVEL = "0"
_FEATURE = f"{OWN}feature"


class _Root(BaseModel):
    """The tags of the node at the map frame's (0, 0)."""

    memory: int
    map: str | None = None
    yaw_deg: FiniteFloat


def to_osm(places: SemanticMap, *, anchor: MapAnchor | None = None) -> str:
    """Return the memory as osmAG.

    Args:
        places: What is written.
        anchor: Where on Earth the map lies; without one, its (0, 0) is put at latitude 0,
            longitude 0.

    Raises:
        MapError: A place is too far from the anchor.
    """
    anchor = anchor or MapAnchor()
    own: Facts = {"memory": FILE_VERSION, "yaw_deg": anchor.yaw_deg}
    if places.map_id is not None:
        own["map"] = places.map_id
    root = {"name": "root"} | {OWN + key: str(value) for key, value in own.items()}
    nodes = [OsmElement(id=-1, tags=root, place=anchor.locate(Point(0.0, 0.0)))]
    for number, place in enumerate(places.waypoints, start=2):
        facts = facts_of(place)
        tags = {"name": place.name, "level": LEVEL, _FEATURE: "waypoint"}
        del facts["name"]
        tags |= {OWN + key: value for key, value in _tags("", facts)}
        nodes.append(OsmElement(id=-number, tags=tags, place=anchor.locate(place_of(place))))
    return write_osm_xml(OsmDocument(nodes=nodes))


def from_osm(text: str) -> SemanticMap:
    """Read the memory that `to_osm` wrote, also after it was edited in JOSM.

    Raises:
        SemanticMapError: It is not OSM XML, or no memory.
    """
    try:
        nodes = read_osm_xml(text).nodes
    except MapError as error:
        message = f"This is no memory as OSM. {error.message}"
        raise SemanticMapError(message, hint=error.hint) from error
    root = next((node for node in nodes if f"{OWN}memory" in node.tags), None)
    if root is None or root.place is None:
        raise SemanticMapError(
            "This OSM file has no root node of a memory, so nothing says where (0, 0) lies.",
            hint=f"Give a file that `{shell_command('memory export --format osm')}` wrote.",
        )
    try:
        own = _Root.model_validate(
            {key.removeprefix(OWN): value for key, value in root.tags.items()}
        )
    except ValidationError as error:
        raise refusal_of(error, "OSM", "its root node") from error
    anchor = MapAnchor(
        lat_deg=root.place.lat_deg,
        lon_deg=root.place.lon_deg,
        yaw_rad=math.radians(own.yaw_deg),
    )
    # Ids count down while writing, and an editor keeps them.
    ordered = sorted(nodes, key=lambda node: -node.id)
    records = [
        (anchor.point_at(node.place), _facts(node.tags))
        for node in ordered
        if node.tags.get(_FEATURE) == "waypoint" and node.place is not None
    ]
    return map_from(records, map_id=own.map, form="OSM")


def _tags(key: str, value: object) -> Iterator[tuple[str, str]]:
    """Return a value as tags, one for each of its leaves."""
    parts: Mapping[str, object] = {}
    if isinstance(value, dict):
        parts = value
    elif isinstance(value, list):
        parts = {str(number): item for number, item in enumerate(value, start=1)}
    else:
        yield key, str(value)
    for name, part in parts.items():
        yield from _tags(f"{key}:{name}" if key else name, part)


def _facts(tags: Mapping[str, str]) -> Facts:
    tree: Facts = {}
    for key, value in tags.items():
        if not key.startswith(OWN) or key == _FEATURE:
            continue
        *way, last = key.removeprefix(OWN).split(":")
        branch = tree
        for step in way:
            below = branch.setdefault(step, {})
            # A label alone that was given details in the editor.
            branch[step] = branch = below if isinstance(below, dict) else {"label": below}
        branch[last] = value
    facts = {key: _with_lists(value) for key, value in tree.items()}
    return facts | {"name": tags.get("name", "")}


def _with_lists(value: object) -> object:
    """Turn what is numbered into lists again."""
    if not isinstance(value, dict):
        return value
    parts = {key: _with_lists(part) for key, part in value.items()}
    if all(key.isdecimal() for key in parts):
        return [parts[key] for key in sorted(parts, key=int)]
    return parts
