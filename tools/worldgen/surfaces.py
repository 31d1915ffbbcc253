"""`python -m tools.worldgen.surfaces` draws the surfaces that the simulator's camera shows.

`surfaces.json` lists the shapes of each; the signs follow the idea of ISO 7010. The pictures ship
with the simulator, so that it need not draw, and shows the same with every version of Pillow.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import orjson
from PIL import Image, ImageDraw, ImageFont

from mapspeak.simulator.worlds.models import Colour

DRAWINGS = Path(__file__).with_name("surfaces.json")
SHIPPED = Path(__file__).parents[2] / "src/mapspeak/simulator/camera/surfaces"

Place = tuple[float, float]

_SMOOTHING = 3


class _Canvas:
    """A picture in the making: x to the right and y down, 100 units high, with smooth edges."""

    def __init__(self, width_px: int, height_px: int, background: Colour) -> None:
        self._size = (width_px, height_px)
        self._scale = _SMOOTHING * height_px / 100.0
        large = (width_px * _SMOOTHING, height_px * _SMOOTHING)
        self._image = Image.new("RGB", large, background)
        self._draw = ImageDraw.Draw(self._image)

    def polygon(self, *, points: Sequence[Place], fill: Colour) -> None:
        """Fill a polygon."""
        self._draw.polygon([self._place(point) for point in points], fill=fill)

    def rectangle(self, *, low: Place, high: Place, fill: Colour, rounding: float = 0.0) -> None:
        """Fill a rectangle between its upper left and its lower right corner."""
        self._draw.rounded_rectangle(
            [self._place(low), self._place(high)], radius=rounding * self._scale, fill=fill
        )

    def disc(self, *, centre: Place, radius: float, fill: Colour) -> None:
        """Fill a circle."""
        self._draw.circle(self._place(centre), radius * self._scale, fill=fill)

    def line(self, *, points: Sequence[Place], width: float, fill: Colour) -> None:
        """Draw a line with round ends and joints."""
        pixels = round(width * self._scale)
        self._draw.line([self._place(point) for point in points], fill=fill, width=pixels)
        for point in points:
            self.disc(centre=point, radius=width / 2, fill=fill)

    def arc(
        self, *, centre: Place, radius: float, turn_deg: Place, stroke: float, fill: Colour
    ) -> None:
        """Draw part of a circle, from one angle to the other; 0 is right, 90 is down."""
        n = max(int(abs(turn_deg[1] - turn_deg[0]) / 6), 2)
        angles = [
            math.radians(turn_deg[0] + (turn_deg[1] - turn_deg[0]) * i / n) for i in range(n + 1)
        ]
        x, y = centre
        points = [(x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles]
        self.line(points=points, width=stroke, fill=fill)

    def text(self, *, centre: Place, words: str, height: float, fill: Colour) -> None:
        """Write words around a centre."""
        self._draw.text(
            self._place(centre),
            words,
            fill=fill,
            font=ImageFont.load_default(size=height * self._scale),
            anchor="mm",
            stroke_width=height * self._scale / 28,
            stroke_fill=fill,
        )

    def finish(self) -> Image.Image:
        """Return the picture."""
        return self._image.resize(self._size, Image.Resampling.BOX)

    def _place(self, point: Place) -> Place:
        return (point[0] * self._scale, point[1] * self._scale)


_SHAPES: Mapping[str, Callable[..., None]] = MappingProxyType(
    {
        "arc": _Canvas.arc,
        "disc": _Canvas.disc,
        "line": _Canvas.line,
        "polygon": _Canvas.polygon,
        "rectangle": _Canvas.rectangle,
        "text": _Canvas.text,
    }
)


def draw_surface(name: str) -> Image.Image:
    """Draw the shapes that the file lists for a surface, each over those before it."""
    drawing = orjson.loads(DRAWINGS.read_bytes())[name]
    width_px, height_px = drawing["size_px"]
    canvas = _Canvas(width_px, height_px, tuple(drawing["background"]))
    for shape in drawing["shapes"]:
        arguments = dict(shape)
        arguments["fill"] = tuple(arguments["fill"])
        _SHAPES[arguments.pop("shape")](canvas, **arguments)
    return canvas.finish()


def surface_names() -> tuple[str, ...]:
    """Return the names of all surfaces that are drawn."""
    return tuple(orjson.loads(DRAWINGS.read_bytes()))


def main() -> None:
    """Draw every surface anew into the simulator's folder."""
    for name in surface_names():
        draw_surface(name).save(SHIPPED / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
