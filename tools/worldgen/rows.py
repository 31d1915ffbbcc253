"""Rooms in a row along a corridor, some with a small room cut out of a corner."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from tools.worldgen.layout import Dice, Layout, Rect, Space
from tools.worldgen.purposes import PURPOSES

__all__ = ["Programme", "Row", "Side", "open_into"]

CUT_RATIO = 0.9
"""How often a room that is large enough gives a corner to a small one."""
FIRST_CUT_M = (2.2, 2.4), (2.4, 2.5)
"""Width and depth of the first small room, which so becomes the smallest of all."""
CUT_M = (2.6, 3.0), (2.8, 3.2)
"""Of all others."""
LEAST_LEFT_M = 2.3
"""What an L keeps of its front, and behind the small room."""
SQUEEZED, STRETCHED = 0.85, 1.6
"""How far from its usual widths a room may be."""


class Side(StrEnum):
    """Where a row's corridor lies."""

    BOTTOM = "bottom"
    TOP = "top"
    LEFT = "left"
    RIGHT = "right"


@dataclass(slots=True)
class Programme:
    """Which rooms a building still needs.

    Attributes:
        needed: Each must be there.
        small: Likewise; they go into corners of other rooms.
        usual: What else there is, again and again.
        has_smallest: The building has its smallest room already.
    """

    needed: list[str]
    small: list[str]
    usual: Sequence[str]
    has_smallest: bool = False
    _turn: Iterator[str] = field(init=False)

    def __post_init__(self) -> None:
        self._turn = itertools.cycle(self.usual)

    @property
    def is_done(self) -> bool:
        """True when nothing that is needed is left."""
        return not self.needed and not self.small

    def next_for(self, width_m: float) -> str | None:
        """Return the next room that fits into what is left of a row."""
        for purpose in self.needed:
            if PURPOSES[purpose].width_m[0] <= width_m:
                self.needed.remove(purpose)
                return purpose
        for purpose in itertools.islice(self._turn, len(self.usual)):
            if PURPOSES[purpose].width_m[0] <= width_m:
                return purpose
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A strip of rooms.

    Attributes:
        rect: All of it.
        front: The side on which the corridor lies.
        corridor: That corridor.
    """

    rect: Rect
    front: Side
    corridor: Space

    @property
    def length_m(self) -> float:
        """Along the corridor."""
        is_level = self.front in {Side.BOTTOM, Side.TOP}
        return self.rect.width_m if is_level else self.rect.height_m

    @property
    def depth_m(self) -> float:
        """Away from the corridor."""
        is_level = self.front in {Side.BOTTOM, Side.TOP}
        return self.rect.height_m if is_level else self.rect.width_m

    def part(self, low: float, high: float, near: float, far: float) -> Rect:
        """Return what lies between two places along the row and two depths."""
        rect = self.rect
        match self.front:
            case Side.BOTTOM:
                bottom, top = rect.bottom + near, rect.bottom + far
            case Side.TOP:
                bottom, top = rect.top - far, rect.top - near
            case Side.LEFT:
                return Rect(
                    rect.left + near, rect.bottom + low, rect.left + far, rect.bottom + high
                )
            case Side.RIGHT:
                return Rect(
                    rect.right - far, rect.bottom + low, rect.right - near, rect.bottom + high
                )
        return Rect(rect.left + low, bottom, rect.left + high, top)

    def fill(self, layout: Layout, dice: Dice, programme: Programme) -> None:
        """Lay out the rooms of the row.

        Raises:
            ValueError: They do not fit.
        """
        low = 0.0
        for purpose, width_m in _choose_rooms(dice, self.length_m, programme):
            high = round(low + width_m, 2)
            self._add_room(layout, dice, programme, (purpose, low, high))
            low = high

    def _add_room(
        self, layout: Layout, dice: Dice, programme: Programme, room: tuple[str, float, float]
    ) -> None:
        purpose, low, high = room
        whole = self.part(low, high, 0.0, self.depth_m)
        width_m, depth_m = CUT_M if programme.has_smallest else FIRST_CUT_M
        cut_m = dice.length_m(*width_m), dice.length_m(*depth_m)
        is_large = high - low - cut_m[0] >= LEAST_LEFT_M and self.depth_m - cut_m[1] >= LEAST_LEFT_M
        if not (programme.small and is_large and dice.happens(CUT_RATIO)):
            open_into(layout, dice, layout.add(purpose, whole.outline), self.corridor)
            return
        edge = (low, low + cut_m[0]) if dice.happens(0.5) else (high - cut_m[0], high)
        corner = self.part(*edge, 0.0, cut_m[1])
        open_into(layout, dice, layout.add(purpose, whole.without(corner)), self.corridor)
        small = layout.add(programme.small.pop(0), corner.outline)
        programme.has_smallest = True
        open_into(layout, dice, small, self.corridor)


def open_into(layout: Layout, dice: Dice, space: Space, other: Space) -> None:
    """Put the door of a room where it leads to another space."""
    layout.connect(dice, space, other, dice.length_m(*PURPOSES[space.purpose].door_m))


def _choose_rooms(dice: Dice, length_m: float, programme: Programme) -> Iterator[tuple[str, float]]:
    """Return rooms and their widths, which fill the row."""
    chosen: list[tuple[str, float]] = []
    left_m = length_m
    while (purpose := programme.next_for(left_m)) is not None:
        width_m = min(dice.length_m(*PURPOSES[purpose].width_m), left_m)
        chosen.append((purpose, width_m))
        left_m = round(left_m - width_m, 2)
    if not chosen:
        message = f"no room fits into a row of {length_m} m"
        raise ValueError(message)
    share = length_m / (length_m - left_m)
    rest_m = length_m
    for purpose, width_m in chosen[:-1]:
        wide_m = round(width_m * share, 1)
        rest_m = round(rest_m - wide_m, 2)
        yield purpose, wide_m
    purpose, _ = chosen[-1]
    low_m, high_m = PURPOSES[purpose].width_m
    if not SQUEEZED * low_m <= rest_m <= STRETCHED * high_m:
        message = f"{purpose} would be {rest_m} m wide"
        raise ValueError(message)
    yield purpose, rest_m
