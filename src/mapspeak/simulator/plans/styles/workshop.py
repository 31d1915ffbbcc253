"""A workshop: halls with side rooms."""

from mapspeak.simulator.plans.dice import Dice
from mapspeak.simulator.plans.layout import Layout, Rect
from mapspeak.simulator.plans.rows import Programme, Row, Side, open_into
from mapspeak.simulator.plans.styles.style import Building
from mapspeak.spatial.rooms import RoomClass

__all__ = ["lay_out_workshop"]


def lay_out_workshop(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lays out one hall with rooms beside it, or two with a corridor of rooms along both."""
    return _lay_out_two_halls(dice) if is_large else _lay_out_one_hall(dice)


def _lay_out_one_hall(dice: Dice) -> Building:
    layout = Layout()
    length_m, height_m = dice.length_m(12.0, 14.0), dice.length_m(10.5, 12.5)
    purpose = dice.choose(["storage hall", "workshop hall"])
    hall = layout.add(purpose, Rect(0, 0, length_m, height_m).outline, RoomClass.OPEN_SPACE)
    programme = Programme(
        needed=["packing room", "foreman's office"],
        small=["toilet"],
        usual=dice.shuffle(["break room", "paint store"]),
    )
    rooms = Rect(length_m, 0, length_m + dice.length_m(5.0, 6.0), height_m)
    Row(rect=rooms, front=Side.LEFT, corridor=hall).fill(layout, dice, programme)
    return _finish(layout, is_complete=programme.is_done)


def _lay_out_two_halls(dice: Dice) -> Building:
    layout = Layout()
    lengths_m = dice.length_m(16.0, 19.0), dice.length_m(12.0, 14.0)
    height_m = dice.length_m(11.5, 13.5)
    width_m, depth_m = dice.length_m(2.2, 2.6), dice.length_m(5.0, 6.0)
    length_m = sum(lengths_m)
    low, high = depth_m, depth_m + width_m
    store = layout.add(
        "storage hall",
        Rect(0, high, lengths_m[0], high + height_m).outline,
        RoomClass.OPEN_SPACE,
    )
    workshop = layout.add(
        "workshop hall",
        Rect(lengths_m[0], high, length_m, high + height_m).outline,
        RoomClass.OPEN_SPACE,
    )
    corridor = layout.add("corridor", Rect(0, low, length_m, high).outline, RoomClass.CORRIDOR)
    for first, second in ((store, workshop), (store, corridor), (workshop, corridor)):
        open_into(layout, dice, first, second)
    programme = Programme(
        needed=dice.shuffle(["packing room", "foreman's office", "break room", "paint store"]),
        small=["toilet", "store"],
        usual=dice.shuffle(["office", "archive"]),
    )
    rooms = Rect(0, 0, length_m, low)
    Row(rect=rooms, front=Side.TOP, corridor=corridor).fill(layout, dice, programme)
    return _finish(layout, is_complete=programme.is_done)


def _finish(layout: Layout, *, is_complete: bool) -> Building:
    return Building(
        layout=layout,
        start=layout.spaces[0],
        wall_thickness_m=0.2,
        wall_height_m=3.2,
        is_complete=is_complete,
    )
