"""A rough transform between two maps made exact: wall points slide onto the nearest walls."""

import numpy as np

from mapspeak.geometry import Pose
from mapspeak.semantic.alignment.surfaces import MapSurfaces, placed
from mapspeak.spatial.grid import FloatArray

__all__ = ["refine"]

REACHES_M = (1.2, 0.7, 0.4, 0.25, 0.15)
"""Walls farther apart than this do not attract each other; smaller from round to round."""
N_STEPS = 6
MOST_POINTS = 3000
LEAST_POINTS = 10
SETTLED_M, SETTLED_RAD = 1e-4, 1e-5


def refine(old: MapSurfaces, new: MapSurfaces, guess: Pose) -> Pose:
    """Gives the transform near a guess by which most of the old map's walls lie on the new one's.

    Each step moves the points towards the lines of their nearest walls (Chen and Medioni, "Object
    modelling by registration of multiple range images", 1992).
    """
    points = _sample(old.points)
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
    """Gives the small motion that brings points nearest to the lines of walls in reach."""
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


def _sample(points: FloatArray) -> FloatArray:
    """Gives some of the points, spread evenly over the map, the same ones every time."""
    stride = max(-(-len(points) // MOST_POINTS), 1)
    return points[::stride]
