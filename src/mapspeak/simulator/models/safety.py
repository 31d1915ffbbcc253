"""Safety equipment: extinguisher, first aid, exit sign, hose reel, eye wash, traffic cone."""

import math
from itertools import pairwise

from mapspeak.simulator.models.kinds import Category, Kind
from mapspeak.simulator.models.parts import (
    Colour,
    Part,
    ball,
    box,
    cone,
    front_sheet,
    lathe,
    rod,
    sheet,
    tube,
)
from mapspeak.simulator.models.surfaces import Surface

RED: Colour = (196, 18, 22)
GREEN: Colour = (0, 132, 80)
BLACK: Colour = (24, 24, 26)
STEEL: Colour = (168, 172, 178)
WHITE: Colour = (240, 240, 238)
ORANGE: Colour = (242, 96, 16)
BRASS: Colour = (196, 160, 60)


def _fire_extinguisher() -> tuple[Part, ...]:
    x = 0.125
    return (
        *_extinguisher_bottle(x),
        *_extinguisher_valve(x),
        box((0.0, -0.045, 0.10), (0.05, 0.045, 0.46), STEEL),
        box((0.0, -0.17, 0.86), (0.012, 0.17, 1.20), WHITE),
        front_sheet((0.014, 0.0, 1.03), 0.34, 0.34, Surface.EXTINGUISHER_SIGN),
    )


def _extinguisher_bottle(x: float) -> tuple[Part, ...]:
    dome = [
        (0.095 * math.cos(angle), 0.46 + 0.08 * math.sin(angle)) for angle in (0.0, 0.4, 0.8, 1.2)
    ]
    bottle = [(0.0, 0.0), (0.085, 0.0), (0.095, 0.02), *dome, (0.0, 0.54)]
    label = [(0.0955, 0.14), (0.0955, 0.38)]
    return (
        lathe(bottle, RED, at=(x, 0.0), n_sides=24),
        lathe([(0.088, 0.0), (0.0955, 0.022), (0.0955, 0.035)], BLACK, at=(x, 0.0), n_sides=24),
        lathe(label, WHITE, at=(x, 0.0), n_sides=24, surface=Surface.EXTINGUISHER_LABEL),
    )


def _extinguisher_valve(x: float) -> tuple[Part, ...]:
    hose = [
        (x, 0.05, 0.575),
        (x + 0.01, 0.11, 0.57),
        (x + 0.02, 0.15, 0.52),
        (x + 0.03, 0.155, 0.42),
        (x + 0.03, 0.14, 0.30),
        (x + 0.03, 0.122, 0.22),
    ]
    return (
        rod((x, 0.0, 0.53), (x, 0.0, 0.60), 0.028, BRASS),
        box((x - 0.02, -0.03, 0.59), (x + 0.02, 0.14, 0.605), BLACK),
        box((x - 0.02, -0.03, 0.625), (x + 0.02, 0.15, 0.645), BLACK),
        box((x - 0.02, -0.04, 0.57), (x + 0.02, 0.0, 0.645), BLACK),
        rod((x + 0.025, -0.02, 0.56), (x + 0.045, -0.02, 0.56), 0.022, WHITE),
        *tube(hose, 0.014, BLACK),
        cone((x + 0.03, 0.122, 0.24), (x + 0.03, 0.115, 0.10), (0.016, 0.032), BLACK),
    )


def _first_aid_box() -> tuple[Part, ...]:
    return (
        box((0.0, -0.22, 0.0), (0.14, 0.22, 0.34), GREEN),
        box((0.138, -0.215, 0.005), (0.15, 0.215, 0.335), GREEN),
        front_sheet((0.152, 0.0, 0.17), 0.42, 0.32, Surface.FIRST_AID_SIGN),
        sheet((0.01, -0.222, 0.235), (0.12, 0.0, 0.0), (0.0, 0.0, -0.12), Surface.FIRST_AID_CROSS),
        sheet((0.13, 0.222, 0.235), (-0.12, 0.0, 0.0), (0.0, 0.0, -0.12), Surface.FIRST_AID_CROSS),
        box((0.03, -0.08, 0.34), (0.06, 0.08, 0.37), WHITE),
    )


def _exit_sign() -> tuple[Part, ...]:
    return (
        box((0.0, -0.30, 0.0), (0.06, 0.30, 0.30), WHITE),
        front_sheet((0.062, 0.0, 0.15), 0.57, 0.27, Surface.EXIT_SIGN),
    )


def _fire_hose_reel() -> tuple[Part, ...]:
    z = 0.32
    coils = (
        rod((0.09, 0.0, z), (0.19, 0.0, z), radius, shade, n_sides=28)
        for radius, shade in ((0.25, (40, 38, 38)),)
    )
    rings = (
        rod((0.19 + 0.004 * i, 0.0, z), (0.194 + 0.004 * i, 0.0, z), radius, shade, n_sides=28)
        for i, (radius, shade) in enumerate(
            ((0.24, (62, 60, 60)), (0.215, BLACK), (0.19, (62, 60, 60)))
        )
    )
    return (
        box((0.0, -0.12, z - 0.12), (0.06, 0.12, z + 0.12), RED),
        rod((0.05, 0.0, z), (0.09, 0.0, z), 0.32, RED, n_sides=28),
        *coils,
        *rings,
        rod((0.205, 0.0, z), (0.235, 0.0, z), 0.16, RED, n_sides=24),
        rod((0.235, 0.0, z), (0.255, 0.0, z), 0.05, STEEL),
        *tube([(0.15, 0.24, z), (0.15, 0.27, 0.12), (0.14, 0.25, -0.05)], 0.022, BLACK),
        cone((0.14, 0.25, -0.05), (0.14, 0.25, -0.22), (0.028, 0.014), BRASS),
        box((0.0, -0.17, 0.80), (0.012, 0.17, 1.14), WHITE),
        front_sheet((0.014, 0.0, 0.97), 0.34, 0.34, Surface.HOSE_REEL_SIGN),
    )


def _eye_wash_station() -> tuple[Part, ...]:
    bowl = [(0.0, 0.84), (0.10, 0.845), (0.17, 0.90), (0.19, 0.95), (0.175, 0.95), (0.0, 0.90)]
    x = 0.27
    nozzles = (
        part
        for y in (-0.055, 0.055)
        for part in (
            rod((x, y, 0.90), (x, y, 1.03), 0.012, STEEL),
            lathe([(0.0, 1.02), (0.04, 1.03), (0.045, 1.06), (0.0, 1.07)], GREEN, at=(x, y)),
        )
    )
    return (
        box((0.0, -0.06, 0.80), (0.03, 0.06, 1.00), STEEL),
        rod((0.0, 0.0, 0.86), (x, 0.0, 0.86), 0.03, STEEL),
        lathe(bowl, (226, 190, 24), at=(x, 0.0), n_sides=28),
        *nozzles,
        rod((x, 0.0, 0.0), (x, 0.0, 0.85), 0.028, STEEL),
        lathe([(0.12, 0.0), (0.12, 0.02), (0.03, 0.04)], STEEL, at=(x, 0.0)),
        box((x + 0.12, 0.17, 0.86), (x + 0.13, 0.27, 1.02), GREEN),
        box((0.0, -0.19, 1.32), (0.012, 0.19, 1.70), WHITE),
        front_sheet((0.014, 0.0, 1.51), 0.38, 0.38, Surface.EYE_WASH_SIGN),
    )


def _traffic_cone() -> tuple[Part, ...]:
    def radius_at(z: float) -> float:
        return 0.145 - (z - 0.03) * (0.145 - 0.025) / 0.69

    edges = (0.03, 0.24, 0.38, 0.50, 0.60, 0.72)
    rings = (
        lathe([(radius_at(low), low), (radius_at(high), high)], (ORANGE, WHITE)[i % 2])
        for i, (low, high) in enumerate(pairwise(edges))
    )
    return (
        box((-0.19, -0.19, 0.0), (0.19, 0.19, 0.035), ORANGE),
        *rings,
        ball((0.0, 0.0, 0.71), 0.026, ORANGE),
    )


SAFETY_EQUIPMENT = (
    Kind(
        name="fire_extinguisher",
        label="fire extinguisher",
        category=Category.SAFETY,
        build=_fire_extinguisher,
        base_height_m=0.75,
        is_wall_hung=True,
    ),
    Kind(
        name="first_aid_box",
        label="first-aid box",
        category=Category.SAFETY,
        build=_first_aid_box,
        base_height_m=1.2,
        is_wall_hung=True,
    ),
    Kind(
        name="exit_sign",
        label="exit sign",
        category=Category.SAFETY,
        build=_exit_sign,
        base_height_m=2.05,
        is_wall_hung=True,
    ),
    Kind(
        name="fire_hose_reel",
        label="fire hose reel",
        category=Category.SAFETY,
        build=_fire_hose_reel,
        base_height_m=0.85,
        is_wall_hung=True,
    ),
    Kind(
        name="eye_wash_station",
        label="eye wash station",
        category=Category.SAFETY,
        build=_eye_wash_station,
        is_wall_hung=True,
    ),
    Kind(
        name="traffic_cone",
        label="traffic cone",
        category=Category.OTHER,
        build=_traffic_cone,
    ),
)
