"""Occupancy grids of ROS messages, and the updates that change a part of one."""

import binascii
from array import array
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.ros.messages.fields import (
    Dialect,
    Message,
    decode_base64,
    misfit,
    number_of,
    part_of,
    read_header,
    whole_of,
    write_header,
    write_stamp,
)
from mapspeak.ros.messages.poses import read_pose, write_pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import MAX_CELLS

LARGEST_SIDE = 2**32 - 1

Cells = NDArray[np.int8]


def read_grid(message: Message) -> OccupancyGrid:
    """Read nav_msgs/OccupancyGrid.

    The cells may be a list (JSON), base64 text, bytes, or a numpy array (a CBOR typed array).

    Raises:
        LinkError: A field is missing or of another kind.
        MapError: Together the fields are no map.
    """
    _, stamp_s = read_header(message)
    info = part_of(message, "info")
    n_cols, n_rows = _read_size(info)
    return OccupancyGrid(
        cells=_read_cells(message, n_rows=n_rows, n_cols=n_cols),
        resolution_m=_undo_single_precision(number_of(info, "resolution")),
        origin=read_pose(part_of(info, "origin")),
        stamp_s=stamp_s,
    )


def write_grid(grid: OccupancyGrid, *, dialect: Dialect) -> dict[str, Any]:
    """Write nav_msgs/OccupancyGrid in the frame map; the cells as a flat numpy array of int8."""
    info = {
        "map_load_time": write_stamp(grid.stamp_s, dialect=dialect),
        "resolution": float(np.float32(grid.resolution_m)),
        "width": grid.n_cols,
        "height": grid.n_rows,
        "origin": write_pose(grid.origin),
    }
    header = write_header("map", grid.stamp_s, dialect=dialect)
    return {"header": header, "info": info, "data": grid.cells.ravel()}


def apply_grid_update(grid: OccupancyGrid, message: Message) -> OccupancyGrid:
    """Return the map with the part changed that a map_msgs/OccupancyGridUpdate tells.

    Raises:
        LinkError: A field is missing or of another kind.
        MapError: The part does not lie on the map.
    """
    _, stamp_s = read_header(message)
    n_cols, n_rows = _read_size(message, may_be_empty=True)
    col = whole_of(message, "x", low=-LARGEST_SIDE, high=LARGEST_SIDE)
    row = whole_of(message, "y", low=-LARGEST_SIDE, high=LARGEST_SIDE)
    if col < 0 or row < 0 or col + n_cols > grid.n_cols or row + n_rows > grid.n_rows:
        raise MapError(
            f"A map update of {n_cols}x{n_rows} cells at column {col}, row {row} does not lie on "
            f"the map of {grid.n_cols}x{grid.n_rows} cells.",
            hint="The map has grown since: fetch the whole map again.",
        )
    cells = grid.cells.copy()
    changed = _read_cells(message, n_rows=n_rows, n_cols=n_cols)
    cells[row : row + n_rows, col : col + n_cols] = changed
    return OccupancyGrid(
        cells=cells, resolution_m=grid.resolution_m, origin=grid.origin, stamp_s=stamp_s
    )


def _read_size(message: Message, *, may_be_empty: bool = False) -> tuple[int, int]:
    n_cols = whole_of(message, "width", low=0, high=LARGEST_SIDE)
    n_rows = whole_of(message, "height", low=0, high=LARGEST_SIDE)
    if n_cols * n_rows == 0 and not may_be_empty:
        raise MapError(
            f"The robot's map has {n_cols}x{n_rows} cells: it is empty.",
            hint="SLAM has not made a map yet: check that the laser scans arrive, and wait.",
        )
    if n_cols * n_rows > MAX_CELLS:
        raise MapError(
            f"The robot's map has {n_cols}x{n_rows} cells; the limit is {MAX_CELLS:,}.",
            hint="Let SLAM make a coarser map, or crop it.",
        )
    return n_cols, n_rows


def _read_cells(message: Message, *, n_rows: int, n_cols: int) -> Cells:
    cells = _flat_cells(message.get("data"))
    if cells.size != n_rows * n_cols:
        raise MapError(
            f"The robot's map says {n_cols}x{n_rows} cells and brings {cells.size}.",
            hint="The message was cut off or is damaged: fetch the map again.",
        )
    return cells.reshape(n_rows, n_cols)


def _flat_cells(data: object) -> Cells:
    try:
        match data:
            case np.ndarray() if data.ndim == 1 and data.dtype.kind in "iu":
                return _narrow(data)
            case bytes() | bytearray() | memoryview():
                return np.frombuffer(data, dtype=np.int8)
            case str():
                return np.frombuffer(decode_base64(data), dtype=np.int8)
            case list() | tuple():
                # `array` refuses fractions and texts, which numpy would quietly cut or parse.
                return np.frombuffer(array("b", data), dtype=np.int8)
    except (OverflowError, TypeError, ValueError, BufferError, binascii.Error):
        pass
    raise misfit("data", data, "a list of whole numbers from -128 to 127")


def _narrow(data: NDArray[Any]) -> Cells:
    """Return the numbers as int8; 8-bit ones keep their bits, so that 255 is unknown."""
    if data.dtype.itemsize == 1:
        return data.view(np.int8)
    if data.size and (int(data.min()) < -128 or int(data.max()) > 127):
        raise OverflowError
    return data.astype(np.int8)


def _undo_single_precision(value: float) -> float:
    """Return 0.05 for 0.05000000074505806, which is how a ROS float32 arrives."""
    with np.errstate(over="ignore"):
        single = np.float32(value)
    return float(str(single)) if float(single) == value else value
