"""Zones on the map area: a bold outline and wide hatching that hide no wall and no room."""

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import Mask
from mapspeak.spatial.picture.marks import Zone
from mapspeak.spatial.picture.palette import FILLS, WALL, Canvas, Colour, FillPart
from mapspeak.spatial.picture.poles import find_poles
from mapspeak.spatial.picture.view import View

__all__ = ["ZONE_NUMBER", "paint_zones"]

ZONE_NUMBER = FILLS[Colour.VERMILION, FillPart.OUTLINE]
_OUTLINE_PX = 3
_HATCH_STEP_PX = 12
_HATCH_PX = 2
_SHIFT = 4
_FAR_PX = 1 << 20
"""OpenCV draws with whole numbers; what lies so far out of sight needs no exact place."""


def paint_zones(
    ground: Canvas, view: View, zones: tuple[Zone, ...]
) -> dict[Zone, tuple[float, float] | None]:
    """Draws zones over the ground, and gives those in sight with the place for each label.

    Args:
        ground: Palette numbers of the map area; changed in place, but for walls.
        view: Where the map lies.
        zones: The later ones lie above; what they cover wholly has no place for a label.
    """
    numbers = np.zeros(ground.shape, dtype=np.uint16)
    shown = {}
    row = np.arange(ground.shape[0])[:, np.newaxis]
    col = np.arange(ground.shape[1])
    is_hatch = (row - col) % _HATCH_STEP_PX < _HATCH_PX
    for number, zone in enumerate(zones, start=1):
        is_inside, is_edge = _cover(ground.shape, view, zone)
        is_floor = ground != WALL
        ground[(is_edge | (is_inside & is_hatch)) & is_floor] = ZONE_NUMBER
        if (is_inside | is_edge).any():
            # Walls are left out, so that the label stands beside them.
            numbers[(is_inside | is_edge) & is_floor] = number
            shown[number] = zone
    poles = find_poles(numbers, tuple(shown))
    return {zone: poles.get(number) for number, zone in shown.items()}


def _cover(shape: tuple[int, ...], view: View, zone: Zone) -> tuple[Mask, Mask]:
    """Gives which pixels lie in a zone, and which on its outlines."""
    corners = [
        _in_subpixels(np.array([[corner.x, corner.y] for corner in outline]), view)
        for outline in zone.outlines
    ]
    inside = np.zeros(shape, dtype=np.uint8)
    cv2.fillPoly(inside, corners, (1,), cv2.LINE_8, _SHIFT)
    edge = np.zeros(shape, dtype=np.uint8)
    cv2.polylines(edge, corners, isClosed=True, color=(1,), thickness=_OUTLINE_PX, shift=_SHIFT)
    return inside > 0, edge > 0


def _in_subpixels(points: NDArray[np.float64], view: View) -> NDArray[np.int32]:
    pixels = np.clip(view.area_pixels_at(points) - 0.5, -_FAR_PX, _FAR_PX)
    return np.asarray(np.rint(pixels * (1 << _SHIFT)), dtype=np.int32)
