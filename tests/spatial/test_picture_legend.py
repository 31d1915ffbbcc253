import math

import numpy as np
import pytest

from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    Colour,
    LegendEntry,
    LegendSample,
    Line,
    LineStyle,
    MapLayers,
    MapPicture,
    Mark,
    PictureRegion,
    RegionLayer,
    Shape,
    Zoom,
    draw_map,
)
from mapspeak.spatial.picture.ink import NUMBER_SIZE_PX
from mapspeak.spatial.picture.marks import FILLS, PALETTE, FillPart
from seeing import find_text, full_colour, is_colour, pixels_of

FLOOR = OccupancyGrid(
    cells=np.zeros((120, 160), dtype=np.int8), resolution_m=0.05, origin=Pose(-1.0, -1.0)
)
LEGEND = (
    LegendEntry(sample=LegendSample.PLAIN_REGION, text="room"),
    LegendEntry(sample=LegendSample.HATCHED_REGION, text="corridor"),
    LegendEntry(sample=LegendSample.DOTTED_REGION, text="open space"),
    LegendEntry(sample=LegendSample.HIGHLIGHTED_REGION, text="asked for"),
    LegendEntry(sample=Shape.SQUARE, text="door"),
    LegendEntry(sample=Shape.TRIANGLE, text="frontier"),
    LegendEntry(sample=Shape.DIAMOND, text="remembered place"),
    LegendEntry(sample=Shape.CROSS, text="refused"),
    LegendEntry(sample=LegendSample.ROBOT, text="robot"),
    LegendEntry(sample=LineStyle.DASHED, text="path"),
    LegendEntry(sample=LegendSample.ORIGIN, text="origin"),
)
DOOR = Mark(point=Point(1.0, 1.0), label="D1", shape=Shape.SQUARE, colour=Colour.ORANGE)
PATH = Line(points=(Point(1.0, 1.0), Point(4.0, 3.0)), style=LineStyle.DASHED, colour=Colour.GREEN)


def strips(*regions: PictureRegion) -> RegionLayer:
    """Gives regions 1, 2, 3, ... as strips two metres wide from left to right."""
    labels = np.broadcast_to(1 + np.arange(160) // 40, (120, 160))
    return RegionLayer(labels.astype(np.uint16), regions)


EVERYTHING = MapLayers(
    regions=strips(
        PictureRegion(label=1, text="R1"),
        PictureRegion(label=2, text="C2", is_hatched=True),
        PictureRegion(label=3, text="O3", is_dotted=True),
        PictureRegion(label=4, text="R4", is_highlighted=True),
    ),
    marks=tuple(
        Mark(point=Point(1.0 + n, 2.0), label=f"W{n}", shape=shape) for n, shape in enumerate(Shape)
    ),
    lines=(PATH,),
    robot=Pose(3.0, 4.0),
    legend=LEGEND,
)


def explained(picture: MapPicture) -> list[str]:
    """Gives the texts of the legend that stand below the map."""
    below = picture.view.area.bottom
    return [
        entry.text
        for entry in LEGEND
        if any(v > below for _, v in find_text(picture, entry.text, NUMBER_SIZE_PX))
    ]


def sample_pixels(picture: MapPicture, text: str) -> np.ndarray:
    """Gives the pixels of the legend to the left of a text."""
    [(u, v)] = [
        place
        for place in find_text(picture, text, NUMBER_SIZE_PX)
        if place[1] > picture.view.area.bottom
    ]
    right = round(u) - 10
    return pixels_of(picture)[round(v) - 9 : round(v) + 9, max(0, right - 60) : right]


def test_a_legend_explains_all_that_is_to_be_seen() -> None:
    assert explained(draw_map(FLOOR, layers=EVERYTHING)) == [entry.text for entry in LEGEND]


def test_a_legend_explains_nothing_that_is_not_to_be_seen() -> None:
    layers = MapLayers(marks=(DOOR,), lines=(PATH,), legend=LEGEND)
    assert explained(draw_map(FLOOR, layers=layers)) == ["door", "path", "origin"]


def test_what_lies_outside_a_closer_look_is_not_explained() -> None:
    far = Mark(point=Point(6.0, 4.0), label="F1", shape=Shape.TRIANGLE)
    layers = MapLayers(
        regions=strips(
            PictureRegion(label=1, text="R1"), PictureRegion(label=4, text="C4", is_hatched=True)
        ),
        marks=(DOOR, far),
        robot=Pose(6.0, 4.5),
        legend=LEGEND,
    )
    picture = draw_map(FLOOR, layers=layers, zoom=Zoom(centre=DOOR.point, radius_m=0.5))
    assert explained(picture) == ["room", "door"]


def test_without_entries_only_ground_and_scale_are_explained() -> None:
    picture = draw_map(FLOOR, layers=MapLayers(marks=(DOOR,)))
    assert explained(picture) == []
    assert find_text(picture, "unknown", NUMBER_SIZE_PX)


def test_ground_that_is_not_to_be_seen_is_not_explained() -> None:
    picture = draw_map(FLOOR)
    assert find_text(picture, "free", NUMBER_SIZE_PX)
    assert not find_text(picture, "wall", NUMBER_SIZE_PX)


@pytest.mark.parametrize(
    ("text", "rgb"),
    [
        ("door", full_colour(Colour.ORANGE)),
        ("path", full_colour(Colour.GREEN)),
        ("robot", full_colour(Colour.VERMILION)),
        ("corridor", tuple(PALETTE[FILLS[Colour.SKY, FillPart.HATCH]].tolist())),
    ],
)
def test_a_sample_has_the_colour_of_what_it_explains(text: str, rgb: tuple[int, ...]) -> None:
    regions = strips(PictureRegion(label=2, text="C2", is_hatched=True))
    layers = MapLayers(
        regions=regions, marks=(DOOR,), lines=(PATH,), robot=Pose(3.0, 4.0), legend=LEGEND
    )
    assert is_colour(sample_pixels(draw_map(FLOOR, layers=layers), text), rgb).any()


def test_two_colours_of_one_shape_can_be_told_apart() -> None:
    refused = Mark(point=Point(3.0, 1.0), label="", shape=Shape.SQUARE, colour=Colour.PURPLE)
    legend = (
        LegendEntry(sample=Shape.SQUARE, text="closed", colour=Colour.PURPLE),
        LegendEntry(sample=Shape.SQUARE, text="green door", colour=Colour.GREEN),
    )
    picture = draw_map(FLOOR, layers=MapLayers(marks=(DOOR, refused), legend=legend))
    assert is_colour(sample_pixels(picture, "closed"), full_colour(Colour.PURPLE)).any()
    assert not find_text(picture, "green door", NUMBER_SIZE_PX)


@pytest.mark.parametrize("shape", [(120, 160), (400, 20), (20, 400), (1, 1)])
@pytest.mark.parametrize("max_edge_px", [320, 500, 1000, 1072])
def test_a_legend_takes_as_many_rows_as_it_needs_within_the_picture(
    shape: tuple[int, int], max_edge_px: int
) -> None:
    grid = OccupancyGrid(cells=np.zeros(shape, dtype=np.int8), resolution_m=0.05)
    middle = Point(shape[1] * 0.025, shape[0] * 0.025)
    marks = tuple(Mark(point=middle, label="", shape=kind) for kind in Shape)
    layers = MapLayers(marks=marks, robot=Pose(middle.x, middle.y), legend=LEGEND)
    picture = draw_map(grid, layers=layers, max_edge_px=max_edge_px)
    height, width, _ = pixels_of(picture).shape
    assert (width, height) == (picture.view.width_px, picture.view.height_px)
    assert max(width, height) <= max_edge_px
    wanted = {"door", "frontier", "remembered place", "refused", "robot", "origin"}
    assert set(explained(picture)) == wanted


def test_a_sample_of_the_robot_points_to_the_right_whatever_the_view() -> None:
    layers = MapLayers(robot=Pose(3.0, 4.0, 2.0), legend=LEGEND)
    pixels = sample_pixels(draw_map(FLOOR, layers=layers, up_rad=2.0), "robot")
    rows, cols = np.nonzero(is_colour(pixels, full_colour(Colour.VERMILION)))
    assert np.ptp(cols) > np.ptp(rows)
    assert math.isclose(rows[cols == cols.max()].mean(), rows.mean(), abs_tol=1.5)
