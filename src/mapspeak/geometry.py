"""Points, poses and angles in the plane: SI units, x forward, y left, yaw counter-clockwise.

Conventions are those of ROS REP 103 (units and axes) and REP 105 (frames). A point or pose whose
name says no frame is in the `map` frame.
"""

import math
from dataclasses import dataclass


def wrap_angle(angle_rad: float) -> float:
    """Return the same angle in (-pi, pi]."""
    wrapped = math.remainder(angle_rad, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


@dataclass(frozen=True, slots=True)
class Point:
    """A place in the plane, in metres."""

    x: float
    y: float

    def distance_to(self, other: "Point") -> float:
        """Return the straight distance in metres."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def bearing_to(self, other: "Point") -> float:
        """Return the direction to the other point, as a yaw in radians."""
        return math.atan2(other.y - self.y, other.x - self.x)


@dataclass(frozen=True, slots=True)
class Pose:
    """A place and a heading; also the rigid transform from its own frame to the outer one.

    Attributes:
        yaw_rad: Heading, counter-clockwise from the outer x axis.
    """

    x: float
    y: float
    yaw_rad: float = 0.0

    @property
    def point(self) -> Point:
        """The place without the heading."""
        return Point(self.x, self.y)

    @property
    def yaw_deg(self) -> float:
        """The heading as people and models read it."""
        return math.degrees(self.yaw_rad)

    def __matmul__(self, inner: "Pose") -> "Pose":
        """Chain two transforms: `map_from_odom @ odom_from_base` gives `map_from_base`."""
        place = self.transform(inner.point)
        return Pose(place.x, place.y, wrap_angle(self.yaw_rad + inner.yaw_rad))

    def inverse(self) -> "Pose":
        """Return the transform the other way round."""
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return Pose(
            -cos * self.x - sin * self.y, sin * self.x - cos * self.y, wrap_angle(-self.yaw_rad)
        )

    def transform(self, point: Point) -> Point:
        """Take a point of this pose's own frame to the outer frame."""
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return Point(self.x + cos * point.x - sin * point.y, self.y + sin * point.x + cos * point.y)

    def point_at(self, bearing_rad: float, range_m: float) -> Point:
        """Return the point so far off in a direction, which counts from the heading."""
        return self.transform(
            Point(range_m * math.cos(bearing_rad), range_m * math.sin(bearing_rad))
        )

    def is_near(self, other: "Pose", *, off_m: float, turn_rad: float) -> bool:
        """Return True when the other is no farther away and turned by no more than that."""
        turned_rad = abs(wrap_angle(other.yaw_rad - self.yaw_rad))
        return self.point.distance_to(other.point) <= off_m and turned_rad <= turn_rad

    def is_finite(self) -> bool:
        """Return True when no coordinate is NaN or infinite."""
        return all(math.isfinite(value) for value in (self.x, self.y, self.yaw_rad))
