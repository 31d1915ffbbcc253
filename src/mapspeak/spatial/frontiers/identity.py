"""Frontiers keep their ids from call to call, while they exist."""

import dataclasses

import numpy as np

from mapspeak.spatial.frontiers.frontier import Frontier, FrontierReport
from mapspeak.spatial.grid import FloatArray

__all__ = ["match_frontiers"]

TOUCH_M = 0.3
"""Points of one frontier on two maps are no further apart."""
SAME_PLACE_M = 2.0
"""Who goes to a frontier by its id comes no farther off than this from where it was."""
SAME_RATIO = 0.25
"""Two frontiers are one when this share of the shorter lies on the other."""


def match_frontiers(previous: FrontierReport, current: FrontierReport) -> FrontierReport:
    """Gives the current report with the ids of the previous one where a frontier still exists.

    Frontiers are compared by where they lie in the world, so the map may grow and move its origin
    in between. New ones get numbers that were never given before.
    """
    ids = _inherited(previous.frontiers, current.frontiers)
    n_named = previous.n_named
    named = []
    for index, frontier in enumerate(current.frontiers):
        if index not in ids:
            n_named += 1
        named.append(dataclasses.replace(frontier, id=ids.get(index, f"F{n_named}")))
    return dataclasses.replace(current, frontiers=tuple(named), n_named=n_named)


def _inherited(previous: tuple[Frontier, ...], current: tuple[Frontier, ...]) -> dict[int, str]:
    """Gives the ids that pass on, largest overlap first, by index among the current ones."""
    overlaps = [
        (_overlap_ratio(old.points, new.points), index, old.id)
        for old in previous
        for index, new in enumerate(current)
    ]
    ids: dict[int, str] = {}
    for ratio, index, old_id in sorted(overlaps, key=lambda each: (-each[0], each[1], each[2])):
        if ratio >= SAME_RATIO and index not in ids and old_id not in ids.values():
            ids[index] = old_id
    return {
        index: old_id for index, old_id in ids.items() if _is_near(previous, current, index, old_id)
    }


def _is_near(
    previous: tuple[Frontier, ...], current: tuple[Frontier, ...], index: int, old_id: str
) -> bool:
    """True when the pose has hardly moved: an id that leads somewhere else would mislead."""
    old = next(frontier for frontier in previous if frontier.id == old_id)
    return old.pose.point.distance_to(current[index].pose.point) <= SAME_PLACE_M


def _overlap_ratio(first: FloatArray, second: FloatArray) -> float:
    """Gives the share of the shorter set of points that lies on the other."""
    shorter, longer = sorted((first, second), key=len)
    low, high = longer.min(axis=0) - TOUCH_M, longer.max(axis=0) + TOUCH_M
    near = shorter[((shorter >= low) & (shorter <= high)).all(axis=1)]
    if not len(near):
        return 0.0
    gaps = np.hypot(*(near[:, None, :] - longer[None, :, :]).transpose(2, 0, 1)).min(axis=1)
    return float((gaps <= TOUCH_M).sum()) / len(shorter)
