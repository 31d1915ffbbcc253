"""The names of all drawn surfaces; `mapspeak.simulator.rendering.textures` draws them."""

from enum import StrEnum


class Surface(StrEnum):
    """A drawn surface: signs first, then goods and devices, then the building."""

    EXTINGUISHER_SIGN = "extinguisher_sign"
    HOSE_REEL_SIGN = "hose_reel_sign"
    FIRST_AID_SIGN = "first_aid_sign"
    FIRST_AID_CROSS = "first_aid_cross"
    EXIT_SIGN = "exit_sign"
    EYE_WASH_SIGN = "eye_wash_sign"
    CHARGING_SIGN = "charging_sign"
    RECYCLING_SIGN = "recycling_sign"
    HAZARD_STRIPES = "hazard_stripes"

    EXTINGUISHER_LABEL = "extinguisher_label"
    FORKLIFT_LABEL = "forklift_label"
    CARDBOARD = "cardboard"
    CRATE_SIDE = "crate_side"
    WOOD = "wood"
    SCREEN = "screen"
    KEYBOARD = "keyboard"
    WHITEBOARD = "whiteboard"
    PRINTER_PANEL = "printer_panel"
    COFFEE_PANEL = "coffee_panel"
    MIRROR = "mirror"

    FLOOR = "floor"
    WALL = "wall"
    CEILING = "ceiling"
