"""What stands in a warehouse: loaded shelf, pallet, crate, ladder, charging dock."""

from collections.abc import Iterator
from dataclasses import replace

from mapspeak.simulator.models.kinds import Category, Kind
from mapspeak.simulator.models.parts import Colour, Part, box, front_sheet, moved, rod, sheet
from mapspeak.simulator.models.surfaces import Surface

BLUE: Colour = (28, 70, 150)
ORANGE: Colour = (232, 96, 24)
WOOD: Colour = (206, 168, 118)
DARK_WOOD: Colour = (160, 122, 78)
ZINC: Colour = (150, 154, 158)
ALUMINIUM: Colour = (186, 190, 196)
BLACK: Colour = (28, 28, 30)
LIGHT: Colour = (236, 238, 240)
CARDBOARD_TINTS: tuple[Colour, ...] = (
    (255, 255, 255),
    (236, 228, 222),
    (255, 244, 226),
    (222, 212, 204),
    (246, 236, 240),
)


def _pallet() -> tuple[Part, ...]:
    runners = (
        box((-0.4, y - 0.05, 0.0), (0.4, y + 0.05, 0.10), DARK_WOOD) for y in (-0.55, 0.0, 0.55)
    )
    boards = (
        box((x - 0.06, -0.6, 0.10), (x + 0.06, 0.6, 0.125), WOOD, surface=Surface.WOOD)
        for x in (-0.34, -0.17, 0.0, 0.17, 0.34)
    )
    return (*runners, *boards)


def _stack(n_wide: int, heights_m: tuple[float, ...], seed: int) -> Iterator[Part]:
    """Gives rows of cardboard boxes 0.8 m deep and 0.8 m wide, each row as high as said."""
    z = 0.0
    width = 0.8 / n_wide
    for row, height in enumerate(heights_m):
        for column in range(n_wide):
            tint = CARDBOARD_TINTS[(seed + 2 * row + 3 * column) % len(CARDBOARD_TINTS)]
            y = -0.4 + column * width
            inset = 0.01 * ((seed + row + column) % 4)
            low = (-0.36 + inset, y + 0.008, z)
            high = (0.38 - inset, y + width - 0.008, z + height - 0.006)
            yield box(low, high, tint, surface=Surface.CARDBOARD)
        z += height


def _small_pallet() -> tuple[Part, ...]:
    runners = (
        box((-0.4, y - 0.04, 0.0), (0.4, y + 0.04, 0.08), DARK_WOOD) for y in (-0.36, 0.0, 0.36)
    )
    return (*runners, box((-0.41, -0.41, 0.08), (0.41, 0.41, 0.11), WOOD))


def _loaded_shelf() -> tuple[Part, ...]:
    loads = (
        ((2, (0.33, 0.27)), (1, (0.52,)), (3, (0.25, 0.25, 0.18))),
        ((1, (0.5,)), (2, (0.25, 0.25)), (2, (0.32, 0.22))),
        ((3, (0.24, 0.24)), (2, (0.38,)), (1, (0.55,))),
    )
    return (
        *_rack((0.86, 1.66)),
        *(
            part
            for level, (floor_m, row) in enumerate(zip((0.0, 0.91, 1.71), loads, strict=True))
            for place, (n_wide, heights) in enumerate(row)
            for part in moved(
                (
                    *_small_pallet(),
                    *moved(_stack(n_wide, heights, 3 * level + place), by=_ON_PALLET),
                ),
                by=(0.0, (place - 1) * 0.86, floor_m),
            )
        ),
    )


_ON_PALLET = (0.0, 0.0, 0.11)


def _rack(beam_heights_m: tuple[float, ...]) -> Iterator[Part]:
    """Gives the uprights with their braces, and the beams and decks at the given heights."""
    for y in (-1.31, 1.31):
        for x in (-0.41, 0.41):
            yield box((x - 0.04, y - 0.045, 0.0), (x + 0.04, y + 0.045, 2.5), BLUE)
            yield box((x - 0.06, y - 0.07, 0.0), (x + 0.06, y + 0.07, 0.012), ZINC)
        for z, rise in ((0.2, 0.7), (0.9, -0.7), (1.0, 0.7), (1.7, 0.65)):
            brace = rod((-0.4, y, z), (0.4, y, z + abs(rise)), 0.014, BLUE, n_sides=6)
            yield replace(brace, is_solid=False)
    for z in beam_heights_m:
        for x in (-0.43, 0.43):
            yield box((x - 0.025, -1.27, z - 0.06), (x + 0.025, 1.27, z + 0.05), ORANGE)
        yield box((-0.41, -1.27, z + 0.02), (0.41, 1.27, z + 0.045), ZINC)


def _crate() -> tuple[Part, ...]:
    return (
        box((-0.4, -0.4, 0.06), (0.4, 0.4, 0.74), (255, 255, 255), surface=Surface.CRATE_SIDE),
        *(box((-0.4, y - 0.04, 0.0), (0.4, y + 0.04, 0.06), DARK_WOOD) for y in (-0.34, 0.0, 0.34)),
    )


def _ladder() -> tuple[Part, ...]:
    def front_x(z: float) -> float:
        return 0.5 - 0.46 * z / 1.9

    rails = (
        rod((0.5, y, 0.0), (0.04, 0.85 * y, 1.9), 0.03, ALUMINIUM, n_sides=8) for y in (-0.26, 0.26)
    )
    back = (
        rod((-0.5, y, 0.0), (-0.04, 0.85 * y, 1.85), 0.022, ALUMINIUM, n_sides=8)
        for y in (-0.26, 0.26)
    )
    steps = (
        box((front_x(z) - 0.06, -0.25, z - 0.02), (front_x(z) + 0.04, 0.25, z + 0.02), ALUMINIUM)
        for z in (0.27, 0.54, 0.81, 1.08, 1.35, 1.62)
    )
    bars = (
        rod((x, -0.25, z), (x, 0.25, z), 0.014, ALUMINIUM, n_sides=6)
        for x, z in ((-0.43, 0.3), (-0.27, 0.95))
    )
    feet = (
        box((x - 0.04, y - 0.04, 0.0), (x + 0.04, y + 0.04, 0.05), BLACK)
        for x in (-0.5, 0.5)
        for y in (-0.26, 0.26)
    )
    top = box((-0.1, -0.25, 1.88), (0.12, 0.25, 1.93), ORANGE)
    return (*rails, *back, *steps, *bars, *feet, top)


def _charging_dock() -> tuple[Part, ...]:
    return (
        box((0.0, -0.36, 0.0), (0.06, 0.36, 1.5), LIGHT),
        front_sheet((0.062, 0.0, 1.08), 0.68, 0.76, Surface.CHARGING_SIGN),
        box((0.06, -0.28, 0.0), (0.26, 0.28, 0.42), (52, 56, 62), taper=0.92),
        box((0.25, -0.18, 0.14), (0.285, 0.18, 0.30), BLACK),
        box((0.28, -0.14, 0.17), (0.30, 0.14, 0.20), (214, 160, 50)),
        box((0.28, -0.14, 0.24), (0.30, 0.14, 0.27), (214, 160, 50)),
        box((0.24, -0.24, 0.36), (0.262, 0.24, 0.385), (30, 220, 110)),
        sheet((0.06, -0.5, 0.004), (0.0, 1.0, 0.0), (0.9, 0.0, 0.0), Surface.HAZARD_STRIPES),
    )


WAREHOUSE_EQUIPMENT = (
    Kind(
        name="loaded_shelf",
        label="loaded shelf",
        category=Category.FUNCTIONAL,
        build=_loaded_shelf,
    ),
    Kind(name="pallet", label="pallet", category=Category.OTHER, build=_pallet),
    Kind(name="crate", label="crate", category=Category.OTHER, build=_crate),
    Kind(name="ladder", label="ladder", category=Category.FUNCTIONAL, build=_ladder),
    Kind(
        name="charging_dock",
        label="charging dock",
        category=Category.FUNCTIONAL,
        build=_charging_dock,
        is_wall_hung=True,
    ),
)
