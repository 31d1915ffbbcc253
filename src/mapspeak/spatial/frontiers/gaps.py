"""Which borders lie where the robot does not fit, and how wide the way to them is."""

import dataclasses
import math
from collections.abc import Sequence

import cv2
import numpy as np

from mapspeak.spatial.frontiers.edges import Border, Labels
from mapspeak.spatial.frontiers.terrain import Terrain
from mapspeak.spatial.grid import Mask

__all__ = ["find_gap_widths_m", "find_parts_beyond"]

WIDTH_STEP_M = 0.1
"""Gaps are measured in steps of this."""
ROUNDING_CELLS = 2
"""By so much the reachable floor of a large map may be off, as its cells are joined."""


def find_parts_beyond(terrain: Terrain, borders: Sequence[Border]) -> list[Border | None]:
    """Finds of each border the part where the robot does not fit; None where it is the lesser part.

    The body of a robot that drives wherever it can covers all floor but slits, what lies behind
    them, and corners, which are no deeper than that of a right angle.
    """
    if not borders:
        return []
    away = cv2.distanceTransform((~terrain.reachable).view(np.uint8), cv2.DIST_L2, 5)
    deepest = math.sqrt(2) * terrain.radius_m / terrain.grid.resolution_m + ROUNDING_CELLS
    return [_part_where(border, away[border.rows, border.cols] > deepest) for border in borders]


def _part_where(border: Border, is_part: Mask) -> Border | None:
    ratio = float(is_part.mean())
    if ratio <= 0.5:
        return None
    return dataclasses.replace(
        border,
        rows=border.rows[is_part],
        cols=border.cols[is_part],
        length_m=ratio * border.length_m,
    )


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
