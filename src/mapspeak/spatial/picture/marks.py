"""What can be drawn on a map: marks, lines, areas and a legend, whatever they stand for."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.spatial.picture.palette import Colour

_MAX_LABEL = np.iinfo(np.uint16).max


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
    """

    points: tuple[Point, ...]
    style: LineStyle = LineStyle.SOLID
    colour: Colour = Colour.BLUE
    width_px: int = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureRegion:
    """An area of the floor with a name.

    Attributes:
        label: The number its cells carry in the layer's array.
        text: What is written in it; empty for none.
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


@dataclass(frozen=True, slots=True, eq=False)
class RegionLayer:
    """Areas that do not overlap, as one array of numbers; compared by identity.

    Attributes:
        labels: uint16, the shape of the grid's cells; 0 belongs to no region.

    Raises:
        MapError: A label is not between 0 and 65535, or the array has not two dimensions.
    """

    labels: NDArray[np.uint16]
    regions: tuple[PictureRegion, ...]

    def __post_init__(self) -> None:
        labels = np.asarray(self.labels)
        in_range = labels.size == 0 or (labels.min() >= 0 and labels.max() <= _MAX_LABEL)
        if labels.ndim != 2 or not in_range:
            raise MapError(
                f"The region labels have {labels.ndim} dimensions or leave 0..{_MAX_LABEL}.",
                hint="Give an array of the grid's shape with small positive numbers, 0 for none.",
            )
        locked = np.array(labels, dtype=np.uint16, order="C")
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
    """One symbol of a picture and what it stands for.

    Attributes:
        text: Its meaning in a word or two.
        colour: Only for marks and lines of this colour; None for those of any.
    """

    sample: Shape | LineStyle | LegendSample
    text: str
    colour: Colour | None = None
