"""Furniture: desk, office chair, table, cabinet, sofa, plant, whiteboard."""

import math
from collections.abc import Iterator

from mapspeak.simulator.models.kinds import Category, Kind
from mapspeak.simulator.models.parts import (
    Colour,
    Part,
    box,
    front_sheet,
    lathe,
    moved,
    prism,
    rod,
    sheet,
    tube,
)
from mapspeak.simulator.models.surfaces import Surface

WHITE: Colour = (238, 238, 236)
GREY: Colour = (120, 124, 130)
BLACK: Colour = (30, 30, 33)
BEIGE: Colour = (206, 202, 190)
OAK: Colour = (214, 178, 128)
FABRIC: Colour = (58, 92, 128)
FABRIC_LIGHT: Colour = (74, 112, 150)
LEAF: Colour = (44, 122, 50)
DARK_LEAF: Colour = (30, 92, 40)
CLAY: Colour = (184, 92, 58)


def _desk() -> tuple[Part, ...]:
    legs = (
        box((x - 0.03, y - 0.03, 0.0), (x + 0.03, y + 0.03, 0.71), GREY)
        for x in (-0.34, 0.34)
        for y in (-0.74, 0.74)
    )
    return (
        box((-0.4, -0.8, 0.71), (0.4, 0.8, 0.745), OAK, surface=Surface.WOOD),
        *legs,
        box((-0.36, -0.72, 0.35), (-0.34, 0.72, 0.70), WHITE),
        *_drawers(),
        *_computer(),
    )


def _drawers() -> Iterator[Part]:
    yield box((-0.28, 0.30, 0.04), (0.30, 0.70, 0.66), WHITE)
    for z in (0.08, 0.28, 0.47):
        yield box((0.30, 0.31, z), (0.315, 0.69, z + 0.17), (224, 224, 222))
        yield box((0.315, 0.44, z + 0.11), (0.33, 0.56, z + 0.13), GREY)


def _computer() -> tuple[Part, ...]:
    return (
        lathe([(0.0, 0.745), (0.13, 0.745), (0.13, 0.757), (0.0, 0.757)], BLACK, at=(-0.2, -0.1)),
        box((-0.24, -0.13, 0.75), (-0.21, -0.07, 0.95), BLACK),
        box((-0.21, -0.41, 0.86), (-0.17, 0.21, 1.23), BLACK),
        front_sheet((-0.168, -0.1, 1.05), 0.58, 0.33, Surface.SCREEN),
        box((0.08, -0.34, 0.745), (0.24, 0.12, 0.765), BLACK),
        sheet((0.085, -0.33, 0.767), (0.0, 0.44, 0.0), (0.15, 0.0, 0.0), Surface.KEYBOARD),
        box((0.12, 0.20, 0.745), (0.22, 0.26, 0.775), BLACK, taper=0.7),
        lathe(
            [(0.0, 0.745), (0.04, 0.745), (0.042, 0.84), (0.0, 0.83)], (190, 40, 40), at=(0.1, 0.45)
        ),
        box((-0.1, -0.7, 0.745), (0.12, -0.54, 0.77), (60, 110, 170)),
        box((-0.09, -0.69, 0.77), (0.11, -0.53, 0.79), (210, 190, 80)),
    )


def _office_chair() -> tuple[Part, ...]:
    arms = (
        part
        for y in (-0.29, 0.29)
        for part in (
            box((-0.02, y - 0.02, 0.47), (0.03, y + 0.02, 0.68), BLACK),
            box((-0.14, y - 0.035, 0.68), (0.16, y + 0.035, 0.71), BLACK),
        )
    )
    (back,) = moved(
        [box((-0.035, -0.23, 0.0), (0.035, 0.23, 0.58), FABRIC)],
        by=(-0.26, 0.0, 0.58),
        pitch_rad=-0.14,
    )
    return (
        *_star_base(),
        rod((0.0, 0.0, 0.1), (0.0, 0.0, 0.44), 0.03, GREY),
        box((-0.25, -0.25, 0.44), (0.25, 0.25, 0.53), FABRIC),
        box((-0.30, -0.04, 0.42), (-0.24, 0.04, 0.75), BLACK),
        back,
        *arms,
    )


def _star_base() -> Iterator[Part]:
    for i in range(5):
        angle = math.tau * i / 5 + 0.3
        x, y = 0.30 * math.cos(angle), 0.30 * math.sin(angle)
        yield rod((0.0, 0.0, 0.12), (x, y, 0.08), 0.022, BLACK, n_sides=8)
        side = (0.02 * math.sin(angle), -0.02 * math.cos(angle))
        yield rod((x - side[0], y - side[1], 0.03), (x + side[0], y + side[1], 0.03), 0.03, BLACK)


def _table() -> tuple[Part, ...]:
    legs = (
        box((x - 0.035, y - 0.035, 0.0), (x + 0.035, y + 0.035, 0.70), OAK)
        for x in (-0.38, 0.38)
        for y in (-0.82, 0.82)
    )
    aprons = (box((x - 0.015, -0.8, 0.62), (x + 0.015, 0.8, 0.70), OAK) for x in (-0.38, 0.38))
    ends = (box((-0.38, y - 0.015, 0.62), (0.38, y + 0.015, 0.70), OAK) for y in (-0.82, 0.82))
    top = box((-0.45, -0.9, 0.70), (0.45, 0.9, 0.74), OAK, surface=Surface.WOOD)
    return (*legs, *aprons, *ends, top)


def _cabinet() -> tuple[Part, ...]:
    def drawer(y: float, z: float) -> tuple[Part, ...]:
        return (
            box((0.225, y - 0.205, z), (0.24, y + 0.205, z + 0.29), BEIGE),
            box((0.24, y - 0.07, z + 0.13), (0.265, y + 0.07, z + 0.155), GREY),
            box((0.24, y - 0.05, z + 0.19), (0.245, y + 0.05, z + 0.24), WHITE),
        )

    drawers = (
        part for y in (-0.22, 0.22) for i in range(4) for part in drawer(y, 0.07 + 0.315 * i)
    )
    return (
        box((-0.23, -0.45, 0.04), (0.225, 0.45, 1.35), (150, 146, 136)),
        box((-0.21, -0.43, 0.0), (0.2, 0.43, 0.04), BLACK),
        *drawers,
    )


def _sofa() -> tuple[Part, ...]:
    feet = (
        box((x - 0.03, y - 0.03, 0.0), (x + 0.03, y + 0.03, 0.1), (90, 60, 36))
        for x in (-0.36, 0.36)
        for y in (-0.88, 0.88)
    )
    seats = (
        box((-0.22, y - 0.375, 0.30), (0.42, y + 0.375, 0.46), FABRIC_LIGHT, taper=0.97)
        for y in (-0.385, 0.385)
    )
    cushions = (
        prism(
            [(-0.28, 0.45), (-0.12, 0.45), (-0.20, 0.84), (-0.34, 0.84)],
            y - 0.37,
            y + 0.37,
            FABRIC_LIGHT,
        )
        for y in (-0.385, 0.385)
    )
    arms = (
        box((-0.42, y - 0.095, 0.1), (0.42, y + 0.095, 0.62), FABRIC, taper=0.96)
        for y in (-0.86, 0.86)
    )
    return (
        *feet,
        box((-0.42, -0.85, 0.1), (0.40, 0.85, 0.30), FABRIC),
        prism([(-0.42, 0.1), (-0.24, 0.1), (-0.32, 0.80), (-0.44, 0.80)], -0.85, 0.85, FABRIC),
        *seats,
        *cushions,
        *arms,
    )


def _plant() -> tuple[Part, ...]:
    pot = [
        (0.0, 0.0),
        (0.13, 0.0),
        (0.18, 0.30),
        (0.20, 0.30),
        (0.20, 0.36),
        (0.17, 0.36),
        (0.0, 0.33),
    ]
    return (
        lathe(pot, CLAY),
        lathe([(0.172, 0.34), (0.0, 0.345)], (60, 44, 32)),
        *(part for i in range(26) for part in _leaf(i)),
    )


def _leaf(i: int) -> tuple[Part, ...]:
    """Gives a stem and a leaf; successive leaves turn by the golden angle, as plants do."""
    azimuth = i * 2.39996
    lift = 1.25 - 0.035 * i
    reach = 0.16 + 0.011 * i
    height = 0.46 + 0.75 * (1.0 - i / 26)
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    stem_end = (0.3 * reach * cos, 0.3 * reach * sin, height)
    blade = prism(
        [(0.0, 0.0), (0.16, -0.02), (0.36, 0.03), (0.16, 0.03)],
        -0.055,
        0.055,
        LEAF if i % 2 else DARK_LEAF,
    )
    stem = tube([(0.02 * cos, 0.02 * sin, 0.34), stem_end], 0.008, DARK_LEAF, n_sides=5)
    return (*stem, *moved([blade], by=stem_end, yaw_rad=azimuth, pitch_rad=-(lift - 0.5)))


def _whiteboard() -> tuple[Part, ...]:
    frame = (
        box((0.0, y - 0.02, 0.0), (0.035, y + 0.02, 1.2), (176, 180, 186)) for y in (-0.93, 0.93)
    )
    rails = (
        box((0.0, -0.95, z - 0.02), (0.035, 0.95, z + 0.02), (176, 180, 186)) for z in (0.0, 1.2)
    )
    pens = (
        rod((0.07, y, 0.02), (0.07, y + 0.12, 0.02), 0.012, colour, n_sides=8)
        for y, colour in ((-0.35, (200, 30, 30)), (-0.15, (30, 60, 180)), (0.05, (20, 20, 20)))
    )
    return (
        box((0.0, -0.92, 0.0), (0.022, 0.92, 1.2), WHITE),
        front_sheet((0.024, 0.0, 0.6), 1.82, 1.16, Surface.WHITEBOARD),
        *frame,
        *rails,
        box((0.02, -0.55, -0.02), (0.1, 0.55, 0.005), (176, 180, 186)),
        *pens,
        box((0.045, 0.25, 0.005), (0.09, 0.39, 0.045), (40, 60, 110)),
    )


FURNITURE = (
    Kind(name="desk", label="desk", category=Category.FUNCTIONAL, build=_desk),
    Kind(name="office_chair", label="office chair", category=Category.OTHER, build=_office_chair),
    Kind(name="table", label="table", category=Category.FUNCTIONAL, build=_table),
    Kind(name="cabinet", label="filing cabinet", category=Category.FUNCTIONAL, build=_cabinet),
    Kind(name="sofa", label="sofa", category=Category.FUNCTIONAL, build=_sofa),
    Kind(name="plant", label="potted plant", category=Category.OTHER, build=_plant),
    Kind(
        name="whiteboard",
        label="whiteboard",
        category=Category.FUNCTIONAL,
        build=_whiteboard,
        base_height_m=0.9,
        is_wall_hung=True,
    ),
)
