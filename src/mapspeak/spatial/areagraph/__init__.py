"""The area graph: rooms as polygons, doors as the edges between them; its forms are modules."""

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
]
