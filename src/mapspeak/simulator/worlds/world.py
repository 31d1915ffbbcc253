"""A world as it truly is: walls, doors, objects, rooms; read by `worldfiles`, or made of a map.

Of a map, the occupied cells become walls and there are no objects; unknown parts are closed off by
a wall, since what would be seen there is not known.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.paths import clearance_m
from mapspeak.spatial.rooms import RoomClass

BODY_RADIUS_M = 0.28
"""Of the robot: a world must have room for it."""
BODY_BAND_M = (0.02, 1.2)
"""The heights between which its body, camera mast included, bumps into things."""
LEAF_M, LEAF_HEIGHT_M = 0.05, 2.1
"""Of a door that is shut."""
WALL_HEIGHT_M = 2.6
Mask = NDArray[np.bool_]


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


def build_map_world(grid: OccupancyGrid, *, name: str, start: Pose | None = None) -> World:
    """Build a world whose floor is that of a map; its frame is the map's.

    Args:
        start: Where the robot stands at first; None for where it has most room.

    Raises:
        MapError: The map has no floor on which the robot fits.
    """
    floor = find_floor(grid)
    if not floor.any():
        raise MapError(
            f"The map {name} has no free floor on which the robot, {BODY_RADIUS_M} m in radius,"
            " fits.",
            hint="Use a map with free cells, and look at its resolution and thresholds.",
        )
    return World(
        name=name,
        title=f"The building of the map {name}.",
        walls=tuple(_raise_walls(grid)),
        objects=(),
        rooms=(),
        start=_roomiest(grid, floor) if start is None else start,
    )


def find_floor(grid: OccupancyGrid) -> Mask:
    """Find the largest floor of a map on which the robot can come from anywhere to anywhere."""
    solid = _find_solid(grid)
    closed = OccupancyGrid(
        cells=np.where(solid | ~grid.free, 100, 0).astype(np.int8),
        resolution_m=grid.resolution_m,
        origin=grid.origin,
    )
    # One cell more than the radius, because clearances end at the centres of cells.
    is_clear = closed.free & (clearance_m(closed) >= BODY_RADIUS_M + grid.resolution_m)
    n_labels, labels, statistics, _ = cv2.connectedComponentsWithStats(
        is_clear.view(np.uint8), connectivity=4
    )
    if n_labels < 2:
        return np.zeros(grid.cells.shape, dtype=np.bool_)
    return np.asarray(labels == 1 + int(statistics[1:, cv2.CC_STAT_AREA].argmax()))


def _roomiest(grid: OccupancyGrid, floor: Mask) -> Pose:
    room = np.where(floor, clearance_m(grid), -1.0)
    row, col = np.unravel_index(int(np.argmax(room)), room.shape)
    middle = grid.point_at(Cell(int(row), int(col)))
    return Pose(middle.x, middle.y, grid.origin.yaw_rad)


def _find_solid(grid: OccupancyGrid) -> Mask:
    """Return True where the map has a wall, and where floor ends without one."""
    free = np.pad(grid.free, 1).view(np.uint8)
    beside_floor = cv2.dilate(free, np.ones((3, 3), dtype=np.uint8)) > 0
    is_rim = (beside_floor & (free == 0))[1:-1, 1:-1]
    edge = np.zeros(grid.cells.shape, dtype=np.bool_)
    edge[[0, -1], :] = edge[:, [0, -1]] = True
    return np.asarray(grid.occupied | is_rim | (edge & grid.free))


def _raise_walls(grid: OccupancyGrid) -> Iterator[WorldWall]:
    """Return a wall for each rectangle of solid cells."""
    size_m = grid.resolution_m
    for rows, cols in _cover(_find_surface(grid)):
        middle = (rows.start + rows.stop) / 2 * size_m
        yield WorldWall(
            start=grid.origin.transform(Point(cols.start * size_m, middle)),
            end=grid.origin.transform(Point(cols.stop * size_m, middle)),
            thickness_m=(rows.stop - rows.start) * size_m,
            height_m=WALL_HEIGHT_M,
        )


def _find_surface(grid: OccupancyGrid) -> Mask:
    """Return the solid cells that anything can touch or see: those near floor."""
    near = cv2.dilate(grid.free.view(np.uint8), np.ones((5, 5), dtype=np.uint8)) > 0
    return np.asarray(_find_solid(grid) & near)


def _cover(solid: Mask) -> Iterator[tuple[slice, slice]]:
    """Cover cells with rectangles: runs along the rows, joined where they lie on each other."""
    open_ones: dict[tuple[int, int], int] = {}
    for row in range(solid.shape[0] + 1):
        runs = set(_runs(solid[row])) if row < solid.shape[0] else set()
        for run in [run for run in open_ones if run not in runs]:
            yield slice(open_ones.pop(run), row), slice(*run)
        for run in runs:
            open_ones.setdefault(run, row)


def _runs(line: Mask) -> Iterable[tuple[int, int]]:
    """Return from where to where the true cells of a line go."""
    ends = np.flatnonzero(np.diff(np.concatenate(([False], line, [False])).astype(np.int8)))
    return zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True)
