"""The one thing a benchmark gives."""

from dataclasses import dataclass

__all__ = ["Figure"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number that was measured, and what it counts.

    Attributes:
        name: What was measured, in words.
        value: The number.
        unit: Its unit, such as "ms" or "MB".
    """

    name: str
    value: float
    unit: str
