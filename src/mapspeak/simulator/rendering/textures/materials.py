"""Goods and building: cardboard, wood, floor, wall paint, ceiling."""

import numpy as np
from numpy.typing import NDArray

from mapspeak.simulator.rendering.textures.canvas import Canvas, Colour, Picture

FloatArray = NDArray[np.float64]
CARDBOARD: Colour = (190, 146, 98)
SEED = 7


def draw_cardboard() -> Picture:
    """Draws the side of a cardboard box: tape down the middle, a label, two arrows up."""
    canvas = Canvas(256, 192, CARDBOARD)
    width = canvas.width
    canvas.rectangle((0, 0), (width, 2.5), (150, 112, 72))
    canvas.rectangle((0, 97.5), (width, 100), (140, 104, 66))
    canvas.rectangle((0, 0), (2, 100), (156, 118, 76))
    canvas.rectangle((width - 2, 0), (width, 100), (156, 118, 76))
    canvas.rectangle((width / 2 - 6, 0), (width / 2 + 6, 34), (214, 186, 140))
    canvas.rectangle((width / 2 - 6, 82), (width / 2 + 6, 100), (214, 186, 140))
    canvas.rectangle((82, 46), (122, 76), (244, 244, 240))
    for i in range(11):
        left = 86 + 3 * i
        canvas.rectangle((left, 50), (left + (1.8 if i % 3 else 0.9), 62), (30, 30, 30))
    for top in (66, 70):
        canvas.rectangle((86, top), (112, top + 1.5), (90, 90, 90))
    for middle in (18, 34):
        canvas.polygon([(middle, 66), (middle - 6, 76), (middle + 6, 76)], (96, 66, 40))
        canvas.rectangle((middle - 2.5, 75), (middle + 2.5, 88), (96, 66, 40))
    return _grained(canvas.finish(), _ripples(192, 256, rows=0.35, columns=0.02), 7.0)


def draw_crate_side() -> Picture:
    """Draws the side of a wooden crate: planks, a frame and a diagonal brace, nailed."""
    light, mid, dark = (206, 164, 108), (186, 142, 88), (110, 78, 44)
    canvas = Canvas(256, 256, dark)
    for i in range(6):
        canvas.rectangle((0, i * 16.7 + 0.8), (100, (i + 1) * 16.7 - 0.8), mid)
    canvas.polygon([(10, 78), (78, 10), (92, 22), (22, 92)], dark)
    canvas.polygon([(12, 80), (80, 12), (90, 22), (22, 90)], light)
    canvas.rectangle((0, 0), (100, 15), light)
    canvas.rectangle((0, 85), (100, 100), light)
    canvas.rectangle((0, 0), (15, 100), light)
    canvas.rectangle((85, 0), (100, 100), light)
    canvas.line([(16, 16), (84, 16), (84, 84), (16, 84), (16, 16)], 1.5, dark)
    for x in (4, 11, 89, 96):
        for y in (4, 11, 89, 96):
            canvas.disc((x, y), 1.2, (70, 70, 72))
    return _grained(canvas.finish(), _ripples(256, 256, rows=0.3, columns=0.03), 12.0)


def draw_wood() -> Picture:
    """Draws the grain of a board along the picture's width; its tint is that of the part."""
    board = np.full((256, 256, 3), (232, 232, 232), dtype=np.uint8)
    return _grained(board, _ripples(256, 256, rows=0.25, columns=0.015), 16.0)


def draw_floor() -> Picture:
    """Draws four metres of sealed concrete with its joints."""
    n = 1024
    clouds = 3.5 * _ripples(n, n, rows=0.006, columns=0.006)
    specks = 2.2 * _ripples(n, n, rows=0.4, columns=0.4)
    grey = 158.0 + clouds + specks
    floor = np.stack([grey, grey * 0.995, grey * 0.97], axis=2)
    for edge in (slice(0, 3), slice(n - 2, n)):
        floor[edge, :] *= 0.72
        floor[:, edge] *= 0.72
    return _as_picture(floor)


def draw_wall() -> Picture:
    """Draws two metres of painted plaster."""
    n = 256
    shade = 0.8 * _ripples(n, n, rows=0.02, columns=0.02) + 1.2 * _ripples(
        n, n, rows=0.4, columns=0.4
    )
    return _as_picture(240.0 + shade[:, :, None] + np.array([0.0, 0.0, -5.0]))


def draw_ceiling() -> Picture:
    """Draws a suspended ceiling: two by two boards of 0.6 m."""
    n = 256
    ceiling = 232.0 + 3.0 * _ripples(n, n, rows=0.4, columns=0.4)
    for edge in (slice(0, 2), slice(n // 2 - 2, n // 2 + 2), slice(n - 2, n)):
        ceiling[edge, :] *= 0.86
        ceiling[:, edge] *= 0.86
    return _as_picture(np.repeat(ceiling[:, :, None], 3, axis=2))


def _ripples(n_rows: int, n_columns: int, *, rows: float, columns: float) -> FloatArray:
    """Gives noise that repeats without a seam; the arguments are its highest frequencies."""
    noise = np.random.default_rng(SEED).normal(size=(n_rows, n_columns))
    across = np.fft.fftfreq(n_rows)[:, None] / rows
    along = np.fft.fftfreq(n_columns)[None, :] / columns
    smooth = np.fft.ifft2(np.fft.fft2(noise) * np.exp(-(across**2) - along**2)).real
    return np.asarray(smooth / smooth.std())


def _grained(picture: Picture, grain: FloatArray, strength: float) -> Picture:
    return _as_picture(picture + strength * grain[:, :, None])


def _as_picture(values: FloatArray) -> Picture:
    return np.clip(values, 0, 255).astype(np.uint8)
