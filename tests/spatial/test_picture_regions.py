"""Regions: colours that stay, patterns, the highlight, and labels in the part that is seen."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    Colour,
    MapLayers,
    MapPicture,
    PictureRegion,
    RegionLayer,
    Zoom,
    draw_map,
)
from mapspeak.spatial.picture.ink import LABEL_SIZE_PX
from mapspeak.spatial.picture.marks import FILLS, PALETTE, FillPart
from mapspeak.spatial.picture.regions import colour_regions
from seeing import (
    WALL_RGB,
    colour_at,
    colours_at,
    find_text,
    full_colour,
    is_colour,
    pixels_of,
)

Labels = NDArray[np.uint16]
HIGHLIGHT = full_colour(Colour.VERMILION)

THREE_ROOMS = grid_from_text(
    """
    ###############################
    #.........#.........#.........#
    #.........#.........#.........#
    #.........#.........#.........#
    #.........#.........#.........#
    #.........#.........#.........#
    #.........#.........#.........#
    #.........#.........#.........#
    ###############################
    """,
    resolution_m=0.5,
    origin=Pose(100.0, 200.0),
)
THREE = np.zeros((9, 31), dtype=np.uint16)
THREE[1:-1, 1:10], THREE[1:-1, 11:20], THREE[1:-1, 21:30] = 1, 2, 3


def fill(colour: Colour, part: FillPart = FillPart.PLAIN) -> tuple[int, ...]:
    return tuple(PALETTE[FILLS[colour, part]].tolist())


def grid_of(labels: Labels, resolution_m: float = 0.1) -> OccupancyGrid:
    return OccupancyGrid(cells=np.zeros(labels.shape, dtype=np.int8), resolution_m=resolution_m)


def keyed(*keys: int) -> tuple[PictureRegion, ...]:
    return tuple(
        PictureRegion(label=label, text=f"R{key}", key=key)
        for label, key in enumerate(keys, start=1)
    )


@st.composite
def mosaics(draw: st.DrawFn) -> Labels:
    """Draws up to 20 rectangles in a row, or with a few others over them."""
    labels = np.repeat(np.arange(1, 21, dtype=np.uint16), 10)[np.newaxis].repeat(30, axis=0)
    for label in range(21, 24):
        row, col = draw(st.integers(0, 20)), draw(st.integers(0, 150))
        labels[row : row + 10, col : col + 40] = label
    return labels


@settings(max_examples=30)
@given(labels=mosaics(), seed=st.integers(0, 1000))
def test_another_region_elsewhere_changes_no_colour(labels: Labels, seed: int) -> None:
    keys = np.random.default_rng(seed).permutation(100)[:23] + 1
    regions = keyed(*keys.tolist())
    newest = max(regions, key=lambda region: region.key or 0)
    after = colour_regions(RegionLayer(labels, regions), grid_of(labels))
    earlier = np.where(labels == newest.label, 0, labels).astype(np.uint16)
    others = tuple(region for region in regions if region is not newest)
    before = colour_regions(RegionLayer(earlier, others), grid_of(labels))
    assert before == {label: after[label] for label in before}


@settings(max_examples=20)
@given(keys=st.permutations(range(1, 21)))
def test_regions_side_by_side_differ_whatever_their_keys(keys: list[int]) -> None:
    labels = np.repeat(np.arange(1, 21, dtype=np.uint16), 10)[np.newaxis].repeat(30, axis=0)
    colours = colour_regions(RegionLayer(labels, keyed(*keys)), grid_of(labels))
    assert all(colours[label] is not colours[label + 1] for label in range(1, 20))


def test_the_key_and_not_the_label_decides_on_a_colour() -> None:
    labels = np.zeros((20, 60), dtype=np.uint16)
    labels[:, 5:15], labels[:, 45:55] = 1, 2
    swapped = np.choose(labels, [0, 2, 1]).astype(np.uint16)
    colours = colour_regions(RegionLayer(labels, keyed(4, 9)), grid_of(labels))
    assert colours == {
        label % 2 + 1: colour
        for label, colour in colour_regions(
            RegionLayer(swapped, keyed(9, 4)), grid_of(labels)
        ).items()
    }


def test_the_colours_of_a_closer_look_are_those_of_the_whole() -> None:
    layers = MapLayers(regions=RegionLayer(THREE, keyed(1, 7, 13)))
    points = [Point(101.25, 201.25), Point(106.25, 201.25), Point(111.25, 201.25)]
    whole = draw_map(THREE_ROOMS, layers=layers)
    colours = [colour_at(whole, point) for point in points]
    assert colours[0] != colours[1] != colours[2]
    for point, colour in zip(points, colours, strict=True):
        near = draw_map(THREE_ROOMS, layers=layers, zoom=Zoom(centre=point, radius_m=0.7))
        assert colour_at(near, Point(point.x + 0.3, point.y + 0.3)) == colour


def test_a_picture_is_the_same_whatever_was_drawn_of_its_regions_before() -> None:
    kept = RegionLayer(THREE, keyed(1, 7, 13))
    opened = replace(THREE_ROOMS, cells=np.where(THREE_ROOMS.cells > 0, 0, THREE_ROOMS.cells))
    near = Zoom(centre=Point(106.25, 201.25), radius_m=3.0)
    for grid, robot, zoom in (
        (THREE_ROOMS, Pose(101.25, 201.25), None),
        (THREE_ROOMS, Pose(106.25, 202.25), None),
        (THREE_ROOMS, Pose(106.25, 202.25), near),
        (opened, Pose(106.25, 202.25), near),
        (THREE_ROOMS, Pose(101.25, 201.25), None),
    ):
        anew = MapLayers(regions=RegionLayer(THREE, keyed(1, 7, 13)), robot=robot)
        drawn = draw_map(grid, layers=replace(anew, regions=kept), zoom=zoom)
        assert drawn == draw_map(grid, layers=anew, zoom=zoom)


def test_a_map_that_grew_towards_its_origin_keeps_its_colours() -> None:
    labels = np.repeat(np.arange(1, 9, dtype=np.uint16), 7)[np.newaxis].repeat(30, axis=0)
    regions = keyed(*range(1, 9))
    grown = np.pad(labels, ((3, 0), (5, 0)))
    before = colour_regions(RegionLayer(labels, regions), grid_of(labels, 0.05))
    cells = np.zeros(grown.shape, dtype=np.int8)
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(-0.25, -0.15))
    assert colour_regions(RegionLayer(grown, regions), grid) == before


def test_a_dotted_region_has_dots_in_its_fill() -> None:
    region = PictureRegion(label=2, text="", colour=Colour.GREEN, is_dotted=True)
    picture = draw_map(THREE_ROOMS, layers=MapLayers(regions=RegionLayer(THREE, (region,))))
    area = picture.view.area_of(pixels_of(picture))
    n_dots = np.count_nonzero(is_colour(area, fill(Colour.GREEN, FillPart.HATCH)))
    n_plain = np.count_nonzero(is_colour(area, fill(Colour.GREEN)))
    assert n_dots / (n_dots + n_plain) == pytest.approx(4 / 100, abs=0.01)


def highlighted(zoom: Zoom | None = None) -> MapPicture:
    regions = (
        PictureRegion(label=1, text="R1"),
        PictureRegion(label=2, text="R2", is_highlighted=True),
    )
    return draw_map(THREE_ROOMS, layers=MapLayers(regions=RegionLayer(THREE, regions)), zoom=zoom)


def test_a_highlighted_region_has_a_bold_outline_and_no_other_has() -> None:
    picture = highlighted()
    inset_m = 2.5 / picture.view.pixels_per_m
    inside = [(105.5 + inset_m, 202.0), (110.0 - inset_m, 202.0), (107.0, 200.5 + inset_m)]
    assert is_colour(colours_at(picture, np.array(inside)), HIGHLIGHT).all()
    rows, cols = np.nonzero(is_colour(pixels_of(picture), HIGHLIGHT))
    xs = picture.view.points_at(np.stack([cols + 0.5, rows + 0.5], axis=1))[:, 0]
    assert xs.min() > 105.5
    assert xs.max() < 110.0


def test_a_highlight_hides_no_wall() -> None:
    picture = highlighted()
    points = THREE_ROOMS.points_at(*np.nonzero(THREE_ROOMS.occupied))
    assert is_colour(colours_at(picture, points), WALL_RGB).all()


def test_where_the_picture_cuts_a_region_off_it_has_no_outline() -> None:
    picture = highlighted(zoom=Zoom(centre=Point(105.5, 202.25), radius_m=1.0))
    area = picture.view.area_of(pixels_of(picture))
    assert is_colour(area, HIGHLIGHT).any()
    assert not is_colour(area[:, -1], HIGHLIGHT).any()


@settings(max_examples=25)
@given(
    x=st.floats(99.5, 116.0),
    y=st.floats(199.5, 205.0),
    radius_m=st.floats(0.1, 20.0),
    up_rad=st.sampled_from([np.pi / 2, 0.0, 0.6, -2.0]),
)
def test_each_region_is_labelled_in_its_visible_part(
    x: float, y: float, radius_m: float, up_rad: float
) -> None:
    layers = MapLayers(regions=RegionLayer(THREE, keyed(1, 2, 3)))
    zoom = Zoom(centre=Point(x, y), radius_m=radius_m)
    picture = draw_map(THREE_ROOMS, layers=layers, zoom=zoom, up_rad=up_rad, max_edge_px=400)
    in_sight = labels_in_sight(picture)
    for label in (1, 2, 3):
        text = f"R{label}"
        places = find_text(picture, text, LABEL_SIZE_PX)
        assert len(places) == int(label in in_sight and text not in picture.labels_left_out)
        for u, v in places:
            assert picture.view.area.left <= u < picture.view.area.right
            assert picture.view.area.top <= v < picture.view.area.bottom


def labels_in_sight(picture: MapPicture) -> set[int]:
    """Gives the regions in which some pixel of the map area has its middle, or nearly so."""
    area = picture.view.area
    rows, cols = np.mgrid[area.top : area.bottom, area.left : area.right]
    points = picture.view.points_at(np.stack([cols.ravel() + 0.5, rows.ravel() + 0.5], axis=1))
    row, col = THREE_ROOMS.cells_at(points)
    is_on = (row >= 0) & (row < 9) & (col >= 0) & (col < 31)
    return set(np.unique(THREE[row[is_on], col[is_on]]).tolist()) - {0}


def test_the_label_of_a_region_cut_in_two_halves_stands_in_the_half_that_is_seen() -> None:
    layers = MapLayers(regions=RegionLayer(THREE, keyed(1, 2, 3)))
    zoom = Zoom(centre=Point(106.0, 202.25), radius_m=1.5)
    picture = draw_map(THREE_ROOMS, layers=layers, zoom=zoom)
    [(u, v)] = find_text(picture, "R2", LABEL_SIZE_PX)
    x, y = picture.view.points_at(np.array([[u, v]]))[0]
    assert 105.5 < x < 107.5
    assert 200.75 < y < 203.75
    assert find_text(picture, "R3", LABEL_SIZE_PX) == []
