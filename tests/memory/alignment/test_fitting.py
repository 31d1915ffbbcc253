import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alignment_maps import HOUSE, OTHER_HOUSE, TWIN_HOUSES, fine, moved
from drawing import grid_from_text
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory.alignment.comparing import MapRelation, compare_maps
from mapspeak.memory.alignment.fitting import LEAST_SHARED_M, Certainty, MapFit, find_fit
from mapspeak.memory.alignment.surfaces import MapSurfaces
from mapspeak.spatial import OccupancyGrid


def fit_of(old: OccupancyGrid, new: OccupancyGrid) -> MapFit:
    fit = find_fit(MapSurfaces(old), MapSurfaces(new))
    assert fit is not None
    return fit


def error_of(grid: OccupancyGrid, said: Pose, truth: Pose) -> float:
    """Gives how far apart two motions put the farthest corner of a map, in metres."""
    low, high = grid.bounds()
    corners = [Point(x, y) for x in (low.x, high.x) for y in (low.y, high.y)]
    return max(said.transform(each).distance_to(truth.transform(each)) for each in corners)


MOTIONS = st.builds(
    Pose, st.floats(-40, 40), st.floats(-40, 40), st.floats(-math.pi, math.pi).map(wrap_angle)
)


@settings(max_examples=8)
@given(MOTIONS)
def test_a_map_is_found_again_however_it_was_turned_and_shifted(motion: Pose) -> None:
    house = fine(HOUSE)

    fit = fit_of(house, moved(house, motion))

    assert fit.certainty is Certainty.SURE
    assert error_of(house, fit.new_from_old, motion) < 0.1


@settings(max_examples=3)
@given(MOTIONS)
def test_there_and_back_again_is_where_one_was(motion: Pose) -> None:
    house = fine(HOUSE)
    new = moved(house, motion)

    there, back = fit_of(house, new).new_from_old, fit_of(new, house).new_from_old

    assert error_of(house, back @ there, Pose(0.0, 0.0)) < 0.15


@settings(max_examples=3)
@given(MOTIONS, MOTIONS)
def test_the_fit_turns_with_both_maps(motion: Pose, common: Pose) -> None:
    house = fine(HOUSE)
    new = moved(house, motion)

    plain = fit_of(house, new).new_from_old
    both = fit_of(moved(house, common), moved(new, common)).new_from_old

    assert error_of(house, both @ common, common @ plain) < 0.15


def test_the_same_maps_give_the_same_fit() -> None:
    house = fine(HOUSE)
    new = moved(house, Pose(3.0, -2.0, 1.0))

    assert fit_of(house, new) == fit_of(house, new)


def test_cells_of_another_size_make_no_difference() -> None:
    house, motion = fine(HOUSE), Pose(5.0, 1.0, -2.0)

    fit = fit_of(house, moved(house, motion, resolution_m=0.07))

    assert fit.is_sure_enough
    assert error_of(house, fit.new_from_old, motion) < 0.1


def test_an_origin_that_is_turned_makes_no_difference() -> None:
    house, motion = fine(HOUSE), Pose(5.0, 1.0, -2.0)
    new = OccupancyGrid(cells=house.cells, resolution_m=0.1, origin=motion)

    fit = fit_of(house, new)

    assert error_of(house, fit.new_from_old, motion) < 0.02


def test_half_of_a_building_is_enough() -> None:
    house, motion = fine(HOUSE), Pose(5.0, 1.0, -2.0)
    half = house.crop(slice(0, house.n_rows), slice(0, house.n_cols // 2))

    fit = fit_of(house, moved(half, motion))

    assert fit.is_sure_enough
    assert error_of(house, fit.new_from_old, motion) < 0.1


def test_a_building_that_looks_the_same_from_both_ends_is_ambiguous() -> None:
    twins = fine(TWIN_HOUSES)

    fit = fit_of(twins, moved(twins, Pose(5.0, 1.0, 0.3)))

    assert fit.certainty is Certainty.AMBIGUOUS
    assert not fit.is_sure_enough
    assert fit.rival is not None
    assert fit.rival.agreement_ratio > 0.9


def test_maps_without_walls_have_no_fit() -> None:
    bare = grid_from_text("....\n....")

    assert find_fit(MapSurfaces(bare), MapSurfaces(fine(HOUSE))) is None
    assert find_fit(MapSurfaces(fine(HOUSE)), MapSurfaces(bare)) is None


# --- what a comparison says ------------------------------------------------------------------


def test_a_map_is_the_same_as_itself_grown_and_with_new_furniture() -> None:
    house = fine(HOUSE)
    cells = house.cells.copy()
    cells[40:50, 60:70] = 100
    grown = OccupancyGrid(cells=cells, resolution_m=0.1, origin=house.origin)
    half = house.crop(slice(0, house.n_rows), slice(0, house.n_cols // 2))

    comparison = compare_maps(half, grown)

    assert comparison.relation is MapRelation.SAME
    assert comparison.fit is None


def test_a_map_in_another_frame_has_moved() -> None:
    house = fine(HOUSE)

    comparison = compare_maps(house, moved(house, Pose(3.0, 1.0, math.radians(30))))

    assert comparison.relation is MapRelation.MOVED
    assert comparison.fit is not None
    assert math.degrees(comparison.fit.new_from_old.yaw_rad) == pytest.approx(30.0, abs=0.1)
    assert comparison.fit.certainty is Certainty.SURE


def test_another_building_is_told_apart() -> None:
    comparison = compare_maps(fine(HOUSE), fine(OTHER_HOUSE))

    assert comparison.relation is MapRelation.OTHER


def test_a_symmetric_building_in_another_frame_is_not_decided() -> None:
    twins = fine(TWIN_HOUSES)

    comparison = compare_maps(twins, moved(twins, Pose(5.0, 1.0, 0.3)))

    assert comparison.relation is MapRelation.UNKNOWN


@pytest.mark.parametrize("turned_about", [False, True])
def test_a_map_that_shows_hardly_a_wall_is_not_decided(turned_about: bool) -> None:  # noqa: FBT001
    house, corner = fine(HOUSE), fine(grid_from_text("###\n#..\n#..", resolution_m=0.5))
    pair = (corner, house) if turned_about else (house, corner)

    comparison = compare_maps(*pair)

    assert comparison.relation is MapRelation.UNKNOWN
    assert comparison.fit is None
    assert comparison.shortest_m < LEAST_SHARED_M
