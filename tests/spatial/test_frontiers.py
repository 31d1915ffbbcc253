import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.frontiers import (
    FrontierMerit,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    Tried,
    find_frontiers,
    find_proved_gap,
    remaining_ratio,
)
from mapspeak.spatial.paths import clearance_m, distances_from

RADIUS_M = 0.2
ROOM_WITH_TWO_WAYS_OUT = """
    ????????????????????????????????????
    ????????????????????????????????????
    ####################################
    #...............#??????????????????#
    #...............#??????????????????#
    #...............#??????????????????#
    #...............#??????????????????#
    #..................????????????????#
    #..................????????????????#
    #..................????????????????#
    #...............#??????????????????#
    #...............#??????????????????#
    #...............#??????????????????#
    #...............#??????????????????#
    ######.....#########################
    ??????.....?????????????????????????
    ??????.....?????????????????????????
    ????????????????????????????????????
    ????????????????????????????????????
    ????????????????????????????????????
    """


def find(
    text: str, robot: Point, *, resolution_m: float = 0.2, looked_from: tuple[Point, ...] = ()
) -> FrontierReport:
    grid = grid_from_text(text, resolution_m=resolution_m)
    return find_frontiers(grid, robot, radius_m=RADIUS_M, tried=Tried(looked_from=looked_from))


def reasons(report: FrontierReport) -> set[RefusalReason]:
    return {each.reason for each in report.refused}


def disc(
    shape: tuple[int, int], centre: tuple[int, int], radius: float, *, resolution_m: float = 0.05
) -> OccupancyGrid:
    rows, cols = np.indices(shape)
    is_known = np.hypot(rows - centre[0], cols - centre[1]) <= radius
    cells = np.where(is_known, 0, -1).astype(np.int8)
    return OccupancyGrid(cells=cells, resolution_m=resolution_m)


def test_each_opening_of_a_room_is_one_frontier() -> None:
    report = find(ROOM_WITH_TWO_WAYS_OUT, Point(1.5, 2.5))
    assert report.verdict is FrontierVerdict.SOME_LEFT
    assert [frontier.id for frontier in report.frontiers] == ["F1", "F2"]
    anchors = sorted((f.anchor.x, f.anchor.y) for f in report.frontiers)
    assert anchors[0] == pytest.approx((1.7, 0.7), abs=0.21)
    assert anchors[1] == pytest.approx((3.7, 2.3), abs=0.21)


def test_the_pose_of_a_frontier_is_reachable_clear_of_walls_and_faces_the_unknown() -> None:
    grid = grid_from_text(ROOM_WITH_TWO_WAYS_OUT, resolution_m=0.2)
    robot = Point(1.5, 2.5)
    distances = distances_from(grid, robot, radius_m=RADIUS_M)
    clearances_m = clearance_m(grid)
    for frontier in find_frontiers(grid, robot, radius_m=RADIUS_M).frontiers:
        cell = grid.cell_at(frontier.pose.point)
        assert clearances_m[cell.row, cell.col] >= RADIUS_M
        assert frontier.distance_m == pytest.approx(distances.distance_to(frontier.pose.point))
        ahead = frontier.pose.transform(Point(1.0, 0.0))
        seen = grid.cell_at(ahead)
        assert grid.cells[seen.row, seen.col] == -1


def test_a_frontier_says_its_length_and_what_there_is_to_see() -> None:
    report = find(ROOM_WITH_TWO_WAYS_OUT, Point(1.5, 2.5))
    to_the_east = max(report.frontiers, key=lambda frontier: frontier.anchor.x)
    assert 0.6 <= to_the_east.length_m <= 1.4
    assert 4.0 <= to_the_east.gain_m2 <= 9.0


def test_a_closed_room_has_no_frontier_left() -> None:
    report = find("#####\n#...#\n#...#\n#...#\n#####", Point(0.5, 0.5))
    assert report.verdict is FrontierVerdict.NONE_LEFT
    assert not report.refused


def test_a_map_without_free_floor_says_that_nothing_is_known() -> None:
    assert find("????\n????", Point(0.3, 0.3)).verdict is FrontierVerdict.NOTHING_KNOWN


def test_walls_that_touch_at_a_corner_do_not_leak() -> None:
    text = """
        #########
        #....#???
        #...#????
        #..#?????
        #.#??????
        ##???????
        """
    assert find(text, Point(0.3, 0.7)).verdict is FrontierVerdict.NONE_LEFT


def test_a_frontier_behind_a_wall_is_refused_as_having_no_way() -> None:
    text = """
        ################
        #......#.......?
        #......#.......?
        #......#.......?
        #......#.......?
        ################
        """
    report = find(text, Point(0.7, 0.6))
    assert report.verdict is FrontierVerdict.ALL_REFUSED
    assert reasons(report) == {RefusalReason.NO_WAY}


def test_a_gap_narrower_than_the_robot_is_refused_with_its_width() -> None:
    cells = np.full((60, 120), 100, np.int8)
    cells[1:59, 1:40] = 0
    cells[28:32, 40:80] = 0
    cells[1:59, 80:100] = 0
    cells[1:59, 100:] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    report = find_frontiers(grid, Point(1.0, 1.5), radius_m=RADIUS_M)
    assert reasons(report) == {RefusalReason.TOO_NARROW}
    (gap,) = report.refused
    assert (gap.gap_width_m, gap.needed_width_m) == pytest.approx((0.2, 0.4))


@pytest.mark.parametrize("slit_cells", [3, 5])
def test_a_long_border_seen_through_a_slit_is_refused_for_the_slit(slit_cells: int) -> None:
    cells = np.full((80, 120), -1, np.int8)
    cells[:, :40] = 0
    cells[:, 40] = 100
    cells[[0, -1]] = 100
    cells[:, 0] = 100
    # Through the slit the robot has seen a fan of floor, from the slit itself on.
    for col in range(40, 100):
        half = slit_cells / 2 + (col - 40) * 0.5
        cells[max(round(40 - half), 1) : min(round(40 + half), 79), col] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    report = find_frontiers(grid, Point(1.0, 2.0), radius_m=RADIUS_M)
    assert not report.frontiers
    assert reasons(report) == {RefusalReason.TOO_NARROW}
    assert all(0 < each.gap_width_m < each.needed_width_m for each in report.refused)


def test_speckle_is_refused() -> None:
    cells = np.zeros((80, 80), np.int8)
    cells[[0, -1]] = 100
    cells[:, [0, -1]] = 100
    cells[40, 78:] = -1
    cells[20:23, 76:80] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    report = find_frontiers(grid, Point(1.0, 1.0), radius_m=0.4)
    assert not report.frontiers
    assert reasons(report) <= {RefusalReason.NOTHING_TO_SEE}
    assert report.verdict is FrontierVerdict.ALL_REFUSED


def test_holes_that_beams_have_left_in_a_wall_are_no_frontier_to_go_to() -> None:
    cells = np.full((100, 100), -1, np.int8)
    cells[10:90, 10:90] = 0
    cells[10:90, 90] = cells[10:90, 9] = cells[9, 10:90] = cells[90, 10:90] = 100
    for start in range(14, 86, 9):
        cells[start : start + 4, 90] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    report = find_frontiers(grid, Point(2.5, 2.5), radius_m=RADIUS_M)
    assert not report.frontiers


def test_a_sliver_behind_furniture_does_not_keep_the_robot_busy() -> None:
    cells = np.zeros((100, 100), np.int8)
    cells[[0, -1]] = 100
    cells[:, [0, -1]] = 100
    cells[40:60, 80] = 100
    cells[40:60, 81:99] = np.where(np.arange(18) < 6, -1, 0)
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    report = find_frontiers(grid, Point(1.0, 1.0), radius_m=0.25)
    assert report.verdict is FrontierVerdict.ALL_REFUSED
    assert reasons(report) <= {RefusalReason.NOTHING_TO_SEE}


def test_what_has_been_looked_at_without_success_is_not_offered_again() -> None:
    robot = Point(1.5, 2.5)
    first = find(ROOM_WITH_TWO_WAYS_OUT, robot).frontiers[0]
    again = find(ROOM_WITH_TWO_WAYS_OUT, robot, looked_from=(first.pose.point,))
    assert [each.anchor for each in again.frontiers].count(first.anchor) == 0
    assert again.refused[0].reason is RefusalReason.LOOKED_ALREADY


def test_the_edge_of_the_array_is_a_frontier() -> None:
    text = """
        ##########
        #.........
        #.........
        #.........
        #.........
        ##########
        """
    report = find(text, Point(0.7, 0.6))
    assert len(report.frontiers) == 1
    assert report.frontiers[0].anchor.x == pytest.approx(1.9)
    assert math.cos(report.frontiers[0].pose.yaw_rad) > 0.9


@pytest.mark.parametrize("value", [-1, 100])
def test_a_robot_whose_own_cell_is_not_free_still_gets_frontiers(value: int) -> None:
    grid = disc((160, 160), (80, 80), 40)
    cells = grid.cells.copy()
    cells[78:82, 78:82] = value
    report = find_frontiers(
        OccupancyGrid(cells=cells, resolution_m=0.05), Point(4.0, 4.0), radius_m=RADIUS_M
    )
    assert report.frontiers


@pytest.mark.parametrize("robot", [Point(-50.0, 3.0), Point(6.5, 2.0)])
def test_a_robot_away_from_all_known_floor_is_told_so(robot: Point) -> None:
    report = find(ROOM_WITH_TWO_WAYS_OUT, robot)
    assert report.verdict is FrontierVerdict.NONE_REACHABLE


def test_refusals_are_told_longest_first_and_noise_is_left_out() -> None:
    cells = np.full((120, 200), 100, np.int8)
    cells[2:118, 2:100] = 0
    cells[10:60, 120:140] = 0
    cells[10:60, 140:150] = -1
    cells[80:100, 120:140] = 0
    cells[80:100, 140:150] = -1
    cells[110:114, 120:140] = 0
    cells[110:114, 140:150] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    report = find_frontiers(grid, Point(1.0, 1.0), radius_m=0.1)
    assert [round(each.length_m, 1) for each in report.refused] == [2.5, 1.0]


def test_a_robot_nearer_to_a_wall_than_its_radius_still_gets_frontiers() -> None:
    report = find(ROOM_WITH_TWO_WAYS_OUT, Point(0.21, 2.5))
    assert len(report.frontiers) == 2


def test_a_frontier_all_around_the_robot_is_one_with_a_pose_on_it() -> None:
    grid = disc((200, 200), (100, 100), 50)
    report = find_frontiers(grid, Point(5.0, 5.0), radius_m=RADIUS_M)
    assert len(report.frontiers) == 1
    from_the_middle_m = report.frontiers[0].pose.point.distance_to(Point(5.0, 5.0))
    assert from_the_middle_m == pytest.approx(2.5, abs=0.3)
    ahead = report.frontiers[0].pose.transform(Point(0.5, 0.0))
    assert ahead.distance_to(Point(5.0, 5.0)) > from_the_middle_m


@pytest.mark.parametrize("resolution_m", [0.025, 0.05, 0.1])
def test_frontiers_are_about_the_same_at_any_resolution(resolution_m: float) -> None:
    factor = round(0.2 / resolution_m)
    coarse = grid_from_text(ROOM_WITH_TWO_WAYS_OUT, resolution_m=0.2)
    fine = OccupancyGrid(
        cells=coarse.cells.repeat(factor, axis=0).repeat(factor, axis=1), resolution_m=resolution_m
    )
    report = find_frontiers(fine, Point(1.5, 2.5), radius_m=RADIUS_M)
    south, east = sorted(report.frontiers, key=lambda each: each.anchor.x)
    # The way out to the south has a border on three sides, each cell of which will do.
    assert south.anchor.distance_to(Point(1.7, 0.7)) <= 0.5
    assert east.anchor.distance_to(Point(3.7, 2.3)) <= 0.3
    assert (south.gain_m2, east.gain_m2) == pytest.approx((10.0, 2.8), rel=0.12)
    assert (south.length_m, east.length_m) == pytest.approx((1.7, 1.3), abs=0.15)


def test_the_first_of_two_equal_frontiers_is_the_nearer_one() -> None:
    grid = grid_from_text("?" * 20 + "." * 60 + "?" * 20 + "\n" + "#" * 100, resolution_m=0.1)
    tall = OccupancyGrid(
        cells=np.vstack([grid.cells[0]] + [grid.cells[1]] * 20 + [grid.cells[0]]), resolution_m=0.1
    )
    report = find_frontiers(tall, Point(6.5, 1.0), radius_m=RADIUS_M)
    assert [f.anchor.x > 5.0 for f in report.frontiers] == [True, False]


def test_a_frontier_that_has_been_seen_has_nothing_remaining() -> None:
    grid = grid_from_text(ROOM_WITH_TWO_WAYS_OUT, resolution_m=0.2)
    frontier = max(
        find_frontiers(grid, Point(1.5, 2.5), radius_m=RADIUS_M).frontiers,
        key=lambda each: each.anchor.x,
    )
    assert remaining_ratio(grid, frontier) == pytest.approx(1.0)
    seen = grid.cells.copy()
    seen[:, 17:] = np.where(seen[:, 17:] < 0, 0, seen[:, 17:])
    seen[:6] = 100  # the other way out is in sight of the pose, and would count as well
    grown = OccupancyGrid(
        cells=np.pad(seen, 7, constant_values=-1), resolution_m=0.2, origin=Pose(-1.4, -1.4)
    )
    assert remaining_ratio(grown, frontier) == pytest.approx(0.0, abs=0.05)


@given(seed=st.integers(0, 2**32 - 1), yaw_rad=st.floats(-3.0, 3.0))
@settings(max_examples=8)
def test_frontiers_of_any_map_can_be_driven_to(seed: int, yaw_rad: float) -> None:
    rng = np.random.default_rng(seed)
    coarse = rng.choice([-1, 0, 0, 0, 100], size=(12, 12))
    coarse[5:7, 5:7] = 0
    grid = OccupancyGrid(
        cells=coarse.repeat(6, axis=0).repeat(6, axis=1).astype(np.int8),
        resolution_m=0.1,
        origin=Pose(2.0, -1.0, yaw_rad),
    )
    robot = grid.point_at(Cell(36, 36))
    distances = distances_from(grid, robot, radius_m=RADIUS_M)
    report = find_frontiers(grid, robot, radius_m=RADIUS_M, distances=distances)
    assert all(distances.is_reachable(each.pose.point) for each in report.frontiers)
    for frontier in report.frontiers[:2]:
        assert distances.path_to(frontier.pose.point) is not None
        assert frontier.length_m > 0
        assert frontier.gain_m2 > 0


def test_a_corner_on_the_way_comes_before_what_would_mean_to_come_back() -> None:
    cells = np.full((140, 600), 100, np.int8)
    cells[30:74, 10:520] = 0
    cells[74:79, 200:220] = 0
    cells[79:100, 190:230] = -1
    cells[:, 520:] = -1
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    report = find_frontiers(grid, Point(8.0, 2.0), radius_m=RADIUS_M)
    corner, hall = report.frontiers
    assert (corner.anchor.x, hall.anchor.x) == pytest.approx((10.5, 26.0), abs=0.5)
    assert hall.gain_m2 / hall.distance_m > corner.gain_m2 / corner.distance_m
    assert corner.merits == (FrontierMerit.BEST, FrontierMerit.NEAREST)
    assert corner.detour_m == pytest.approx(0.0)
    assert hall.merits == (FrontierMerit.MOST_PER_METRE,)
    assert hall.detour_m == pytest.approx(15.0, abs=0.5)


GAP_BESIDE_THE_UNKNOWN = """
    ##################################????
    #...............##...............?????
    #...............##...............?????
    #...............##...............?????
    #................................?????
    #................................?????
    #................................?????
    #...............##...............?????
    #...............##...............?????
    #...............##...............?????
    ##################################????
    """


def test_what_lies_behind_a_gap_that_the_robot_did_not_pass_is_not_offered() -> None:
    robot = Point(1.0, 1.0)
    grid = grid_from_text(GAP_BESIDE_THE_UNKNOWN, resolution_m=0.2)
    goal = find_frontiers(grid, robot, radius_m=0.29).frontiers[0].pose.point
    gap = find_proved_gap(distances_from(grid, robot, radius_m=0.29), goal)
    assert gap is not None
    again = find_frontiers(grid, robot, radius_m=0.29, tried=Tried(gaps=(gap,)))
    assert not again.frontiers
    (refused,) = again.refused
    assert refused.reason is RefusalReason.PROVED_NARROW
    assert refused.gap_at == gap.point


TWO_GAPS = """
    ##################################????
    #...............##...............?????
    #...............##...............?????
    #...............##...............?????
    #................................?????
    #................................?????
    #................................?????
    #...............##...............?????
    #...............##...............?????
    #...............##...............?????
    #..........#######################????
    #..........#######################
    #.........................##.....#
    #.........................##.....#
    #................................#
    #................................#
    #................................#
    #.........................##.....#
    #.........................##.....#
    ##################################
    """


def test_of_two_gaps_the_one_before_a_border_is_named_though_the_other_is_nearer() -> None:
    robot = Point(0.6, 3.0)
    grid = grid_from_text(TWO_GAPS, resolution_m=0.2)
    distances = distances_from(grid, robot, radius_m=0.29)
    gaps = [find_proved_gap(distances, goal) for goal in (Point(5.0, 3.0), Point(6.0, 0.9))]
    above, below = (gap for gap in gaps if gap is not None)
    found = find_frontiers(grid, robot, radius_m=0.29, tried=Tried(gaps=(above, below)))
    (refused,) = found.refused
    assert refused.anchor.distance_to(below.point) < refused.anchor.distance_to(above.point)
    assert refused.gap_at == above.point


def test_a_gap_that_the_map_shows_wider_is_tried_again() -> None:
    robot = Point(1.0, 1.0)
    grid = grid_from_text(GAP_BESIDE_THE_UNKNOWN, resolution_m=0.2)
    goal = find_frontiers(grid, robot, radius_m=0.29).frontiers[0].pose.point
    gap = find_proved_gap(distances_from(grid, robot, radius_m=0.29), goal)
    assert gap is not None
    rows = GAP_BESIDE_THE_UNKNOWN.splitlines()
    wider_rows = [*rows[:4], rows[5], *rows[5:8], rows[7], *rows[9:]]
    wider = grid_from_text("\n".join(wider_rows), resolution_m=0.2)
    assert find_frontiers(wider, robot, radius_m=0.29, tried=Tried(gaps=(gap,))).frontiers


def test_a_gap_counts_no_more_for_a_robot_that_is_on_its_other_side() -> None:
    robot = Point(1.0, 1.0)
    grid = grid_from_text(GAP_BESIDE_THE_UNKNOWN, resolution_m=0.2)
    goal = find_frontiers(grid, robot, radius_m=0.29).frontiers[0].pose.point
    gap = find_proved_gap(distances_from(grid, robot, radius_m=0.29), goal)
    assert gap is not None
    beyond = find_frontiers(grid, Point(5.0, 1.0), radius_m=0.29, tried=Tried(gaps=(gap,)))
    assert beyond.frontiers
