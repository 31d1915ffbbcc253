"""Thirty questions about six furnished plans, answered from what two tools say, without a model.

Of each plan: which room is the second smallest, which the largest, how many there are, how long
the way to the largest is, and which room is the nearest by way. They are answered from one
`look_at_map` and one `measure` by reading the tables; what is right is computed from the drawn
plan, and by a search of its own over the true floor (Dijkstra 1959), which share nothing with the
tools. A room is the right one if the place where it is said to be lies in the true one.

The plans are those of `benchmarks.rooms` that rooms were developed on, one of each style.
"""

import heapq
import math
import re
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import anyio
import cv2
import numpy as np
from mcp.client import Client
from mcp_types import TextContent
from numpy.typing import NDArray

from benchmarks.figure import Figure
from benchmarks.rooms.drawn import DEVELOPED_ON, draw_worlds, number_spaces
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.session import Session
from mapspeak.simulator import TrueFloor, World
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomClass

__all__ = ["measure"]

SAME_SIZE = 1.03
"""Floors that differ by less are equally large: maps round them so."""
WAY_SLACK = 0.05
SIZES = re.compile(
    r"^Of (\d+) (?:sure )?rooms.* the smallest is (R\d+|O\d+) .*?, then (R\d+|O\d+) .*"
    r"the largest is (R\d+|O\d+) ",
    re.MULTILINE,
)
PART = re.compile(r"^([RO]\d+) \| .* \(probably part of ([RO]\d+): D\d+\)", re.MULTILINE)
ROW = re.compile(r"^([RO]\d+) \| (-?[\d.]+), (-?[\d.]+) \| ([\d.]+) \|", re.MULTILINE)
KINDS = ("second smallest", "largest", "count", "way", "nearest")


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers:
    """What a reader of the tables says.

    Attributes:
        places: Where each room is, and how many metres of way there are to it.
    """

    n_rooms: int
    second: str
    largest: str
    places: dict[str, tuple[Point, float]]

    @property
    def nearest(self) -> str:
        """The room with the shortest way, but for that in which the robot is."""
        return min((way_m, name) for name, (_, way_m) in self.places.items() if way_m > 0)[1]


async def ask(grid: OccupancyGrid, start: Pose, folder: Path) -> Answers:
    """Call both tools on a map, and read what they say."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from fakes import FakeRobot  # noqa: PLC0415 - of the tests

    robot = FakeRobot(grid, pose=start)
    memory = SemanticMapStore(folder / "memory.yaml", map_id=robot.description.map_name)
    session = Session(robot, memory, lease_s=math.inf, find_model=lambda: None)
    async with Client(build_server(session, toolsets=("look", "places"))) as client:
        look = await _call(client, "look_at_map")
        names = re.findall(r"^([RO]\d+) \| ", look, re.MULTILINE)
        ways = await _call(client, "measure", places=names)
    sizes = SIZES.search(look)
    if sizes is None:
        raise AssertionError(look)
    # Two rooms that are probably parts of each other are one; the count leaves both out.
    parts = dict(PART.findall(look))
    n_pairs = sum(parts.get(other) == name for name, other in parts.items()) // 2
    return Answers(
        n_rooms=int(sizes[1]) + n_pairs,
        second=sizes[3],
        largest=sizes[4],
        places={
            name: (Point(float(x), float(y)), float(way_m))
            for name, x, y, way_m in ROW.findall(ways)
        },
    )


async def _call(client: Client, tool: str, **arguments: object) -> str:
    result = await client.call_tool(tool, arguments)
    return "\n".join(each.text for each in result.content if isinstance(each, TextContent))


def judge(world: World, folder: Path) -> dict[str, bool]:
    """Ask about one plan; return which answers are right."""
    grid = TrueFloor(world).visible
    answers = anyio.run(ask, grid, Pose(0.0, 0.0, 0.0), folder)
    numbers, classes = number_spaces(world, grid)
    counts = np.bincount(numbers.ravel(), minlength=len(classes) + 1)
    rooms = [number for number, each in enumerate(classes, 1) if each is not RoomClass.CORRIDOR]
    by_size = sorted(counts[number] for number in rooms)

    def space_of(name: str) -> int:
        cell = grid.cell_at(answers.places[name][0])
        return int(numbers[cell.row, cell.col])

    def is_as_large(name: str, n_cells: int) -> bool:
        ratio = counts[space_of(name)] / n_cells
        return space_of(name) in rooms and 1 / SAME_SIZE <= ratio <= SAME_SIZE

    ways_m = search_ways(grid, Point(0.0, 0.0))
    way_m = {
        name: ways_m[grid.cell_at(at).row, grid.cell_at(at).col]
        for name, (at, _) in answers.places.items()
    }
    here = int(numbers[grid.cell_at(Point(0.0, 0.0)).row, grid.cell_at(Point(0.0, 0.0)).col])
    others = [name for name in way_m if space_of(name) != here]
    return {
        "second smallest": is_as_large(answers.second, by_size[1]),
        "largest": is_as_large(answers.largest, by_size[-1]),
        "count": answers.n_rooms == len(rooms),
        "way": math.isclose(
            answers.places[answers.largest][1], way_m[answers.largest], rel_tol=WAY_SLACK
        ),
        "nearest": way_m[answers.nearest] <= (1 + WAY_SLACK) * min(way_m[each] for each in others),
    }


def search_ways(grid: OccupancyGrid, start: Point) -> NDArray[np.float64]:
    """Return the metres from a point to each cell, by the eight neighbours of cells.

    The robot's middle keeps its radius from what is not free, where that can be.
    """
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from fakes import FakeRobot  # noqa: PLC0415 - of the tests

    radius_m = FakeRobot(grid).description.radius_m
    clear_m = cv2.distanceTransform(grid.free.astype(np.uint8), cv2.DIST_L2, 5) * grid.resolution_m
    can_stand = clear_m >= radius_m
    ways_m = np.full(grid.cells.shape, np.inf)
    first = grid.cell_at(start)
    waiting = [(0.0, first.row, first.col)]
    ways_m[first.row, first.col] = 0.0
    while waiting:
        way_m, row, col = heapq.heappop(waiting)
        if way_m > ways_m[row, col]:
            continue
        for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            there = row + down, col + right
            further_m = way_m + math.hypot(down, right) * grid.resolution_m
            if can_stand[there] and further_m < ways_m[there]:
                ways_m[there] = further_m
                heapq.heappush(waiting, (further_m, *there))
    return ways_m


def measure() -> Iterator[Figure]:
    """Ask five questions about each plan."""
    right: dict[str, list[bool]] = {kind: [] for kind in KINDS}
    for world in draw_worlds(DEVELOPED_ON[:1]):
        with tempfile.TemporaryDirectory() as folder:
            for kind, is_right in judge(world, Path(folder)).items():
                right[kind].append(is_right)
    for kind, all_of_them in right.items():
        title = f"{kind}, of {len(all_of_them)}"
        yield Figure(name=title, value=sum(all_of_them), unit="right")
    n = sum(map(len, right.values()))
    yield Figure(name=f"all, of {n}", value=sum(map(sum, right.values())), unit="right")
