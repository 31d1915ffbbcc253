"""Labels and numbers: none touches another, and marks in one place share theirs."""

import itertools
import math

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    Colour,
    MapLayers,
    MapPicture,
    Mark,
    PictureRegion,
    RegionLayer,
    Shape,
    draw_map,
)
from mapspeak.spatial.picture.ink import LABEL_SIZE_PX, NUMBER_SIZE_PX, text_patch
from seeing import find_text, full_colour, is_colour, pixels_of

FLOOR = OccupancyGrid(
    cells=np.zeros((120, 160), dtype=np.int8), resolution_m=0.05, origin=Pose(100.0, 200.0)
)
DIGIT_GAP_PX = 7
"""Ink that near along a line is read as one number."""


def place_of(picture: MapPicture, text: str) -> tuple[float, float]:
    [place] = find_text(picture, text, LABEL_SIZE_PX)
    return place


def numbers_in_margins(picture: MapPicture) -> list[tuple[int, int]]:
    """Gives the width and height of each thing that reads as one word around the map."""
    view = picture.view
    ink = (pixels_of(picture)[..., 0] < 200).astype(np.uint8)
    height = text_patch("0", NUMBER_SIZE_PX).shape[0]
    ink[view.area.bottom + 2 * 6 + height :] = 0
    ink[view.area.top - 1 : view.area.bottom + 1, view.area.left - 1 : view.area.right + 1] = 0
    joined = cv2.morphologyEx(ink, cv2.MORPH_CLOSE, np.ones((1, DIGIT_GAP_PX), np.uint8))
    _, _, stats, _ = cv2.connectedComponentsWithStats(joined)
    return [(int(width), int(height)) for _, _, width, height, _ in stats[1:]]


@settings(max_examples=30)
@given(
    shape=st.tuples(st.integers(1, 60), st.integers(1, 60)),
    resolution_m=st.floats(0.02, 2.0),
    x=st.integers(-40, 40),
    y=st.integers(-40, 40),
    up_rad=st.sampled_from([math.pi / 2, 0.0, math.pi / 4, 0.3, -2.0]),
    max_edge_px=st.integers(320, 700),
)
def test_numbers_around_a_map_are_never_read_as_one(
    shape: tuple[int, int],
    resolution_m: float,
    x: int,
    y: int,
    up_rad: float,
    max_edge_px: int,
) -> None:
    grid = OccupancyGrid(
        cells=np.zeros(shape, dtype=np.int8), resolution_m=resolution_m, origin=Pose(x, y)
    )
    picture = draw_map(grid, up_rad=up_rad, max_edge_px=max_edge_px)
    assert picture.spacing_m is not None
    decimals = max(0, -math.floor(math.log10(picture.spacing_m) + 1e-9))
    corners = picture.view.area_corners()
    ends = [f"{value:.{decimals}f}" for value in corners.ravel()]
    axes = [""] if up_rad == math.pi / 2 else ["x=", "y="]
    # A digit more than the ends have: 10 may lie between 9.7 and 10.3, and -0.5 before 0.3.
    texts = [f"{axis}{end}0" for axis, end in itertools.product(axes, ends)]
    widest_px = max(text_patch(text, NUMBER_SIZE_PX).shape[1] for text in texts)
    found = numbers_in_margins(picture)
    assert found
    assert max(width for width, _ in found) <= widest_px
    assert max(height for _, height in found) <= text_patch("0", NUMBER_SIZE_PX).shape[0]


def test_the_number_of_a_line_along_the_side_of_the_map_stands_beside_that_side() -> None:
    cells = np.zeros((80, 80), dtype=np.int8)
    grid = OccupancyGrid(cells=cells, resolution_m=0.1, origin=Pose(31.0, 51.0))
    picture = draw_map(grid)
    area = picture.view.area
    assert picture.view.area_corners().min(axis=0).tolist() == pytest.approx([30.0, 50.0])
    beside = find_text(picture, "50", NUMBER_SIZE_PX)
    assert {u < area.left or u > area.right for u, _ in beside} == {True}
    below = find_text(picture, "30", NUMBER_SIZE_PX)
    assert {v < area.top or v > area.bottom for _, v in below} == {True}


def test_marks_in_one_place_share_a_label_that_names_them_all() -> None:
    place = Point(104.0, 203.0)
    marks = tuple(
        Mark(point=place, label=label, shape=Shape.DIAMOND) for label in ("W11", "W44", "W77")
    )
    picture = draw_map(FLOOR, layers=MapLayers(marks=marks))
    places = [place_of(picture, mark.label) for mark in marks]
    assert len({v for _, v in places}) == 1
    gaps = [second[0] - first[0] for first, second in itertools.pairwise(places)]
    width = text_patch("W44", LABEL_SIZE_PX).shape[1]
    assert all(width + 4 < gap < width + 12 for gap in gaps)


def test_many_marks_in_one_place_share_a_label_of_several_lines() -> None:
    marks = tuple(Mark(point=Point(104.0, 203.0), label=f"W{n}") for n in range(10, 20))
    picture = draw_map(FLOOR, layers=MapLayers(marks=marks))
    places = [place_of(picture, mark.label) for mark in marks]
    assert 2 <= len({v for _, v in places}) <= 5
    assert picture.labels_left_out == ()


def test_marks_a_symbol_apart_keep_labels_of_their_own() -> None:
    view = draw_map(FLOOR).view
    apart_m = 24 / view.pixels_per_m
    marks = tuple(
        Mark(point=Point(104.0, 202.0 + n * apart_m), label=f"W{10 + n}") for n in range(4)
    )
    picture = draw_map(FLOOR, layers=MapLayers(marks=marks))
    pixels = view.fractional_pixels_at(np.array([[mark.point.x, mark.point.y] for mark in marks]))
    for mark, (u, v) in zip(marks, pixels, strict=True):
        label_u, label_v = place_of(picture, mark.label)
        assert math.hypot(label_u - u, label_v - v) < 40


def test_a_shared_label_without_room_is_named_mark_by_mark() -> None:
    marks = tuple(
        Mark(point=Point(100.5, 200.5), label=f"a long name of place {n}") for n in range(10, 40)
    )
    grid = OccupancyGrid(
        cells=np.zeros((20, 20), dtype=np.int8), resolution_m=0.05, origin=Pose(100.0, 200.0)
    )
    picture = draw_map(grid, layers=MapLayers(marks=marks), max_edge_px=320)
    assert set(picture.labels_left_out) <= {mark.label for mark in marks}
    assert picture.labels_left_out


@settings(max_examples=4)
@example(seed=182)  # the line to a label crosses another symbol
@given(seed=st.integers(0, 1000))
def test_no_label_covers_another_or_a_symbol(seed: int) -> None:
    generator = np.random.default_rng(seed)
    kinds = [
        (Shape.SQUARE, Colour.ORANGE),
        (Shape.TRIANGLE, Colour.GREEN),
        (Shape.DIAMOND, Colour.BLUE),
    ]
    marks = tuple(
        Mark(
            point=Point(*(np.array([100.3, 200.3]) + generator.uniform(0, 1, 2) * [7.4, 5.4])),
            label=f"{'DFW'[n % 3]}{n}",
            shape=kinds[n % 3][0],
            colour=kinds[n % 3][1],
        )
        for n in range(10, 50)
    )
    labels = np.broadcast_to(1 + np.arange(160) // 80, (120, 160)).astype(np.uint16)
    regions = (PictureRegion(label=1, text="R1 24.0 m2"), PictureRegion(label=2, text="R2 24.0 m2"))
    layers = MapLayers(regions=RegionLayer(labels, regions), marks=marks, robot=Pose(104.0, 203.0))
    picture = draw_map(FLOOR, layers=layers, max_edge_px=500)
    for mark in marks:
        n_whole = len(find_text(picture, mark.label, LABEL_SIZE_PX))
        assert n_whole == int(mark.label not in picture.labels_left_out)
    points = np.array([[mark.point.x, mark.point.y] for mark in marks])
    pixels = picture.view.fractional_pixels_at(points)
    robot = picture.view.fractional_pixels_at(np.array([[104.0, 203.0]]))
    for number, mark in enumerate(marks):
        others = np.vstack([np.delete(pixels, number, axis=0), robot])
        if np.hypot(*(others - pixels[number]).T).min() > 24:
            u, v = np.floor(pixels[number]).astype(int)
            assert is_colour(pixels_of(picture)[v, u], full_colour(mark.colour))


def test_a_room_keeps_its_label_inside_though_it_is_full_of_marks() -> None:
    labels = np.zeros((120, 160), dtype=np.uint16)
    labels[20:100, 20:140] = 1
    generator = np.random.default_rng(5)
    marks = tuple(
        Mark(point=Point(101.2 + 5.6 * x, 201.2 + 3.6 * y), label=f"F{n}", shape=Shape.TRIANGLE)
        for n, (x, y) in enumerate(generator.uniform(0, 1, (45, 2)), start=10)
    )
    layer = RegionLayer(labels, (PictureRegion(label=1, text="R1"),))
    picture = draw_map(FLOOR, layers=MapLayers(regions=layer, marks=marks))
    x, y = picture.view.points_at(np.array([place_of(picture, "R1")]))[0]
    assert 101.0 < x < 107.0
    assert 201.0 < y < 205.0


def test_a_cross_has_two_diagonal_arms() -> None:
    place = Point(104.0, 203.0)
    cross = Mark(point=place, label="", shape=Shape.CROSS, colour=Colour.PURPLE)
    picture = draw_map(FLOOR, layers=MapLayers(marks=(cross,)))
    centre = picture.view.fractional_pixels_at(np.array([[place.x, place.y]]))[:, ::-1].round()
    is_cross = is_colour(pixels_of(picture), full_colour(Colour.PURPLE))
    arms = np.array([[5, 5], [5, -6], [-6, 5], [-6, -6]]) + centre.astype(int)
    beside = np.array([[0, 7], [0, -8], [7, 0], [-8, 0]]) + centre.astype(int)
    assert is_cross[arms[:, 0], arms[:, 1]].all()
    assert not is_cross[beside[:, 0], beside[:, 1]].any()
