"""A counterbalance forklift truck: body, mast and forks, driver's cage, wheels."""

from mapspeak.simulator.models.kinds import Category, Kind
from mapspeak.simulator.models.parts import (
    Colour,
    Part,
    box,
    lathe,
    moved,
    prism,
    rod,
    sheet,
    tube,
)
from mapspeak.simulator.models.surfaces import Surface

YELLOW: Colour = (240, 170, 10)
DARK: Colour = (44, 46, 50)
BLACK: Colour = (22, 22, 24)
STEEL: Colour = (110, 114, 120)
FORK_STEEL: Colour = (70, 72, 76)
RED: Colour = (206, 24, 20)
LAMP: Colour = (250, 248, 225)
AMBER: Colour = (250, 130, 0)


def _forklift() -> tuple[Part, ...]:
    return (*_body(), *_seat(), *_cage(), *_wheels(), *_mast(), *_forks())


def _body() -> tuple[Part, ...]:
    counterweight = [(-1.5, 0.3), (-0.8, 0.22), (-0.8, 1.0), (-1.3, 1.0), (-1.55, 0.8)]
    return (
        prism(counterweight, -0.52, 0.52, YELLOW),
        prism([(-0.85, 0.24), (0.36, 0.24), (0.36, 0.62), (-0.85, 0.72)], -0.5, 0.5, YELLOW),
        prism([(0.1, 0.6), (0.36, 0.6), (0.36, 1.02), (0.22, 1.08)], -0.46, 0.46, DARK),
        box((-0.95, -0.36, 0.7), (-0.3, 0.36, 1.0), DARK),
        box((-0.5, -0.54, 0.36), (-0.05, 0.54, 0.42), BLACK),
        sheet((-1.25, -0.523, 0.72), (0.8, 0.0, 0.0), (0.0, 0.0, -0.2), Surface.FORKLIFT_LABEL),
        sheet((-0.45, 0.523, 0.72), (-0.8, 0.0, 0.0), (0.0, 0.0, -0.2), Surface.FORKLIFT_LABEL),
        sheet((-1.529, 0.5, 0.56), (0.0, -1.0, 0.0), (0.016, 0.0, -0.16), Surface.HAZARD_STRIPES),
        *(box((-1.555, y - 0.07, 0.66), (-1.52, y + 0.07, 0.76), RED) for y in (-0.4, 0.4)),
    )


def _seat() -> tuple[Part, ...]:
    ring = [(-0.02, 0.17, 1.22), (0.06, 0.0, 1.30), (-0.02, -0.17, 1.22), (-0.10, 0.0, 1.14)]
    return (
        box((-0.78, -0.25, 1.0), (-0.3, 0.25, 1.12), BLACK),
        prism([(-0.80, 1.05), (-0.68, 1.05), (-0.76, 1.62), (-0.88, 1.62)], -0.23, 0.23, BLACK),
        rod((0.22, 0.0, 1.02), (-0.02, 0.0, 1.22), 0.025, DARK),
        *tube([*ring, ring[0]], 0.018, BLACK),
    )


def _cage() -> tuple[Part, ...]:
    posts = (
        rod(foot, head, 0.035, BLACK, n_sides=8)
        for y in (-0.46, 0.46)
        for foot, head in (
            ((0.30, y, 0.62), (0.05, y, 2.08)),
            ((-1.12, y, 0.95), (-0.95, y, 2.08)),
        )
    )
    rails = (box((-1.0, y - 0.035, 2.06), (0.12, y + 0.035, 2.13), BLACK) for y in (-0.46, 0.46))
    slats = (
        box((x - 0.025, -0.46, 2.07), (x + 0.025, 0.46, 2.12), BLACK)
        for x in (-0.97, -0.76, -0.55, -0.34, -0.13, 0.09)
    )
    lamps = (rod((0.10, y, 1.98), (0.18, y, 1.98), 0.06, LAMP, n_sides=14) for y in (-0.40, 0.40))
    beacon = lathe([(0.055, 2.13), (0.055, 2.23), (0.0, 2.26)], AMBER, at=(-0.85, 0.3))
    return (*posts, *rails, *slats, *lamps, beacon)


def _wheels() -> tuple[Part, ...]:
    places = ((0.12, 0.33, 0.40), (-1.1, 0.27, 0.38))
    return tuple(
        part
        for x, radius, y in places
        for side in (-1, 1)
        for part in (
            rod((x, side * y, radius), (x, side * 0.57, radius), radius, BLACK, n_sides=24),
            rod(
                (x, side * 0.57, radius),
                (x, side * 0.578, radius),
                0.6 * radius,
                YELLOW,
                n_sides=18,
            ),
            rod((x, side * 0.578, radius), (x, side * 0.6, radius), 0.2 * radius, STEEL),
        )
    )


def _mast() -> tuple[Part, ...]:
    channels = (
        box((0.40 + 0.05 * i, y - 0.035, 0.08), (0.50 + 0.05 * i, y + 0.035, top), shade)
        for i, (reach, top, shade) in enumerate(((0.34, 2.15, DARK), (0.26, 2.05, STEEL)))
        for y in (-reach, reach)
    )
    beams = (box((0.40, -0.36, z), (0.46, 0.36, z + 0.09), DARK) for z in (0.3, 1.35, 2.08))
    return (
        *channels,
        *beams,
        rod((0.47, 0.12, 0.1), (0.47, 0.12, 1.95), 0.03, STEEL, n_sides=10),
        rod((0.47, -0.12, 0.1), (0.47, -0.12, 1.95), 0.03, STEEL, n_sides=10),
    )


def _forks() -> tuple[Part, ...]:
    plates = (box((0.55, -0.48, z), (0.60, 0.48, z + 0.09), BLACK) for z in (0.14, 0.46))
    backrest = (
        box((0.56, y - 0.018, 0.5), (0.59, y + 0.018, 1.15), BLACK)
        for y in (-0.46, -0.23, 0.0, 0.23, 0.46)
    )
    (tip,) = moved([box((0.0, -0.06, 0.0), (1.02, 0.06, 0.04), FORK_STEEL)], by=(0.6, 0.0, 0.06))
    tines = (
        part
        for y in (-0.27, 0.27)
        for part in moved(
            [tip, box((0.60, -0.06, 0.06), (0.645, 0.06, 0.56), FORK_STEEL)], by=(0.0, y, 0.0)
        )
    )
    return (*plates, *backrest, box((0.56, -0.48, 1.12), (0.59, 0.48, 1.16), BLACK), *tines)


FORKLIFT = Kind(
    name="forklift",
    label="forklift",
    category=Category.FUNCTIONAL,
    build=_forklift,
)
