"""What is told of rooms while the 14 shipped worlds are still being explored, and how ids hold.

Each world is explored once by the exploration loop, one goal at a time; the map at every stop is
kept in a folder of the system's temporary one. The rooms of those maps are found anew each time,
so that another rule is measured on the same maps. Looks count from 60 % explored on: the share of
the reachable floor that is on the map. Truth comes from the simulator, and nothing else sees it.

A region told as seen whole is false when no true space covers the same floor with an intersection
over union of .5; corridors that meet without a wall may be one space or several. The smallest room
is right when it covers the true smallest so, or one that is at most 5 % larger. It is unsure while
a frontier may lead to another room, when it may grow beyond the second, and when a smaller one may
be part of another; what is probably part of another leaves nothing open. An id changes its owner
when the true space that it shares most floor with is not the one at the look before.
"""

import math
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import anyio
import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.exploration import Truth, choose_start, known_ratio
from benchmarks.figure import Figure
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration.explorer import Explorer
from mapspeak.driving.exploration.progress import Bounds
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.geometry import Pose
from mapspeak.links.simulated import SimulatedRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.session import Session
from mapspeak.simulator import MeasuredRoom, Simulation, load_world, world_names
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import Region, RoomClass, RoomMap, find_rooms
from mapspeak.worldmodel.model import HIDDEN_M2, HIDDEN_RATIO, WorldModel

__all__ = ["measure"]

WAIT_S = 20.0
MOST_CALLS = 200
COUNTED_RATIO, LATE_RATIO = 0.60, 0.95
LEAST_IOU = 0.5
SAME_SIZE = 1.05
IDLE_M2 = 1.5
FOLDER = Path(tempfile.gettempdir()) / "mapspeak-growing-rooms"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Look:
    """The map at one stop.

    Attributes:
        known_ratio: Of the reachable floor.
        borders: Points on the border with the unknown, shape (n, 2): those of every frontier,
            refused ones included, and the poses to look beyond them.
        gains_m2: What each frontier that is not refused promises; their poses come first in
            `borders`, their places next.
    """

    grid: OccupancyGrid
    known_ratio: float
    borders: NDArray[np.float64]
    gains_m2: NDArray[np.float64]


# --- recording -------------------------------------------------------------------------------


def load_looks(name: str, seed: int = 0) -> list[Look]:
    """Return the looks of one world from one start; explore it where that was not done yet."""
    path = FOLDER / f"{name}_{seed}.npz"
    if not path.exists():
        FOLDER.mkdir(exist_ok=True)
        _save(anyio.run(record, name, seed), path)
    with np.load(path) as kept:
        return [
            Look(
                grid=OccupancyGrid(
                    cells=kept[f"cells_{number}"],
                    resolution_m=float(resolution_m),
                    origin=Pose(float(x), float(y), float(yaw)),
                ),
                known_ratio=float(ratio),
                borders=kept[f"borders_{number}"],
                gains_m2=kept[f"gains_{number}"],
            )
            for number, (ratio, resolution_m, x, y, yaw) in enumerate(kept["looks"])
        ]


def _save(looks: list[Look], path: Path) -> None:
    rows = [
        (look.known_ratio, look.grid.resolution_m, *_pose_row(look.grid.origin)) for look in looks
    ]
    arrays = {"looks": np.array(rows)}
    for number, look in enumerate(looks):
        arrays[f"cells_{number}"] = look.grid.cells
        arrays[f"borders_{number}"] = look.borders
        arrays[f"gains_{number}"] = look.gains_m2
    np.savez_compressed(path, allow_pickle=False, **arrays)


def _pose_row(pose: Pose) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw_rad


async def record(name: str, seed: int) -> list[Look]:
    """Explore a world goal by goal, with a look at every answer."""
    simulation = Simulation(choose_start(load_world(name), seed), seed=seed)
    truth = Truth(simulation.truth.floor)
    robot = SimulatedRobot(simulation, has_detector=False)
    looks: list[Look] = []
    with tempfile.TemporaryDirectory() as folder:
        session = Session(robot, SemanticMapStore(Path(folder) / "map.yaml"), lease_s=math.inf)
        explorer = Explorer(session)
        for _ in range(MOST_CALLS):
            progress = await explorer.advance(Bounds(n_goals=1), wait_s=WAIT_S, on_trip=_no_news)
            looks.append(_look(await session.fetch_world_model(), truth))
            if progress.state.is_end and progress.n_goals == 0:
                return looks
    return looks


def _look(world: WorldModel, truth: Truth) -> Look:
    report = world.frontiers
    borders = [
        *(each.pose.point for each in report.frontiers),
        *(each.anchor for each in report.frontiers),
        *(each.anchor for each in report.refused),
    ]
    return Look(
        grid=world.grid,
        known_ratio=known_ratio(world.grid, truth.reachable),
        borders=np.array([(point.x, point.y) for point in borders]).reshape(-1, 2),
        gains_m2=np.array([each.gain_m2 for each in report.frontiers], np.float64),
    )


async def _no_news(_report: DriveReport) -> None:
    """Take no news."""


# --- measuring -------------------------------------------------------------------------------


class Spaces:
    """The true spaces of a world as masks of floor between walls."""

    def __init__(self, site: GroundTruth) -> None:
        self.rooms = site.rooms
        self.floor_m2 = [site.floor_area_m2(room) for room in self.rooms]
        self._labels = np.zeros(site.grid.cells.shape, np.int32)
        for number, room in enumerate(self.rooms, start=1):
            self._labels[site.cells_of(room)] = number
        self._grid = site.grid
        corridors = [number for number, room in enumerate(self.rooms, 1) if not _is_room(room)]
        floor = np.isin(self._labels, corridors).astype(np.uint8)
        halls = cv2.connectedComponents(floor, connectivity=4)[1]
        self._arms = [
            np.unique(self._labels[halls == hall]) - 1 for hall in range(1, int(halls.max()) + 1)
        ]

    def shared_m2(self, rooms: RoomMap) -> NDArray[np.float64]:
        """Return the floor that each region shares with each space; row 0 is no region."""
        rows, cols = np.nonzero(rooms.labels)
        points = rooms.grid.points_at(rows, cols)
        there = self._grid.look_up(self._labels, points, outside=0)
        here = rooms.labels[rows, cols].astype(np.intp)
        n_regions, n_spaces = len(rooms.regions) + 1, len(self.rooms) + 1
        counts = np.bincount(here * n_spaces + there, minlength=n_regions * n_spaces)
        return np.asarray(counts.reshape(n_regions, n_spaces)[:, 1:] * rooms.grid.resolution_m**2)

    def find_agreement(self, rooms: RoomMap, shared_m2: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the intersection over union of each region and space.

        Of corridors that meet, those that a region covers half of are one space to it.
        """
        region_m2 = np.array([0.0, *(region.floor_area_m2 for region in rooms.regions)])
        space_m2 = np.array(self.floor_m2)
        both_m2, union_m2 = shared_m2.copy(), np.tile(space_m2, (len(region_m2), 1))
        for region, arms in product(range(1, len(region_m2)), self._arms):
            own = arms[2 * shared_m2[region, arms] >= space_m2[arms]]
            both_m2[region, own] = shared_m2[region, own].sum()
            union_m2[region, own] = space_m2[own].sum()
        union_m2 += region_m2[:, None] - both_m2
        return np.asarray(both_m2 / np.maximum(union_m2, 1e-9))

    def find_smallest(self) -> list[int]:
        """Return which spaces are a right answer to which room is the smallest."""
        sizes = {
            number: self.floor_m2[number]
            for number, space in enumerate(self.rooms)
            if _is_room(space)
        }
        return [number for number, m2 in sizes.items() if m2 <= SAME_SIZE * min(sizes.values())]


def _is_room(space: MeasuredRoom) -> bool:
    return space.room.room_class is not RoomClass.CORRIDOR


@dataclass(slots=True)
class Tally:
    """Counts over looks.

    Attributes:
        n_whole: Regions told as seen whole; of them `n_false` are false.
        n_right: Looks at which the smallest room was right.
        n_unsure: At which it was said to be unsure; `n_fine` of them and of the right ones.
        n_new_class: Ids that changed class; `n_new_owner` owner; `n_come_or_gone` came or went,
            `n_idly` of them while nearly as much floor was known as at the look before.
    """

    n_looks: int = 0
    n_late: int = 0
    n_whole: int = 0
    n_false: int = 0
    n_right: int = 0
    n_fine: int = 0
    n_late_unsure: int = 0
    n_new_class: int = 0
    n_new_owner: int = 0
    n_come_or_gone: int = 0
    n_idly: int = 0
    wrong: list[str] = field(default_factory=list)


def find_unsure(rooms: RoomMap, look: Look) -> frozenset[str]:
    """Find the regions that are told as not all seen, or as maybe part of another."""
    there = rooms.grid.look_up(rooms.labels, look.borders, outside=0)
    return frozenset(
        region.id
        for region in rooms.regions
        if region.index in there or rooms.find_doubtful_door(region)
    )


def watch(name: str, tally: Tally) -> None:
    """Find the rooms at every look of one world, and count."""
    spaces = Spaces(GroundTruth(load_world(name)))
    rooms: RoomMap | None = None
    before: dict[int, tuple[RoomClass, int]] = {}
    floor_m2 = 0.0
    for number, look in enumerate(load_looks(name)):
        rooms = find_rooms(look.grid, previous=rooms)
        shared = spaces.shared_m2(rooms)
        now = {
            int(region.id[1:]): (region.room_class, int(shared[region.index].argmax()))
            for region in rooms.regions
        }
        if look.known_ratio >= COUNTED_RATIO:
            _count(f"{name} {number}", look, rooms, (spaces, shared), tally)
            both = before.keys() & now.keys()
            tally.n_new_class += sum(before[each][0] != now[each][0] for each in both)
            tally.n_new_owner += sum(before[each][1] != now[each][1] for each in both)
            n_come_or_gone = len(before.keys() ^ now.keys())
            tally.n_come_or_gone += n_come_or_gone
            is_idle = abs(shared.sum() - floor_m2) < IDLE_M2
            tally.n_idly += n_come_or_gone * is_idle
        before, floor_m2 = now, shared.sum()


def _count(
    where: str,
    look: Look,
    rooms: RoomMap,
    truth: tuple[Spaces, NDArray[np.float64]],
    tally: Tally,
) -> None:
    spaces, shared = truth
    unsure = find_unsure(rooms, look)
    iou = spaces.find_agreement(rooms, shared)
    whole = [region for region in rooms.regions if region.id not in unsure]
    false = [region for region in whole if iou[region.index].max() < LEAST_IOU]
    tally.n_looks += 1
    tally.n_whole += len(whole)
    tally.n_false += len(false)
    tally.wrong += [f"{where} {region.id} {region.floor_area_m2:.1f} m2" for region in false]
    by_size = list_by_size(rooms)
    smallest = by_size[0] if by_size else None
    is_right = smallest is not None and bool(
        (iou[smallest.index, spaces.find_smallest()] >= LEAST_IOU).any()
    )
    is_unsure = is_smallest_unsure(rooms, look)
    tally.n_right += is_right
    tally.n_fine += is_right or is_unsure
    if look.known_ratio >= LATE_RATIO:
        tally.n_late += 1
        tally.n_late_unsure += is_unsure


def list_by_size(rooms: RoomMap) -> list[Region]:
    """List the rooms that are compared by size, the smallest first."""
    sure = [each for each in rooms.regions if not rooms.find_doubtful_door(each)]
    named = [each for each in sure if each.room_class is not RoomClass.CORRIDOR]
    return sorted(named, key=lambda region: region.floor_area_m2)


def is_smallest_unsure(rooms: RoomMap, look: Look) -> bool:
    """Return True where the text leaves open which room is the smallest."""
    by_size = list_by_size(rooms)
    known_m2 = sum(region.floor_area_m2 for region in rooms.regions)
    is_much = look.gains_m2.sum() > HIDDEN_RATIO * known_m2
    if not by_size or is_much or (look.gains_m2 >= HIDDEN_M2).any():
        return True
    smallest = by_size[0]
    there = rooms.grid.look_up(rooms.labels, look.borders, outside=0) == smallest.index
    n = len(look.gains_m2)
    most_m2 = smallest.floor_area_m2 + look.gains_m2[there[:n] | there[n : 2 * n]].sum()
    return any(most_m2 > second.floor_area_m2 for second in by_size[1:2]) or any(
        region.floor_area_m2 <= smallest.floor_area_m2
        for region in rooms.regions
        if region.room_class is not RoomClass.CORRIDOR
        and (door := rooms.find_doubtful_door(region)) is not None
        and door.is_likely
    )


def measure() -> Iterator[Figure]:
    """Return what is told and kept at every look above 60 % explored, over all worlds."""
    cv2.setNumThreads(1)
    tally = Tally()
    for name in world_names():
        watch(name, tally)
    n = max(tally.n_looks, 1)
    yield Figure(name="looks from 60 % explored on", value=tally.n_looks, unit="")
    yield Figure(name="regions told as seen whole", value=tally.n_whole, unit="")
    yield Figure(name="of them false (target: 0)", value=tally.n_false, unit="")
    yield Figure(name="smallest room right", value=tally.n_right / n, unit="")
    yield Figure(
        name="smallest right or said to be unsure (target: 0.98)", value=tally.n_fine / n, unit=""
    )
    late = tally.n_late_unsure / max(tally.n_late, 1)
    yield Figure(
        name="smallest unsure, from 95 % explored on (target: at most 0.1)", value=late, unit=""
    )
    yield Figure(name="looks from 95 % explored on", value=tally.n_late, unit="")
    yield Figure(name="ids that change class, per look", value=tally.n_new_class / n, unit="")
    yield Figure(name="ids that change owner, per look", value=tally.n_new_owner / n, unit="")
    yield Figure(name="ids that come or go, per look", value=tally.n_come_or_gone / n, unit="")
    yield Figure(
        name=f"of them while less than {IDLE_M2:g} m2 of floor changed", value=tally.n_idly, unit=""
    )
