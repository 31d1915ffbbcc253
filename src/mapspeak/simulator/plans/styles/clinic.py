"""A clinic: a main corridor and a ward corridor that leaves it."""

from mapspeak.simulator.plans.dice import Dice
from mapspeak.simulator.plans.layout import Layout, Rect
from mapspeak.simulator.plans.rows import Programme, Row, Side
from mapspeak.simulator.plans.styles.style import Building
from mapspeak.spatial.rooms import RoomClass

__all__ = ["lay_out_clinic"]


def lay_out_clinic(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lays out treatment rooms along the main corridor and patient rooms along the other one."""
    layout = Layout()
    width_m = dice.length_m(2.2, 2.6)
    south_m = dice.length_m(5.0, 6.0)
    ward_m = dice.length_m(13.0, 16.0) if is_large else dice.length_m(8.0, 10.0)
    west_m, east_m = dice.length_m(5.0, 6.0), dice.length_m(5.0, 6.0)
    wing_m = dice.length_m(9.0, 12.0) if is_large else 0.0
    length_m = round(wing_m + west_m + width_m + east_m, 1)
    low, high = south_m, round(south_m + width_m, 2)
    ward = Rect(wing_m + west_m, high, wing_m + west_m + width_m, high + ward_m)
    main = layout.add(
        "corridor",
        Rect(0, low, length_m, high).outline,
        RoomClass.CORRIDOR,
        name="main corridor",
    )
    side = layout.add("side corridor", ward.outline, RoomClass.CORRIDOR, name="ward corridor")
    layout.join(main, side)
    treatment = Programme(
        needed=dice.shuffle(["waiting room", "laboratory", *(["first-aid room"] * is_large)]),
        small=["toilet"],
        usual=["treatment room"],
    )
    care = Programme(
        needed=["nurses' room", "patient room"],
        small=dice.shuffle(["toilet", "store"])[: 1 + is_large],
        usual=["patient room", "treatment room", "patient room"],
        has_smallest=True,
    )
    Row(rect=Rect(0, 0, length_m, low), front=Side.TOP, corridor=main).fill(layout, dice, treatment)
    if is_large:
        wing = Rect(0, high, wing_m, high + dice.length_m(4.8, 5.8))
        Row(rect=wing, front=Side.BOTTOM, corridor=main).fill(layout, dice, treatment)
    west = Rect(wing_m, high, ward.left, ward.top)
    east = Rect(ward.right, high, length_m, ward.top)
    Row(rect=west, front=Side.RIGHT, corridor=side).fill(layout, dice, care)
    Row(rect=east, front=Side.LEFT, corridor=side).fill(layout, dice, care)
    return Building(
        layout=layout,
        start=main,
        wall_thickness_m=0.15,
        wall_height_m=2.8,
        is_complete=treatment.is_done and care.is_done,
    )
