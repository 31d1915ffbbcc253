"""Labels, screens and panels of machines, a written-on whiteboard, a mirror."""

from mapspeak.simulator.rendering.textures.canvas import Canvas, Colour, Picture

WHITE: Colour = (248, 248, 246)
BLACK: Colour = (24, 24, 26)
GREY: Colour = (120, 122, 126)
RED: Colour = (200, 24, 28)
BLUE: Colour = (30, 70, 170)
GREEN: Colour = (20, 130, 70)


def draw_extinguisher_label() -> Picture:
    """Draws the label around the bottle: the filling, the classes of fire, instructions."""
    canvas = Canvas(512, 208, (196, 18, 22))
    left, right = canvas.width * 0.27, canvas.width * 0.73
    middle = canvas.width / 2
    canvas.rectangle((left, 0), (right, 100), WHITE)
    canvas.rectangle((left, 0), (right, 22), RED)
    canvas.text((middle, 11), "FIRE  6 kg", 15, WHITE)
    for i, letter in enumerate("ABC"):
        x = left + 20 + i * 37
        canvas.rectangle((x - 13, 28), (x + 13, 54), RED, rounding=3)
        canvas.text((x, 41), letter, 20, WHITE)
    for y in range(62, 96, 8):
        canvas.rectangle((left + 8, y), (right - 8 - y % 3 * 10, y + 3), GREY)
    return canvas.finish()


def draw_forklift_label() -> Picture:
    """Draws a truck's load plate and its warning stripe."""
    canvas = Canvas(512, 128, (240, 170, 10))
    canvas.text((70, 50), "25", 80, BLACK)
    canvas.text((196, 54), "2.5 t", 56, BLACK)
    canvas.rectangle((290, 22), (390, 78), BLACK, rounding=6)
    canvas.rectangle((296, 28), (384, 72), (236, 236, 230))
    for y in (36, 46, 56):
        canvas.rectangle((304, y), (374, y + 4), GREY)
    return canvas.finish()


def draw_screen() -> Picture:
    """Draws a computer's screen with two windows."""
    canvas = Canvas(320, 180, (36, 96, 168))
    width = canvas.width
    canvas.rectangle((0, 93), (width, 100), (24, 30, 44))
    canvas.rectangle((12, 10), (104, 82), WHITE)
    canvas.rectangle((12, 10), (104, 18), (70, 76, 90))
    for i, length in enumerate((70, 82, 60, 78, 40, 74, 80, 52)):
        canvas.rectangle((18, 24 + i * 7), (18 + length, 26.5 + i * 7), (110, 116, 126))
    canvas.rectangle((112, 24), (168, 78), (244, 246, 250))
    canvas.rectangle((112, 24), (168, 31), (70, 76, 90))
    for i, top in enumerate((62, 52, 57, 42, 47)):
        canvas.rectangle((118 + i * 9.5, top), (124 + i * 9.5, 74), ((40, 130, 220), RED)[i % 2])
    return canvas.finish()


def draw_keyboard() -> Picture:
    """Draws the keys of a keyboard."""
    canvas = Canvas(288, 96, (34, 35, 38))
    for row in range(5):
        shift = (0, 6, 9, 14, 0)[row]
        for column in range(14):
            x = 6 + shift + column * 20.5
            if row == 4 and 4 <= column <= 8:
                continue
            canvas.rectangle(
                (x, 6 + row * 18.5), (x + 16, 20 + row * 18.5), (88, 90, 94), rounding=2
            )
    canvas.rectangle((90, 80), (184, 94), (88, 90, 94), rounding=2)
    return canvas.finish()


def draw_whiteboard() -> Picture:
    """Draws a written-on whiteboard: a heading, a list, a chart and a sketch with arrows."""
    canvas = Canvas(512, 326, WHITE)
    canvas.text((38, 12), "Plan for today", 9, BLUE)
    canvas.line([(8, 19), (70, 19)], 0.9, BLUE)
    for i, words in enumerate(("- unload", "- check stock", "- team at 10:30", "- clean up")):
        canvas.text((30, 30 + i * 10), words, 6.5, BLACK)
    canvas.line([(88, 12), (88, 48), (148, 48)], 0.9, BLACK)
    canvas.line([(90, 44), (102, 36), (114, 39), (128, 24), (144, 16)], 1.2, RED)
    canvas.line([(90, 40), (104, 42), (120, 30), (144, 32)], 1.2, GREEN)
    for x, words in ((24, "in"), (66, "store"), (108, "out")):
        canvas.rectangle((x - 14, 74), (x + 14, 90), BLUE)
        canvas.rectangle((x - 13, 75), (x + 13, 89), WHITE)
        canvas.text((x, 82), words, 7, BLUE)
    for x in (40, 82):
        canvas.line([(x, 82), (x + 9, 82)], 0.9, RED)
        canvas.polygon([(x + 8, 79), (x + 8, 85), (x + 12, 82)], RED)
    return canvas.finish()


def draw_printer_panel() -> Picture:
    """Draws the touch panel of an office printer."""
    canvas = Canvas(256, 90, (44, 46, 50))
    canvas.rectangle((14, 12), (150, 88), (90, 170, 230))
    for i in range(4):
        canvas.rectangle((22 + i * 32, 24), (46 + i * 32, 50), WHITE, rounding=4)
    canvas.rectangle((22, 60), (142, 76), (220, 236, 250))
    for x in (172, 196, 220):
        for y in (22, 44, 66):
            canvas.disc((x, y), 8, (170, 172, 176))
    canvas.disc((258, 50), 18, GREEN)
    return canvas.finish()


def draw_coffee_panel() -> Picture:
    """Draws the panel of a coffee machine: a display and cups to choose from."""
    canvas = Canvas(288, 144, (34, 34, 37))
    canvas.rectangle((60, 10), (140, 40), (120, 190, 230), rounding=3)
    canvas.text((100, 25), "COFFEE", 15, BLACK)
    for x in (24, 62, 100, 138, 176):
        canvas.disc((x, 68), 14, (226, 226, 222))
        canvas.rectangle((x - 6, 62), (x + 5, 74), (92, 58, 34), rounding=2)
        canvas.arc((x + 5, 67), 4, (-90, 90), 2, (92, 58, 34))
    return canvas.finish()


def draw_mirror() -> Picture:
    """Draws a mirror as people sketch one: pale, with slanting gleams."""
    canvas = Canvas(232, 256, (176, 200, 212))
    for x, width in ((-10, 22), (24, 8), (62, 26)):
        canvas.polygon(
            [(x, 100), (x + width, 100), (x + width + 52, 0), (x + 52, 0)], (214, 230, 236)
        )
    return canvas.finish()
