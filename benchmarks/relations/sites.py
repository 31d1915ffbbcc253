"""The maps of the benchmark, with what is true on them: rooms, doors, remembered places.

Truth comes from what the maps were drawn from, in the map frame, and not from the map.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.simulator.truth import TrueFloor
from mapspeak.simulator.worlds.worldfiles import load_world
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map

__all__ = ["Site", "TrueDoor", "TrueRoom", "build_sites"]

CELL_M = 0.05
MAPS = Path(__file__).parents[2] / "tests" / "maps"

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class TrueRoom:
    """A room by its corners, in metres, counter-clockwise."""

    name: str
    corners: tuple[Point, ...]

    @property
    def middle(self) -> Point:
        """The mean of the corners."""
        n = len(self.corners)
        return Point(sum(p.x for p in self.corners) / n, sum(p.y for p in self.corners) / n)


@dataclass(frozen=True, slots=True)
class TrueDoor:
    """A door by its middle, the direction in which it leads, and its width in metres."""

    place: Point
    normal_rad: float
    width_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Site:
    """A map with a robot in it, and what is true there."""

    name: str
    grid: OccupancyGrid
    robot: Pose
    radius_m: float = 0.22
    rooms: tuple[TrueRoom, ...] = ()
    doors: tuple[TrueDoor, ...] = ()
    memory: SemanticMap = field(default_factory=SemanticMap)


def build_sites() -> Iterator[Site]:
    """Return every map, robots and remembered places included."""
    yield _offices("offices", turn=Pose(0.0, 0.0, 0.0))
    yield _offices("offices turned by 30 degrees", turn=Pose(-7.0, 3.0, math.radians(30)))
    yield _flat()
    yield _drawn()
    yield _world("office")
    yield _world("warehouse")
    yield _small_house()
    yield _freiburg()


def _remember(*poses: tuple[str, Pose], things: Sequence[Landmark] = ()) -> SemanticMap:
    places = [Waypoint(name=name, pose=pose) for name, pose in poses]
    if things:
        first = places[0]
        places[0] = Waypoint(name=first.name, pose=first.pose, functional_landmarks=tuple(things))
    return SemanticMap(waypoints=tuple(places))


def _box(name: str, x: float, y: float, width: float, height: float, turn: Pose) -> TrueRoom:
    corners = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
    return TrueRoom(name, tuple(turn.transform(Point(*corner)) for corner in corners))


def _paint(
    size: tuple[float, float], walls: Sequence[Box], gaps: Sequence[Box], things: Sequence[Box]
) -> np.ndarray:
    """Return cells of 0.05 m with walls, openings cut into them, and furniture, as x, y, w, h."""
    cells = np.zeros((round(size[1] / CELL_M), round(size[0] / CELL_M)), dtype=np.int8)
    for value, boxes in ((100, walls), (0, gaps), (100, things)):
        for x, y, width, height in boxes:
            rows = slice(round(y / CELL_M), round((y + height) / CELL_M))
            cells[rows, round(x / CELL_M) : round((x + width) / CELL_M)] = value
    return cells


def _offices(name: str, *, turn: Pose) -> Site:
    """Draw six rooms along a corridor, with walls of 0.1 m, desks and cupboards; 14 x 10 m."""
    outer: list[Box] = [(0, 0, 14, 0.1), (0, 9.9, 14, 0.1), (0, 0, 0.1, 10), (13.9, 0, 0.1, 10)]
    inner: list[Box] = [(0, 4, 14, 0.1), (0, 5.9, 14, 0.1)]
    inner += [(x, 0, 0.1, 4) for x in (4.5, 9.5)] + [(x, 6, 0.1, 4) for x in (5, 9)]
    doors = [(2.3, 4.05), (7.0, 4.05), (12.0, 4.05), (2.5, 5.95), (7.0, 5.95), (11.0, 5.95)]
    gaps = [(x - 0.45, y - 0.1, 0.9, 0.2) for x, y in doors]
    desks = [
        (0.1, 1.5, 0.8, 1.4),
        (12.9, 0.1, 1.0, 0.6),
        (6.5, 1.2, 1.0, 0.6),
        (0.1, 9.3, 0.6, 0.6),
    ]
    grid = OccupancyGrid(
        cells=_paint((14, 10), [*outer, *inner], gaps, desks), resolution_m=CELL_M, origin=turn
    )
    boxes = [
        ("corridor", 0.1, 4.1, 13.8, 1.8),
        ("a", 0.1, 0.1, 4.4, 3.9),
        ("b", 4.6, 0.1, 4.9, 3.9),
        ("c", 9.6, 0.1, 4.3, 3.9),
        ("d", 0.1, 6.0, 4.9, 3.9),
        ("e", 5.1, 6.0, 3.9, 3.9),
        ("f", 9.1, 6.0, 4.8, 3.9),
    ]
    normal_rad = turn.yaw_rad + math.pi / 2
    places = [
        ("plotter", Pose(2.5, 2.0, 0.0)),
        ("window seat", Pose(7.0, 2.6, math.pi / 2)),
        ("long table", Pose(11.5, 8.0, math.pi)),
        ("corridor sign", Pose(5.0, 5.0, -math.pi / 2)),
        ("coat rack", Pose(3.0, 8.0, -2.2)),
    ]
    sink = Landmark(label="sink", bearing_rad=0.0, range_m=1.2)
    return Site(
        name=name,
        grid=grid,
        robot=turn @ Pose(1.5, 5.0, 0.0),
        rooms=tuple(_box(*box, turn) for box in boxes),
        doors=tuple(TrueDoor(turn.transform(Point(x, y)), normal_rad, 0.9) for x, y in doors),
        memory=_remember(*((each, turn @ pose) for each, pose in places), things=[sink]),
    )


def _flat() -> Site:
    """Draw three rooms in a row with partitions of one cell, and a half-high one; 12 x 5 m."""
    walls: list[Box] = [(0, 0, 12, 0.05), (0, 4.95, 12, 0.05), (0, 0, 0.05, 5), (11.95, 0, 0.05, 5)]
    walls += [(4, 0, 0.05, 5), (8, 0, 0.05, 5), (6, 0, 0.05, 2)]
    gaps = [(3.95, 3.0, 0.15, 1.0), (7.95, 3.0, 0.15, 1.0)]
    grid = OccupancyGrid(
        cells=_paint((12, 5), walls, gaps, [(9.5, 2.2, 0.8, 0.8)]), resolution_m=CELL_M
    )
    plain = Pose(0.0, 0.0)
    return Site(
        name="flat with thin walls",
        grid=grid,
        robot=Pose(1.0, 1.0, 1.0),
        rooms=(
            _box("left", 0.05, 0.05, 3.95, 4.9, plain),
            _box("right", 8.05, 0.05, 3.9, 4.9, plain),
        ),
        doors=(
            TrueDoor(Point(4.02, 3.5), 0.0, 1.0),
            TrueDoor(Point(8.02, 3.5), 0.0, 1.0),
        ),
        memory=_remember(
            ("bed", Pose(3.3, 1.2, 0.0)),
            ("sofa", Pose(5.2, 0.9, math.pi / 2)),
            ("shelf", Pose(6.9, 0.9, 0.0)),
            ("stove", Pose(10.8, 4.0, -math.pi / 2)),
            things=[Landmark(label="lamp", bearing_rad=math.pi / 2, range_m=2.0)],
        ),
    )


DRAWN = """
########################################
#..................#...................#
#..................#...................#
#..................#...................#
#......................................#
#......................................#
#......................................#
#..................#...................#
#..................#...........##......#
#..................#...........##......#
########...#########...................#
#..................#...................#
#..................#...................#
#..................########...##########
#..................#...................#
#..................#...................#
#..................#...................#
#..................#...................#
#..................#...................#
########################################
"""


def _drawn() -> Site:
    """Read a map drawn as text, 0.25 m to each sign; one of its rooms is L-shaped."""
    lines = [line for line in DRAWN.split("\n") if line]
    cells = np.array([[100 if sign == "#" else 0 for sign in line] for line in reversed(lines)])
    plain = Pose(0.0, 0.0)
    return Site(
        name="drawn as text",
        grid=OccupancyGrid(cells=cells.astype(np.int8), resolution_m=0.25),
        robot=Pose(1.5, 4.0, 0.0),
        radius_m=0.25,
        rooms=(
            _box("north-west", 0.25, 2.5, 4.5, 2.25, plain),
            _box("south-west", 0.25, 0.25, 4.5, 2.0, plain),
            _box("south-east", 5.0, 0.25, 4.75, 1.25, plain),
            _box("east", 5.0, 1.75, 4.75, 3.0, plain),
        ),
        doors=(
            TrueDoor(Point(4.875, 3.625), 0.0, 0.75),
            TrueDoor(Point(2.375, 2.375), math.pi / 2, 0.75),
            TrueDoor(Point(7.125, 1.625), math.pi / 2, 0.75),
        ),
        memory=_remember(("desk", Pose(1.5, 1.2, 0.0)), ("rug", Pose(6.5, 3.2, math.pi / 2))),
    )


def _world(name: str) -> Site:
    """Return a shipped world as its robot's map would be, its objects as seen from the dock."""
    world = load_world(name)
    floor = TrueFloor(world)
    to_map = world.start.inverse()
    rooms = tuple(
        TrueRoom(room.name, tuple(to_map.transform(p) for p in room.outline))
        for room in world.rooms
        if len(room.outline) == 4
    )
    doors = tuple(
        TrueDoor(
            to_map.transform(door.pose.point),
            (to_map @ door.pose).yaw_rad + math.pi / 2,
            door.width_m,
        )
        for door in world.doors
    )
    middles = [(f"{room.name} spot", Pose(room.middle.x, room.middle.y, 0.3)) for room in rooms]
    return Site(
        name=name,
        grid=floor.visible,
        robot=Pose(0.0, 0.0, 0.0),
        rooms=rooms,
        doors=doors,
        memory=_remember(*middles),
    )


def _small_house() -> Site:
    grid = load_map(MAPS / "aws_small_house" / "map.yaml").grid
    return _surveyed("aws_small_house", grid)


def _freiburg() -> Site:
    grid = load_map(MAPS / "freiburg79" / "half.yaml").grid
    return _surveyed("freiburg79", grid)


def _surveyed(name: str, grid: OccupancyGrid) -> Site:
    """Return a map of which only the cells are known; places are spread over the open floor."""
    clear = cv2.distanceTransform((~grid.occupied & grid.free).astype(np.uint8), cv2.DIST_L2, 5)
    poses = []
    for number in range(7):
        row, col = np.unravel_index(int(np.argmax(clear)), clear.shape)
        x, y = grid.points_at(np.array([row]), np.array([col]))[0].tolist()
        poses.append((f"place {number}", Pose(x, y, math.remainder(number * 1.3, math.tau))))
        rows, cols = np.indices(clear.shape)
        clear[np.hypot(rows - row, cols - col) * grid.resolution_m < 2.5] = 0
    return Site(name=name, grid=grid, robot=poses[0][1], memory=_remember(*poses[1:]))
