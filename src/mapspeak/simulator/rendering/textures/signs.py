"""Signs after the idea of ISO 7010: red for fire equipment, green for escape and first aid."""

import math

from mapspeak.simulator.rendering.textures.canvas import Canvas, Colour, Picture, Place

RED: Colour = (200, 16, 24)
GREEN: Colour = (0, 136, 82)
BLUE: Colour = (0, 84, 166)
WHITE: Colour = (250, 250, 250)
BLACK: Colour = (20, 20, 20)
YELLOW: Colour = (250, 200, 0)
SIDE_PX = 256


def draw_extinguisher_sign() -> Picture:
    """Draws the sign of a fire extinguisher: the bottle with its hose, and flames."""
    canvas = _framed(RED)
    canvas.rectangle((24, 38), (48, 88), WHITE, rounding=8)
    canvas.rectangle((31, 28), (41, 42), WHITE)
    canvas.polygon([(22, 18), (48, 22), (48, 28), (22, 25)], WHITE)
    canvas.rectangle((28, 22), (44, 30), WHITE)
    canvas.line([(31, 32), (22, 34), (16, 44), (15, 66)], 4.5, WHITE)
    canvas.polygon([(12, 64), (18, 64), (20, 78), (10, 78)], WHITE)
    _flames(canvas, (70, 88), 1.0)
    return canvas.finish()


def draw_hose_reel_sign() -> Picture:
    """Draws the sign of a fire hose reel: the reel, the hose with its nozzle, and flames."""
    canvas = _framed(RED)
    for radius, colour in ((27, WHITE), (22, RED), (18, WHITE), (13, RED), (9, WHITE), (4, RED)):
        canvas.disc((37, 42), radius, colour)
    canvas.line([(62, 42), (62, 66), (56, 74), (40, 82)], 5, WHITE)
    canvas.polygon([(42, 78), (24, 84), (26, 92), (44, 86)], WHITE)
    _flames(canvas, (79, 90), 0.72)
    return canvas.finish()


def draw_first_aid_sign() -> Picture:
    """Draws the lid of a first-aid box: a white cross and the words."""
    canvas = Canvas(336, SIDE_PX, GREEN)
    middle = canvas.width / 2
    canvas.rectangle((middle - 10, 8), (middle + 10, 68), WHITE)
    canvas.rectangle((middle - 30, 28), (middle + 30, 48), WHITE)
    canvas.text((middle, 84), "FIRST AID", 21, WHITE)
    return canvas.finish()


def draw_first_aid_cross() -> Picture:
    """Draws the side of a first-aid box: a white cross."""
    canvas = Canvas(128, 128, GREEN)
    canvas.rectangle((38, 10), (62, 90), WHITE)
    canvas.rectangle((10, 38), (90, 62), WHITE)
    return canvas.finish()


def draw_exit_sign() -> Picture:
    """Draws an escape sign: a running figure, a door, an arrow and the word."""
    canvas = Canvas(540, SIDE_PX, GREEN)
    canvas.rectangle((66, 12), (100, 88), WHITE)
    _running_figure(canvas, (44, 50))
    canvas.text((156, 38), "EXIT", 44, WHITE)
    canvas.rectangle((122, 70), (176, 80), WHITE)
    canvas.polygon([(172, 60), (172, 90), (194, 75)], WHITE)
    return canvas.finish()


def draw_eye_wash_sign() -> Picture:
    """Draws the sign of an eye wash: an eye under falling water, and the words."""
    canvas = _framed(GREEN)
    lids = _lens((50, 34), half_width=34, half_height=18)
    canvas.polygon(lids, WHITE)
    canvas.disc((50, 34), 13, GREEN)
    canvas.disc((50, 34), 6, WHITE)
    for x, y in ((30, 60), (50, 64), (70, 60)):
        canvas.disc((x, y), 4.5, WHITE)
        canvas.polygon([(x - 4, y - 2), (x, y - 11), (x + 4, y - 2)], WHITE)
    canvas.text((50, 83), "EYE WASH", 17, WHITE)
    return canvas.finish()


def draw_charging_sign() -> Picture:
    """Draws the sign of a charging place: a battery with a bolt, and the words."""
    canvas = Canvas(SIDE_PX, 286, BLUE)
    middle = canvas.width / 2
    canvas.rectangle((middle - 28, 14), (middle + 28, 50), WHITE, rounding=4)
    canvas.rectangle((middle + 28, 25), (middle + 33, 39), WHITE)
    canvas.rectangle((middle - 24, 18), (middle + 24, 46), BLUE, rounding=2)
    bolt = [(4, -14), (-12, 3), (-2, 3), (-5, 14), (12, -4), (2, -4)]
    canvas.polygon([(middle + x, 32 + y) for x, y in bolt], YELLOW)
    canvas.text((middle, 65), "ROBOT", 17, WHITE)
    canvas.text((middle, 84), "CHARGING", 15, WHITE)
    return canvas.finish()


def draw_recycling_sign() -> Picture:
    """Draws three arrows that chase each other, on the green of the bin it is for."""
    canvas = Canvas(128, 128, (62, 66, 70))
    for turn in (0, 120, 240):
        canvas.arc((50, 52), 30, (turn - 90, turn - 15), 11, WHITE)
        tip = _on_circle((50, 52), 30, turn + 18)
        inner = _on_circle((50, 52), 17, turn - 16)
        outer = _on_circle((50, 52), 43, turn - 16)
        canvas.polygon([tip, inner, outer], WHITE)
    return canvas.finish()


def draw_hazard_stripes() -> Picture:
    """Draws slanted black and yellow stripes."""
    canvas = Canvas(512, 128, YELLOW)
    for x in range(-100, 400, 50):
        canvas.polygon([(x, 100), (x + 25, 100), (x + 75, 0), (x + 50, 0)], BLACK)
    return canvas.finish()


def _framed(colour: Colour) -> Canvas:
    canvas = Canvas(SIDE_PX, SIDE_PX, WHITE)
    canvas.rectangle((3, 3), (97, 97), colour, rounding=3)
    return canvas


def _flames(canvas: Canvas, foot: Place, scale: float) -> None:
    outline = [(-17, -8), (-20, -24), (-13, -38), (-11, -29), (-6, -42), (-7, -58), (3, -68)]
    outline += [(2, -54), (9, -44), (13, -34), (15, -42), (20, -26), (17, -8), (8, 0), (-8, 0)]
    x, y = foot
    canvas.polygon([(x + scale * dx, y + scale * dy) for dx, dy in outline], WHITE)
    core = [(-6, -6), (-8, -18), (-1, -32), (2, -22), (8, -16), (7, -6), (0, -2)]
    canvas.polygon([(x + scale * dx, y + scale * dy) for dx, dy in core], RED)


def _running_figure(canvas: Canvas, hip: Place) -> None:
    x, y = hip
    limbs: tuple[tuple[float, list[Place]], ...] = (
        (13, [(8, -20), (0, 2)]),
        (8, [(9, -22), (22, -14), (32, -24)]),
        (8, [(6, -22), (-10, -20), (-16, -6)]),
        (10, [(1, 2), (16, 10), (12, 32)]),
        (10, [(-1, 2), (-8, 22), (-26, 24)]),
    )
    for width, points in limbs:
        canvas.line([(x + dx, y + dy) for dx, dy in points], width, WHITE)
    canvas.disc((x + 14, y - 34), 8.5, WHITE)


def _lens(centre: Place, *, half_width: float, half_height: float) -> list[Place]:
    x, y = centre
    steps = [i / 12 for i in range(-12, 13)]
    upper = [(x + half_width * t, y - half_height * (1 - t * t)) for t in steps]
    lower = [(x + half_width * t, y + half_height * (1 - t * t)) for t in reversed(steps)]
    return upper + lower


def _on_circle(centre: Place, radius: float, angle_deg: float) -> Place:
    angle = math.radians(angle_deg)
    return (centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle))
