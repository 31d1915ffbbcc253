"""A memory of the two drawn rooms for tests: who looked where and named what."""

import math

from fakes import two_rooms
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.worldmodel.model import WorldModel

LADDER = Point(0.3, 2.4)
"""At the west wall of the west room, R2."""
EXTINGUISHER = Point(7.4, 1.5)
"""At the east wall of the east room, R1."""
ROBOT = Pose(1.5, 1.4, 0.0)


def look(
    name: str,
    x: float,
    y: float,
    *things: tuple[str, Point],
    yaw_deg: float = 0.0,
    range_m: float | None = None,
) -> Waypoint:
    """A waypoint that names things in their true directions, and perhaps a distance."""
    pose = Pose(x, y, math.radians(yaw_deg))
    landmarks = tuple(
        Landmark(
            label=label,
            bearing_rad=pose.point.bearing_to(point) - pose.yaw_rad,
            range_m=range_m,
        )
        for label, point in things
    )
    return Waypoint(name=name, pose=pose, functional_landmarks=landmarks)


def looks_at(label: str, point: Point) -> tuple[Waypoint, ...]:
    """Two waypoints in the east room that name one thing."""
    return (look("east a", 4.5, 0.6, (label, point)), look("east b", 5.5, 2.2, (label, point)))


def world_of(*waypoints: Waypoint, previous: WorldModel | None = None) -> WorldModel:
    """The two rooms with that memory."""
    return WorldModel(
        two_rooms() if previous is None else previous.grid,
        ROBOT,
        SemanticMap(waypoints=waypoints),
        radius_m=0.2,
        previous=previous,
    )
