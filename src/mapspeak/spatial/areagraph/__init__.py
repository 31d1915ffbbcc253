"""The area graph: rooms as polygons, doors as the edges between them, and its text forms."""

from mapspeak.spatial.areagraph.building import build_area_graph
from mapspeak.spatial.areagraph.graph import (
    Area,
    AreaGraph,
    LatLon,
    Line,
    MapAnchor,
    Passage,
    Polygon,
    Ring,
)
from mapspeak.spatial.areagraph.jsonforms import from_geojson, from_json, to_geojson, to_json
from mapspeak.spatial.areagraph.osm import from_osm, read_area_graph, to_osm

__all__ = [
    "Area",
    "AreaGraph",
    "LatLon",
    "Line",
    "MapAnchor",
    "Passage",
    "Polygon",
    "Ring",
    "build_area_graph",
    "from_geojson",
    "from_json",
    "from_osm",
    "read_area_graph",
    "to_geojson",
    "to_json",
    "to_osm",
]
