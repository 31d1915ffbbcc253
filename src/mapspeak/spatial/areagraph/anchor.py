"""Where on Earth a map lies: metres in the map frame, and latitude and longitude."""

import math
from dataclasses import dataclass

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial.areagraph.graph import MICROMETRE_DECIMALS

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
    """Where on Earth the map frame's (0, 0) lies, and where its x axis points.

    The conversion is the flat one around the anchor, with the radii of curvature of the WGS 84
    ellipsoid there. Meridians converge, which it leaves out: x y tan(latitude) / 6.4e6 m, or 2 cm
    at 300 m and 0.3 m at 1 km from an anchor at 60 degrees.

    Attributes:
        lat_deg: WGS 84 latitude of (0, 0), from -85 to 85.
        lon_deg: WGS 84 longitude of (0, 0), from -180 to 180.
        yaw_rad: Direction of the x axis, counter-clockwise from east (REP 103).

    Raises:
        MapError: It is no such place.
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
        """The direction of the x axis as files and people say it."""
        return round(math.degrees(self.yaw_rad), 12)

    def locate(self, point: Point) -> LatLon:
        """Return the place on Earth of a point of the map, to a hundredth of a micrometre.

        Raises:
            MapError: It is so far from the anchor that degrees run out.
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
