"""Records and the map they belong to, kept together: noticed when the map is another, and moved."""

from dataclasses import dataclass
from pathlib import Path

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory.alignment.comparing import (
    FIRST_NAME,
    LEAST_STILL_M,
    MapComparison,
    MapRelation,
    SnapshotFolder,
    compare_maps,
    say_comparison,
)
from mapspeak.memory.alignment.fitting import Certainty
from mapspeak.memory.alignment.surfaces import MapSurfaces
from mapspeak.memory.episodes import EpisodeStore
from mapspeak.memory.store import MapDocument, moved
from mapspeak.memory.store.semanticmap import SemanticMapStore
from mapspeak.spatial import OccupancyGrid

GROWN_RATIO = 0.1
"""A map that shows so much more floor than the kept one is kept in its place."""
KEY = "snapshot"


@dataclass(frozen=True, slots=True, kw_only=True)
class RealignReceipt:
    """What became of records whose map has moved.

    Attributes:
        comparison: Of the old map and the new one.
        motion: From the old frame to the new one; None where nothing had to move.
        certainty: How sure it is; None where nothing had to move.
        n_waypoints: How many were moved.
        n_events: Likewise.
        n_observations: Likewise.
        undo_path: The file as it was before.
    """

    comparison: MapComparison
    motion: Pose | None
    certainty: Certainty | None
    n_waypoints: int
    n_events: int
    n_observations: int
    undo_path: Path | None


class MapKeeper:
    """Keeps the map that a store's records belong to, and compares it with the robot's.

    Args:
        store: The records.
        episodes: What was observed on the way, with poses on the same map.
    """

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

        The file as it was is kept beside the old map; `undo_path` names it.

        Raises:
            SemanticMapError: No map was kept, or the maps do not tell surely enough how one lies
                on the other. Nothing was changed.
        """
        self.finish_move()
        kept = self._load(self._name())
        if kept is None:
            raise SemanticMapError(
                "No map was kept with these records: where they belong cannot be found out.",
                hint="Write one of them anew on this map; the map is kept with it.",
            )
        comparison = self._compare(kept, grid)
        if comparison.relation is MapRelation.SAME:
            return _nothing_moved(comparison)
        fit = comparison.fit
        if comparison.relation is not MapRelation.MOVED or fit is None:
            raise SemanticMapError(
                f"The records stay where they are. {say_comparison(comparison)}",
                hint="Let the robot see more of the building and try again, or use another file "
                "for this map.",
            )
        return self._move(grid, comparison, fit.new_from_old, fit.certainty)

    def finish_move(self) -> int:
        """Move the observations where a crash has kept them from following their records.

        Returns:
            How many were moved.
        """
        return 0 if self._episodes is None else self._episodes.finish_move(at=self._name())

    # --- inside ---

    def _move(
        self,
        grid: OccupancyGrid,
        comparison: MapComparison,
        motion: Pose,
        certainty: Certainty,
    ) -> RealignReceipt:
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
            certainty=certainty,
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
            return grid
        return self._loaded[1]

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


def _nothing_moved(comparison: MapComparison) -> RealignReceipt:
    return RealignReceipt(
        comparison=comparison,
        motion=None,
        certainty=None,
        n_waypoints=0,
        n_events=0,
        n_observations=0,
        undo_path=None,
    )


def _floor_m2(grid: OccupancyGrid) -> float:
    return float(grid.free.sum()) * grid.resolution_m**2
