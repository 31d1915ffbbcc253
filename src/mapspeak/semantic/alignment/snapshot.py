"""The map that records belong to, kept beside their file: `places.memory/map.yaml` and a picture.

The .yaml is what counts. It names its picture, whose name says what is in it, so that a crash
between the two leaves the pair that was there before.
"""

import os
import zlib
from pathlib import Path

import numpy as np

from mapspeak.errors import MapError, SemanticMapError
from mapspeak.spatial import UNKNOWN, OccupancyGrid
from mapspeak.spatial.mapfiles import load_map, write_map

__all__ = ["FIRST_NAME", "SnapshotFolder"]

FIRST_NAME = "map.yaml"


class SnapshotFolder:
    """The folder with the maps that a memory's poses belong to, or did once.

    Args:
        memory_path: Of the semantic map's file.
    """

    def __init__(self, memory_path: Path) -> None:
        real = Path(os.path.realpath(memory_path))
        self.path = real.with_name(f"{real.stem}.memory")

    def load(self, name: str) -> OccupancyGrid | None:
        """Gives a map that was kept; None where there is none of that name.

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
        """Writes a map in place of the one of that name; it is on the disk when this returns.

        Raises:
            SemanticMapError: It cannot be written.
        """
        grid = _in_three_greys(grid)
        stem = f"{Path(name).stem}-{zlib.crc32(grid.cells.tobytes()):08x}"
        try:
            self.path.mkdir(exist_ok=True, parents=True)
            new = self.path / f"{stem}.yaml"
            picture = write_map(grid, new)
            _sync(picture)
            _sync(new)
            new.replace(self.path / name)
            self._forget_pictures_of(name, but=picture)
        except MapError as error:
            raise SemanticMapError(error.message, hint=error.hint) from error
        except OSError as error:
            raise SemanticMapError(
                f"The map cannot be kept in {self.path}: {error.strerror or error}.",
                hint="Check that the folder may be written to and has room.",
            ) from error

    def free_name(self) -> str:
        """Gives a name for another map that none has yet: map-2.yaml, map-3.yaml, ..."""
        number = 2
        while (self.path / f"map-{number}.yaml").exists():
            number += 1
        return f"map-{number}.yaml"

    def note(self, name: str, content: bytes) -> Path:
        """Writes any other file into the folder; it is on the disk when this returns."""
        path = self.path / name
        try:
            path.write_bytes(content)
            _sync(path)
        except OSError as error:
            raise SemanticMapError(
                f"{path} cannot be written: {error.strerror or error}.",
                hint="Check that the folder may be written to and has room.",
            ) from error
        return path

    def _forget_pictures_of(self, name: str, *, but: Path) -> None:
        for picture in self.path.glob(f"{Path(name).stem}-????????.pgm"):
            if picture != but:
                picture.unlink(missing_ok=True)


def _in_three_greys(grid: OccupancyGrid) -> OccupancyGrid:
    """Gives the map with free, occupied and unknown alone: map files know no free cell of 45."""
    cells = np.where(grid.free, 0, np.where(grid.occupied, 100, UNKNOWN)).astype(np.int8)
    return OccupancyGrid(
        cells=cells, resolution_m=grid.resolution_m, origin=grid.origin, stamp_s=grid.stamp_s
    )


def _sync(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())
