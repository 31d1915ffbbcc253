"""The walls that a memory keeps of its frames: maps, by which a frame is known again."""

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np
from filelock import FileLock

from mapspeak.atomic import sync_folder
from mapspeak.errors import DamagedMapError, MapError, SemanticMapError
from mapspeak.spatial import UNKNOWN, OccupancyGrid
from mapspeak.spatial.mapfiles import load_map
from mapspeak.spatial.mapwriting import write_map

LOCK_TIMEOUT_S = 5.0


class KeptWalls(Protocol):
    """Maps by their names, kept where the memory is.

    All methods raise a `SemanticMapError` where a map cannot be read or written.
    """

    def load(self, name: str) -> OccupancyGrid | None:
        """Return a kept map; None if there is none of that name."""

    def keep(self, grid: OccupancyGrid, name: str, *, is_first: bool = False) -> bool:
        """Write a map in place of the one of that name; it lasts when this returns.

        Args:
            is_first: Leave a map alone that is there already.

        Returns:
            False where one was left alone.
        """

    def free_name(self) -> str:
        """Return a name for another map that none has yet."""


class WallFolder:
    """A folder with maps, each as a .yaml and a picture; `KeptWalls` of a memory in a file.

    The .yaml is what counts. It names its picture, whose name says what is in it, so that a crash
    between the two leaves the pair that was there before.
    """

    def __init__(self, memory_path: Path) -> None:
        real = Path(os.path.realpath(memory_path))
        self.path = real.with_name(f"{real.stem}.memory")

    def load(self, name: str) -> OccupancyGrid | None:
        """Return a map that was kept."""
        path = self.path / Path(name).name
        if not path.exists():
            return None
        try:
            return load_map(path).grid
        except MapError as error:
            raise DamagedMapError(
                f"The map that the records belong to cannot be read: {error.message}",
                hint=f"Put {path} back from a copy: what was remembered on it waits until then. "
                "What is written goes on with a map of its own.",
            ) from error

    def keep(self, grid: OccupancyGrid, name: str, *, is_first: bool = False) -> bool:
        """Write a map in place of the one of that name; it is on the disk when this returns."""
        grid = in_three_greys(grid)
        stem = f"{Path(name).stem}-{zlib.crc32(grid.cells.tobytes()):08x}"
        with self._explained():
            self.path.mkdir(exist_ok=True, parents=True)
        with self._explained(), FileLock(self.path / "walls.lock", timeout=LOCK_TIMEOUT_S):
            new = self.path / f"{stem}.yaml"
            picture = write_map(grid, new)
            for path in (picture, new):
                with path.open("rb+") as file:
                    os.fsync(file.fileno())
            target = self.path / Path(name).name
            if is_first and not _is_linked(new, target):
                return False
            if not is_first:
                new.replace(target)
            sync_folder(self.path)
            pictures = self.path.glob(f"{Path(name).stem}-????????.pgm")
            # The one before stays: another program may have begun to read it.
            for other in sorted(pictures, key=lambda each: each.stat().st_mtime_ns)[:-2]:
                other.unlink()
        return True

    def free_name(self) -> str:
        """Return a name for another map that none has yet: map-2.yaml, map-3.yaml, ..."""
        number = 2
        while (self.path / f"map-{number}.yaml").exists():
            number += 1
        return f"map-{number}.yaml"

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


def _is_linked(new: Path, target: Path) -> bool:
    """Give a file its name; False where another has it."""
    try:
        os.link(new, target)
    except FileExistsError:
        return False
    except OSError:
        # A file system without links, where two may be first at once.
        new.replace(target)
    finally:
        new.unlink(missing_ok=True)
    return True


def in_three_greys(grid: OccupancyGrid) -> OccupancyGrid:
    """Return the map with free, occupied and unknown alone: map files know no free cell of 45."""
    cells = np.where(grid.free, 0, np.where(grid.occupied, 100, UNKNOWN)).astype(np.int8)
    return OccupancyGrid(
        cells=cells, resolution_m=grid.resolution_m, origin=grid.origin, stamp_s=grid.stamp_s
    )
