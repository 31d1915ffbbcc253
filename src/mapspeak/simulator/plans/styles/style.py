"""What a style gives: a layout with what is common to all of a building."""

from collections.abc import Callable
from dataclasses import dataclass

from mapspeak.simulator.plans.dice import Dice
from mapspeak.simulator.plans.layout import Layout, Space

__all__ = ["Building", "Style"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Building:
    """A building before it is furnished.

    Attributes:
        layout: Its floor.
        start: The space with the charging dock.
        wall_thickness_m: Of all walls.
        wall_height_m: Of all walls.
        is_complete: Every room that it needs found its place.
    """

    layout: Layout
    start: Space
    wall_thickness_m: float
    wall_height_m: float
    is_complete: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """A kind of building.

    Attributes:
        name: As the command takes it.
        title: Such as "An office floor".
        lay_out: Draws one, a large one if its second argument is true. It raises ValueError when
            what it drew does not fit.
    """

    name: str
    title: str
    lay_out: Callable[[Dice, bool], Building]
