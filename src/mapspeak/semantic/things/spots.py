"""Where a direction and a range together say that a thing is, and which two views exclude it.

Lines of sight cross somewhere even where the views are of two things. Who tells how far each is
has said that they are two, and that weighs more than the crossing.
"""

import math
from dataclasses import dataclass

from mapspeak.geometry import Point, Pose
from mapspeak.semantic.things.noise import NoiseModel
from mapspeak.semantic.things.sight import BODY_M
from mapspeak.semantic.waypoint import Landmark

__all__ = ["N_SIGMAS", "Spot", "are_apart", "find_spot"]

N_SIGMAS = 2.5
"""Of views of one thing, one pair in twenty lies farther apart (chi-squared, two dimensions).

One such pair in twenty splits a thing in two, which makes it ambiguous and so is told; joining two
things makes one in a wrong place that nothing tells. Hence no wider; narrower splits ever more.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spot:
    """A point in the map frame, and its covariance in square metres.

    Attributes:
        point: The end of the line of sight.
        xx: The variance along x.
        xy: The covariance of x and y.
        yy: The variance along y.
    """

    point: Point
    xx: float
    xy: float
    yy: float


def find_spot(pose: Pose, landmark: Landmark, noise: NoiseModel) -> Spot | None:
    """Gives where a landmark says that its thing is; None without a direction or a range."""
    if landmark.bearing_rad is None or landmark.range_m is None:
        return None
    way, far_m = pose.yaw_rad + landmark.bearing_rad, landmark.range_m
    # A range ends at the surface or in the middle of a thing; nobody says which.
    body = (BODY_M / 2) ** 2
    along = (noise.range_m + noise.range_ratio * far_m) ** 2 + body
    across = (noise.bearing_rad * far_m) ** 2 + body
    cos, sin = math.cos(way), math.sin(way)
    return Spot(
        point=Point(pose.x + far_m * cos, pose.y + far_m * sin),
        xx=along * cos * cos + across * sin * sin,
        xy=(along - across) * cos * sin,
        yy=along * sin * sin + across * cos * cos,
    )


def are_apart(one: Spot | None, other: Spot | None) -> bool:
    """True for two spots so far apart that one thing is hardly in both."""
    if one is None or other is None:
        return False
    dx, dy = one.point.x - other.point.x, one.point.y - other.point.y
    xx, xy, yy = one.xx + other.xx, one.xy + other.xy, one.yy + other.yy
    squared = (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
    return squared > N_SIGMAS**2
