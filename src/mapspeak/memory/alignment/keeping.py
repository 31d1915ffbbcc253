"""Recognise by kept walls which of a memory's frames the robot's map is in."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, replace

import numpy as np

from mapspeak.errors import DamagedMapError, SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory.alignment.comparing import (
    LEAST_STILL_AGREEMENT,
    LEAST_STILL_M,
    NO_MOTION,
    MapComparison,
    MapRelation,
    compare_maps,
)
from mapspeak.memory.alignment.fitting import LEAST_SHARED_M, Certainty
from mapspeak.memory.alignment.surfaces import MapSurfaces, judge
from mapspeak.memory.frames import FrameId, MapFrame
from mapspeak.memory.store.memorystore import MemoryStore
from mapspeak.memory.waypoint import SemanticMap
from mapspeak.spatial import OccupancyGrid

GROWN_RATIO = 0.1
"""A map with this share of floor more than the kept one replaces it."""
SHRUNK_RATIO = 0.5
"""A map with less than this share of its predecessor's floor was begun anew."""
LEAST_TELLING_M = 2.0
"""Shorter walls cannot show whether a map continues the previous one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RealignReceipt:
    """Result of aligning records whose map may have moved.

    Attributes:
        motion: From the first old frame to the robot's; None if nothing was aligned.
        n_waypoints: Waypoints whose frame became known, of all frames.
    """

    comparison: MapComparison
    motion: Pose | None = None
    certainty: Certainty | None = None
    n_waypoints: int = 0
    n_events: int = 0


class FrameKeeper:
    """Identify the frame of the robot's map, keep its walls, and align it with other frames.

    Args:
        name_robot: Returns the name of the mapping robot; called when a frame begins.
        lock: Reentrant; held during every read and change. None for use by one thread only.

    Attributes:
        frame: The frame of the robot's map if `is_placed`.
        is_placed: False before the first map, or while its frame is unknown.
        n_maps: Number of times the robot's map was begun anew.
    """

    def __init__(
        self,
        store: MemoryStore,
        *,
        name_robot: Callable[[], str] = str,
        lock: AbstractContextManager[object] | None = None,
    ) -> None:
        self._store = store
        self._name_robot = name_robot
        self._loaded: dict[str, OccupancyGrid] = {}
        self._compared: dict[str, tuple[OccupancyGrid, OccupancyGrid, MapComparison]] = {}
        self._lock = lock or nullcontext()
        self._grid: OccupancyGrid | None = None
        self._surfaces: MapSurfaces | None = None
        self._is_assumed = False
        # True once this robot may have written on a map whose frame is assumed.
        self._has_begun = False
        self._fault: SemanticMapError | None = None
        self._damage: SemanticMapError | None = None
        self.frame: FrameId = None
        self.is_placed = False
        self.n_maps = 0

    @property
    def has_met(self) -> bool:
        """True once the robot's map was met."""
        return self._grid is not None

    def meet(self, grid: OccupancyGrid) -> None:
        """Find the frame of the robot's map; it keeps that frame while it grows.

        Raises:
            SemanticMapError: The memory cannot be read.
        """
        with self._lock:
            before, self._grid = self._grid, grid
            if before is not None and not _goes_on(before, grid):
                self.n_maps += 1
                self.is_placed = self._has_begun = False
            if not self.is_placed:
                self._place(self._store.read())

    def review(self, memory: SemanticMap) -> None:
        """Place the robot's map anew where its frame is only assumed: another may have come first.

        While the kept maps cannot be read the assumption stands; a write tells of it.
        """
        if self._is_assumed:
            with self._lock, suppress(SemanticMapError):
                self._place(memory)

    def has_walls(self, frame_id: FrameId) -> bool:
        """Return True if something distinguishes a frame from others, be it damaged or not."""
        name = self._walls_of(frame_id)
        try:
            return name is not None and self._load(name) is not None
        except DamagedMapError:
            return True

    def place(self) -> FrameId:
        """Return the frame of the robot's map, for a write; begin a new one where none is known.

        The walls of the map are kept if there are none yet or the map has grown. A map with
        hardly a wall is not kept, since it identifies nothing.

        Raises:
            SemanticMapError: A new frame cannot be written.
        """
        with self._lock:
            if self._is_assumed or not self.is_placed:
                self._place(self._store.read())
            if not self.is_placed:
                self._begin_frame()
            elif self._grid is not None and self._is_worth_keeping(self._grid):
                try:
                    is_kept = self._keep(self._grid)
                except SemanticMapError as fault:
                    # The record counts for more than the walls; `compare` tells of it.
                    self._fault = fault
                else:
                    if not is_kept:
                        return self.place()
            self._has_begun = self._is_assumed
            return self.frame

    def _is_worth_keeping(self, grid: OccupancyGrid) -> bool:
        if self._surfaces is None or self._surfaces.grid is not grid:
            self._surfaces = MapSurfaces(grid)
        return self._surfaces.length_m >= LEAST_STILL_M

    def _keep(self, grid: OccupancyGrid) -> bool:
        """Keep the walls if none are kept or they have grown; False if another robot was first."""
        name = self._walls_of(self.frame)
        kept = None if name is None else self._load(name)
        if name is None or kept is None:
            return self._keep_walls(grid, name)
        if self._has_grown(name, kept, grid):
            # Another robot may have kept more of them meanwhile.
            del self._loaded[name]
            latest = self._load(name)
            if latest is None or self._has_grown(name, latest, grid):
                self._store.walls.keep(grid, name)
                self._loaded[name] = grid
        return True

    def compare(self) -> MapComparison | None:
        """Compare the robot's map with the first one whose records cannot be used on it.

        Returns:
            None if there is no such map.

        Raises:
            SemanticMapError: A kept map is damaged, or none could be kept with the last write.
        """
        with self._lock:
            grid, fault, self._fault = self._grid, self._fault, None
            if fault is not None:
                raise fault
            if grid is None:
                return None
            strange = list(self._find_strange(self._store.read()))
            if self._damage is not None:
                raise self._damage
            return next((self._compare(name, kept, grid) for _, name, kept in strange), None)

    def realign(self) -> RealignReceipt:
        """Align the frames of the memory with the robot's map where the fit is sure.

        Each frame gets one transform; no record changes.

        Raises:
            SemanticMapError: No map was kept, or the memory cannot be written.
        """
        with self._lock:
            grid = self._grid
            if grid is None:
                raise SemanticMapError("The robot has no map yet.", hint="Wait for one.")
            self._compared.clear()
            self._loaded.clear()
            strange = list(self._find_strange(self._store.read()))
            if not strange and self._damage is not None:
                raise self._damage
            if not strange:
                return self._tell_all_known(grid)
            receipts = [self._align(frame_id, name, kept) for frame_id, name, kept in strange]
            first = next((each for each in receipts if each.motion is not None), receipts[0])
            return replace(
                first,
                n_waypoints=sum(each.n_waypoints for each in receipts),
                n_events=sum(each.n_events for each in receipts),
            )

    # --- where the robot's map is ------------------------------------------------------------

    def _place(self, memory: SemanticMap) -> None:
        """Find the frame whose kept walls match the robot's map unmoved."""
        grid = self._grid
        for frame_id, name, kept in self._find_kept(memory):
            if grid is not None and self._compare(name, kept, grid).relation is MapRelation.SAME:
                self.frame, self.is_placed, self._is_assumed = frame_id, True, False
                return
        is_own = self._is_own_by_name(memory)
        self.frame, self.is_placed, self._is_assumed = None, is_own, is_own

    def _is_own_by_name(self, memory: SemanticMap) -> bool:
        """Return True where the memory's own frame has no walls, and nothing speaks against it."""
        if self.has_walls(None):
            return False
        if self._has_begun or memory.frames.items:
            return self._has_begun
        is_empty = not memory.waypoints and not self._store.read_events()
        names = (memory.map_id, self._store.map_id)
        is_named = memory.map_id is not None and (None in names or names[0] == names[1])
        return is_empty or is_named

    def _begin_frame(self) -> None:
        grid = self._grid
        walls = None
        if grid is not None and self._is_worth_keeping(grid):
            walls = self._keep_new(grid)
        frames = self._store.write_frames(
            lambda known: known.added(
                MapFrame(
                    id=known.free_id(),
                    map_id=self._store.map_id,
                    robot=self._name_robot() or None,
                    walls=walls,
                )
            )
        )
        self.frame, self.is_placed, self._is_assumed = frames.items[-1].id, True, False

    # --- other frames ------------------------------------------------------------------------

    def _align(self, frame_id: FrameId, name: str, kept: OccupancyGrid) -> RealignReceipt:
        grid = self._grid
        assert grid is not None  # noqa: S101 - asked for after it was met
        comparison = self._compare(name, kept, grid)
        fit = comparison.fit
        if comparison.relation not in (MapRelation.SAME, MapRelation.MOVED):
            return RealignReceipt(comparison=comparison)
        # The same map has a frame of its own where it was too small at first to be recognised.
        motion = NO_MOTION if fit is None else fit.new_from_old
        here, n_before = self.place(), self._count_known()
        memory = self._store.read()
        if memory.frames.find_transform(of=frame_id, into=here) is None:
            self._store.write_frames(lambda known: known.aligned(frame_id, here, motion=motion))
        n_after = self._count_known()
        return RealignReceipt(
            comparison=comparison,
            motion=motion,
            certainty=Certainty.SURE if fit is None else fit.certainty,
            n_waypoints=n_after[0] - n_before[0],
            n_events=n_after[1] - n_before[1],
        )

    def _count_known(self) -> tuple[int, int]:
        """Return how many waypoints and events are of frames that are aligned with the map."""
        memory = self._store.read()

        def is_known(frame_id: FrameId) -> bool:
            return memory.frames.find_transform(of=frame_id, into=self.frame) is not None

        return (
            sum(is_known(each.frame) for each in memory.waypoints),
            sum(is_known(each.frame) for each in self._store.read_events()),
        )

    def _tell_all_known(self, grid: OccupancyGrid) -> RealignReceipt:
        memory = self._store.read()
        is_known = self._count_known()[0] == len(memory.waypoints)
        name = self._walls_of(self.frame) if self.is_placed else None
        kept = None if name is None else self._load(name)
        if name is None or kept is None or not is_known:
            raise SemanticMapError(
                "No map was kept with these records, or with some of them: where they belong "
                "cannot be found out.",
                hint="If they are of this map, let the file say so, as in `map: house`.",
            )
        return RealignReceipt(comparison=self._compare(name, kept, grid))

    def _find_strange(self, memory: SemanticMap) -> Iterator[tuple[FrameId, str, OccupancyGrid]]:
        """Return the frames with walls that are not aligned with the robot's map."""
        for frame_id, name, kept in self._find_kept(memory):
            motion = memory.frames.find_transform(of=frame_id, into=self.frame)
            if not self.is_placed or motion is None:
                yield frame_id, name, kept

    def _find_kept(self, memory: SemanticMap) -> Iterator[tuple[FrameId, str, OccupancyGrid]]:
        """Return the frames with kept walls, the memory's own first; note which are damaged.

        Records of a frame whose walls cannot be read wait, as those of any other map do.
        """
        self._damage = None
        for frame_id, name in memory.frames.walls.items():
            try:
                kept = self._load(name)
            except DamagedMapError as damage:
                self._damage = damage
                continue
            if kept is not None:
                yield frame_id, name, kept

    # --- kept walls --------------------------------------------------------------------------

    def _walls_of(self, frame_id: FrameId) -> str | None:
        return self._store.read().frames.walls.get(frame_id)

    def _keep_walls(self, grid: OccupancyGrid, name: str | None) -> bool:
        """Keep walls for the first time; False if another robot was first."""
        if name is not None and not self._store.walls.keep(grid, name, is_first=True):
            return False
        kept_as = name or self._keep_new(grid)
        self._loaded[kept_as] = grid
        self._is_assumed = False
        if name is None and self.frame is not None:
            frame_id = self.frame
            self._store.write_frames(lambda known: known.changed(frame_id, walls=kept_as))
        return True

    def _keep_new(self, grid: OccupancyGrid) -> str:
        """Keep walls under a name that no other robot has taken meanwhile; return it."""
        name = self._store.walls.free_name()
        while not self._store.walls.keep(grid, name, is_first=True):
            name = self._store.walls.free_name()
        return name

    def _has_grown(self, name: str, kept: OccupancyGrid, grid: OccupancyGrid) -> bool:
        """Return True where the robot's map shows more than the kept one, and nothing else."""
        if _floor_m2(grid) <= (1 + GROWN_RATIO) * _floor_m2(kept):
            return False
        is_small = MapSurfaces(kept).length_m < LEAST_SHARED_M
        return is_small or self._compare(name, kept, grid).relation is MapRelation.SAME

    def _load(self, name: str) -> OccupancyGrid | None:
        if name not in self._loaded:
            grid = self._store.walls.load(name)
            if grid is None:
                return None
            self._loaded[name] = grid
        return self._loaded[name]

    def _compare(self, name: str, kept: OccupancyGrid, grid: OccupancyGrid) -> MapComparison:
        known = self._compared.get(name)
        if known is not None and known[0] is kept and _is_nearly(known[1], grid, known[2]):
            return known[2]
        comparison = compare_maps(kept, grid)
        self._compared[name] = (kept, grid, comparison)
        return comparison


def _goes_on(before: OccupancyGrid, grid: OccupancyGrid) -> bool:
    """Return True if a map continues the previous one, so that the frame is the same."""
    if grid is before:
        return True
    if _floor_m2(grid) < SHRUNK_RATIO * _floor_m2(before):
        return False
    old, new = MapSurfaces(before), MapSurfaces(grid)
    if old.length_m < LEAST_TELLING_M:
        return True
    agreement = judge(old, new, NO_MOTION)
    is_told = agreement.shared_m >= min(LEAST_TELLING_M, old.length_m / 2)
    return is_told and agreement.agreement_ratio >= LEAST_STILL_AGREEMENT


def _is_nearly(before: OccupancyGrid, grid: OccupancyGrid, told: MapComparison) -> bool:
    """Return True if another search for the placing of a kept map would find nothing."""
    if grid is before:
        return True
    if told.relation is MapRelation.SAME or before.origin != grid.origin:
        return False
    return abs(_floor_m2(grid) - _floor_m2(before)) <= GROWN_RATIO * _floor_m2(before)


def _floor_m2(grid: OccupancyGrid) -> float:
    return np.count_nonzero(grid.free) * grid.resolution_m**2
