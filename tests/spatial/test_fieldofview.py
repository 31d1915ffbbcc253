"""Which walls pictures show, and what a heading adds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.fieldofview import (
    N_RAYS,
    CameraView,
    heading_of,
    look_all_around,
    mask_pictured,
    measure_pictured,
    ray_at,
)

ROOM = grid_from_text(
    """
    ####################
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    ####################
    """,
    resolution_m=0.2,
)
HALF_OPEN = grid_from_text(
    """
    ##########??????????
    #.........??????????
    #.........??????????
    #.........??????????
    ##########??????????
    """,
    resolution_m=0.2,
)
TWO_SIDES = grid_from_text(
    """
    ###########
    #....#....#
    #....#....#
    #....#....#
    #.........#
    ###########
    """,
    resolution_m=0.5,
)
MIDDLE = Point(2.0, 0.7)
AT_MIDDLE = np.array([[2.0, 0.7]])


def test_a_turn_all_around_shows_every_wall() -> None:
    views = [CameraView(Pose(2.0, 0.7, yaw)) for yaw in np.arange(0.0, math.tau, math.radians(50))]
    assert measure_pictured(ROOM, mask_pictured(ROOM, views), AT_MIDDLE) == 1.0


def test_without_pictures_no_wall_is_pictured() -> None:
    assert measure_pictured(ROOM, mask_pictured(ROOM, []), AT_MIDDLE) == 0.0


def test_a_picture_of_one_side_leaves_the_other_sides_to_be_pictured() -> None:
    view = CameraView(Pose(2.0, 0.7, 0.0))
    new_m = look_all_around(ROOM, MIDDLE).wall_m_by_heading(
        view.half_view_rad, but=mask_pictured(ROOM, [view])
    )
    assert new_m[ray_at(0.0)] == pytest.approx(0.0, abs=0.2)
    assert new_m[ray_at(math.pi)] > 1.0


def test_the_two_sides_of_a_wall_are_two_walls() -> None:
    view = CameraView(Pose(1.25, 1.75, 0.0))
    from_behind = look_all_around(TWO_SIDES, Point(4.25, 1.75))
    new_m = from_behind.wall_m_by_heading(math.radians(45), but=mask_pictured(TWO_SIDES, [view]))
    assert new_m[ray_at(math.pi)] >= 1.0


def test_rays_into_the_unknown_meet_no_wall() -> None:
    around = look_all_around(HALF_OPEN, Point(1.0, 0.5))
    assert around.is_open[ray_at(0.0)]
    assert not around.is_open[ray_at(math.pi)]


@given(st.integers(0, N_RAYS - 1))
def test_a_heading_and_its_ray_are_one(ray: int) -> None:
    assert ray_at(heading_of(ray)) == ray


@given(st.floats(-math.pi, math.pi), st.floats(0.4, 1.5))
def test_what_a_picture_shows_is_what_a_picture_there_would_add(yaw: float, half: float) -> None:
    pose = Pose(2.0, 0.7, yaw)
    promised_m = look_all_around(ROOM, MIDDLE).wall_m_by_heading(half)[ray_at(yaw)]
    left = mask_pictured(ROOM, [CameraView(pose, half)])
    left_m = look_all_around(ROOM, MIDDLE).wall_m_by_heading(half, but=left)[ray_at(yaw)]
    assert left_m < promised_m / 2


def test_a_wall_is_pictured_whole_between_rays_that_graze_it() -> None:
    cells = np.full((30, 170), 100, dtype=np.int8)
    cells[2:28, 2:168] = 0
    corridor = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(0.0, 0.0, 0.0))
    shown = mask_pictured(corridor, [CameraView(Pose(0.5, 0.8, 0.0))])
    assert shown[2, 40:150].all()


def test_a_grazed_wall_is_not_pictured_across_a_niche() -> None:
    cells = np.full((30, 170), 100, dtype=np.int8)
    cells[12:28, 2:168] = 0
    cells[2:12, 90:104] = 0
    corridor = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(0.0, 0.0, 0.0))
    shown = mask_pictured(corridor, [CameraView(Pose(0.5, 1.3, 0.0))])
    assert shown[12, 40:88].all()
    assert not shown[2:10, 90:102].any()
