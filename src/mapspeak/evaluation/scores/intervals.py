"""How sure a figure is: Wilson's interval for shares, the bootstrap for everything else."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

__all__ = ["Interval", "bootstrap_interval", "wilson_interval"]

CONFIDENCE = 0.95
N_RESAMPLES = 2000


@dataclass(frozen=True, slots=True)
class Interval:
    """A figure and where the true one lies with 95 % confidence.

    Attributes:
        value: The figure.
        low: The lower end.
        high: The upper end.
    """

    value: float
    low: float
    high: float


def wilson_interval(n_successes: int, n_trials: int) -> Interval | None:
    """Return the share of successes with Wilson's score interval (1927); None without trials."""
    if n_trials == 0:
        return None
    z = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2)
    share, weight = n_successes / n_trials, z**2 / n_trials
    middle = (share + weight / 2) / (1 + weight)
    half = z / (1 + weight) * math.sqrt(share * (1 - share) / n_trials + weight / (4 * n_trials))
    return Interval(share, max(middle - half, 0.0), min(middle + half, 1.0))


def bootstrap_interval(values: Sequence[float], *, seed: int = 0) -> Interval | None:
    """Return the mean with its bootstrap interval (Efron, 1979); None without values."""
    if not values:
        return None
    sample = np.asarray(values, dtype=np.float64)
    chosen = np.random.default_rng(seed).integers(sample.size, size=(N_RESAMPLES, sample.size))
    means = sample[chosen].mean(axis=1)
    low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]).tolist()
    return Interval(float(sample.mean()), low, high)
