"""Fit an old map onto a new one by a rigid motion: guess it from the walls, then refine it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory.alignment.surfaces import MapAgreement, MapSurfaces, judge, placed, sample
from mapspeak.spatial.grid import FloatArray

Raster = NDArray[np.float32]

N_BINS = 360
"""Bins for directions modulo pi, half a degree each."""
BLUR_BINS = 2.0
N_TURNS = 6
"""Turns to be tried, each in both senses; a building of right angles has two."""
APART_RAD = np.radians(4.0)
LEAST_TURN_RATIO = 0.5
"""Skip turns that rise above the floor by less than this share of the best turn's rise."""
N_SHIFTS = 4
"""Shifts to be tried for each turn."""
APART_M = 1.0

CELL_M = 0.2
LARGEST_RASTER = 1024
"""Cells along the side of the raster for shifts; a larger building gets larger cells."""
NEAR_CELLS = 1.25
CONFLICT = 0.5
"""Penalty for a wall in clear floor, relative to the credit for a wall on a wall."""


def guess_transforms(old: MapSurfaces, new: MapSurfaces) -> Iterator[Pose]:
    """Return transforms from the old map's frame to the new one's that are worth a closer look."""
    if not (old.points.size and new.points.size):
        return
    field = _Field(old, new)
    for turn_rad in _find_turns(old, new):
        yield from field.find_shifts(turn_rad)


# --- turns -----------------------------------------------------------------------------------


def _find_turns(old: MapSurfaces, new: MapSurfaces) -> list[float]:
    before, after = _directions(old), _directions(new)
    spectrum = np.conj(np.fft.rfft(before)) * np.fft.rfft(after)
    likeness = np.fft.irfft(spectrum, N_BINS)
    floor = float(np.median(likeness))
    least = floor + LEAST_TURN_RATIO * (float(likeness.max()) - floor)
    turns: list[float] = []
    for index in np.argsort(-likeness, kind="stable"):
        if len(turns) == N_TURNS or likeness[index] < least:
            break
        turn_rad = float(_peak(likeness, int(index))) * np.pi / N_BINS
        if all(abs(wrap_angle(2 * (turn_rad - other))) > 2 * APART_RAD for other in turns):
            turns.append(turn_rad)
    return [wrap_angle(turn + half) for turn in turns for half in (0.0, np.pi)]


def _directions(surfaces: MapSurfaces) -> FloatArray:
    """Return how much wall runs in each direction modulo pi, a little blurred."""
    angles, sureness = surfaces.lines
    bins = (angles / np.pi * N_BINS).astype(np.intp) % N_BINS
    histogram = np.bincount(bins, weights=sureness, minlength=N_BINS)
    frequencies = np.fft.rfftfreq(N_BINS)
    blur = np.exp(-2 * (np.pi * BLUR_BINS * frequencies) ** 2)
    return np.asarray(np.fft.irfft(np.fft.rfft(histogram) * blur, N_BINS))


def _peak(values: FloatArray, index: int) -> float:
    """Return where the parabola through a highest value and its neighbours is highest."""
    low, middle, high = (values[(index + step) % len(values)] for step in (-1, 0, 1))
    curvature = low - 2 * middle + high
    return index + (0.5 * (low - high) / curvature if curvature < 0 else 0.0)


# --- shifts ----------------------------------------------------------------------------------


class _Field:
    """The new map as a raster that a turned old map is laid on in every place at once."""

    def __init__(self, old: MapSurfaces, new: MapSurfaces) -> None:
        self._old_walls, self._old_floor = _thinned(old.points), _thinned(old.clear_floor)
        self._old_centre = _middle(old.points)
        reach_m = float(np.hypot(*(old.points - self._old_centre).T).max())
        self._low = new.points.min(axis=0) - reach_m
        extent_m = float((new.points.max(axis=0) + reach_m - self._low).max()) + reach_m
        self._cell_m = max(CELL_M, extent_m / LARGEST_RASTER)
        self._size = cv2.getOptimalDFTSize(math.ceil(extent_m / self._cell_m))
        self._fits, self._walls = map(np.fft.rfft2, self._rasters(new))

    def find_shifts(self, turn_rad: float) -> Iterator[Pose]:
        turn = Pose(0.0, 0.0, turn_rad)
        turned_centre = placed(self._old_centre[None], turn)[0]
        # Relative to the raster's corner, so that the shift is the new position of the centre.
        walls = self._drawn(placed(self._old_walls, turn) - turned_centre)
        floor = self._drawn(placed(self._old_floor, turn) - turned_centre)
        spectrum = np.conj(np.fft.rfft2(walls)) * self._fits
        spectrum -= CONFLICT * np.conj(np.fft.rfft2(floor)) * self._walls
        score = np.fft.irfft2(spectrum, (self._size, self._size)).astype(np.float32)
        for row, col in self._peaks(score):
            x, y = self._low + np.array([col, row]) * self._cell_m - turned_centre
            yield Pose(float(x), float(y), turn_rad)

    def _rasters(self, new: MapSurfaces) -> tuple[Raster, Raster]:
        """Return how well a wall fits in each place of the new map, and where its walls are."""
        steps = np.arange(self._size) * self._cell_m
        xs, ys = np.meshgrid(self._low[0] + steps, self._low[1] + steps)
        centres = np.stack([xs.ravel(), ys.ravel()], axis=1)
        distances, is_seen = new.distances_at(centres)
        near = np.exp(-((distances / (NEAR_CELLS * self._cell_m)) ** 2))
        is_clear = is_seen & (distances > 2 * NEAR_CELLS * self._cell_m)
        fits = np.where(is_clear, -CONFLICT, near).reshape(self._size, self._size)
        return fits.astype(np.float32), self._drawn(new.points - self._low)

    def _drawn(self, points: FloatArray) -> Raster:
        """Return the raster with ones where points are; what lies left of it is wrapped round."""
        cols, rows = np.round(points / self._cell_m).astype(np.intp).T % self._size
        raster = np.zeros((self._size, self._size), dtype=np.float32)
        raster[rows, cols] = 1.0
        return raster

    def _peaks(self, score: Raster) -> Iterator[tuple[int, int]]:
        apart = max(round(APART_M / self._cell_m), 1)
        around = np.arange(-apart, apart + 1)
        for _ in range(N_SHIFTS):
            row, col = np.unravel_index(int(score.argmax()), score.shape)
            if score[row, col] <= 0:
                return
            yield int(row), int(col)
            score[np.ix_((row + around) % self._size, (col + around) % self._size)] = -np.inf


def _middle(points: FloatArray) -> FloatArray:
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)


def _thinned(points: FloatArray) -> FloatArray:
    """Return one point for each part of the plane as large as a cell of the raster."""
    if not points.size:
        return points
    keys = np.floor(points / (CELL_M / 2)).astype(np.int64)
    _, first = np.unique(keys, axis=0, return_index=True)
    return points[np.sort(first)]


REACHES_M = (1.2, 0.7, 0.4, 0.25, 0.15)
"""Walls farther apart than this do not attract each other; smaller from round to round."""
N_STEPS = 6
MOST_POINTS = 3000
LEAST_POINTS = 10
SETTLED_M, SETTLED_RAD = 1e-4, 1e-5


def refine(old: MapSurfaces, new: MapSurfaces, guess: Pose) -> Pose:
    """Return the transform near a guess by which most of the old map's walls lie on the new one's.

    Each step moves the points towards the lines of their nearest walls (Chen and Medioni, "Object
    modelling by registration of multiple range images", 1992).
    """
    points = sample(old.points, most=MOST_POINTS)
    transform = guess
    for reach_m in REACHES_M:
        reach_m = max(reach_m, 1.5 * new.grid.resolution_m)  # noqa: PLW2901 - coarse maps
        for _ in range(N_STEPS):
            step = _find_step(new, placed(points, transform), reach_m)
            if step is None:
                return transform
            transform = step @ transform
            if np.hypot(step.x, step.y) < SETTLED_M and abs(step.yaw_rad) < SETTLED_RAD:
                break
    return transform


def _find_step(new: MapSurfaces, points: FloatArray, reach_m: float) -> Pose | None:
    """Return the small motion that brings points nearest to the lines of walls in reach."""
    nearest, distances = new.nearest_to(points)
    is_near = distances < reach_m
    if np.count_nonzero(is_near) < LEAST_POINTS:
        return None
    here, there = points[is_near], new.points[nearest[is_near]]
    angles, sureness = (each[nearest[is_near]] for each in new.lines)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    centre = here.mean(axis=0)
    arms = here - centre
    turning = arms[:, 0] * normals[:, 1] - arms[:, 1] * normals[:, 0]
    slopes = np.column_stack([normals, turning])
    gaps = ((there - here) * normals).sum(axis=1)
    weights = sureness * (1 - (distances[is_near] / reach_m) ** 2)
    # Walls of one direction alone leave a shift open: a little inertia keeps it at zero.
    inertia = np.diag([1.0, 1.0, np.square(arms).sum(axis=1).mean()]) * 1e-3 * weights.sum()
    matrix = slopes.T @ (weights[:, None] * slopes) + inertia
    x, y, yaw_rad = np.linalg.solve(matrix, slopes.T @ (weights * gaps)).tolist()
    about = Pose(float(centre[0]), float(centre[1]))
    return about @ Pose(x, y, yaw_rad) @ about.inverse()


LEAST_AGREEMENT = 0.88
"""Other buildings reach .98 where they share a wall or two, and .83 where they share more."""
LEAST_OVERLAP = 0.35
LEAST_SHARED_M = 25.0
"""A room alone has as much wall, and rooms are alike."""
SURE_AGREEMENT, SURE_OVERLAP = 0.9, 0.5

RIVAL_EVIDENCE = 0.8
"""A second placing with at least this share of the best evidence makes the fit ambiguous."""
RIVAL_AGREEMENT, RIVAL_AGREEING_EVIDENCE = 0.05, 0.4
"""Likewise one that agrees as well as the best within the first, with less in common."""
SAME_M, SAME_RAD = 0.5, math.radians(5.0)


class Certainty(StrEnum):
    """Certainty that a map was placed correctly."""

    SURE = "sure"
    LIKELY = "likely"
    AMBIGUOUS = "ambiguous"
    UNSURE = "unsure"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapFit:
    """Placing of an old map on a new one.

    Attributes:
        rival: Agreement at the second best placing; None without one.
        off_m: How far the middle of the old map's walls moves.
    """

    new_from_old: Pose
    quality: MapAgreement
    rival: MapAgreement | None
    certainty: Certainty
    off_m: float

    @property
    def is_sure_enough(self) -> bool:
        """True if poses may be moved by this fit."""
        return self.certainty in (Certainty.SURE, Certainty.LIKELY)


def find_fit(old: MapSurfaces, new: MapSurfaces) -> MapFit | None:
    """Find the placing of an old map on a new one; None if no placing is possible."""
    refined = (refine(old, new, guess) for guess in guess_transforms(old, new))
    judged = [(transform, judge(old, new, transform)) for transform in refined]
    if not judged:
        return None
    judged.sort(key=lambda each: -each[1].evidence_m)
    best, quality = judged[0]
    middle = Point(*_middle(old.points).tolist())
    others = [each for transform, each in judged[1:] if not _is_same_place(transform, best, middle)]
    # The strongest rival of the best placing.
    rival = max(others, key=lambda each: (_is_rival(each, quality), each.evidence_m), default=None)
    return MapFit(
        new_from_old=best,
        quality=quality,
        rival=rival,
        certainty=_certainty_of(quality, rival),
        off_m=middle.distance_to(best.transform(middle)),
    )


def _is_rival(other: MapAgreement, best: MapAgreement) -> bool:
    evidence_ratio = other.evidence_m / best.evidence_m if best.evidence_m > 0 else math.inf
    agrees_as_well = other.agreement_ratio >= best.agreement_ratio - RIVAL_AGREEMENT
    return evidence_ratio >= (RIVAL_AGREEING_EVIDENCE if agrees_as_well else RIVAL_EVIDENCE)


def _certainty_of(quality: MapAgreement, rival: MapAgreement | None) -> Certainty:
    if not (
        quality.agreement_ratio >= LEAST_AGREEMENT
        and quality.overlap_ratio >= LEAST_OVERLAP
        and quality.shared_m >= LEAST_SHARED_M
    ):
        return Certainty.UNSURE
    if rival is not None and _is_rival(rival, quality):
        return Certainty.AMBIGUOUS
    is_sure = quality.agreement_ratio >= SURE_AGREEMENT and quality.overlap_ratio >= SURE_OVERLAP
    return Certainty.SURE if is_sure else Certainty.LIKELY


def _is_same_place(one: Pose, other: Pose, middle: Point) -> bool:
    turned = abs(wrap_angle(one.yaw_rad - other.yaw_rad))
    return turned < SAME_RAD and one.transform(middle).distance_to(other.transform(middle)) < SAME_M
