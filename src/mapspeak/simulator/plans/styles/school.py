"""A school: classrooms along a corridor, and an assembly hall."""

from mapspeak.simulator.plans.dice import Dice
from mapspeak.simulator.plans.layout import Layout, Rect
from mapspeak.simulator.plans.rows import Programme, Row, Side, open_into
from mapspeak.simulator.plans.styles.style import Building
from mapspeak.spatial.rooms import RoomClass

__all__ = ["lay_out_school"]


def lay_out_school(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lays out classrooms to the north of a corridor, smaller rooms to the south of it.

    A large school has an assembly hall at one end of the south side.
    """
    layout = Layout()
    length_m = dice.length_m(36.0, 40.0) if is_large else dice.length_m(19.0, 23.0)
    width_m = dice.length_m(2.4, 2.8)
    south_m, north_m = dice.length_m(5.0, 6.0), dice.length_m(6.5, 7.8)
    hall_m = dice.length_m(13.0, 15.0) if is_large else 0.0
    low = dice.length_m(11.0, 13.0) if is_large else south_m
    high = round(low + width_m, 2)
    corridor = layout.add("corridor", Rect(0, low, length_m, high).outline, RoomClass.CORRIDOR)
    if is_large:
        hall = layout.add("assembly hall", Rect(0, 0, hall_m, low).outline, RoomClass.OPEN_SPACE)
        open_into(layout, dice, hall, corridor)
    lessons = Programme(
        needed=["science room"], small=["store"], usual=["classroom"], has_smallest=True
    )
    others = Programme(
        needed=dice.shuffle(["teachers' room", "first-aid room", *(["kitchen"] * is_large)]),
        small=["toilet"],
        usual=dice.shuffle(["office", "office", "archive"]),
    )
    north = Rect(0, high, length_m, high + north_m)
    south = Rect(hall_m, low - south_m, length_m, low)
    Row(rect=north, front=Side.BOTTOM, corridor=corridor).fill(layout, dice, lessons)
    Row(rect=south, front=Side.TOP, corridor=corridor).fill(layout, dice, others)
    return Building(
        layout=layout,
        start=corridor,
        wall_thickness_m=0.15,
        wall_height_m=3.0,
        is_complete=lessons.is_done and others.is_done,
    )
