"""The styles of buildings: how each is laid out."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from mapspeak.spatial.rooms import RoomClass
from tools.worldgen.layout import Dice, Layout, Rect, Space
from tools.worldgen.rows import Programme, Row, Side, open_into

__all__ = [
    "STYLES",
    "Building",
    "Style",
    "lay_out_clinic",
    "lay_out_flat",
    "lay_out_office",
    "lay_out_ring_office",
    "lay_out_school",
    "lay_out_workshop",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Building:
    """A building before it is furnished.

    Attributes:
        layout: Its floor.
        start: The space with the charging dock.
        wall_thickness_m: Of all walls.
        wall_height_m: Of all walls.
        is_complete: Every room that it needs found its place.
    """

    layout: Layout
    start: Space
    wall_thickness_m: float
    wall_height_m: float
    is_complete: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """A kind of building.

    Attributes:
        name: As the command takes it.
        title: Such as "An office floor".
        lay_out: Draws one, a large one if its second argument is true. It raises ValueError when
            what it drew does not fit.
    """

    name: str
    title: str
    lay_out: Callable[[Dice, bool], Building]


def lay_out_clinic(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lay out treatment rooms along the main corridor and patient rooms along the other one."""
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


def lay_out_flat(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lay out a hallway that ends at a living room as wide as the flat."""
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
    """Return the kitchen a second door where it lies beside the living room."""
    living = next(space for space in layout.spaces if space.purpose == "living room")
    for space in layout.spaces:
        if space.purpose == "home kitchen" and any(space.shared_with(living)):
            open_into(layout, dice, space, living)


WALL_M, HEIGHT_M = 0.12, 2.7


def lay_out_office(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lay out rooms on both sides of one corridor."""
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
    """Lay out rooms around a ring of four corridors, and a core within it."""
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


def lay_out_school(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lay out classrooms to the north of a corridor, smaller rooms to the south of it.

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


def lay_out_workshop(dice: Dice, is_large: bool) -> Building:  # noqa: FBT001 - as every style takes it
    """Lay out one hall with rooms beside it, or two with a corridor of rooms along both."""
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


STYLES: Mapping[str, Style] = MappingProxyType(
    {
        style.name: style
        for style in (
            Style(name="clinic", title="A clinic", lay_out=lay_out_clinic),
            Style(name="flat", title="A flat", lay_out=lay_out_flat),
            Style(
                name="office", title="An office floor along one corridor", lay_out=lay_out_office
            ),
            Style(
                name="ring_office",
                title="An office floor around a ring of corridors",
                lay_out=lay_out_ring_office,
            ),
            Style(name="school", title="A school", lay_out=lay_out_school),
            Style(name="workshop", title="A workshop", lay_out=lay_out_workshop),
        )
    }
)
"""Every kind of building that can be drawn."""
