"""Chances of a plan: all from one seed, in lengths that a person would write."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

__all__ = ["Dice"]

T = TypeVar("T")


class Dice:
    """Draws from a seed; only plain random numbers, so that the draws outlast NumPy's versions."""

    def __init__(self, *seed: int) -> None:
        self._random = np.random.Generator(np.random.PCG64(list(seed)))

    def length_m(self, low_m: float, high_m: float) -> float:
        """Gives a length between two others, in whole decimetres."""
        return round(low_m + (high_m - low_m) * float(self._random.random()), 1)

    def count(self, low: int, high: int) -> int:
        """Gives a whole number from low to high, both included."""
        return low + min(int(self._random.random() * (high - low + 1)), high - low)

    def happens(self, ratio: float) -> bool:
        """True in so many of all cases."""
        return float(self._random.random()) < ratio

    def choose(self, of: Sequence[T]) -> T:
        """Gives one of several."""
        return of[self.count(0, len(of) - 1)]

    def shuffle(self, things: Sequence[T]) -> list[T]:
        """Gives the same things in another order."""
        keys = self._random.random(len(things))
        return [things[at] for at in np.argsort(keys, kind="stable").tolist()]
