"""The walls of a fleet's frames, kept in the fleet's database."""

import secrets
import zlib

import numpy as np

from mapspeak.errors import DamagedMapError, MapError
from mapspeak.geometry import Pose
from mapspeak.memory.postgres.database import Database
from mapspeak.memory.walls import in_three_greys
from mapspeak.spatial import OccupancyGrid

_WRITE = """
    INSERT INTO mapspeak.walls (name, rows, columns, resolution_m, x, y, yaw_rad, stamp_s, cells)
    VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s) ON CONFLICT (name)
"""
_REPLACE = """DO UPDATE SET
    rows = excluded.rows, columns = excluded.columns, resolution_m = excluded.resolution_m,
    x = excluded.x, y = excluded.y, yaw_rad = excluded.yaw_rad, stamp_s = excluded.stamp_s,
    cells = excluded.cells
"""


class DatabaseWalls:
    """Maps as rows of a table; `KeptWalls` of a memory in PostgreSQL."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def load(self, name: str) -> OccupancyGrid | None:
        """Return a map that was kept."""
        with self._database.connected() as connection:
            row = connection.execute(
                "SELECT rows, columns, resolution_m, x, y, yaw_rad, stamp_s, cells"
                " FROM mapspeak.walls WHERE name = %s",
                (name,),
            ).fetchone()
        if row is None:
            return None
        n_rows, n_columns, resolution_m, x, y, yaw_rad, stamp_s, cells = row
        try:
            read = np.frombuffer(zlib.decompress(cells), dtype=np.int8)
            return OccupancyGrid(
                cells=read.reshape(n_rows, n_columns),
                resolution_m=resolution_m,
                origin=Pose(x, y, yaw_rad),
                stamp_s=stamp_s,
            )
        except (zlib.error, ValueError, MapError) as error:
            raise DamagedMapError(
                f"The map {name!r} that the records belong to cannot be read: {error}",
                hint="Put its row of mapspeak.walls back from a copy: what was remembered on it "
                "waits until then. What is written goes on with a map of its own.",
            ) from error

    def keep(self, grid: OccupancyGrid, name: str, *, is_first: bool = False) -> bool:
        """Write a map in place of the one of that name, in one transaction."""
        grid = in_three_greys(grid)
        n_rows, n_columns = grid.cells.shape
        origin = grid.origin
        values = (name, n_rows, n_columns, grid.resolution_m, origin.x, origin.y, origin.yaw_rad)
        cells = zlib.compress(np.ascontiguousarray(grid.cells).tobytes())
        query = _WRITE + ("DO NOTHING" if is_first else _REPLACE)
        with self._database.connected() as connection:
            written = connection.execute(query.encode(), (*values, grid.stamp_s, cells))
            return bool(written.rowcount == 1)

    def free_name(self) -> str:
        """Return a name that no other server takes at the same moment."""
        return f"map-{secrets.token_hex(4)}.yaml"
