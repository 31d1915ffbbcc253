import math

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    Colour,
    Line,
    LineStyle,
    MapLayers,
    Mark,
    PictureRegion,
    RegionLayer,
    Shape,
    Zoom,
    draw_map,
)
from mapspeak.spatial.picture.axes import lines_in_view
from mapspeak.spatial.picture.ink import LABEL_SIZE_PX, NUMBER_SIZE_PX
from mapspeak.spatial.picture.marks import (
    FILLS,
    PALETTE,
    FillPart,
)
from mapspeak.spatial.picture.transform import even_spacing_m
from seeing import (
    FREE_RGB,
    WALL_RGB,
    colour_at,
    colours_at,
    find_text,
    full_colour,
    is_colour,
    pixels_of,
)


def floor(
    width_m: float, height_m: float, *, origin: Pose | None = None, resolution_m: float = 0.05
) -> OccupancyGrid:
    shape = (round(height_m / resolution_m), round(width_m / resolution_m))
    return OccupancyGrid(
        cells=np.zeros(shape, dtype=np.int8),
        resolution_m=resolution_m,
        origin=origin or Pose(100.0, 200.0),
    )


def plain(colour: Colour) -> tuple[int, ...]:
    return tuple(PALETTE[FILLS[colour, FillPart.PLAIN]].tolist())


def near(one_px: float, other_px: float) -> bool:
    return abs(one_px - other_px) <= 2


@pytest.mark.parametrize("longest_m", [0.8, 3.0, 9.0, 22.0, 47.0, 180.0, 1234.0])
def test_five_to_fourteen_round_steps_cross_the_longest_side(longest_m: float) -> None:
    spacing_m = even_spacing_m(longest_m)
    assert 5 <= longest_m / spacing_m <= 14
    assert f"{spacing_m:e}"[0] in "125"


def test_numbers_stand_outside_the_map_on_the_lines_they_name() -> None:
    picture = draw_map(floor(12.0, 8.0, origin=Pose(-3.5, 21.25)))
    view = picture.view
    for value in (-2, 0, 2, 4, 6, 8):
        u = view.fractional_pixels_at(np.array([[value, 25.0]]))[0, 0]
        vs = [
            at_v for at_u, at_v in find_text(picture, str(value), NUMBER_SIZE_PX) if near(at_u, u)
        ]
        assert min(vs) < view.area.top < view.area.bottom < max(vs)
    for value in (22, 24, 26, 28):
        v = view.fractional_pixels_at(np.array([[0.0, value]]))[0, 1]
        us = [
            at_u for at_u, at_v in find_text(picture, str(value), NUMBER_SIZE_PX) if near(at_v, v)
        ]
        assert min(us) < view.area.left < view.area.right < max(us)


def test_numbers_of_a_turned_view_name_their_axis() -> None:
    picture = draw_map(floor(12.0, 8.0), up_rad=0.4)
    assert find_text(picture, "x=104", NUMBER_SIZE_PX)
    assert find_text(picture, "y=204", NUMBER_SIZE_PX)


@pytest.mark.parametrize("up_rad", [math.pi / 2, 0.4, -2.0])
@pytest.mark.parametrize("yaw_rad", [0.0, 1.1])
def test_each_line_of_the_grid_lies_on_its_coordinate(up_rad: float, yaw_rad: float) -> None:
    view = draw_map(floor(12.0, 8.0, origin=Pose(-3.0, 4.0, yaw_rad)), up_rad=up_rad).view
    lines = lines_in_view(view, 2.0)
    assert len(lines) > 8
    for line in lines:
        points = view.points_at(line.ends + np.array([view.area.left, view.area.top]))
        assert points[:, "xy".index(line.axis)] == pytest.approx(line.multiple * 2.0)


def test_the_origin_is_marked_where_it_is() -> None:
    picture = draw_map(floor(6.0, 6.0, origin=Pose(-2.0, -1.0)))
    assert colour_at(picture, Point(0.0, 0.0)) == full_colour(Colour.INK)


def test_the_mark_of_the_origin_hides_no_wall() -> None:
    cells = np.zeros((100, 100), dtype=np.int8)
    cells[::3, ::2] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(-2.5, -2.5))
    picture = draw_map(grid)
    points = grid.points_at(*np.nonzero(grid.occupied))
    assert is_colour(colours_at(picture, points), WALL_RGB).all()


def test_an_origin_off_the_map_is_marked_nowhere() -> None:
    picture = draw_map(floor(6.0, 6.0))
    assert not is_colour(picture.view.area_of(pixels_of(picture)), full_colour(Colour.INK)).any()


@pytest.mark.parametrize("shape", [shape for shape in Shape if shape is not Shape.TRIANGLE])
def test_a_mark_covers_its_place_and_its_label_stands_beside_it(shape: Shape) -> None:
    place = Point(104.3, 203.1)
    mark = Mark(point=place, label="W7", shape=shape, colour=Colour.PURPLE)
    picture = draw_map(floor(8.0, 6.0), layers=MapLayers(marks=(mark,)))
    u, v = picture.view.fractional_pixels_at(np.array([[place.x, place.y]]))[0]
    [(label_u, label_v)] = find_text(picture, "W7", LABEL_SIZE_PX)
    assert colour_at(picture, place) == full_colour(Colour.PURPLE)
    assert math.hypot(label_u - u, label_v - v) < 40


def test_labels_of_crowded_marks_are_all_whole() -> None:
    marks = tuple(
        Mark(point=Point(104.0 + 0.02 * n, 203.0 + 0.1 * (n % 3)), label=f"W{n}")
        for n in range(10, 22)
    )
    picture = draw_map(floor(8.0, 6.0), layers=MapLayers(marks=marks))
    assert picture.labels_left_out == ()
    assert all(len(find_text(picture, mark.label, LABEL_SIZE_PX)) == 1 for mark in marks)


def test_a_label_that_finds_no_room_is_named_in_the_result() -> None:
    marks = tuple(Mark(point=Point(101.0, 201.0), label=f"place {n}") for n in range(10, 100))
    picture = draw_map(floor(2.0, 2.0), layers=MapLayers(marks=marks), max_edge_px=320)
    whole = {m.label for m in marks if find_text(picture, m.label, LABEL_SIZE_PX)}
    assert picture.labels_left_out
    assert whole.isdisjoint(picture.labels_left_out)


def test_a_mark_outside_the_part_shown_is_not_drawn() -> None:
    inside = Mark(point=Point(101.0, 201.0), label="W1")
    outside = Mark(point=Point(107.0, 205.0), label="W2", colour=Colour.GREEN)
    picture = draw_map(
        floor(8.0, 6.0),
        layers=MapLayers(marks=(inside, outside)),
        zoom=Zoom(centre=inside.point, radius_m=1.0),
    )
    assert not is_colour(pixels_of(picture), full_colour(Colour.GREEN)).any()


def test_the_robot_is_an_arrow_with_a_white_edge_and_its_pose_in_words() -> None:
    cells = np.full((120, 160), 100, dtype=np.int8)
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(100.0, 200.0))
    robot = Pose(104.0, 203.0, math.pi)
    picture = draw_map(grid, layers=MapLayers(robot=robot))
    is_arrow = is_colour(pixels_of(picture), full_colour(Colour.VERMILION))
    cols = np.flatnonzero(is_arrow.any(axis=0))
    assert np.ptp(cols) >= 18
    assert colour_at(picture, robot.point) == full_colour(Colour.VERMILION)
    _, v = picture.view.pixels_at(np.array([[robot.x, robot.y]]))[0]
    beyond_tip = pixels_of(picture)[v, cols.min() - 2]
    assert beyond_tip.min() > 200
    assert find_text(picture, "robot 104.00, 203.00, 180°", LABEL_SIZE_PX)


def test_a_solid_line_runs_through_its_points() -> None:
    points = (Point(101.0, 201.0), Point(105.0, 201.0), Point(105.0, 205.0))
    line = Line(points=points, colour=Colour.BLUE)
    picture = draw_map(floor(8.0, 6.0), layers=MapLayers(lines=(line,)))
    along = np.array([[x, 201.0] for x in np.linspace(101.1, 104.9, 50)])
    assert is_colour(colours_at(picture, along), full_colour(Colour.BLUE)).all()
    assert colour_at(picture, Point(105.0, 203.0)) == full_colour(Colour.BLUE)


def test_a_dashed_line_has_dashes_and_gaps_of_even_length() -> None:
    line = Line(points=(Point(101.0, 203.0), Point(107.0, 203.0)), style=LineStyle.DASHED)
    picture = draw_map(floor(8.0, 6.0), layers=MapLayers(lines=(line,)))
    along = np.array([[x, 203.0] for x in np.linspace(101.1, 106.9, 800)])
    is_dash = is_colour(colours_at(picture, along), full_colour(Colour.BLUE))
    changes = np.count_nonzero(np.diff(is_dash))
    length_px = 5.8 * picture.view.pixels_per_m
    assert changes == pytest.approx(2 * length_px / 18, abs=3)


def test_a_line_that_leaves_the_picture_is_cut_at_its_side() -> None:
    line = Line(points=(Point(104.0, 203.0), Point(1e7, 203.0)), colour=Colour.GREEN)
    picture = draw_map(floor(8.0, 6.0), layers=MapLayers(lines=(line,)))
    is_line = is_colour(pixels_of(picture), full_colour(Colour.GREEN))
    assert np.flatnonzero(is_line.any(axis=0)).max() < picture.view.area.right
    assert colour_at(picture, Point(107.9, 203.0)) == full_colour(Colour.GREEN)


ROOMS = grid_from_text(
    """
    #####################
    #.........#.........#
    #.........#.........#
    #.........#.........#
    #...................#
    #.........#.........#
    #.........#.........#
    #.........#.........#
    #####################
    """,
    resolution_m=0.5,
    origin=Pose(100.0, 200.0),
)


def two_rooms(*, colour: Colour | None = None, is_hatched: bool = False) -> RegionLayer:
    labels = np.zeros((9, 21), dtype=np.uint16)
    labels[1:-1, 1:10], labels[1:-1, 11:-1] = 3, 8
    right = PictureRegion(label=8, text="C1", colour=colour, is_hatched=is_hatched)
    return RegionLayer(labels, (PictureRegion(label=3, text="R1 12.4 m2"), right))


def test_regions_have_pale_fills_that_differ_from_room_to_room() -> None:
    picture = draw_map(ROOMS, layers=MapLayers(regions=two_rooms()))
    left, right = colour_at(picture, Point(101.3, 201.3)), colour_at(picture, Point(106.3, 201.3))
    assert len({left, right, FREE_RGB}) == 3
    assert min(left + right) > 150


def test_a_region_has_the_colour_it_asks_for() -> None:
    layer = two_rooms(colour=Colour.GREEN)
    picture = draw_map(ROOMS, layers=MapLayers(regions=layer))
    assert colour_at(picture, Point(106.3, 201.3)) == plain(Colour.GREEN)


def test_a_hatched_region_has_darker_lines_in_its_fill() -> None:
    layer = two_rooms(colour=Colour.GREEN, is_hatched=True)
    area = pixels_of(draw_map(ROOMS, layers=MapLayers(regions=layer)))
    hatch = tuple(PALETTE[FILLS[Colour.GREEN, FillPart.HATCH]].tolist())
    n_hatch, n_plain = (np.count_nonzero(is_colour(area, c)) for c in (hatch, plain(Colour.GREEN)))
    assert n_hatch / (n_hatch + n_plain) == pytest.approx(1 / 9, abs=0.03)


def test_walls_and_floor_outside_regions_keep_their_colour() -> None:
    without = draw_map(ROOMS)
    picture = draw_map(ROOMS, layers=MapLayers(regions=two_rooms()))
    points = ROOMS.points_at(*np.nonzero(ROOMS.occupied))
    assert (colours_at(picture, points) == colours_at(without, points)).all()
    assert colour_at(picture, Point(105.25, 202.3)) == FREE_RGB


def test_the_label_of_a_region_stands_inside_it() -> None:
    picture = draw_map(ROOMS, layers=MapLayers(regions=two_rooms()))
    view = picture.view
    [(u, v)] = find_text(picture, "C1", LABEL_SIZE_PX)
    x, y = view.points_at(np.array([[u, v]]))[0]
    assert 105.5 < x < 110.0
    assert 200.5 < y < 204.0


def test_a_region_too_small_for_its_label_is_joined_to_it_by_a_line() -> None:
    cells = np.zeros((100, 100), dtype=np.int8)
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(100.0, 200.0))
    labels = np.zeros((100, 100), dtype=np.uint16)
    labels[50:53, 50:53] = 1
    layer = RegionLayer(labels, (PictureRegion(label=1, text="closet"),))
    picture = draw_map(grid, layers=MapLayers(regions=layer))
    assert find_text(picture, "closet", LABEL_SIZE_PX)
    assert colour_at(picture, Point(102.575, 202.575)) == full_colour(Colour.INK)


def test_regions_of_another_map_are_refused() -> None:
    with pytest.raises(MapError, match=r"\(9, 21\)"):
        draw_map(floor(2.0, 2.0), layers=MapLayers(regions=two_rooms()))


def test_accents_and_signs_the_font_lacks_do_not_break_a_label() -> None:
    mark = Mark(point=Point(104.0, 203.0), label="Küche 厨房")
    picture = draw_map(floor(8.0, 6.0), layers=MapLayers(marks=(mark,)))
    assert find_text(picture, "Kuche ??", LABEL_SIZE_PX)


def test_the_legend_says_what_a_grid_line_is_worth() -> None:
    picture = draw_map(floor(12.0, 8.0))
    assert picture.spacing_m == 2.0
    assert find_text(picture, "grid 2 m", NUMBER_SIZE_PX)
