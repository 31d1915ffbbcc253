"""The map that records belong to: kept beside their file, compared with the robot's, and followed.

It is kept as `places.memory/map.yaml` and a picture. The .yaml is what counts. It names its
picture, whose name says what is in it, so that a crash between the two leaves the pair that was
there before.
"""

import math
import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from mapspeak.errors import MapError, SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory.alignment.fitting import (
    LEAST_OVERLAP,
    LEAST_SHARED_M,
    Certainty,
    MapFit,
    find_fit,
)
from mapspeak.memory.alignment.surfaces import MapAgreement, MapSurfaces, judge
from mapspeak.memory.episodes.store import EpisodeStore
from mapspeak.memory.store.document import MapDocument
from mapspeak.memory.store.durable import write_synced
from mapspeak.memory.store.rewriting import moved
from mapspeak.memory.store.semanticmap import SemanticMapStore
from mapspeak.spatial import UNKNOWN, OccupancyGrid
from mapspeak.spatial.mapfiles import load_map, write_map

FIRST_NAME = "map.yaml"


class SnapshotFolder:
    """The folder with the maps that a memory's poses belong to, or did once."""

    def __init__(self, memory_path: Path) -> None:
        real = Path(os.path.realpath(memory_path))
        self.path = real.with_name(f"{real.stem}.memory")

    def load(self, name: str) -> OccupancyGrid | None:
        """Return a map that was kept; None where there is none of that name.

        Raises:
            SemanticMapError: It is there, but damaged.
        """
        path = self.path / Path(name).name
        if not path.exists():
            return None
        try:
            return load_map(path).grid
        except MapError as error:
            raise SemanticMapError(
                f"The map that the records belong to cannot be read: {error.message}",
                hint=f"Take {path} away if it is of no use: the next write keeps a new one.",
            ) from error

    def keep(self, grid: OccupancyGrid, name: str) -> None:
        """Write a map in place of the one of that name; it is on the disk when this returns.

        Raises:
            SemanticMapError: It cannot be written.
        """
        grid = _in_three_greys(grid)
        stem = f"{Path(name).stem}-{zlib.crc32(grid.cells.tobytes()):08x}"
        with self._explained():
            self.path.mkdir(exist_ok=True, parents=True)
            new = self.path / f"{stem}.yaml"
            picture = write_map(grid, new)
            for path in (picture, new):
                with path.open("rb+") as file:
                    os.fsync(file.fileno())
            new.replace(self.path / name)
            for other in self.path.glob(f"{Path(name).stem}-????????.pgm"):
                if other != picture:
                    other.unlink(missing_ok=True)

    def free_name(self) -> str:
        """Return a name for another map that none has yet: map-2.yaml, map-3.yaml, ..."""
        number = 2
        while (self.path / f"map-{number}.yaml").exists():
            number += 1
        return f"map-{number}.yaml"

    def note(self, name: str, content: bytes) -> Path:
        """Write any other file into the folder; it is on the disk when this returns."""
        path = self.path / name
        with self._explained():
            write_synced(path, content)
        return path

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except MapError as error:
            raise SemanticMapError(error.message, hint=error.hint) from error
        except OSError as error:
            raise SemanticMapError(
                f"The map cannot be kept in {self.path}: {error.strerror or error}.",
                hint="Check that the folder may be written to and has room.",
            ) from error


def _in_three_greys(grid: OccupancyGrid) -> OccupancyGrid:
    """Return the map with free, occupied and unknown alone: map files know no free cell of 45."""
    cells = np.where(grid.free, 0, np.where(grid.occupied, 100, UNKNOWN)).astype(np.int8)
    return OccupancyGrid(
        cells=cells, resolution_m=grid.resolution_m, origin=grid.origin, stamp_s=grid.stamp_s
    )


NO_MOTION = Pose(0.0, 0.0, 0.0)
STILL_M, STILL_RAD = 0.1, math.radians(1.0)
"""A smaller motion is how maps differ from run to run, and no reason to touch records."""
LEAST_STILL_M, LEAST_STILL_AGREEMENT = 8.0, 0.85
"""So much is enough where maps agree as they lie: no place had to be looked for."""
PERHAPS_AGREEMENT = 0.75
"""Maps that agree less, wherever they are laid, show different places."""


class MapRelation(StrEnum):
    """How the map of the records and the robot's present map go together."""

    SAME = "same"
    MOVED = "moved"
    OTHER = "other_building"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapComparison:
    """What a comparison of two maps gives.

    Attributes:
        as_it_lies: How well they agree when nothing is moved.
        fit: The best place for the old map, where one had to be looked for.
        shortest_m: The walls of the map that shows less of them.
    """

    relation: MapRelation
    as_it_lies: MapAgreement
    fit: MapFit | None
    shortest_m: float


def compare_maps(old: OccupancyGrid, new: OccupancyGrid) -> MapComparison:
    """Compare two maps: whether they show the same building, and in the same frame."""
    before, after = MapSurfaces(old), MapSurfaces(new)
    as_it_lies = judge(before, after, NO_MOTION)
    fit, relation = None, MapRelation.SAME
    shortest_m = min(before.length_m, after.length_m)
    is_good = (
        as_it_lies.agreement_ratio >= LEAST_STILL_AGREEMENT
        and as_it_lies.overlap_ratio >= LEAST_OVERLAP
        and as_it_lies.shared_m >= LEAST_STILL_M
    )
    if not is_good:
        relation = MapRelation.UNKNOWN
        if shortest_m >= LEAST_SHARED_M:
            fit = find_fit(before, after)
            relation = _relation_of(fit)
    return MapComparison(relation=relation, as_it_lies=as_it_lies, fit=fit, shortest_m=shortest_m)


def _relation_of(fit: MapFit | None) -> MapRelation:
    if fit is None:
        return MapRelation.OTHER
    if fit.is_sure_enough:
        is_still = fit.off_m < STILL_M and abs(fit.new_from_old.yaw_rad) < STILL_RAD
        return MapRelation.SAME if is_still else MapRelation.MOVED
    is_possible = fit.certainty is Certainty.AMBIGUOUS or (
        fit.quality.agreement_ratio >= PERHAPS_AGREEMENT
        and fit.quality.overlap_ratio >= LEAST_OVERLAP
    )
    return MapRelation.UNKNOWN if is_possible else MapRelation.OTHER


GROWN_RATIO = 0.1
"""A map that shows so much more floor than the kept one is kept in its place."""
KEY = "snapshot"


@dataclass(frozen=True, slots=True, kw_only=True)
class RealignReceipt:
    """What became of records whose map may have moved.

    Attributes:
        motion: From the old frame to the new one; None where nothing was moved.
        undo_path: The file as it was before.
    """

    comparison: MapComparison
    motion: Pose | None = None
    certainty: Certainty | None = None
    n_waypoints: int = 0
    n_events: int = 0
    n_observations: int = 0
    undo_path: Path | None = None


class MapKeeper:
    """Keeps the map that a store's records belong to, and compares it with the robot's."""

    def __init__(self, store: SemanticMapStore, episodes: EpisodeStore | None = None) -> None:
        self._store = store
        self._episodes = episodes
        self._folder = SnapshotFolder(store.path)
        self._loaded: tuple[str, OccupancyGrid] | None = None
        self._compared: tuple[OccupancyGrid, OccupancyGrid, MapComparison] | None = None

    def keep(self, grid: OccupancyGrid) -> MapComparison | None:
        """Keep the robot's map where none is kept or it has grown; to be called after a write.

        A map with hardly a wall is not kept: it would tell nothing.

        Returns:
            How the kept map and this one go together; None where there is none to compare with.
            When they are not the same, nothing is kept, and a reader should hear of it.

        Raises:
            SemanticMapError: The kept map is damaged, or none can be written.
        """
        name = self._name()
        kept = self._load(name)
        if kept is None:
            if MapSurfaces(grid).length_m >= LEAST_STILL_M:
                self._keep(grid, name)
            return None
        comparison = self._compare(kept, grid)
        has_grown = _floor_m2(grid) > (1 + GROWN_RATIO) * _floor_m2(kept)
        if comparison.relation is MapRelation.SAME and has_grown:
            self._keep(grid, name)
        return comparison

    def compare(self, grid: OccupancyGrid) -> MapComparison | None:
        """Tell how the records' map and the robot's go together; None where none was kept.

        Raises:
            SemanticMapError: The kept map is damaged.
        """
        kept = self._load(self._name())
        return None if kept is None else self._compare(kept, grid)

    def realign(self, grid: OccupancyGrid) -> RealignReceipt:
        """Move all records to the robot's map where it is sure how; all of them or none.

        The file as it was is kept beside the old map; `undo_path` names it. Nothing moves where
        the maps do not tell surely enough how one lies on the other: the comparison says so.

        Raises:
            SemanticMapError: No map was kept, or the file cannot be written.
        """
        self.finish_move()
        kept = self._load(self._name())
        if kept is None:
            raise SemanticMapError(
                "No map was kept with these records: where they belong cannot be found out.",
                hint="Write one of them anew on this map; the map is kept with it.",
            )
        comparison = self._compare(kept, grid)
        if comparison.relation is not MapRelation.MOVED or comparison.fit is None:
            return RealignReceipt(comparison=comparison)
        return self._move(grid, comparison, comparison.fit)

    def finish_move(self) -> int:
        """Move observations that have not followed their records; return how many were moved."""
        return 0 if self._episodes is None else self._episodes.finish_move(at=self._name())

    def _move(self, grid: OccupancyGrid, comparison: MapComparison, fit: MapFit) -> RealignReceipt:
        motion = fit.new_from_old
        old_name, new_name = self._name(), self._folder.free_name()
        self._folder.keep(grid, new_name)
        undo_path = self._folder.path / f"before-{new_name}"
        entries = {KEY: new_name}
        if self._store.map_id is not None:
            entries["map"] = self._store.map_id

        def change(document: MapDocument) -> MapDocument:
            if (document.find_entry(KEY) or FIRST_NAME) != old_name:
                raise SemanticMapError(
                    "Somebody else has just moved these records.", hint="Look at them again."
                )
            self._folder.note(undo_path.name, document.content)
            return moved(document, motion, entries=entries)

        if self._episodes is not None:
            self._episodes.plan_move(motion, to=new_name)
        _, after = self._store.rewrite(change)
        self._loaded = None
        n_observations = self.finish_move()
        return RealignReceipt(
            comparison=comparison,
            motion=motion,
            certainty=fit.certainty,
            n_waypoints=len(after.records),
            n_events=len(after.events),
            n_observations=n_observations,
            undo_path=undo_path,
        )

    def _name(self) -> str:
        return self._store.read_entry(KEY) or FIRST_NAME

    def _load(self, name: str) -> OccupancyGrid | None:
        if self._loaded is None or self._loaded[0] != name:
            grid = self._folder.load(name)
            self._loaded = None if grid is None else (name, grid)
        return None if self._loaded is None else self._loaded[1]

    def _keep(self, grid: OccupancyGrid, name: str) -> None:
        self._folder.keep(grid, name)
        self._loaded = (name, grid)

    def _compare(self, kept: OccupancyGrid, grid: OccupancyGrid) -> MapComparison:
        known = self._compared
        if known is not None and known[0] is kept and known[1] is grid:
            return known[2]
        comparison = compare_maps(kept, grid)
        self._compared = (kept, grid, comparison)
        return comparison


def _floor_m2(grid: OccupancyGrid) -> float:
    return float(grid.free.sum()) * grid.resolution_m**2
