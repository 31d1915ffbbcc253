"""The layout of a floor, drawn by chance: spaces, the doors between them and the walls around them.

All walls run along x or y. Lengths are metres in the world's own frame.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from mapspeak.spatial.rooms import RoomClass

__all__ = ["Corner", "Dice", "Doorway", "Edge", "Layout", "Rect", "Space"]

T = TypeVar("T")


class Dice:
    """Draws from a seed; only plain random numbers, so that the draws outlast NumPy's versions."""

    def __init__(self, *seed: int) -> None:
        self._random = np.random.Generator(np.random.PCG64(list(seed)))

    def length_m(self, low_m: float, high_m: float) -> float:
        """Return a length between two others, in whole decimetres."""
        return round(low_m + (high_m - low_m) * float(self._random.random()), 1)

    def count(self, low: int, high: int) -> int:
        """Return a whole number from low to high, both included."""
        return low + min(int(self._random.random() * (high - low + 1)), high - low)

    def happens(self, ratio: float) -> bool:
        """Return True in so many of all cases."""
        return float(self._random.random()) < ratio

    def choose(self, of: Sequence[T]) -> T:
        """Return one of several."""
        return of[self.count(0, len(of) - 1)]

    def shuffle(self, things: Sequence[T]) -> list[T]:
        """Return the same things in another order."""
        keys = self._random.random(len(things))
        return [things[at] for at in np.argsort(keys, kind="stable").tolist()]


Corner = tuple[float, float]

JAMB_M = 0.3
"""The least wall between a door and the next corner."""


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle along the axes, rounded to centimetres."""

    left: float
    bottom: float
    right: float
    top: float

    def __post_init__(self) -> None:
        for name in ("left", "bottom", "right", "top"):
            object.__setattr__(self, name, round(getattr(self, name), 2))

    @property
    def width_m(self) -> float:
        """Along x."""
        return round(self.right - self.left, 2)

    @property
    def height_m(self) -> float:
        """Along y."""
        return round(self.top - self.bottom, 2)

    @property
    def outline(self) -> tuple[Corner, ...]:
        """The corners, counter-clockwise."""
        return (
            (self.left, self.bottom),
            (self.right, self.bottom),
            (self.right, self.top),
            (self.left, self.top),
        )

    def overlaps(self, other: "Rect") -> bool:
        """Return True when both have floor in common."""
        is_beside = self.right <= other.left or other.right <= self.left
        is_above = self.top <= other.bottom or other.top <= self.bottom
        return not (is_beside or is_above)

    def without(self, corner: "Rect") -> tuple[Corner, ...]:
        """Return the L that is left when a rectangle is cut out of one corner."""
        outline: list[Corner] = []
        for x, y in self.outline:
            if (x, y) not in corner.outline:
                outline.append((x, y))
                continue
            far_x = corner.right if x == corner.left else corner.left
            far_y = corner.top if y == corner.bottom else corner.bottom
            bend = [(x, far_y), (far_x, far_y), (far_x, y)]
            # Counter-clockwise: one comes down the left side and leaves the right one upwards.
            is_down_or_up = (x == self.left) == (y == self.bottom)
            outline += bend if is_down_or_up else bend[::-1]
        return tuple(outline)


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """One side of a space.

    Attributes:
        is_upright: It runs along y; else along x.
        at: Its x if it is upright, else its y.
        low: Where it begins, along itself.
        high: Where it ends.
        inward: 1 when the space lies towards greater x or y, else -1.
    """

    is_upright: bool
    at: float
    low: float
    high: float
    inward: int

    def point(self, along: float, inside_m: float = 0.0) -> Corner:
        """Return the point that lies so far along the edge and so far inside the space."""
        across = round(self.at + self.inward * inside_m, 3)
        return (across, along) if self.is_upright else (along, across)

    @property
    def inward_yaw_deg(self) -> int:
        """Where one looks with the back to this wall."""
        ahead = 0 if self.is_upright else 90
        return ahead if self.inward > 0 else ahead - 180


@dataclass(frozen=True, slots=True, kw_only=True)
class Space:
    """A room, corridor or open space.

    Attributes:
        name: Unique in its layout.
        purpose: What it is for, a key of `PURPOSES`.
        room_class: What it counts as.
        outline: The corners, counter-clockwise.
    """

    name: str
    purpose: str
    room_class: RoomClass
    outline: tuple[Corner, ...]

    @property
    def edges(self) -> Iterator[Edge]:
        """All sides."""
        for (x, y), (to_x, to_y) in zip(
            self.outline, (*self.outline[1:], self.outline[0]), strict=True
        ):
            if x == to_x:
                low, high = sorted((y, to_y))
                yield Edge(is_upright=True, at=x, low=low, high=high, inward=-1 if to_y > y else 1)
            else:
                low, high = sorted((x, to_x))
                yield Edge(is_upright=False, at=y, low=low, high=high, inward=1 if to_x > x else -1)

    @property
    def area_m2(self) -> float:
        """Inside the outline."""
        pairs = zip(self.outline, (*self.outline[1:], self.outline[0]), strict=True)
        return sum(x * to_y - to_x * y for (x, y), (to_x, to_y) in pairs) / 2

    @property
    def bounds(self) -> Rect:
        """The rectangle around it."""
        xs, ys = zip(*self.outline, strict=True)
        return Rect(min(xs), min(ys), max(xs), max(ys))

    def shared_with(self, other: "Space") -> Iterator[Edge]:
        """Return the pieces of its sides that are sides of another space too."""
        for mine, theirs in itertools.product(self.edges, other.edges):
            low, high = max(mine.low, theirs.low), min(mine.high, theirs.high)
            is_in_line = mine.is_upright == theirs.is_upright and mine.at == theirs.at
            if is_in_line and mine.inward != theirs.inward and high > low:
                yield Edge(
                    is_upright=mine.is_upright, at=mine.at, low=low, high=high, inward=mine.inward
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class Doorway:
    """A door between two spaces.

    Attributes:
        name: Unique in its layout.
        at: Its middle, on the wall's line.
        width_m: Of the gap.
        is_upright: The wall runs along y.
        spaces: The names of both.
    """

    name: str
    at: Corner
    width_m: float
    is_upright: bool
    spaces: tuple[str, str]


@dataclass(slots=True)
class Layout:
    """A floor while it is laid out.

    Attributes:
        spaces: All, in the order in which they were added.
        doors: Between two spaces each.
        open_edges: Where spaces flow into each other without a wall.
    """

    spaces: list[Space] = field(default_factory=list)
    doors: list[Doorway] = field(default_factory=list)
    open_edges: list[Edge] = field(default_factory=list)

    def add(
        self,
        purpose: str,
        outline: Sequence[Corner],
        room_class: RoomClass = RoomClass.ROOM,
        *,
        name: str | None = None,
    ) -> Space:
        """Add a space; a purpose that comes again is numbered by `number_names`."""
        space = Space(
            name=name or f"{purpose}#{len(self.spaces)}",
            purpose=purpose,
            room_class=room_class,
            outline=tuple(outline),
        )
        self.spaces.append(space)
        return space

    def join(self, first: Space, second: Space) -> None:
        """Leave out out the wall between two spaces."""
        self.open_edges += first.shared_with(second)

    def connect(self, dice: Dice, space: Space, other: Space, width_m: float) -> None:
        """Put a door somewhere into the longest wall between two spaces.

        Raises:
            ValueError: They have no wall in common that is long enough.
        """
        edges = list(space.shared_with(other))
        longest = max(edges, key=lambda edge: edge.high - edge.low, default=None)
        room_m = width_m / 2 + JAMB_M
        if longest is None or longest.high - longest.low < 2 * room_m:
            message = f"no wall for a door of {width_m} m between {space.name} and {other.name}"
            raise ValueError(message)
        along = dice.length_m(longest.low + room_m, longest.high - room_m)
        self.doors.append(
            Doorway(
                name=f"{space.name} door",
                at=longest.point(along),
                width_m=width_m,
                is_upright=longest.is_upright,
                spaces=(space.name, other.name),
            )
        )

    def doors_of(self, space: Space) -> Iterator[Doorway]:
        """Return the doors that lead into a space."""
        return (door for door in self.doors if space.name in door.spaces)

    def walls(self) -> Iterator[tuple[Corner, Corner]]:
        """Return the ends of all walls: each line as long as it goes, doors not cut yet."""
        sides = [edge for space in self.spaces for edge in space.edges]
        for is_upright, at in sorted({(edge.is_upright, edge.at) for edge in sides}):
            here = [edge for edge in sides if (edge.is_upright, edge.at) == (is_upright, at)]
            left_out = [
                edge for edge in self.open_edges if (edge.is_upright, edge.at) == (is_upright, at)
            ]
            for low, high in _unite(_subtract(here, left_out)):
                yield ((at, low), (at, high)) if is_upright else ((low, at), (high, at))


def _subtract(edges: Iterable[Edge], holes: Sequence[Edge]) -> Iterator[tuple[float, float]]:
    for edge in edges:
        low = edge.low
        for hole in sorted(holes, key=lambda each: each.low):
            if hole.high > low and hole.low < edge.high:
                if hole.low > low:
                    yield low, hole.low
                low = max(low, hole.high)
        if low < edge.high:
            yield low, edge.high


def _unite(pieces: Iterable[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    begun: tuple[float, float] | None = None
    for low, high in sorted(pieces):
        if begun is not None and low <= begun[1]:
            begun = (begun[0], max(begun[1], high))
            continue
        if begun is not None:
            yield begun
        begun = (low, high)
    if begun is not None:
        yield begun
