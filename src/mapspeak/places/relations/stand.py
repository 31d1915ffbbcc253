"""Where a robot is to stand, and why there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.errors import GoalError
from mapspeak.geometry import Point
from mapspeak.places.relations.footing import Footing
from mapspeak.spatial.grid import FloatArray

__all__ = ["Stand", "extent_away_m", "join_or", "refuse", "tolerance_m"]

MOST_EXTENT = 256
TOLERANCE_M = 0.1
FALLBACK = "Call look_at_map, or measure, and name another place."


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """A place that fits a relation.

    Attributes:
        point: Where to stand.
        yaw_rad: The heading there; None for that of the arrival.
        reason: What it is, with the distance actually taken.
    """

    point: Point
    reason: str
    yaw_rad: float | None = None


def refuse(what: str, works: Sequence[str] = (), *, else_hint: str = FALLBACK) -> GoalError:
    """Gives the error for what nothing fits, with what would."""
    hint = f"What would work: {join_or(works)}." if works else else_hint
    return GoalError(what, hint=hint)


def join_or(words: Sequence[str]) -> str:
    """Gives "a, b or c"."""
    return " or ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def tolerance_m(resolution_m: float) -> float:
    """Gives how far off a distance may be that somebody asked for."""
    return max(TOLERANCE_M, 0.75 * resolution_m)


def extent_away_m(footing: Footing, extent: FloatArray) -> FloatArray:
    """Gives how far each cell is from the nearest of some points, as the crow flies."""
    step = -(-len(extent) // MOST_EXTENT)
    squares = np.full(len(footing.points), np.inf)
    for x, y in extent[::step]:
        dx, dy = footing.points[:, 0] - x, footing.points[:, 1] - y
        np.minimum(squares, dx * dx + dy * dy, out=squares)
    return np.asarray(np.sqrt(squares), dtype=np.float64)
