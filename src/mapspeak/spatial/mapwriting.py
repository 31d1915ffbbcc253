"""Map files as Nav2's map_saver writes them: a .yaml and a picture."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedSeq

from mapspeak.errors import MapError
from mapspeak.spatial.grid import UNKNOWN, OccupancyGrid
from mapspeak.spatial.mapfiles import (
    DEFAULT_FREE_THRESH,
    DEFAULT_OCCUPIED_THRESH,
    UNKNOWN_GREY,
    MapMode,
)

Grey = NDArray[np.uint8]

_FREE_GREY, _OCCUPIED_GREY = 254, 0
_SAVED_FREE_MAX, _SAVED_OCCUPIED_MIN = 25, 65


def write_map(grid: OccupancyGrid, path: Path, *, mode: MapMode = MapMode.TRINARY) -> Path:
    """Write a map as map_saver does: the .yaml at the path, the picture beside it.

    Trinary keeps free (up to 25), occupied (from 65) and unknown, the values between become
    unknown. Scale and raw keep every value; scale needs a .png for its transparent pixels.

    Returns:
        The path of the picture.

    Raises:
        MapError: The path does not end in .yaml, or cannot be written.
    """
    if path.suffix not in {".yaml", ".yml"}:
        raise MapError(
            f"A map is written to a .yaml file, not to {path.name}.",
            hint=f"Use {path.with_suffix('.yaml').name}; the picture gets the same name.",
        )
    picture_path = path.with_suffix(".png" if mode is MapMode.SCALE else ".pgm")
    try:
        _save_picture(grid, picture_path, mode)
        _save_description(grid, path, picture_path.name, mode)
    except OSError as error:
        raise MapError(
            f"The map cannot be written to {path}: {error.strerror or error}.",
            hint="Choose a folder that exists and may be written to.",
        ) from error
    return picture_path


def _save_picture(grid: OccupancyGrid, path: Path, mode: MapMode) -> None:
    from_top = grid.cells[::-1]
    grey = _grey_of_occupancy(mode)[from_top.astype(np.intp)]
    if mode is MapMode.SCALE:
        alpha = np.where(from_top == UNKNOWN, 0, 255).astype(np.uint8)
        Image.fromarray(np.stack([grey, grey, grey, alpha], axis=2)).save(path)
    else:
        header = f"P5\n{grid.n_cols} {grid.n_rows}\n255\n"
        path.write_bytes(header.encode("ascii") + grey.tobytes())


def _grey_of_occupancy(mode: MapMode) -> Grey:
    """Return the grey of occupancy 0 to 100, and last, at index -1, of unknown."""
    occupancy = np.arange(101)
    if mode is MapMode.RAW:
        greys, unknown = occupancy, 255
    elif mode is MapMode.SCALE:
        greys, unknown = (255 * (100 - occupancy) + 50) // 100, 128
    else:
        is_free, is_occupied = occupancy <= _SAVED_FREE_MAX, occupancy >= _SAVED_OCCUPIED_MIN
        between = np.where(is_occupied, _OCCUPIED_GREY, UNKNOWN_GREY)
        greys, unknown = np.where(is_free, _FREE_GREY, between), UNKNOWN_GREY
    return np.append(greys, unknown).astype(np.uint8)


def _save_description(grid: OccupancyGrid, path: Path, image: str, mode: MapMode) -> None:
    """Write the .yaml; in scale mode with thresholds that preserve every value."""
    origin = CommentedSeq(float(v) for v in (grid.origin.x, grid.origin.y, grid.origin.yaw_rad))
    origin.fa.set_flow_style()
    is_scale = mode is MapMode.SCALE
    document = {
        "image": image,
        "mode": mode.value,
        "resolution": float(grid.resolution_m),
        "origin": origin,
        "negate": 0,
        "occupied_thresh": 1.0 if is_scale else DEFAULT_OCCUPIED_THRESH,
        "free_thresh": 0.0 if is_scale else DEFAULT_FREE_THRESH,
    }
    with path.open("w", encoding="utf-8") as file:
        YAML(pure=True).dump(document, file)
