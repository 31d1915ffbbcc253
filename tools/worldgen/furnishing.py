"""Furnishing: puts into each space what its purpose asks for, and leaves ways for the robot."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache

from mapspeak.simulator.worlds.models import build_parts, find_kind
from tools.worldgen.layout import Corner, Dice, Doorway, Layout, Rect, Space
from tools.worldgen.purposes import PURPOSES, How, Piece
from tools.worldgen.roomfloor import RoomFloor

__all__ = ["Spot", "Thing", "furnish"]

N_TRIES = 5
DOOR_DEPTH_M, DOOR_SIDE_M = 1.0, 0.2
"""What stays free before a door, and to both sides of it."""
ENTRY_M = 0.6
GAP_M = 0.03
"""Between a piece of furniture and the wall behind it."""
STEP_M = 0.1
FRONT_STEPS_M = (0.45, 0.6, 0.8)
"""Where the robot may stand before a thing, beyond its front."""
OPEN_M = 0.3
"""What a space that flows into another one keeps free on the border."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spot:
    """Where a piece goes.

    Attributes:
        at: Its origin.
        yaw_deg: Where its front looks; a multiple of 90.
    """

    at: Corner
    yaw_deg: int

    def place(self, x: float, y: float) -> Corner:
        """Return where a point of the piece's own frame lies."""
        cosine, sine = _TURNS[self.yaw_deg % 360]
        return (
            round(self.at[0] + cosine * x - sine * y, 3),
            round(self.at[1] + sine * x + cosine * y, 3),
        )

    def place_rect(self, rect: Rect) -> Rect:
        """Return where a rectangle of the piece's own frame lies."""
        ends = [self.place(rect.left, rect.bottom), self.place(rect.right, rect.top)]
        (left, right), (bottom, top) = (sorted(each) for each in zip(*ends, strict=True))
        return Rect(left, bottom, right, top)


_TURNS = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """A thing that found its place.

    Attributes:
        label: What it is called, before numbers.
        kind: One of `kind_names`.
        spot: Where it stands.
    """

    label: str
    kind: str
    spot: Spot


def furnish(
    layout: Layout, space: Space, dice: Dice, *, wall_thickness_m: float, first: tuple[Piece, ...]
) -> list[Thing] | None:
    """Furnish a space; gives None where something it needs finds no place in several tries.

    Args:
        layout: With the doors.
        space: The one to furnish.
        dice: What is drawn from.
        wall_thickness_m: Of all walls.
        first: Pieces that come before those of its purpose.
    """
    for _ in range(N_TRIES):
        things = _try_to_furnish(layout, space, dice, wall_thickness_m, first)
        if things is not None:
            return things
    return None


def _try_to_furnish(
    layout: Layout, space: Space, dice: Dice, wall_thickness_m: float, first: tuple[Piece, ...]
) -> list[Thing] | None:
    floor = RoomFloor(space, wall_thickness_m=wall_thickness_m)
    for door in layout.doors_of(space):
        for rect in _before_door(door):
            floor.keep_free(rect)
        floor.add_entry(_entry(door, space))
    for edge in layout.open_edges:
        (x, y), (to_x, to_y) = edge.point(edge.low), edge.point(edge.high)
        floor.keep_free(Rect(x - OPEN_M, y - OPEN_M, to_x + OPEN_M, to_y + OPEN_M))
    furnisher = _Furnisher(space, floor, dice, wall_thickness_m / 2)
    things: list[Thing] = []
    for piece in (*first, *PURPOSES[space.purpose].pieces):
        low, high = piece.n
        wanted = high if piece.how is How.ROWS else dice.count(low, high)
        placed = furnisher.place(piece, wanted)
        if len(placed) < low:
            return None
        things += [thing for group in placed for thing in group]
    return things


def _before_door(door: Doorway) -> Iterator[Rect]:
    x, y = door.at
    along_m, across_m = door.width_m / 2 + DOOR_SIDE_M, DOOR_DEPTH_M
    if door.is_upright:
        yield Rect(x - across_m, y - along_m, x + across_m, y + along_m)
    else:
        yield Rect(x - along_m, y - across_m, x + along_m, y + across_m)


def _entry(door: Doorway, space: Space) -> Corner:
    """Return the place before a door on which the robot enters a space."""
    x, y = door.at
    along = y if door.is_upright else x
    at = x if door.is_upright else y
    for edge in space.edges:
        is_here = edge.is_upright == door.is_upright and edge.at == at
        if is_here and edge.low <= along <= edge.high:
            return edge.point(along, ENTRY_M)
    message = f"{door.name} is no door of {space.name}"
    raise ValueError(message)


class _Furnisher:
    def __init__(self, space: Space, floor: RoomFloor, dice: Dice, wall_m: float) -> None:
        self._space = space
        self._floor = floor
        self._dice = dice
        self._wall_m = wall_m

    def place(self, piece: Piece, n: int) -> list[list[Thing]]:
        """Place up to so many of a piece; gives each with what belongs to it."""
        placed = self._place_at(piece, self._spots(piece), n) if n else []
        n_missing = piece.n[0] - len(placed)
        if n_missing > 0 and piece.how is How.ROWS:
            placed += self._place_at(piece, self._shuffled(self._anywhere()), n_missing)
        return placed

    def _place_at(self, piece: Piece, spots: Iterable[Spot], n: int) -> list[list[Thing]]:
        placed: list[list[Thing]] = []
        for spot in spots:
            if self._fits(piece, spot):
                placed.append(_things(piece, spot))
                if len(placed) == n:
                    break
        return placed

    def _shuffled(self, spots: Iterable[Spot]) -> list[Spot]:
        return self._dice.shuffle(list(spots))

    def _spots(self, piece: Piece) -> Iterable[Spot]:
        if piece.how is How.WALL:
            return self._shuffled(self._along_walls(piece))
        if piece.how is How.ROWS:
            return self._in_rows(piece)
        return self._shuffled(self._anywhere())

    def _along_walls(self, piece: Piece) -> Iterator[Spot]:
        box = _box(piece.kind)
        back_m = self._wall_m
        if not find_kind(piece.kind).is_wall_hung:
            back_m += GAP_M - box.left
        for edge in self._space.edges:
            low, high = edge.low + self._wall_m, edge.high - self._wall_m
            for number in range(math.ceil(low / STEP_M), math.floor(high / STEP_M) + 1):
                along = round(number * STEP_M, 2)
                yield Spot(at=edge.point(along, back_m), yaw_deg=edge.inward_yaw_deg)

    def _in_rows(self, piece: Piece) -> Iterator[Spot]:
        """Return the places of a block of rows in the middle of the space, in order."""
        blocks = [self._block(piece, yaw_deg) for yaw_deg in self._dice.shuffle([0, 90])]
        return (spot for block in sorted(blocks, key=len, reverse=True) for spot in block)

    def _block(self, piece: Piece, yaw_deg: int) -> list[Spot]:
        bounds = self._space.bounds
        across_m, along_m = piece.pitch_m if yaw_deg == 0 else piece.pitch_m[::-1]
        size = Spot(at=(0, 0), yaw_deg=yaw_deg).place_rect(_group_box(piece))
        xs = _spread(bounds.left, bounds.right, (size.left, size.right), across_m)
        ys = _spread(bounds.bottom, bounds.top, (size.bottom, size.top), along_m)
        return [Spot(at=_round((x, y)), yaw_deg=yaw_deg) for x in xs for y in ys]

    def _anywhere(self) -> Iterator[Spot]:
        bounds = self._space.bounds
        for x in range(math.ceil(bounds.left / 0.5), math.floor(bounds.right / 0.5)):
            for y in range(math.ceil(bounds.bottom / 0.5), math.floor(bounds.top / 0.5)):
                for yaw_deg in (0, 90, 180, 270):
                    yield Spot(at=_round((x * 0.5, y * 0.5)), yaw_deg=yaw_deg)

    def _fits(self, piece: Piece, spot: Spot) -> bool:
        solids = [
            Spot(at=thing.spot.at, yaw_deg=thing.spot.yaw_deg).place_rect(_box(thing.kind))
            for thing in _things(piece, spot)
        ]
        group = _group_box(piece)
        kept = Rect(group.right, group.bottom, group.right + piece.front_m, group.top)
        fronts = [
            spot.place(x, 0.0)
            for step_m in FRONT_STEPS_M
            for x in ((group.right + step_m, group.left - step_m))
        ]
        if piece.how is not How.WALL:
            fronts += [
                spot.place(0.0, y)
                for step_m in FRONT_STEPS_M
                for y in (group.top + step_m, group.bottom - step_m)
            ]
        return self._floor.add(solids, kept=spot.place_rect(kept), fronts=fronts)


def _things(piece: Piece, spot: Spot) -> list[Thing]:
    things = [Thing(label=piece.label, kind=piece.kind, spot=spot)]
    for label, kind, x, y, yaw_deg in piece.beside:
        at = Spot(at=_round(spot.place(x, y)), yaw_deg=round(spot.yaw_deg + yaw_deg) % 360)
        things.append(Thing(label=label, kind=kind, spot=at))
    return things


def _spread(low: float, high: float, size: tuple[float, float], pitch_m: float) -> list[float]:
    """Return as many places as a length has room for, the block of them in its middle."""
    margin_m = 1.0
    free_m = high - low - 2 * margin_m - (size[1] - size[0])
    n = max(math.floor(free_m / pitch_m) + 1, 1)
    first = (low + high) / 2 - (n - 1) * pitch_m / 2 - (size[0] + size[1]) / 2
    return [first + at * pitch_m for at in range(n)]


@cache
def _box(kind: str) -> Rect:
    """Return the rectangle around a kind on the floor plan, all heights, in its own frame."""
    corners = [part.corners.reshape(-1, 3) for part in build_parts(kind) if part.is_solid]
    xs = [float(x) for each in corners for x in each[:, 0]]
    ys = [float(y) for each in corners for y in each[:, 1]]
    return Rect(min(xs), min(ys), max(xs), max(ys))


def _group_box(piece: Piece) -> Rect:
    boxes = [
        thing.spot.place_rect(_box(thing.kind))
        for thing in _things(piece, Spot(at=(0.0, 0.0), yaw_deg=0))
    ]
    return Rect(
        min(box.left for box in boxes),
        min(box.bottom for box in boxes),
        max(box.right for box in boxes),
        max(box.top for box in boxes),
    )


def _round(at: Corner) -> Corner:
    return round(at[0], 2), round(at[1], 2)
