"""The area graph as GeoJSON (RFC 7946): a feature for each area and each passage.

Without an anchor, coordinates are metres in the map frame, which RFC 7946 knows only as "prior
arrangement": the member `mapspeak` says so. With one they are longitude and latitude.
"""

import math
from collections.abc import Callable
from typing import Annotated, Literal

from pydantic import Discriminator, Field, FiniteFloat, Tag, ValidationError

from mapspeak.geometry import Point
from mapspeak.spatial.areagraph.anchor import LatLon, MapAnchor
from mapspeak.spatial.areagraph.graph import Area, AreaGraph, Line, Passage, Polygon
from mapspeak.spatial.areagraph.records import (
    FILE_VERSION,
    AreaRecord,
    GraphRecord,
    PassageRecord,
    PolygonPositions,
    Position,
    compose,
    polygon_from,
    position_of,
    refusal_of,
)

_Rows = list[dict[str, object]]
_ToPosition = Callable[[Point], tuple[float, float]]
_ToPoint = Callable[[Position], Point]


class _Anchor(GraphRecord):
    lat_deg: FiniteFloat
    lon_deg: FiniteFloat
    yaw_deg: FiniteFloat

    def to_anchor(self) -> MapAnchor:
        return MapAnchor(
            lat_deg=self.lat_deg, lon_deg=self.lon_deg, yaw_rad=math.radians(self.yaw_deg)
        )


class _Member(GraphRecord):
    version: Literal[1]
    name: str
    anchor: _Anchor | None


class _PolygonGeometry(GraphRecord):
    type: Literal["Polygon"]
    coordinates: PolygonPositions

    def to_polygons(self, point_of: _ToPoint) -> tuple[Polygon, ...]:
        return (_polygon(self.coordinates, point_of),)


class _MultiPolygonGeometry(GraphRecord):
    type: Literal["MultiPolygon"]
    coordinates: list[PolygonPositions]

    def to_polygons(self, point_of: _ToPoint) -> tuple[Polygon, ...]:
        return tuple(_polygon(each, point_of) for each in self.coordinates)


class _PointGeometry(GraphRecord):
    type: Literal["Point"]

    def to_line(self, _point_of: _ToPoint) -> Line | None:
        return None


class _LineGeometry(GraphRecord):
    type: Literal["LineString"]
    coordinates: tuple[Position, Position]

    def to_line(self, point_of: _ToPoint) -> Line | None:
        return point_of(self.coordinates[0]), point_of(self.coordinates[1])


class _AreaFeature(GraphRecord):
    type: Literal["Feature"]
    geometry: _PolygonGeometry | _MultiPolygonGeometry | None = Field(discriminator="type")
    properties: AreaRecord

    def to_area(self, point_of: _ToPoint) -> Area:
        polygons = self.geometry.to_polygons(point_of) if self.geometry else ()
        facts = self.properties
        return Area(region=facts.to_region(), polygons=polygons, text=facts.reason)


class _PassageFeature(GraphRecord):
    type: Literal["Feature"]
    geometry: _LineGeometry | _PointGeometry = Field(discriminator="type")
    properties: PassageRecord

    def to_passage(self, point_of: _ToPoint) -> Passage:
        return Passage(door=self.properties.to_door(), line=self.geometry.to_line(point_of))


def _kind_of(feature: object) -> str | None:
    properties = feature.get("properties") if isinstance(feature, dict) else None
    kind = properties.get("feature") if isinstance(properties, dict) else None
    return kind if isinstance(kind, str) else None


_Feature = Annotated[
    Annotated[_AreaFeature, Tag("area")] | Annotated[_PassageFeature, Tag("passage")],
    Discriminator(_kind_of),
]


class _Collection(GraphRecord):
    type: Literal["FeatureCollection"]
    mapspeak: _Member
    features: list[_Feature]


def to_geojson(graph: AreaGraph, *, anchor: MapAnchor | None = None) -> str:
    """Return the area graph as GeoJSON.

    Args:
        graph: What is written.
        anchor: Where on Earth the map lies; without one, coordinates are metres in the map frame.

    Raises:
        MapError: The map reaches too far from its anchor.
    """
    position = _position_on(anchor)
    areas: _Rows = [_area_feature(area, position) for area in graph.areas]
    passages: _Rows = [_passage_feature(passage, position) for passage in graph.passages]
    head: dict[str, object] = {"type": "FeatureCollection", "mapspeak": _member(graph.name, anchor)}
    return compose(head, features=areas + passages)


def from_geojson(text: str) -> AreaGraph:
    """Read the area graph that `to_geojson` wrote, back to metres in the map frame.

    Raises:
        MapError: It is not GeoJSON, or no area graph.
    """
    try:
        collection = _Collection.model_validate_json(text)
    except ValidationError as error:
        raise refusal_of(error, "GeoJSON") from error
    point_of = _point_on(collection.mapspeak.anchor)
    features = collection.features
    return AreaGraph(
        name=collection.mapspeak.name,
        areas=tuple(each.to_area(point_of) for each in features if isinstance(each, _AreaFeature)),
        passages=tuple(
            each.to_passage(point_of) for each in features if isinstance(each, _PassageFeature)
        ),
    )


def _member(name: str, anchor: MapAnchor | None) -> dict[str, object]:
    head = {"version": FILE_VERSION, "name": name}
    if anchor is None:
        return head | {"coordinates": "x and y in metres, in the map frame", "anchor": None}
    place = {
        "lat_deg": anchor.lat_deg,
        "lon_deg": anchor.lon_deg,
        "yaw_deg": anchor.yaw_deg,
    }
    return head | {"coordinates": "longitude and latitude of WGS 84, in degrees", "anchor": place}


def _position_on(anchor: MapAnchor | None) -> _ToPosition:
    if anchor is None:
        return position_of

    def position(point: Point) -> tuple[float, float]:
        place = anchor.locate(point)
        return place.lon_deg, place.lat_deg

    return position


def _point_on(record: _Anchor | None) -> _ToPoint:
    if record is None:
        return lambda position: Point(*position)
    anchor = record.to_anchor()
    return lambda position: anchor.point_at(LatLon(lat_deg=position[1], lon_deg=position[0]))


def _area_feature(area: Area, position: _ToPosition) -> dict[str, object]:
    polygons = [
        [[position(point) for point in ring] for ring in polygon.rings] for polygon in area.polygons
    ]
    geometry: object = None
    if len(polygons) == 1:
        geometry = {"type": "Polygon", "coordinates": polygons[0]}
    elif polygons:
        geometry = {"type": "MultiPolygon", "coordinates": polygons}
    return _feature(area.id, geometry, {"feature": "area"} | AreaRecord.facts_of(area))


def _passage_feature(passage: Passage, position: _ToPosition) -> dict[str, object]:
    geometry: object = {"type": "Point", "coordinates": position(passage.door.place)}
    if passage.line is not None:
        ends = [position(point) for point in passage.line]
        geometry = {"type": "LineString", "coordinates": ends}
    facts = PassageRecord.facts_of(passage.door)
    return _feature(passage.id, geometry, {"feature": "passage"} | facts)


def _feature(name: str, geometry: object, properties: dict[str, object]) -> dict[str, object]:
    return {"type": "Feature", "id": name, "geometry": geometry, "properties": properties}


def _polygon(rings: list[list[Position]], point_of: _ToPoint) -> Polygon:
    return polygon_from([tuple(point_of(each) for each in ring) for ring in rings])
