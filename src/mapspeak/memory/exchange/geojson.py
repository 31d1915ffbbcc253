"""The memory for other programs, as GeoJSON (RFC 7946).

It has a point for each place, with what the semantic map file says of it under the same keys:
lengths in metres to the millimetre, angles in degrees to the hundredth. Without an anchor,
coordinates are metres in the map frame, as in the area graph's GeoJSON: the member `mapspeak` says
so. With one they are longitude and latitude. Comments and people's own keys are lost.
"""

import json
import math
from collections.abc import Iterator
from typing import Literal, cast

from pydantic import BaseModel, FiniteFloat, ValidationError

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.memory.quoting import name_key
from mapspeak.memory.store.records import WrongRecordError, data_of, read_record
from mapspeak.memory.store.yamltext import Data, Path
from mapspeak.memory.waypoint import SemanticMap, Waypoint
from mapspeak.spatial.areagraph import LatLon, MapAnchor

Facts = dict[str, object]

_NUMBERS = ("_m", "_s", "_deg")
_COORDINATES = ("x", "y")


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
    coordinates: tuple[FiniteFloat, FiniteFloat]


class _Feature(BaseModel):
    geometry: _Geometry
    properties: dict[str, object]


class _Collection(BaseModel):
    type: Literal["FeatureCollection"]
    mapspeak: _Member
    features: list[dict[str, object]]


def facts_of(waypoint: Waypoint) -> Facts:
    """Return the known fields of a waypoint besides x and y."""
    said: Facts = dict(data_of(waypoint))
    pose = said.pop("pose")
    assert isinstance(pose, dict)  # noqa: S101 - a record has a pose
    facts = {"name": said.pop("name"), "yaw_deg": pose["yaw_deg"]} | said
    return {key: _plain(key, value) for key, value in facts.items() if value not in (None, "", [])}


def place_of(waypoint: Waypoint) -> Point:
    """Return the position of a waypoint in the map frame, rounded to millimetres as in files."""
    return Point(round(waypoint.pose.x, 3) + 0.0, round(waypoint.pose.y, 3) + 0.0)


def to_geojson(places: SemanticMap, *, anchor: MapAnchor | None = None) -> str:
    """Return the memory as GeoJSON, in its own frame as far as other frames are aligned with it.

    Places of a frame of unknown alignment keep its id and its metres; nothing tells where on earth
    they are, so that with an anchor they are left out.

    Raises:
        MapError: A place is too far from the anchor.
    """
    member: Facts = {"version": 1, "map": places.map_id}
    if anchor is None:
        member |= {"coordinates": "x and y in metres, in the map frame", "anchor": None}
    else:
        on_earth = {"lat_deg": anchor.lat_deg, "lon_deg": anchor.lon_deg, "yaw_deg": anchor.yaw_deg}
        member |= {
            "coordinates": "longitude and latitude of WGS 84, in degrees",
            "anchor": on_earth,
        }
    placed = (places.frames.bring(place, None) or place for place in places.waypoints)
    told = (place for place in placed if anchor is None or place.frame is None)
    features = [_feature(place, anchor) for place in told]
    collection = {"type": "FeatureCollection", "mapspeak": member, "features": features}
    return json.dumps(collection, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def from_geojson(text: str) -> SemanticMap:
    """Read the memory that `to_geojson` wrote; ignore features of other kinds.

    Raises:
        SemanticMapError: It is not GeoJSON, or no memory.
    """
    try:
        collection = _Collection.model_validate_json(text)
        records = list(_records(collection))
    except ValidationError as error:
        first = error.errors()[0]
        raise _fault("the file", first["loc"], first["msg"]) from error
    map_id, places = collection.mapspeak.map, dict[str, Waypoint]()
    for number, (place, facts) in enumerate(records, start=1):
        said = {key: value for key, value in facts.items() if key != "yaw_deg"}
        pose = {"x": place.x, "y": place.y, "yaw_deg": facts.get("yaw_deg")}
        record = cast("dict[str, Data]", {**said, "pose": pose})
        try:
            waypoint = cast("Waypoint", read_record("waypoints", record, map_id))
        except WrongRecordError as error:
            what = f"record {number} ({facts.get('name')!s})"
            raise _fault(what, error.path, error.message.rstrip(".")) from error
        if places.setdefault(name_key(waypoint.name), waypoint) is not waypoint:
            raise SemanticMapError(
                f"This is no memory as GeoJSON: two records are called '{waypoint.name}'.",
                hint="Rename one of them; case and spaces make no difference.",
            )
    return SemanticMap(map_id=map_id, waypoints=tuple(places.values()))


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


def _plain(key: str, value: object) -> object:
    """Return numbers as numbers; the file's schema holds them as text."""
    if isinstance(value, list):
        return [_plain("", item) for item in value]
    if isinstance(value, dict):
        return {name: _plain(name, item) for name, item in value.items()}
    is_number = key.endswith(_NUMBERS) or key in _COORDINATES
    return float(value) if isinstance(value, str) and is_number else value


def _fault(what: str, path: Path, reason: str) -> SemanticMapError:
    place = ".".join(map(str, path)) or "the whole of it"
    return SemanticMapError(
        f"This is no memory as GeoJSON: {what}: at {place!a}: {reason}.",
        hint=f"Mend that place, or write the file anew with `{shell_command('memory export')}`.",
    )
