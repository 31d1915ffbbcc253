"""What is put into rooms: a piece with what belongs to it, and how it is placed."""

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["How", "Piece", "Purpose", "desk_rows", "desks", "one_of", "tables"]


class How(StrEnum):
    """How a piece is placed."""

    WALL = "with its back to a wall"
    ROWS = "in rows"
    FREE = "anywhere"


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Something to put into a room, with what belongs to it.

    Attributes:
        label: What it is called, before numbers.
        kind: One of `KINDS`.
        how: Where it goes.
        n: The fewest and the most of them; a room without the fewest is drawn again. Of what stands
            in rows there are as many as have room.
        beside: Label, kind, x, y (m) and yaw (degrees) of what belongs to it, in its own frame.
        front_m: What stays free before it.
        pitch_m: Along its own x and y, from one to the next in rows.
    """

    label: str
    kind: str
    how: How = How.WALL
    n: tuple[int, int] = (1, 1)
    beside: tuple[tuple[str, str, float, float, float], ...] = ()
    front_m: float = 0.6
    pitch_m: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Purpose:
    """What a room is for.

    Attributes:
        width_m: Along its corridor, at least and at most.
        door_m: Its door, at least and at most.
        pieces: What stands in it.
    """

    width_m: tuple[float, float] = (3.0, 4.5)
    door_m: tuple[float, float] = (0.9, 1.0)
    pieces: tuple[Piece, ...] = ()


def one_of(kind: str, low: int = 1, high: int = 1, *, label: str | None = None) -> Piece:
    """Gives something that stands at a wall alone; one of it unless told otherwise."""
    return Piece(label=label or kind.replace("_", " "), kind=kind, n=(low, high))


_DESK_CHAIR = (("office chair", "office_chair", 0.95, 0.0, 180.0),)
_AT_BOTH_SIDES = (
    ("chair", "office_chair", 0.95, 0.0, 180.0),
    ("chair", "office_chair", -0.95, 0.0, 0.0),
)
_FOUR_SEATS = tuple(
    ("chair", "office_chair", x, y, 180.0 if x > 0 else 0.0)
    for x in (0.95, -0.95)
    for y in (0.45, -0.45)
)


def desks(low: int, high: int) -> Piece:
    """Gives desks at walls, each with its chair."""
    return Piece(label="desk", kind="desk", n=(low, high), beside=_DESK_CHAIR, front_m=0.3)


def desk_rows(low: int, high: int) -> Piece:
    """Gives desks in rows, each with its chair."""
    return Piece(
        label="desk",
        kind="desk",
        how=How.ROWS,
        n=(low, high),
        beside=_DESK_CHAIR,
        front_m=0.3,
        pitch_m=(2.9, 2.6),
    )


def tables(label: str, low: int, high: int, *, is_large: bool = False) -> Piece:
    """Gives tables in rows with chairs on both sides, four for a large one."""
    return Piece(
        label=label,
        kind="table",
        how=How.ROWS,
        n=(low, high),
        beside=_FOUR_SEATS if is_large else _AT_BOTH_SIDES,
        pitch_m=(3.8, 2.9),
    )
