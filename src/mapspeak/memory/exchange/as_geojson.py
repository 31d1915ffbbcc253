"""The memory as GeoJSON (RFC 7946): a point for each place, with what is known of it.

Without an anchor, coordinates are metres in the map frame, as in the area graph's GeoJSON: the
member `mapspeak` says so. With one they are longitude and latitude. What the format cannot hold are
comments and people's own keys.
"""

import json
import math
from collections.abc import Iterator
from typing import Literal

from pydantic import BaseModel, FiniteFloat, ValidationError

from mapspeak.geometry import Point
from mapspeak.memory.exchange.records import (
    FILE_VERSION,
    Facts,
    facts_of,
    map_from,
    place_of,
    refusal_of,
)
from mapspeak.memory.waypoint import SemanticMap, Waypoint
from mapspeak.spatial.areagraph import LatLon, MapAnchor

_Position = tuple[FiniteFloat, FiniteFloat]


class _Anchor(BaseModel):
    lat_deg: FiniteFloat
    lon_deg: FiniteFloat
    yaw_deg: FiniteFloat


class _Member(BaseModel):
    version: Literal[1]
    map: str | None = None
    anchor: _Anchor | None = None


class _Geometry(BaseModel):
    type: Literal["Point"]
    coordinates: _Position


class _Feature(BaseModel):
    geometry: _Geometry
    properties: dict[str, object]


class _Collection(BaseModel):
    type: Literal["FeatureCollection"]
    mapspeak: _Member
    features: list[dict[str, object]]


def to_geojson(places: SemanticMap, *, anchor: MapAnchor | None = None) -> str:
    """Return the memory as GeoJSON.

    Args:
        places: What is written.
        anchor: Where on Earth the map lies; without one, coordinates are metres in the map frame.

    Raises:
        MapError: A place is too far from the anchor.
    """
    member: Facts = {"version": FILE_VERSION, "map": places.map_id}
    if anchor is None:
        member |= {"coordinates": "x and y in metres, in the map frame", "anchor": None}
    else:
        on_earth = {"lat_deg": anchor.lat_deg, "lon_deg": anchor.lon_deg, "yaw_deg": anchor.yaw_deg}
        member |= {
            "coordinates": "longitude and latitude of WGS 84, in degrees",
            "anchor": on_earth,
        }
    features = [_feature(place, anchor) for place in places.waypoints]
    collection = {"type": "FeatureCollection", "mapspeak": member, "features": features}
    return json.dumps(collection, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def from_geojson(text: str) -> SemanticMap:
    """Read the memory that `to_geojson` wrote; features of other kinds are left aside.

    Raises:
        SemanticMapError: It is not GeoJSON, or no memory.
    """
    try:
        collection = _Collection.model_validate_json(text)
        records = list(_records(collection))
    except ValidationError as error:
        raise refusal_of(error, "GeoJSON", "the file") from error
    return map_from(records, map_id=collection.mapspeak.map, form="GeoJSON")


def _feature(place: Waypoint, anchor: MapAnchor | None) -> Facts:
    point = place_of(place)
    position = (point.x, point.y)
    if anchor is not None:
        on_earth = anchor.locate(point)
        position = (on_earth.lon_deg, on_earth.lat_deg)
    geometry = {"type": "Point", "coordinates": position}
    properties = {"feature": "waypoint"} | facts_of(place)
    return {"type": "Feature", "id": place.name, "geometry": geometry, "properties": properties}


def _records(collection: _Collection) -> Iterator[tuple[Point, Facts]]:
    anchor = None
    if (said := collection.mapspeak.anchor) is not None:
        anchor = MapAnchor(
            lat_deg=said.lat_deg, lon_deg=said.lon_deg, yaw_rad=math.radians(said.yaw_deg)
        )
    for each in collection.features:
        properties = each.get("properties")
        if not isinstance(properties, dict) or properties.get("feature") != "waypoint":
            continue
        feature = _Feature.model_validate(each)
        x, y = feature.geometry.coordinates
        point = Point(x, y) if anchor is None else anchor.point_at(LatLon(lat_deg=y, lon_deg=x))
        yield point, feature.properties
