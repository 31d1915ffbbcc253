"""A flat: a living room, and rooms on both sides of a hallway."""

from mapspeak.simulator.plans.dice import Dice
from mapspeak.simulator.plans.layout import Layout, Rect
from mapspeak.simulator.plans.rows import Programme, Row, Side, open_into
from mapspeak.simulator.plans.styles.style import Building
from mapspeak.spatial.rooms import RoomClass

__all__ = ["lay_out_flat"]


def lay_out_flat(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lays out a hallway that ends at a living room as wide as the flat."""
    layout = Layout()
    width_m = dice.length_m(1.5, 1.7)
    west_m = dice.length_m(3.8, 4.6) if is_large else dice.length_m(3.1, 3.5)
    east_m = dice.length_m(3.6, 4.4) if is_large else dice.length_m(3.0, 3.4)
    hall_m = dice.length_m(8.5, 9.8) if is_large else dice.length_m(5.6, 6.2)
    living_m = dice.length_m(4.6, 5.4) if is_large else dice.length_m(3.9, 4.3)
    length_m = round(west_m + width_m + east_m, 1)
    hallway = layout.add(
        "hallway", Rect(west_m, 0, west_m + width_m, hall_m).outline, RoomClass.CORRIDOR
    )
    living = layout.add("living room", Rect(0, hall_m, length_m, hall_m + living_m).outline)
    layout.connect(dice, living, hallway, 0.9)
    programme = Programme(
        needed=dice.shuffle(["bathroom", "home kitchen", "bedroom", *(["study"] * is_large)]),
        small=[],
        usual=["bedroom", "larder", "study"] if is_large else ["study", "larder"],
    )
    west = Rect(0, 0, west_m, hall_m)
    east = Rect(west_m + width_m, 0, length_m, hall_m)
    Row(rect=west, front=Side.RIGHT, corridor=hallway).fill(layout, dice, programme)
    Row(rect=east, front=Side.LEFT, corridor=hallway).fill(layout, dice, programme)
    _open_kitchen(layout, dice)
    return Building(
        layout=layout,
        start=living,
        wall_thickness_m=0.12,
        wall_height_m=2.5,
        is_complete=programme.is_done,
    )


def _open_kitchen(layout: Layout, dice: Dice) -> None:
    """Gives the kitchen a second door where it lies beside the living room."""
    living = next(space for space in layout.spaces if space.purpose == "living room")
    for space in layout.spaces:
        if space.purpose == "home kitchen" and any(space.shared_with(living)):
            open_into(layout, dice, space, living)
