"""Where one stands to look at a thing."""

import math

from drawing import grid_from_text
from mapspeak.geometry import Point
from mapspeak.semantic.things import build_sight_map, find_approach
from mapspeak.spatial.paths import distances_from

WITH_CUPBOARD = """
    #########################
    #.........#####.........#
    #.........#####.........#
    #.........#####.........#
    #.........#####.........#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #########################
"""


def test_one_stands_before_a_thing_whose_middle_lies_deep_in_its_own_body() -> None:
    grid = grid_from_text(WITH_CUPBOARD, resolution_m=0.25)
    middle, viewer = Point(3.1, 2.0), Point(3.1, 0.5)
    distances = distances_from(grid, Point(1.0, 0.6), radius_m=0.2)
    pose = find_approach(build_sight_map(grid), distances, middle, [viewer])
    assert pose is not None
    assert pose.y < 1.5
    assert pose.point.distance_to(middle) <= 1.5
    assert math.isclose(pose.yaw_rad, pose.point.bearing_to(middle))
