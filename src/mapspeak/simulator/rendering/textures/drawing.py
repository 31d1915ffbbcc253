"""Which function draws which surface."""

from collections.abc import Callable
from functools import cache
from types import MappingProxyType

from mapspeak.simulator.models import Surface
from mapspeak.simulator.rendering.textures import devices, materials, signs
from mapspeak.simulator.rendering.textures.canvas import Picture

_DRAWERS: MappingProxyType[Surface, Callable[[], Picture]] = MappingProxyType(
    {
        Surface.EXTINGUISHER_SIGN: signs.draw_extinguisher_sign,
        Surface.HOSE_REEL_SIGN: signs.draw_hose_reel_sign,
        Surface.FIRST_AID_SIGN: signs.draw_first_aid_sign,
        Surface.FIRST_AID_CROSS: signs.draw_first_aid_cross,
        Surface.EXIT_SIGN: signs.draw_exit_sign,
        Surface.EYE_WASH_SIGN: signs.draw_eye_wash_sign,
        Surface.CHARGING_SIGN: signs.draw_charging_sign,
        Surface.RECYCLING_SIGN: signs.draw_recycling_sign,
        Surface.HAZARD_STRIPES: signs.draw_hazard_stripes,
        Surface.EXTINGUISHER_LABEL: devices.draw_extinguisher_label,
        Surface.FORKLIFT_LABEL: devices.draw_forklift_label,
        Surface.CARDBOARD: materials.draw_cardboard,
        Surface.CRATE_SIDE: materials.draw_crate_side,
        Surface.WOOD: materials.draw_wood,
        Surface.SCREEN: devices.draw_screen,
        Surface.KEYBOARD: devices.draw_keyboard,
        Surface.WHITEBOARD: devices.draw_whiteboard,
        Surface.PRINTER_PANEL: devices.draw_printer_panel,
        Surface.COFFEE_PANEL: devices.draw_coffee_panel,
        Surface.MIRROR: devices.draw_mirror,
        Surface.FLOOR: materials.draw_floor,
        Surface.WALL: materials.draw_wall,
        Surface.CEILING: materials.draw_ceiling,
    }
)

TILED = frozenset({Surface.FLOOR, Surface.WALL, Surface.CEILING})
"""Surfaces that repeat without a seam beyond 0..1; all others are drawn once."""

GLOWING = frozenset(
    {Surface.EXIT_SIGN, Surface.SCREEN, Surface.PRINTER_PANEL, Surface.COFFEE_PANEL}
)
"""Surfaces that shine by themselves."""


@cache
def draw(surface: Surface) -> Picture:
    """Gives a drawn surface as red, green and blue, 0 to 255, shape (height, width, 3)."""
    picture = _DRAWERS[surface]().copy()
    picture.setflags(write=False)
    return picture
