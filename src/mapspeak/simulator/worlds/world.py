"""A world as it truly is: walls, doors, objects, rooms. `worldfiles` reads it from a file."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from mapspeak.geometry import Point, Pose
from mapspeak.spatial.rooms import RoomClass

BODY_RADIUS_M = 0.28
"""Of the robot: a world must have room for it."""
BODY_BAND_M = (0.02, 1.2)
"""The heights between which its body, camera mast included, bumps into things."""
LEAF_M, LEAF_HEIGHT_M = 0.05, 2.1
"""Of a door that is shut."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldWall:
    """A straight piece of wall along its centre line, already cut where doors are."""

    start: Point
    end: Point
    thickness_m: float
    height_m: float

    @property
    def pose(self) -> Pose:
        """Its start; the x axis looks along it."""
        return Pose(self.start.x, self.start.y, self.start.bearing_to(self.end))

    @property
    def length_m(self) -> float:
        """From one end to the other."""
        return self.start.distance_to(self.end)

    def point_at(self, along_m: float) -> Point:
        """Return the point of the centre line at a distance from the start."""
        return self.pose.transform(Point(along_m, 0.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldDoor:
    """A gap that was cut into a wall.

    Attributes:
        name: Unique in its world.
        pose: The middle of the gap on the wall's centre line; its x axis looks along the wall.
        width_m: Between the two ends of the wall.
        is_shut: Its leaf stands in it; the robot can have it opened.
    """

    name: str
    pose: Pose
    width_m: float
    is_shut: bool = False

    @property
    def leaf(self) -> WorldWall:
        """The leaf that fills it while it is shut."""
        half = self.width_m / 2
        start, end = (self.pose.transform(Point(side * half, 0.0)) for side in (-1, 1))
        return WorldWall(start=start, end=end, thickness_m=LEAF_M, height_m=LEAF_HEIGHT_M)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldObject:
    """A thing in the world.

    Attributes:
        name: Unique in its world.
        kind: One of `mapspeak.simulator.worlds.models.kind_names`.
        pose: Where its own frame stands on the floor plan; its front faces along its x axis.
        base_height_m: How high above the floor it hangs; None for the kind's usual height.
    """

    name: str
    kind: str
    pose: Pose
    base_height_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueRoom:
    """A room, corridor or open space as a person would outline it on the plan.

    Attributes:
        name: Unique in its world.
        outline: The corners, in order.
    """

    name: str
    room_class: RoomClass
    outline: tuple[Point, ...]

    def contains(self, point: Point) -> bool:
        """Return True when a point of the world's own frame lies inside the outline."""
        n_crossings = 0
        for start, end in zip(self.outline, (*self.outline[1:], self.outline[0]), strict=True):
            if (start.y > point.y) != (end.y > point.y):
                share = (point.y - start.y) / (end.y - start.y)
                n_crossings += start.x + share * (end.x - start.x) > point.x
        return n_crossings % 2 == 1


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """Everything that is true of a world. Scoring may read it; tools never do.

    Attributes:
        start: Where the robot stands at first, in the world's own frame.
        battery_ratio: How full its battery is then.
        n_faults: How often each of its skills fails before it works, by name.
    """

    name: str
    title: str
    walls: tuple[WorldWall, ...]
    objects: tuple[WorldObject, ...]
    rooms: tuple[TrueRoom, ...]
    start: Pose
    doors: tuple[WorldDoor, ...] = ()
    battery_ratio: float = 1.0
    n_faults: Mapping[str, int] = field(default_factory=dict)
