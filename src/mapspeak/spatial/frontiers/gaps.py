"""How wide the way is to a border that the robot cannot get to."""

from collections.abc import Sequence

import cv2
import numpy as np

from mapspeak.spatial.frontiers.edges import Border, Labels
from mapspeak.spatial.frontiers.terrain import Terrain

__all__ = ["find_gap_widths_m"]

WIDTH_STEP_M = 0.1
"""Gaps are measured in steps of this."""


def find_gap_widths_m(terrain: Terrain, borders: Sequence[Border]) -> list[float | None]:
    """Finds for each border how wide the widest way to it is at its narrowest; None without a way.

    The floor is taken in that has so much room around it, step by step more; a border hangs
    together with where the robot is until its way is too narrow.
    """
    widths_m: list[float | None] = [None] * len(borders)
    joined = list(range(len(borders))) if terrain.reachable.any() else []
    for width_m in np.arange(0.0, 2 * terrain.radius_m - 1e-9, WIDTH_STEP_M):
        if not joined:
            break
        labels, robot = _label_wide_floor(terrain, float(width_m))
        joined = [i for i in joined if (labels[borders[i].rows, borders[i].cols] == robot).any()]
        for index in joined:
            widths_m[index] = float(width_m)
    return widths_m


def _label_wide_floor(terrain: Terrain, width_m: float) -> tuple[Labels, int]:
    """Numbers the pieces of floor that are nowhere narrower, and says where the robot is."""
    wide = terrain.free & (terrain.clearances_m >= width_m / 2 - 1e-6)
    wide |= terrain.reachable
    _, labels = cv2.connectedComponents(wide.view(np.uint8), connectivity=4)
    return np.asarray(labels, dtype=np.int32), int(labels.flat[terrain.reachable.argmax()])
