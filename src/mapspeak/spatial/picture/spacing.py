"""How far apart the lines of a metric grid are, and how their numbers are written."""

import math

__all__ = ["decimals_of", "even_spacing_m", "paper_spacing_m", "round_length_m"]

_N_LINES_ALONG_LONG_SIDE = 8.5
"""Between 6 and 12: enough to read coordinates from, few enough to see the map."""

_PAPER_N_LINES = 15
_PAPER_MAX_LINES = 90
_STEPS = (1.0, 2.0, 5.0)


def even_spacing_m(longest_m: float) -> float:
    """Gives the spacing that puts about 6 to 12 lines across the longest side of a map."""
    return round_length_m(longest_m / _N_LINES_ALONG_LONG_SIDE)


def round_length_m(wanted_m: float) -> float:
    """Gives the 1, 2 or 5 times a power of ten that comes nearest to a length."""
    return min(_candidates(wanted_m), key=lambda step_m: abs(math.log(step_m / wanted_m)))


def paper_spacing_m(width_m: float, height_m: float, resolution_m: float) -> float:
    """Gives the paper's adaptive spacing: the next intuitive value from s_base on (eq. 5).

    On maps more than six times as long as wide it grows beyond the paper's, for the same purpose:
    so that the lines across the long side do not merge into a grey floor.
    """
    base_m = max(min(width_m, height_m) / _PAPER_N_LINES, resolution_m)
    base_m = max(base_m, max(width_m, height_m) / _PAPER_MAX_LINES)
    return next(step_m for step_m in _candidates(base_m) if step_m >= base_m * (1 - 1e-9))


def decimals_of(spacing_m: float) -> int:
    """Gives how many decimals the numbers at multiples of a spacing need."""
    return max(0, -math.floor(math.log10(spacing_m) + 1e-9))


def _candidates(around_m: float) -> list[float]:
    exponent = math.floor(math.log10(around_m))
    return [step * 10.0**power for power in range(exponent - 1, exponent + 2) for step in _STEPS]
