"""A raster cut into rooms."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.basins import build_basins, find_saddles
from mapspeak.spatial.rooms.floor import Floor, build_floor
from mapspeak.spatial.rooms.frames import Frames
from mapspeak.spatial.rooms.merging import merge_basins
from mapspeak.spatial.rooms.raster import Raster
from mapspeak.spatial.rooms.settings import RoomSettings


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Segmentation:
    """Room numbers on a raster.

    Attributes:
        raster: What was cut.
        floor: The floor of it, without furniture.
        labels: 0 for no room, else from 1, the largest room first.
    """

    raster: Raster
    floor: Floor
    labels: NDArray[np.int32]


def segment(raster: Raster, settings: RoomSettings) -> Segmentation:
    """Cuts the floor at its doors."""
    floor = build_floor(raster, settings)
    height = _smooth(floor, settings.smoothing_m / raster.cell_size_m)
    basins = build_basins(height, floor.floor)
    saddles = find_saddles(basins, height)
    labels = merge_basins(
        basins,
        height,
        saddles,
        frames=Frames(floor, raster.cell_size_m),
        cell_area_m2=raster.cell_area_m2,
        settings=settings,
    )
    return Segmentation(raster=raster, floor=floor, labels=labels)


def _smooth(floor: Floor, sigma: float) -> NDArray[np.float32]:
    smooth = cv2.GaussianBlur(floor.clearance_m, (0, 0), sigma)
    return np.where(floor.floor > 0, smooth, np.float32(0))
