"""Offices: along one corridor, and around a ring of corridors."""

from mapspeak.simulator.plans.dice import Dice
from mapspeak.simulator.plans.layout import Layout, Rect
from mapspeak.simulator.plans.rows import Programme, Row, Side
from mapspeak.simulator.plans.styles.style import Building
from mapspeak.spatial.rooms import RoomClass

__all__ = ["lay_out_office", "lay_out_ring_office"]

WALL_M, HEIGHT_M = 0.12, 2.7


def lay_out_office(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lays out rooms on both sides of one corridor."""
    layout = Layout()
    length_m = dice.length_m(22.0, 28.0) if is_large else dice.length_m(14.0, 18.0)
    width_m = dice.length_m(1.9, 2.3)
    depths_m = dice.length_m(5.0, 6.8), dice.length_m(4.6, 6.0)
    corridor = layout.add(
        "corridor",
        Rect(0, depths_m[0], length_m, depths_m[0] + width_m).outline,
        RoomClass.CORRIDOR,
    )
    programme = Programme(
        needed=dice.shuffle(
            ["meeting room", "kitchen", *(["open office", "lounge", "print room"] * is_large)]
        ),
        small=["toilet", *dice.shuffle(["store", "archive"])[: 1 + is_large]],
        usual=["office"],
    )
    south = Rect(0, 0, length_m, depths_m[0])
    north = Rect(0, depths_m[0] + width_m, length_m, depths_m[0] + width_m + depths_m[1])
    Row(rect=south, front=Side.TOP, corridor=corridor).fill(layout, dice, programme)
    Row(rect=north, front=Side.BOTTOM, corridor=corridor).fill(layout, dice, programme)
    return Building(
        layout=layout,
        start=corridor,
        wall_thickness_m=WALL_M,
        wall_height_m=HEIGHT_M,
        is_complete=programme.is_done,
    )


def lay_out_ring_office(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lays out rooms around a ring of four corridors, and a core within it."""
    layout = Layout()
    length_m = dice.length_m(26.0, 30.0) if is_large else dice.length_m(18.0, 21.0)
    width_m = dice.length_m(1.9, 2.2)
    core_m = dice.length_m(4.0, 5.0)
    low, high = dice.length_m(4.8, 6.0), dice.length_m(4.8, 6.0)
    ring = Rect(0, low, length_m, low + 2 * width_m + core_m)
    core = Rect(width_m, low + width_m, length_m - width_m, low + width_m + core_m)
    corridors = [
        layout.add("corridor", rect.outline, RoomClass.CORRIDOR, name=name)
        for name, rect in (
            ("south corridor", Rect(0, ring.bottom, length_m, core.bottom)),
            ("north corridor", Rect(0, core.top, length_m, ring.top)),
            ("west corridor", Rect(0, core.bottom, core.left, core.top)),
            ("east corridor", Rect(core.right, core.bottom, length_m, core.top)),
        )
    ]
    for side in corridors[2:]:
        for main in corridors[:2]:
            layout.join(side, main)
    programme = Programme(
        needed=dice.shuffle(["meeting room", "open office", "lounge", "first-aid room"]),
        small=dice.shuffle(["store", "archive"]),
        usual=dice.shuffle(["office", "office", "office", "meeting room"]),
    )
    services = Programme(
        needed=["toilet", "kitchen", "print room"], small=[], usual=["archive", "store"]
    )
    south, north = corridors[:2]
    Row(rect=Rect(0, 0, length_m, ring.bottom), front=Side.TOP, corridor=south).fill(
        layout, dice, programme
    )
    Row(rect=Rect(0, ring.top, length_m, ring.top + high), front=Side.BOTTOM, corridor=north).fill(
        layout, dice, programme
    )
    front, corridor = dice.choose([(Side.BOTTOM, south), (Side.TOP, north)])
    Row(rect=core, front=front, corridor=corridor).fill(layout, dice, services)
    return Building(
        layout=layout,
        start=dice.choose(corridors),
        wall_thickness_m=WALL_M,
        wall_height_m=HEIGHT_M,
        is_complete=programme.is_done and services.is_done,
    )
