"""The area graph: areas with outlines, joined by passages, and its anchor on Earth."""

import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial.rooms import Door, Region

Ring = tuple[Point, ...]
"""A closed line: the last point repeats the first."""

Line = tuple[Point, Point]

MICROMETRE_DECIMALS = 6
"""Outlines and lines are whole micrometres, so that conversion to degrees and back is exact."""

_ID = re.compile(r"[\w.-]+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Polygon:
    """A connected piece of floor.

    Attributes:
        outer: Its outline, counter-clockwise.
        holes: The outlines of excluded parts, clockwise.
    """

    outer: Ring
    holes: tuple[Ring, ...] = ()

    def __post_init__(self) -> None:
        for ring in self.rings:
            if len(ring) < 4 or ring[0] != ring[-1]:
                raise MapError(
                    f"An outline of the area graph with {len(ring)} points is not closed.",
                    hint="A ring has four points or more, and the last repeats the first.",
                )
        if signed_area_m2(self.outer) <= 0 or any(signed_area_m2(ring) >= 0 for ring in self.holes):
            raise MapError(
                "An outline of the area graph turns the wrong way, or encloses nothing.",
                hint="Outer rings run counter-clockwise, holes clockwise.",
            )

    @property
    def rings(self) -> tuple[Ring, ...]:
        """The outer ring, then the holes."""
        return (self.outer, *self.holes)

    @property
    def area_m2(self) -> float:
        """The area without the holes."""
        return sum(signed_area_m2(ring) for ring in self.rings)


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """A node of the graph: a region with its outline.

    Attributes:
        polygons: Its parts, the largest first.
        text: Description for people; files call it `reason`.
    """

    region: Region
    polygons: tuple[Polygon, ...]
    text: str = ""

    @property
    def id(self) -> str:
        """The region's id."""
        return self.region.id


@dataclass(frozen=True, slots=True, kw_only=True)
class Passage:
    """An edge of the graph: a door with the line to cross.

    Attributes:
        line: From post to post: the ends of the border that its two areas share there, which are
            corners of both outlines. None when the areas do not touch on the map.
    """

    door: Door
    line: Line | None

    @property
    def id(self) -> str:
        """The door's id."""
        return self.door.id


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaGraph:
    """Areas joined by passages, in metres in the map frame.

    Raises:
        MapError: Ids are not unique, passages lead nowhere, areas name doors that do not join
            them, or a text holds control characters.
    """

    name: str
    areas: tuple[Area, ...]
    passages: tuple[Passage, ...]

    def __post_init__(self) -> None:
        _check_ids([area.id for area in self.areas], "areas")
        _check_ids([passage.id for passage in self.passages], "passages")
        for text in (self.name, *(area.text for area in self.areas)):
            if any(unicodedata.category(s) in {"Cc", "Cs"} or s in "\ufffe\uffff" for s in text):
                raise MapError(
                    f"The text {text!a} holds control characters, which files cannot carry.",
                    hint="Rename the map, or remove them from the text.",
                )
        _check_passages(self)

    def passages_by_area(self) -> Mapping[str, tuple[Passage, ...]]:
        """Return the passages of every area: the graph as adjacency lists."""
        found: dict[str, list[Passage]] = {area.id: [] for area in self.areas}
        for passage in self.passages:
            for area_id in passage.door.region_ids:
                found[area_id].append(passage)
        return {area_id: tuple(passages) for area_id, passages in found.items()}


def signed_area_m2(ring: Ring) -> float:
    """Return the area inside a closed ring, positive when it runs counter-clockwise."""
    base = ring[0]
    return 0.5 * sum(
        (one.x - base.x) * (other.y - base.y) - (other.x - base.x) * (one.y - base.y)
        for one, other in pairwise(ring)
    )


def _check_ids(ids: list[str], what: str) -> None:
    wrong = [name for name in ids if not _ID.fullmatch(name)]
    if wrong:
        raise MapError(
            f"{wrong[0]!a} is no id for {what}.",
            hint="Ids are letters, digits, dots, hyphens and underscores, such as R3 or D1.",
        )
    doubled = {name for name in ids if ids.count(name) > 1} if len(set(ids)) < len(ids) else set()
    if doubled:
        raise MapError(f"Two {what} are called {min(doubled)}.", hint="Give each an id of its own.")


def _check_passages(graph: AreaGraph) -> None:
    known = {area.id for area in graph.areas}
    for passage in graph.passages:
        first, second = passage.door.region_ids
        if first == second or not {first, second} <= known:
            raise MapError(
                f"Passage {passage.id} joins {first!a} and {second!a}.",
                hint="A passage joins two areas of the same graph.",
            )
    passages = graph.passages_by_area()
    for area in graph.areas:
        doors = {passage.id for passage in passages[area.id]}
        behind = {end for passage in passages[area.id] for end in passage.door.region_ids}
        region = area.region
        if set(region.door_ids) != doors or set(region.neighbour_ids) != behind - {area.id}:
            raise MapError(
                f"Area {area.id} names other doors or neighbours than the passages that join it.",
                hint=f"By its passages its doors are: {', '.join(sorted(doors)) or 'none'}.",
            )


_EQUATORIAL_RADIUS_M = 6_378_137.0
_SQUARED_ECCENTRICITY = 0.00669437999014
_FARTHEST_LAT_DEG = 85.0

DEGREE_DECIMALS = 13
"""A hundredth of a micrometre: metres that are whole micrometres come back exactly."""


@dataclass(frozen=True, slots=True)
class LatLon:
    """A place on Earth, in degrees of WGS 84."""

    lat_deg: float
    lon_deg: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MapAnchor:
    """Position of the map frame's (0, 0) on Earth, and direction of its x axis.

    The conversion is flat around the anchor, with the radii of curvature of the WGS 84 ellipsoid
    there. It neglects the convergence of meridians: x y tan(latitude) / 6.4e6 m, or 2 cm at 300 m
    and 0.3 m at 1 km from an anchor at 60 degrees.

    Attributes:
        lat_deg: WGS 84 latitude of (0, 0), from -85 to 85.
        lon_deg: WGS 84 longitude of (0, 0), from -180 to 180.
        yaw_rad: Direction of the x axis, counter-clockwise from east (REP 103).

    Raises:
        MapError: A value is out of range.
    """

    lat_deg: float = 0.0
    lon_deg: float = 0.0
    yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        is_place = abs(self.lat_deg) <= _FARTHEST_LAT_DEG and abs(self.lon_deg) <= 180
        if not (is_place and math.isfinite(self.yaw_rad)):
            raise MapError(
                f"A map cannot be anchored at latitude {self.lat_deg}, longitude {self.lon_deg}, "
                f"yaw {math.degrees(self.yaw_rad):g} deg.",
                hint="Give degrees: latitude from -85 to 85, longitude from -180 to 180.",
            )

    @property
    def yaw_deg(self) -> float:
        """The direction of the x axis in degrees, for files and people."""
        return round(math.degrees(self.yaw_rad), 12)

    def locate(self, point: Point) -> LatLon:
        """Return the place on Earth of a point of the map, to a hundredth of a micrometre.

        Raises:
            MapError: It is too far from the anchor to have a latitude and longitude.
        """
        east, north = self._metres_per_degree()
        turned = Pose(0.0, 0.0, self.yaw_rad).transform(point)
        lat, lon = self.lat_deg + turned.y / north, self.lon_deg + turned.x / east
        if not (abs(lat) <= 90 and abs(lon - self.lon_deg) < 180):
            raise MapError(
                f"The point ({point.x:g}, {point.y:g}) of the map is too far from its anchor for "
                "latitude and longitude.",
                hint="Shift the map's origin to within a few kilometres of (0, 0).",
            )
        return LatLon(round(lat, DEGREE_DECIMALS), round(math.remainder(lon, 360), DEGREE_DECIMALS))

    def point_at(self, place: LatLon) -> Point:
        """Return the point of the map at a place on Earth, to the micrometre."""
        east, north = self._metres_per_degree()
        turned = Point(
            math.remainder(place.lon_deg - self.lon_deg, 360) * east,
            (place.lat_deg - self.lat_deg) * north,
        )
        point = Pose(0.0, 0.0, -self.yaw_rad).transform(turned)
        return Point(
            round(point.x, MICROMETRE_DECIMALS) + 0.0, round(point.y, MICROMETRE_DECIMALS) + 0.0
        )

    def _metres_per_degree(self) -> tuple[float, float]:
        """Return the metres to the east and to the north that one degree covers."""
        lat_rad = math.radians(self.lat_deg)
        root = math.sqrt(1 - _SQUARED_ECCENTRICITY * math.sin(lat_rad) ** 2)
        normal_m = _EQUATORIAL_RADIUS_M / root
        meridian_m = _EQUATORIAL_RADIUS_M * (1 - _SQUARED_ECCENTRICITY) / root**3
        return math.radians(normal_m * math.cos(lat_rad)), math.radians(meridian_m)
