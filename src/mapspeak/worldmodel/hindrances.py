"""Parts of the floor that cost more than their length: ways around them are preferred."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import Path
from mapspeak.spatial.paths.wavefront import Costs
from mapspeak.worldmodel.closures import ClosedArea, mask_areas

__all__ = ["Hindrance", "weigh_floor"]

STEP_M = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Hindrance:
    """A part of the floor that is better not driven over where there is another way.

    Attributes:
        area: Where.
        extra_m: A way across it counts as at least so much longer.
        factor: A metre in it counts as at least so many.
    """

    area: ClosedArea
    extra_m: float
    factor: float

    @property
    def weight(self) -> float:
        """What a metre in it counts as: across a door's sill as much as across a room."""
        corners = np.array([[each.x, each.y] for each in self.area.outline], dtype=np.float32)
        _, sides, _ = cv2.minAreaRect(corners)
        return max(self.factor, 1 + self.extra_m / max(min(sides), STEP_M))

    def is_crossed_by(self, path: Path) -> bool:
        """True when a way leads over it."""
        return any(self.area.contains(point) for point in _points_along(path))


def weigh_floor(grid: OccupancyGrid, hindrances: Sequence[Hindrance]) -> Costs | None:
    """Gives what a metre counts in each cell of a map; None where it is one everywhere."""
    if not hindrances:
        return None
    weights = np.ones(grid.cells.shape, dtype=np.float32)
    for hindrance in hindrances:
        inside = mask_areas(grid, [hindrance.area])
        weights[inside] = np.maximum(weights[inside], np.float32(hindrance.weight))
    return weights


def _points_along(path: Path) -> list[Point]:
    points = [*path.points[:1]]
    for start, end in zip(path.points, path.points[1:], strict=False):
        n_steps = max(int(np.ceil(start.distance_to(end) / STEP_M)), 1)
        xs = np.linspace(start.x, end.x, n_steps + 1)[1:].tolist()
        ys = np.linspace(start.y, end.y, n_steps + 1)[1:].tolist()
        points += [Point(x, y) for x, y in zip(xs, ys, strict=True)]
    return points
