"""Frontiers that are looked over from one place are one frontier."""

import dataclasses

import numpy as np

from mapspeak.spatial.frontiers.frontier import Frontier

__all__ = ["merge_by_place"]


def merge_by_place(frontiers: list[Frontier], *, apart_m: float) -> list[Frontier]:
    """Gives frontiers whose poses are further from each other than some metres.

    The pose with most to see stands for all that are near to it: the gain, which is the same
    unknown, is counted once, and the borders become one.
    """
    waiting = sorted(frontiers, key=lambda each: -each.gain_m2)
    places = np.array([[each.pose.x, each.pose.y] for each in waiting]).reshape(-1, 2)
    is_waiting = np.ones(len(waiting), dtype=np.bool_)
    merged = []
    for index, frontier in enumerate(waiting):
        if is_waiting[index]:
            gaps_m = np.hypot(*(places - places[index]).T)
            near = np.flatnonzero(is_waiting & (gaps_m <= apart_m))
            is_waiting[near] = False
            merged.append(_joined(frontier, [waiting[each] for each in near if each != index]))
    return merged


def _joined(first: Frontier, others: list[Frontier]) -> Frontier:
    if not others:
        return first
    return dataclasses.replace(
        first,
        points=np.concatenate([first.points, *(each.points for each in others)]),
        length_m=first.length_m + sum(each.length_m for each in others),
    )
