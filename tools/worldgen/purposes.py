"""What rooms are for: how wide they are along their corridor, their doors, and what stands in them.

Each list of pieces stands in the order in which a room is furnished: what it cannot do without
comes first, and what no longer fits is left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

__all__ = ["PURPOSES", "How", "Piece", "Purpose", "desk_rows", "desks", "one_of", "tables"]


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
        kind: One of `kind_names`.
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
    """Return something that stands at a wall alone; one of it unless told otherwise."""
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
    """Return desks at walls, each with its chair."""
    return Piece(label="desk", kind="desk", n=(low, high), beside=_DESK_CHAIR, front_m=0.3)


def desk_rows(low: int, high: int) -> Piece:
    """Return desks in rows, each with its chair."""
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
    """Return tables in rows with chairs on both sides, four for a large one."""
    return Piece(
        label=label,
        kind="table",
        how=How.ROWS,
        n=(low, high),
        beside=_FOUR_SEATS if is_large else _AT_BOTH_SIDES,
        pitch_m=(3.8, 2.9),
    )


_EXTINGUISHER = one_of("fire_extinguisher")
_BIN = one_of("trash_bin", 0)
_PLANT = one_of("plant", 0)
_BASIN = one_of("sink", label="hand basin")
_LAVATORY = (one_of("toilet", label="toilet bowl"), _BASIN)

_SCHOOL_DESKS = Piece(
    label="school desk",
    kind="table",
    how=How.ROWS,
    n=(2, 9),
    beside=(("chair", "office_chair", 0.95, 0.0, 180.0),),
    front_m=0.3,
    pitch_m=(2.6, 2.8),
)
_SHELVES = Piece(
    label="shelf", kind="loaded_shelf", how=How.ROWS, n=(2, 12), front_m=0.0, pitch_m=(3.4, 2.8)
)

PURPOSES: Mapping[str, Purpose] = MappingProxyType(
    {
        "living room": Purpose(
            width_m=(4.5, 6.5),
            door_m=(1.0, 1.6),
            pieces=(
                one_of("sofa", 1, 2),
                tables("dining table", 1, 1),
                one_of("cabinet", 1, 2, label="sideboard"),
                one_of("plant", 1, 2),
            ),
        ),
        "bedroom": Purpose(
            width_m=(3.0, 4.2),
            pieces=(
                one_of("sofa", label="sofa bed"),
                one_of("cabinet", 1, 2, label="chest of drawers"),
                _PLANT,
            ),
        ),
        "home kitchen": Purpose(
            width_m=(2.8, 3.8),
            door_m=(0.9, 1.4),
            pieces=(
                one_of("sink", label="kitchen sink"),
                one_of("fridge"),
                one_of("coffee_machine"),
                _EXTINGUISHER,
                _BIN,
            ),
        ),
        "bathroom": Purpose(width_m=(2.0, 2.8), pieces=_LAVATORY),
        "study": Purpose(
            width_m=(2.6, 3.6),
            pieces=(desks(1, 1), one_of("cabinet"), one_of("printer", 0), _PLANT),
        ),
        "larder": Purpose(width_m=(2.0, 2.4), pieces=(one_of("crate", 0), one_of("ladder", 0))),
        "office": Purpose(
            width_m=(3.2, 4.8),
            pieces=(desks(1, 2), one_of("cabinet", 1, 2), _PLANT, _BIN),
        ),
        "open office": Purpose(
            width_m=(7.0, 10.0),
            door_m=(1.0, 1.4),
            pieces=(
                _EXTINGUISHER,
                one_of("whiteboard"),
                desk_rows(2, 8),
                one_of("cabinet", 1, 3),
                _PLANT,
                _BIN,
            ),
        ),
        "meeting room": Purpose(
            width_m=(4.6, 6.5),
            door_m=(1.0, 1.2),
            pieces=(
                one_of("whiteboard"),
                tables("meeting table", 1, 2, is_large=True),
                _PLANT,
            ),
        ),
        "kitchen": Purpose(
            width_m=(4.2, 5.6),
            door_m=(1.0, 1.4),
            pieces=(
                one_of("sink", label="kitchen sink"),
                one_of("fridge"),
                one_of("coffee_machine"),
                _EXTINGUISHER,
                tables("kitchen table", 1, 2),
                _BIN,
            ),
        ),
        "print room": Purpose(
            width_m=(2.8, 3.6),
            pieces=(one_of("printer", 1, 2), one_of("cabinet"), _BIN),
        ),
        "archive": Purpose(
            width_m=(2.6, 3.6), pieces=(one_of("cabinet", 1, 4), one_of("ladder", 0))
        ),
        "toilet": Purpose(width_m=(2.0, 2.6), pieces=_LAVATORY),
        "store": Purpose(width_m=(2.2, 3.0), pieces=(one_of("crate"), one_of("ladder", 0))),
        "first-aid room": Purpose(
            width_m=(3.4, 4.4),
            pieces=(
                one_of("first_aid_box"),
                one_of("sofa", label="couch"),
                _BASIN,
                one_of("eye_wash_station", 0),
                one_of("cabinet", 0),
            ),
        ),
        "lounge": Purpose(
            width_m=(4.5, 7.0),
            door_m=(1.8, 2.4),
            pieces=(
                one_of("sofa", 1, 3),
                one_of("plant", 1, 2),
                one_of("table", label="low table"),
                _BIN,
            ),
        ),
        "treatment room": Purpose(
            width_m=(3.4, 4.8),
            door_m=(1.0, 1.2),
            pieces=(
                _BASIN,
                one_of("sofa", label="examination couch"),
                desks(1, 1),
                one_of("cabinet", label="medicine cabinet"),
                _BIN,
            ),
        ),
        "patient room": Purpose(
            width_m=(4.4, 6.0),
            door_m=(1.2, 1.4),
            pieces=(
                one_of("sofa", 2, 3, label="day bed"),
                _BASIN,
                one_of("cabinet", 1, 2, label="locker"),
                _PLANT,
            ),
        ),
        "waiting room": Purpose(
            width_m=(5.0, 7.0),
            door_m=(1.6, 2.4),
            pieces=(
                _EXTINGUISHER,
                one_of("sofa", 2, 4),
                one_of("plant", 1, 2),
                one_of("coffee_machine", 0),
                _BIN,
            ),
        ),
        "laboratory": Purpose(
            width_m=(4.5, 6.5),
            door_m=(1.0, 1.2),
            pieces=(
                one_of("eye_wash_station"),
                _EXTINGUISHER,
                one_of("sink", label="laboratory sink"),
                one_of("fridge", label="sample fridge"),
                tables("laboratory table", 1, 2),
                one_of("cabinet", 0, 2),
            ),
        ),
        "nurses' room": Purpose(
            width_m=(3.8, 5.0),
            pieces=(
                one_of("first_aid_box"),
                desks(1, 2),
                one_of("coffee_machine", 0),
                one_of("cabinet"),
            ),
        ),
        "classroom": Purpose(
            width_m=(6.5, 9.0),
            door_m=(1.0, 1.2),
            pieces=(
                one_of("whiteboard"),
                _SCHOOL_DESKS,
                _BASIN,
                one_of("cabinet", 1, 2),
                _BIN,
            ),
        ),
        "science room": Purpose(
            width_m=(8.5, 10.5),
            door_m=(1.0, 1.2),
            pieces=(
                one_of("eye_wash_station"),
                _EXTINGUISHER,
                one_of("whiteboard"),
                one_of("sink", 1, 2, label="laboratory sink"),
                tables("laboratory table", 2, 4),
                one_of("cabinet", 1, 2),
            ),
        ),
        "teachers' room": Purpose(
            width_m=(5.0, 7.0),
            pieces=(
                one_of("coffee_machine"),
                one_of("printer"),
                tables("conference table", 1, 2, is_large=True),
                one_of("cabinet", 1, 2),
                _PLANT,
            ),
        ),
        "assembly hall": Purpose(
            door_m=(1.8, 2.4),
            pieces=(
                _EXTINGUISHER,
                one_of("fire_hose_reel"),
                one_of("exit_sign", 1, 2),
                one_of("whiteboard"),
                tables("hall table", 2, 6),
                one_of("plant", 1, 3),
            ),
        ),
        "storage hall": Purpose(
            door_m=(1.6, 2.4),
            pieces=(
                one_of("fire_extinguisher", 1, 2),
                one_of("fire_hose_reel"),
                one_of("exit_sign", 1, 2),
                _SHELVES,
                Piece(label="forklift", kind="forklift", how=How.FREE, n=(0, 1), front_m=0.0),
                one_of("pallet", 1, 3),
                one_of("crate", 1, 3),
                one_of("traffic_cone", 1, 2),
            ),
        ),
        "workshop hall": Purpose(
            door_m=(1.6, 2.4),
            pieces=(
                one_of("fire_extinguisher", 1, 2),
                one_of("eye_wash_station"),
                one_of("first_aid_box"),
                one_of("exit_sign", 1, 2),
                tables("workbench", 2, 5),
                Piece(label="forklift", kind="forklift", how=How.FREE, n=(1, 1), front_m=0.0),
                one_of("cabinet", 1, 3, label="tool cabinet"),
                one_of("pallet", 1, 2),
                one_of("crate", 1, 2),
                one_of("ladder", 0),
                one_of("trash_bin"),
            ),
        ),
        "packing room": Purpose(
            width_m=(4.5, 6.5),
            door_m=(1.2, 1.8),
            pieces=(
                tables("packing table", 1, 2),
                one_of("crate", 1, 2),
                one_of("pallet", 0),
                _BIN,
            ),
        ),
        "paint store": Purpose(
            width_m=(3.0, 4.0),
            pieces=(_EXTINGUISHER, one_of("eye_wash_station"), one_of("cabinet", 1, 2)),
        ),
        "foreman's office": Purpose(
            width_m=(3.2, 4.4),
            pieces=(desks(1, 1), one_of("cabinet"), one_of("printer", 0), _PLANT),
        ),
        "break room": Purpose(
            width_m=(4.2, 5.4),
            pieces=(
                one_of("sink", label="kitchen sink"),
                one_of("fridge"),
                one_of("coffee_machine"),
                tables("break table", 1, 1),
                _BIN,
            ),
        ),
        "corridor": Purpose(
            pieces=(
                one_of("fire_extinguisher", 2, 3),
                one_of("exit_sign"),
                one_of("fire_hose_reel", 0),
                one_of("plant", 0),
            ),
        ),
        "side corridor": Purpose(pieces=(one_of("fire_extinguisher"), one_of("exit_sign", 0))),
        "hallway": Purpose(pieces=(one_of("fire_extinguisher"),)),
    }
)
