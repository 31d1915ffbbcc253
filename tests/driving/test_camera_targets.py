"""Where to stop for pictures: each spot shows what it can once."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.driving.exploration.camera import find_camera_target, is_shown
from mapspeak.driving.exploration.trips import Target
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import SemanticMap
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.fieldofview import CameraView
from mapspeak.spatial.frontiers import Frontier
from mapspeak.worldmodel.model import WorldModel

HALF_VIEW_RAD = math.radians(42.5)
MOST_STOPS = 40


def rough_corridor(seed: int) -> OccupancyGrid:
    """Draw a corridor of 19.5 m between walls as a laser draws them, a cell to and fro."""
    random_ = np.random.default_rng(seed)
    cells = np.full((50, 400), 100, dtype=np.int8)
    for col, (low, high) in enumerate(random_.integers(0, 2, (390, 2)).tolist(), start=5):
        cells[10 + low : 40 - high, col] = 0
    return OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(0.013, 0.027, 0.0))


@pytest.mark.parametrize("seed", range(4))
def test_no_spot_is_looked_at_from_twice_the_same_way(seed: int) -> None:
    grid, off = rough_corridor(seed), np.random.default_rng(seed)
    robot, views = Pose(3.5, 1.25, 0.0), list[CameraView]()
    for _ in range(MOST_STOPS):
        world = WorldModel(grid, robot, SemanticMap(), radius_m=0.2)
        target = find_camera_target(world, views, (), is_closed=lambda _: False)
        if target is None:
            break
        x, y, yaw_rad = target.pose.x, target.pose.y, target.pose.yaw_rad
        for view in views:
            is_near = view.pose.point.distance_to(target.pose.point) < 0.1
            assert not (is_near and abs(wrap_angle(yaw_rad - view.pose.yaw_rad)) < 0.2)
        # A robot arrives as well as it can.
        dx, dy, turn_rad = off.uniform(-0.03, 0.03, 3).tolist()
        robot = Pose(x + dx, y + dy, yaw_rad + turn_rad)
        views.append(CameraView(robot, HALF_VIEW_RAD))
    else:
        pytest.fail("there is always another stop")


NICHE_BEHIND = """
    #####????????????????????????????????????????????????????
    #...#????????????????????????????????????????????????????
    #...#????????????????????????????????????????????????????
    #...#????????????????????????????????????????????????????
    #...#????????????????????????????????????????????????????
    #...#????????????????????????????????????????????????????
    #...#????????????????????????????????????????????????????
    #...#################################################????
    #....................................................????
    #....................................................????
    #....................................................????
    #....................................................????
    #####################################################????
"""


@pytest.mark.parametrize(("x", "is_niche_first"), [(5.0, True), (11.5, False)])
def test_what_lies_behind_is_looked_at_before_the_robot_goes_on_where_that_is_the_shorter_way(
    x: float, *, is_niche_first: bool
) -> None:
    grid = grid_from_text(NICHE_BEHIND, resolution_m=0.25)
    views = [CameraView(Pose(x, 0.75, 0.0), math.pi), CameraView(Pose(5.0, 0.75, 0.0), math.pi)]
    world = WorldModel(grid, Pose(x, 0.75, 0.0), SemanticMap(), radius_m=0.2)
    frontiers = world.frontiers.frontiers
    target = find_camera_target(world, views, frontiers, is_closed=lambda _: False)
    # Without a stop, too, the frontiers come first.
    assert (target is not None and target.frontier is None) is is_niche_first


CORNERS_UNSEEN = """
    ###################
    #.................#
    #.................#
    #.................#
    #.................#
    #.................#
    #?????.......?????#
    #?????.......?????#
    #######.....#######
    #.................#
    #.................#
    #.................#
    #.................#
    ###################
"""


def test_a_corner_in_which_nobody_has_looked_is_worth_a_picture_where_no_frontier_leads_there() -> (
    None
):
    grid = grid_from_text(CORNERS_UNSEEN, resolution_m=0.2)
    views = [CameraView(Pose(x, 0.5, 0.0), math.pi) for x in (0.5, 1.3, 1.9, 2.5, 3.3)]
    world = WorldModel(grid, Pose(1.9, 1.3, 0.0), SemanticMap(), radius_m=0.15)

    def find(frontiers: Sequence[Frontier]) -> Target | None:
        return find_camera_target(world, views, frontiers, is_closed=lambda _: False)

    target = find(())
    assert target is not None
    assert target.pose.y > 1.4
    assert find(world.frontiers.frontiers) is None


NICHE_AT_THE_END = """
    #####################################################
    #...#################################################
    #...#################################################
    #...#################################################
    #...................................................#
    #...................................................#
    #...................................................#
    #...................................................#
    #####################################################
"""


@pytest.mark.parametrize(("x", "is_worth_it"), [(12.5, False), (2.0, True)])
def test_the_robot_does_not_drive_far_for_little_new_wall(x: float, *, is_worth_it: bool) -> None:
    grid = grid_from_text(NICHE_AT_THE_END, resolution_m=0.25)
    views = [CameraView(Pose(at, 0.75, 0.0), math.pi) for at in (3.0, 8.0, 12.5)]
    world = WorldModel(grid, Pose(x, 0.75, 0.0), SemanticMap(), radius_m=0.2)
    target = find_camera_target(world, views, (), is_closed=lambda _: False)
    assert (target is not None) is is_worth_it


def test_a_stop_is_for_nothing_once_pictures_from_elsewhere_show_its_walls() -> None:
    grid = grid_from_text(NICHE_AT_THE_END, resolution_m=0.25)
    views = [CameraView(Pose(at, 0.75, 0.0), math.pi) for at in (3.0, 8.0, 12.5)]
    world = WorldModel(grid, Pose(4.0, 0.75, math.pi), SemanticMap(), radius_m=0.2)
    stop = Point(0.9, 1.6)
    assert not is_shown(world, views, (), stop)
    across = CameraView(Pose(1.2, 0.75, math.radians(110.0)), math.radians(60.0))
    assert is_shown(world, [*views, across], (), stop)
