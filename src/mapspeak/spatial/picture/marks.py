"""What can be drawn on a map, whatever it stands for, and the one palette it is drawn in.

Pale fills and marks follow the Okabe-Ito set, which people with any colour vision can tell apart.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose

Canvas = NDArray[np.uint8]
"""Palette numbers, shape (rows, cols); row 0 is the top."""

Rgb = tuple[int, int, int]


class Colour(StrEnum):
    """A colour by name; always joined by a shape, a text or a hatching."""

    INK = "ink"
    ORANGE = "orange"
    SKY = "sky"
    GREEN = "green"
    YELLOW = "yellow"
    BLUE = "blue"
    VERMILION = "vermilion"
    PURPLE = "purple"


_RGB: dict[Colour, Rgb] = {
    Colour.INK: (20, 20, 20),
    Colour.ORANGE: (230, 159, 0),
    Colour.SKY: (86, 180, 233),
    Colour.GREEN: (0, 158, 115),
    Colour.YELLOW: (240, 228, 66),
    Colour.BLUE: (0, 114, 178),
    Colour.VERMILION: (213, 94, 0),
    Colour.PURPLE: (204, 121, 167),
}


class FillPart(StrEnum):
    """What a pixel of a filled area belongs to."""

    PLAIN = "plain"
    HATCH = "hatch"
    OUTLINE = "outline"


WHITE: Rgb = (255, 255, 255)
UNKNOWN_GROUND, FREE, WALL, PAPER, FRAME = range(5)
_GRID_FREE, _GRID_UNKNOWN, _GRID_PAPER_UNKNOWN = range(5, 8)
_ZERO_FREE, _ZERO_UNKNOWN, _ZERO_PAPER_UNKNOWN = range(8, 11)
N_RAMP_LEVELS = 8
_FILL_START, _RAMP_START, _GREY_START = 16, 64, 144

FILLS: dict[tuple[Colour, FillPart], int] = {
    (colour, part): _FILL_START + 5 * index + offset
    for index, colour in enumerate(_RGB)
    for offset, part in enumerate(FillPart)
}
"""Palette numbers of filled areas; two more per colour are the grid lines over them."""

RAMPS: dict[Colour, NDArray[np.uint8]] = {
    colour: np.arange(N_RAMP_LEVELS, dtype=np.uint8) + (_RAMP_START + N_RAMP_LEVELS * index)
    for index, colour in enumerate(_RGB)
}
"""Palette numbers from nearly white to the full colour, for smooth edges on a white halo."""

GREYS: NDArray[np.uint8] = np.arange(102, dtype=np.uint8) + _GREY_START
"""Palette numbers of the paper's grey levels: occupancy -1 first, then 0 to 100."""


def _mix(colour: Rgb, other: Rgb, share: float) -> Rgb:
    """Return a mixture with that share of the first colour."""
    red, green, blue = (
        round(share * a + (1 - share) * b) for a, b in zip(colour, other, strict=True)
    )
    return red, green, blue


def _build_palette() -> NDArray[np.uint8]:
    table = np.full((256, 3), 255, dtype=np.uint8)
    table[UNKNOWN_GROUND] = (212, 212, 212)
    table[WALL] = (24, 24, 24)
    table[FRAME] = (120, 120, 120)
    table[_GRID_FREE], table[_ZERO_FREE] = (206, 216, 228), (140, 164, 196)
    table[_GRID_UNKNOWN], table[_ZERO_UNKNOWN] = (188, 194, 202), (140, 156, 178)
    table[_GRID_PAPER_UNKNOWN], table[_ZERO_PAPER_UNKNOWN] = (150, 154, 160), (176, 190, 212)
    for colour, rgb in _RGB.items():
        plain = _mix(rgb, WHITE, 0.28)
        table[FILLS[colour, FillPart.PLAIN]] = plain
        table[FILLS[colour, FillPart.HATCH]] = _mix(rgb, WHITE, 0.62)
        table[FILLS[colour, FillPart.OUTLINE]] = _mix(rgb, (60, 60, 60), 0.75)
        table[_grid_over_fill(colour)] = _mix(plain, (90, 110, 140), 0.80)
        table[_grid_over_fill(colour) + 1] = _mix(plain, (60, 90, 140), 0.55)
        for level, number in enumerate(RAMPS[colour], start=1):
            table[number] = _mix(rgb, WHITE, level / N_RAMP_LEVELS)
    occupancy = np.arange(101)
    table[GREYS[0]] = 127
    table[GREYS[1:]] = ((255 * (100 - occupancy) + 50) // 100)[:, np.newaxis]
    return table


def _grid_over_fill(colour: Colour) -> int:
    return FILLS[colour, FillPart.PLAIN] + len(FillPart)


def _build_grid_over(first: int, *, fill_offset: int) -> NDArray[np.uint8]:
    """Return the palette number of a grid line over each number; walls stay as they are."""
    over = np.arange(256, dtype=np.uint8)
    over[FREE], over[UNKNOWN_GROUND], over[GREYS[0]] = first, first + 1, first + 2
    over[GREYS[1:51]] = first
    for colour in _RGB:
        for part in (FillPart.PLAIN, FillPart.HATCH):
            over[FILLS[colour, part]] = _grid_over_fill(colour) + fill_offset
    return over


def _build_is_busy() -> NDArray[np.uint8]:
    """Return 1 for what a label should not cover: walls and everything drawn over the map."""
    busy = np.zeros(256, dtype=np.uint8)
    busy[WALL] = 1
    busy[_RAMP_START : _RAMP_START + N_RAMP_LEVELS * len(_RGB)] = 1
    busy[GREYS[51:]] = 1
    return busy


PALETTE = _build_palette()
GRID_OVER = _build_grid_over(_GRID_FREE, fill_offset=0)
ZERO_LINE_OVER = _build_grid_over(_ZERO_FREE, fill_offset=1)
IS_BUSY = _build_is_busy()


class Shape(StrEnum):
    """The symbol of a mark."""

    CIRCLE = "circle"
    SQUARE = "square"
    DIAMOND = "diamond"
    TRIANGLE = "triangle"
    CROSS = "cross"


class LineStyle(StrEnum):
    """How a line is drawn."""

    SOLID = "solid"
    DASHED = "dashed"


class LegendSample(StrEnum):
    """What a legend can explain besides the shapes of marks and the styles of lines."""

    PLAIN_REGION = "plain region"
    HATCHED_REGION = "hatched region"
    DOTTED_REGION = "dotted region"
    HIGHLIGHTED_REGION = "highlighted region"
    ZONE = "zone"
    ROBOT = "robot"
    ORIGIN = "origin"


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A symbol at a place, with a short label beside it.

    Attributes:
        label: The text beside it, such as an id; empty for none.
        shape: The symbol; None for the label alone.
    """

    point: Point
    label: str
    shape: Shape | None = Shape.CIRCLE
    colour: Colour = Colour.BLUE


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A line through points of the map.

    Attributes:
        width_px: Its thickness in the picture.
        is_over_robot: The robot's arrow does not hide it.
    """

    points: tuple[Point, ...]
    style: LineStyle = LineStyle.SOLID
    colour: Colour = Colour.BLUE
    width_px: int = 3
    is_over_robot: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureRegion:
    """An area of the floor with a name.

    Attributes:
        label: The number its cells carry in the layer's array.
        colour: Of its pale fill; None for one that differs from the neighbours'.
        is_hatched: Its fill has diagonal lines.
        is_highlighted: It has a bold outline, for the one region that a picture is about.
        key: What stays the same from picture to picture, such as the number in its id; it decides
            on an automatic colour. None where the label itself stays the same.
    """

    label: int
    text: str
    colour: Colour | None = None
    is_hatched: bool = False
    is_dotted: bool = False
    is_highlighted: bool = False
    key: int | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sheet:
    """What lies below the lines, marks and labels of a picture.

    Attributes:
        canvas: Ground, regions and axes, in palette numbers.
        regions: The region of each pixel of the map area; 0 for none.
        poles: The place (u, v) in it for the name of each region in sight.
        grounds: The names of the kinds of ground in sight, by palette number.
    """

    canvas: Canvas
    regions: NDArray[np.uint16]
    poles: Mapping[int, tuple[float, float]]
    grounds: Mapping[int, str]


@dataclass(frozen=True, slots=True, eq=False)
class RegionLayer:
    """Areas that do not overlap, as one array of numbers; compared by identity.

    Attributes:
        labels: uint16, the shape of the grid's cells; 0 belongs to no region.
        painted: The sheet painted last, by the map, the view and the spacing of its lines.
    """

    labels: NDArray[np.uint16]
    regions: tuple[PictureRegion, ...]
    painted: dict[Hashable, Sheet] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        locked = np.array(self.labels, dtype=np.uint16, order="C")
        locked.setflags(write=False)
        object.__setattr__(self, "labels", locked)


@dataclass(frozen=True, slots=True, kw_only=True)
class Zone:
    """A part of the map with a bold outline and wide hatching; walls in it stay to be seen.

    Attributes:
        outlines: Corners in order, of parts and of holes: what lies within an even number of them
            is outside.
        label: What is written in it; empty for nothing.
    """

    outlines: tuple[tuple[Point, ...], ...]
    label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LegendEntry:
    """One symbol of a picture and its meaning.

    Attributes:
        colour: Only for marks and lines of this colour; None for those of any.
    """

    sample: Shape | LineStyle | LegendSample
    text: str
    colour: Colour | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLayers:
    """What is drawn over the ground, from the lowest to the highest.

    Attributes:
        zones: Parts of the map that are set apart from it, such as what is closed.
        legend: What symbols and patterns mean; only those that are to be seen are explained, in
            this order, below the map.
    """

    regions: RegionLayer | None = None
    zones: tuple[Zone, ...] = ()
    lines: tuple[Line, ...] = ()
    marks: tuple[Mark, ...] = ()
    robot: Pose | None = None
    legend: tuple[LegendEntry, ...] = ()
