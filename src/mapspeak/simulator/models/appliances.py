"""Appliances and sanitary ware: printer, fridge, coffee machine, sink, toilet, trash bin."""

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

WHITE: Colour = (240, 241, 242)
PORCELAIN: Colour = (246, 247, 248)
GREY: Colour = (128, 132, 138)
DARK: Colour = (52, 55, 60)
BLACK: Colour = (26, 26, 28)
CHROME: Colour = (190, 196, 202)
STEEL: Colour = (196, 199, 202)
PAPER: Colour = (252, 252, 250)
WATER: Colour = (120, 150, 170)


def _printer() -> tuple[Part, ...]:
    trays = (
        part
        for z in (0.10, 0.28)
        for part in (
            box((0.29, -0.28, z), (0.305, 0.28, z + 0.16), (214, 216, 218)),
            box((0.305, -0.09, z + 0.09), (0.315, 0.09, z + 0.12), DARK),
        )
    )
    return (
        box((-0.3, -0.3, 0.03), (0.29, 0.3, 0.48), WHITE),
        *trays,
        box((-0.3, -0.3, 0.48), (0.29, 0.3, 0.70), (228, 230, 232)),
        box((-0.3, -0.3, 0.70), (-0.1, 0.3, 0.86), WHITE),
        box((-0.1, 0.22, 0.70), (0.29, 0.3, 0.86), WHITE),
        box((-0.1, -0.3, 0.70), (0.27, 0.22, 0.715), DARK),
        box((-0.05, -0.2, 0.715), (0.24, 0.12, 0.728), PAPER),
        box((-0.3, -0.3, 0.86), (0.29, 0.3, 0.93), WHITE),
        box((-0.3, -0.3, 0.935), (0.25, 0.3, 1.03), DARK, taper=0.94),
        *moved(
            [
                box((0.0, -0.22, 0.0), (0.16, 0.22, 0.035), DARK),
                sheet(
                    (0.01, -0.2, 0.037), (0.0, 0.4, 0.0), (0.14, 0.0, 0.0), Surface.PRINTER_PANEL
                ),
            ],
            by=(0.24, 0.0, 0.95),
            pitch_rad=0.6,
        ),
        box((-0.27, -0.27, 0.0), (0.27, 0.27, 0.03), BLACK),
    )


def _fridge() -> tuple[Part, ...]:
    return (
        box((-0.33, -0.32, 0.03), (0.27, 0.32, 1.82), (206, 208, 210)),
        box((0.28, -0.32, 0.05), (0.33, 0.32, 1.16), WHITE),
        box((0.28, -0.32, 1.18), (0.33, 0.32, 1.82), WHITE),
        rod((0.37, -0.26, 0.72), (0.37, -0.26, 1.10), 0.016, CHROME),
        rod((0.37, -0.26, 1.24), (0.37, -0.26, 1.55), 0.016, CHROME),
        *(
            box((0.33, -0.272, z - 0.012), (0.372, -0.248, z + 0.012), CHROME)
            for z in (0.74, 1.08, 1.26, 1.53)
        ),
        box((-0.3, -0.3, 0.0), (0.27, 0.3, 0.03), BLACK),
        box((0.33, 0.06, 1.36), (0.333, 0.18, 1.52), (250, 226, 90)),
        box((0.33, 0.0, 1.0), (0.333, 0.16, 1.1), (90, 160, 220)),
    )


def _coffee_machine() -> tuple[Part, ...]:
    z = 0.9
    cup = [(0.0, 0.0), (0.03, 0.0), (0.042, 0.09), (0.036, 0.09), (0.0, 0.07)]
    cups = (
        lathe([(r, z + h) for r, h in cup], PORCELAIN, at=(x, y), n_sides=14)
        for x, y in ((0.1, 0.34), (0.0, 0.40), (0.14, 0.44))
    )
    return (
        box((-0.3, -0.5, 0.08), (0.28, 0.5, 0.86), WHITE),
        box((-0.27, -0.48, 0.0), (0.24, 0.48, 0.08), BLACK),
        *(
            box((0.28, y - 0.235, 0.1), (0.297, y + 0.235, 0.84), (230, 231, 232))
            for y in (-0.25, 0.25)
        ),
        *(box((0.297, y - 0.01, 0.55), (0.315, y + 0.01, 0.75), GREY) for y in (-0.05, 0.05)),
        box((-0.32, -0.52, 0.86), (0.32, 0.52, z), (70, 66, 62)),
        *moved(_coffee_maker(), by=(0.0, -0.1, z)),
        *cups,
    )


def _coffee_maker() -> tuple[Part, ...]:
    cup = [(0.0, 0.03), (0.03, 0.03), (0.04, 0.11), (0.034, 0.11), (0.0, 0.09)]
    return (
        box((-0.22, -0.2, 0.0), (0.0, 0.2, 0.5), BLACK),
        box((0.0, -0.2, 0.27), (0.2, 0.2, 0.5), STEEL),
        box((0.0, -0.2, 0.0), (0.22, 0.2, 0.03), STEEL),
        box((0.02, -0.17, 0.03), (0.2, 0.17, 0.034), BLACK),
        front_sheet((0.202, 0.0, 0.40), 0.36, 0.18, Surface.COFFEE_PANEL),
        rod((0.1, -0.03, 0.27), (0.1, -0.03, 0.20), 0.014, CHROME),
        rod((0.1, 0.03, 0.27), (0.1, 0.03, 0.20), 0.014, CHROME),
        box((0.06, -0.06, 0.24), (0.14, 0.06, 0.27), BLACK),
        lathe(cup, PORCELAIN, at=(0.1, 0.0), n_sides=16),
        lathe([(0.034, 0.095), (0.0, 0.096)], (70, 40, 20), at=(0.1, 0.0), n_sides=16),
        box((-0.15, -0.13, 0.5), (0.08, 0.13, 0.62), (120, 90, 64), taper=1.1),
    )


def _sink() -> tuple[Part, ...]:
    bowl = [
        (0.0, 0.70),
        (0.10, 0.70),
        (0.22, 0.80),
        (0.26, 0.86),
        (0.215, 0.86),
        (0.12, 0.76),
        (0.0, 0.75),
    ]
    tap = [
        (0.07, 0.0, 0.86),
        (0.07, 0.0, 1.06),
        (0.11, 0.0, 1.10),
        (0.19, 0.0, 1.08),
        (0.20, 0.0, 1.03),
    ]
    return (
        box((0.0, -0.27, 0.74), (0.14, 0.27, 0.86), PORCELAIN),
        lathe(bowl, PORCELAIN, at=(0.27, 0.0), n_sides=28),
        lathe([(0.025, 0.757), (0.0, 0.758)], GREY, at=(0.27, 0.0)),
        lathe(
            [(0.0, 0.0), (0.10, 0.0), (0.075, 0.1), (0.07, 0.6), (0.1, 0.72)],
            PORCELAIN,
            at=(0.2, 0.0),
        ),
        *tube(tap, 0.016, CHROME),
        rod((0.07, -0.1, 0.86), (0.07, -0.1, 0.92), 0.022, CHROME),
        rod((0.07, 0.1, 0.86), (0.07, 0.1, 0.92), 0.022, CHROME),
        box((0.0, -0.31, 1.18), (0.02, 0.31, 1.86), CHROME),
        front_sheet((0.022, 0.0, 1.52), 0.58, 0.64, Surface.MIRROR),
        rod((0.08, 0.2, 0.86), (0.08, 0.2, 0.99), 0.03, (90, 190, 150)),
        rod((0.08, 0.2, 0.99), (0.08, 0.2, 1.03), 0.01, WHITE),
    )


def _toilet() -> tuple[Part, ...]:
    bowl = [
        (0.0, 0.0),
        (0.12, 0.0),
        (0.105, 0.18),
        (0.19, 0.38),
        (0.19, 0.40),
        (0.13, 0.40),
        (0.07, 0.28),
        (0.0, 0.27),
    ]
    lid = moved(
        [lathe([(0.0, 0.0), (0.195, 0.0), (0.195, 0.025), (0.0, 0.025)], PORCELAIN, n_sides=28)],
        by=(-0.135, 0.0, 0.62),
        pitch_rad=1.48,
    )
    return (
        lathe(bowl, PORCELAIN, at=(0.12, 0.0), n_sides=28),
        prism(
            [(-0.3, 0.0), (0.12, 0.0), (0.12, 0.16), (-0.05, 0.36), (-0.3, 0.38)],
            -0.11,
            0.11,
            PORCELAIN,
        ),
        lathe(
            [(0.13, 0.40), (0.2, 0.40), (0.2, 0.425), (0.13, 0.425), (0.13, 0.40)],
            WHITE,
            at=(0.12, 0.0),
            n_sides=28,
        ),
        lathe([(0.085, 0.31), (0.0, 0.311)], WATER, at=(0.12, 0.0)),
        *lid,
        box((-0.34, -0.2, 0.38), (-0.16, 0.2, 0.76), PORCELAIN, taper=1.02),
        box((-0.35, -0.215, 0.76), (-0.15, 0.215, 0.79), PORCELAIN),
        rod((-0.25, 0.0, 0.79), (-0.25, 0.0, 0.80), 0.03, CHROME),
    )


def _trash_bin() -> tuple[Part, ...]:
    return (
        lathe([(0.0, 0.0), (0.17, 0.0), (0.21, 0.62), (0.0, 0.62)], (62, 66, 70), n_sides=24),
        lathe([(0.216, 0.58), (0.222, 0.64), (0.19, 0.66)], BLACK, n_sides=24),
        lathe(
            [(0.0, 0.62), (0.19, 0.655), (0.165, 0.75), (0.08, 0.80), (0.0, 0.81)],
            (30, 104, 60),
            n_sides=24,
        ),
        *moved(
            [front_sheet((0.0, 0.0, 0.0), 0.2, 0.2, Surface.RECYCLING_SIGN)],
            by=(0.205, 0.0, 0.33),
            pitch_rad=0.065,
        ),
        box((0.12, -0.07, 0.68), (0.19, 0.07, 0.745), BLACK),
    )


APPLIANCES = (
    Kind(name="printer", label="printer", category=Category.FUNCTIONAL, build=_printer),
    Kind(name="fridge", label="fridge", category=Category.FUNCTIONAL, build=_fridge),
    Kind(
        name="coffee_machine",
        label="coffee machine",
        category=Category.FUNCTIONAL,
        build=_coffee_machine,
    ),
    Kind(name="sink", label="sink", category=Category.FUNCTIONAL, build=_sink, is_wall_hung=True),
    Kind(name="toilet", label="toilet", category=Category.FUNCTIONAL, build=_toilet),
    Kind(name="trash_bin", label="trash bin", category=Category.OTHER, build=_trash_bin),
)
