"""Where a thing is, out of all views of it: every cell is weighed by all of them at once.

A view that is wrong as a whole counts with a constant, so it takes the same from every cell and
moves nothing (a mixture of a Gaussian and uniform outliers, for each view).
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapspeak.geometry import Point
from mapspeak.memory.things.likelihood import ViewLikelihood, WeighedView
from mapspeak.memory.things.sight import BODY_M, SURFACE_M, SightMap, find_log_priors
from mapspeak.memory.things.thing import NOISE
from mapspeak.spatial.grid import FloatArray, IntArray

_LEAST_WEIGHT = 1e-4
_N_SIGMAS = 2.5
_PEAK_M = 0.5
_MIDDLE_M = 0.75
_MOST_PEAKS = 25
N_WHEREABOUTS = 40
"""Enough to tell shares of the weight to within a few in a hundred, few enough to keep."""
HELD_RATIO = 0.9
MISJOINED_RATIO = 0.1
"""Of things, so many have a view of another one among theirs; half of these lie within all the
same. The weight knows nothing of that, so that a little more of it has to be held."""
_HELD_WEIGHT_RATIO = (HELD_RATIO - MISJOINED_RATIO / 2) / (1 - MISJOINED_RATIO)
POSE_M = 0.1
"""Standard deviation of where the map has a wall, as seen from where an observer was."""
_NINETY_SIGMAS = math.sqrt(-2 * math.log(1 - HELD_RATIO))
_SPREAD_M = _NINETY_SIGMAS * math.hypot(BODY_M / 2, POSE_M)
"""What the weight of cells leaves out: how deep a thing is, and what map and pose are good to."""
_BEST_ODDS = 1e6
"""However many views agree: they may all be of a map that is wrong."""
_SAME_PLACE_M = 0.3
"""Views from nearer to each other share their mistakes and count once."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Posterior:
    """Where a thing may be: lattice cells, rising, and weights that add up to one."""

    cells: IntArray
    weights: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Where a thing is; compared by identity.

    Attributes:
        position: The middle of the densest part of all the weight.
        uncertainty_m: The radius around it that holds the thing with 90 %.
        whereabouts: Points of the map frame, shape (n, 2): its surface is as likely at any as at
            any other.
    """

    position: Point
    uncertainty_m: float
    whereabouts: FloatArray

    def __post_init__(self) -> None:
        points = np.array(self.whereabouts)
        points.setflags(write=False)
        object.__setattr__(self, "whereabouts", points)


def build_posterior(sight: SightMap, views: Sequence[WeighedView]) -> Posterior:
    """Weigh the cells by all views; cells that hardly count are left out."""
    cells, logs = _log_weights(sight, views)
    weights = _normalised(logs.sum(axis=0))
    kept = weights >= _LEAST_WEIGHT * weights.max()
    return Posterior(cells=cells[kept], weights=weights[kept] / weights[kept].sum())


def measure_agreement(sight: SightMap, views: Sequence[WeighedView]) -> tuple[float, ...]:
    """Return for each view how much likelier it is than by chance, given all the others."""
    if len(views) < 2:
        return (1.0,) * len(views)
    cells, logs = _log_weights(sight, views)
    every = logs.sum(axis=0)
    agreements = []
    for i, said in enumerate(map(likelihood_of, views), start=1):
        weights = _normalised(every - logs[i])
        agreements.append(float(weights[np.searchsorted(cells, said.cells)] @ said.ratios))
    return tuple(agreements)


def find_confidence_ratio(apart: Iterable[tuple[WeighedView, float]]) -> float:
    """Return how likely it is that not all views are wrong: the odds of each, multiplied.

    The first view may be wrong in any way; a further one must be wrong and agree by chance.
    """
    odds = 1.0
    for i, (each, agreement) in enumerate(apart):
        odds *= (1 - each.wrong_ratio) / each.wrong_ratio * (agreement if i else 1.0)
    odds = min(odds, _BEST_ODDS)
    return odds / (1 + odds)


def views_from_apart(
    views: Iterable[tuple[WeighedView, float]],
) -> Iterator[tuple[WeighedView, float]]:
    """Yield views, each with its agreement, but those from beside another one."""
    places = list[Point]()
    for each, agreement in views:
        here = each.waypoint.pose.point
        if all(here.distance_to(other) >= _SAME_PLACE_M for other in places):
            places.append(here)
            yield each, agreement


def log_evidence(sight: SightMap, views: Sequence[WeighedView]) -> float:
    """Return how well all views go together as views of one thing, as a logarithm."""
    logs = _log_weights(sight, views)[1].sum(axis=0)
    top = float(logs.max())
    return top + float(np.log(np.exp(logs - top).sum()))


def trust_range(sight: SightMap, view: WeighedView, told_m: float) -> Posterior:
    """Weigh the cells by a lone view with a range, as if it were not wrong.

    How likely it is wrong, the trust in it says. Kept in the weight, that would reach as far as
    the line of sight: there are walls along it, and things stand by walls more often than on the
    floor where this one was told to be. Cells that the range's noise tells apart from it count only
    where all are such.
    """
    said, viewer = likelihood_of(view), view.waypoint.pose
    rows, cols = sight.rows.ravel()[said.cells], sight.cols.ravel()[said.cells]
    here = sight.grid.fractional_cells_at(np.array([[viewer.x, viewer.y]]))[0]
    far_m = np.hypot(rows - here[0], cols - here[1]) * sight.grid.resolution_m
    sigmas_m = NOISE.range_m + NOISE.range_ratio * far_m
    is_told = np.abs(far_m - told_m) <= _N_SIGMAS * sigmas_m
    kept = is_told if is_told.any() else slice(None)
    told = replace(said, cells=said.cells[kept], ratios=said.ratios[kept])
    return build_posterior(sight, [replace(view, likelihood=told, wrong_ratio=0.0)])


def likelihood_of(view: WeighedView) -> ViewLikelihood:
    """Return where a view that says so has its thing."""
    assert view.likelihood is not None, "joined views say where"  # noqa: S101 - our belief
    return view.likelihood


def speaks_of(sight: SightMap, view: WeighedView, point: Point) -> bool:
    """Return True where a view may be of a thing at a point."""
    rows, cols = sight.rows.ravel()[view.spoken_of], sight.cols.ravel()[view.spoken_of]
    row, col = sight.grid.fractional_cells_at(np.array([[point.x, point.y]]))[0]
    off_m = np.hypot(rows - row, cols - col) * sight.grid.resolution_m
    return bool((off_m <= SURFACE_M).any())


def find_middle(sight: SightMap, posterior: Posterior) -> tuple[float, float]:
    """Return the mean of the weight in metres along the rows and columns of the grid."""
    rows, cols = sight.rows.ravel()[posterior.cells], sight.cols.ravel()[posterior.cells]
    size_m = sight.grid.resolution_m
    return float(posterior.weights @ rows) * size_m, float(posterior.weights @ cols) * size_m


def place(sight: SightMap, posterior: Posterior, seen_from: Sequence[Point]) -> Placement:
    """Return the middle of the densest part of the weight, and how far 90 % of it reaches.

    Args:
        seen_from: The places of those who saw it: its middle lies behind what they met.
    """
    rows, cols = sight.rows.ravel()[posterior.cells], sight.cols.ravel()[posterior.cells]
    at = np.stack([rows, cols], axis=1) * sight.grid.resolution_m
    tops = np.argsort(-posterior.weights, kind="stable")[:_MOST_PEAKS]
    squares = np.subtract.outer(at[tops, 0], at[:, 0]) ** 2
    squares += np.subtract.outer(at[tops, 1], at[:, 1]) ** 2
    nearness = np.exp(squares * (-0.5 / _PEAK_M**2))
    peak = at[tops[int(np.argmax(nearness @ posterior.weights))]]
    around = posterior.weights * (np.hypot(*(at - peak).T) <= _MIDDLE_M)
    middle = around @ at / around.sum()
    off_m = np.hypot(*(at - middle).T)
    order = np.argsort(off_m, kind="stable")
    held = np.searchsorted(np.cumsum(posterior.weights[order]), _HELD_WEIGHT_RATIO)
    row, col = (middle / sight.grid.resolution_m).tolist()
    radius_m = float(off_m[order[min(int(held), len(order) - 1)]])
    surface = _point_at(sight, row, col)
    return Placement(
        position=_behind(surface, seen_from),
        uncertainty_m=math.hypot(radius_m, _SPREAD_M),
        whereabouts=_draw(sight, posterior.weights, at),
    )


def _draw(sight: SightMap, weights: FloatArray, at: FloatArray) -> FloatArray:
    """Return places as often as their weight says: systematic resampling (Kitagawa, 1996)."""
    levels = (np.arange(N_WHEREABOUTS) + 0.5) / N_WHEREABOUTS
    drawn = np.searchsorted(np.cumsum(weights), levels * weights.sum())
    down, across = at[np.minimum(drawn, len(at) - 1)].T
    x, y, yaw_rad = sight.grid.origin.x, sight.grid.origin.y, sight.grid.origin.yaw_rad
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    points = np.stack([x + across * cos - down * sin, y + across * sin + down * cos], axis=1)
    return np.asarray(points, dtype=np.float64)


def _behind(surface: Point, seen_from: Sequence[Point]) -> Point:
    """Return middle of a thing whose surface was met; of one seen from all sides that itself."""
    ways = [place.bearing_to(surface) for place in seen_from]
    share = BODY_M / 2 / max(len(ways), 1)
    return Point(
        surface.x + share * sum(map(math.cos, ways)), surface.y + share * sum(map(math.sin, ways))
    )


def _log_weights(sight: SightMap, views: Sequence[WeighedView]) -> tuple[IntArray, FloatArray]:
    """Return cells, and in logarithms their prior, then what each view says of them."""
    said = [likelihood_of(view) for view in views]
    is_spoken_of = np.zeros(sight.rows.size, dtype=np.bool_)
    for each in said:
        is_spoken_of[each.cells] = True
    cells = np.flatnonzero(is_spoken_of)
    logs = np.empty((len(views) + 1, len(cells)))
    logs[0] = find_log_priors(sight, cells, (each.update for each in said), views[0].stance)
    for i, (view, each) in enumerate(zip(views, said, strict=True), start=1):
        logs[i] = view.wrong_ratio
        logs[i, np.searchsorted(cells, each.cells)] += (1 - view.wrong_ratio) * each.ratios
    np.log(logs[1:], out=logs[1:])
    return cells, logs


def _normalised(logs: FloatArray) -> FloatArray:
    weights = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def _point_at(sight: SightMap, row: float, col: float) -> Point:
    grid = sight.grid
    return grid.origin.transform(Point(col * grid.resolution_m, row * grid.resolution_m))
