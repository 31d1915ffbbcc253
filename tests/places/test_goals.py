import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.places.goalcheck import GoalCheck, GoalVerdict, check_goal, say_check, say_instead
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.paths import distances_from

FLAT = """
    ############????
    #.....#....#????
    #.....#....#????
    #..........#????
    #.....#....#????
    #.....#....#####
    ############...#
               #...#
               #####
    """
RADIUS_M = 0.4


def check(goal: Pose, *, text: str = FLAT, origin: Pose | None = None) -> GoalCheck:
    """Judges a goal for a robot that stands in the left room of the flat."""
    grid = grid_from_text(text, resolution_m=0.5, origin=origin)
    robot = (origin or Pose(0.0, 0.0)).transform(Point(1.25, 2.25))
    return check_goal(grid, distances_from(grid, robot, radius_m=RADIUS_M), goal)


TABLE = """
    ????????????????
    ?##############?
    ?#............#?
    ?#..####......#?
    ?#..#??#...##.#?
    ?#..#??#...#?.#?
    ?#..####...##.#?
    ?#............#?
    ?##############?
    ????????????????
    """


def test_the_unseen_inside_of_a_table_is_an_obstacle_and_no_space_to_explore() -> None:
    assert check(Pose(2.75, 2.75), text=TABLE).verdict is GoalVerdict.OCCUPIED
    assert check(Pose(6.25, 2.25), text=TABLE).verdict is GoalVerdict.UNKNOWN
    assert check(Pose(0.25, 2.25), text=TABLE).verdict is GoalVerdict.UNKNOWN


def test_a_goal_in_the_open_is_fine_and_says_how_far_it_is() -> None:
    found = check(Pose(4.75, 2.75, 1.0))
    assert found.is_ok
    assert found.nearest is None
    assert found.path_m == pytest.approx(3.7, abs=0.2)
    assert found.clearance_m == pytest.approx(1.0)
    assert (
        say_check(found) == "(4.75, 2.75) is 3.7 m away by path, 1.00 m from the nearest obstacle."
    )


@pytest.mark.parametrize(
    ("goal", "verdict", "says"),
    [
        (Pose(math.nan, 1.0), GoalVerdict.NOT_FINITE, "not a valid goal"),
        (Pose(1.0, math.inf), GoalVerdict.NOT_FINITE, "not a valid goal"),
        (Pose(1.0, 1.0, math.nan), GoalVerdict.NOT_FINITE, "not a valid goal"),
        (Pose(1e300, 1.0), GoalVerdict.NOT_FINITE, "not a valid goal"),
        (Pose(-3.0, 2.0), GoalVerdict.OFF_MAP, "spans x 0.0 to 8.0, y 0.0 to 4.5"),
        (Pose(7.0, 3.5), GoalVerdict.UNKNOWN, "unexplored space"),
        (Pose(3.25, 3.75), GoalVerdict.OCCUPIED, "in a wall"),
        (Pose(6.75, 0.75), GoalVerdict.UNREACHABLE, "as wide as the robot, 0.80 m"),
    ],
)
def test_a_bad_goal_is_refused_with_the_reason(goal: Pose, verdict: GoalVerdict, says: str) -> None:
    found = check(goal)
    assert found.verdict is verdict
    assert says in say_check(found)
    assert found.path_m is None


def test_a_goal_nearer_to_a_wall_than_the_robots_radius_is_too_tight() -> None:
    cells = np.zeros((60, 60), np.int8)
    cells[:, 0] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    distances = distances_from(grid, Point(2.0, 2.0), radius_m=0.3)
    found = check_goal(grid, distances, Pose(0.125, 1.025, 0.5))
    assert found.verdict is GoalVerdict.TOO_TIGHT
    assert "0.10 m from the nearest obstacle; the robot needs 0.30 m" in say_check(found)
    assert found.nearest is not None
    assert (found.nearest.x, found.nearest.y) == pytest.approx((0.375, 1.025))
    assert found.nearest.yaw_rad == 0.5


def test_a_goal_inside_a_wall_is_refused_with_the_nearest_free_pose() -> None:
    found = check(Pose(0.25, 2.75))
    assert found.nearest is not None
    assert (found.nearest.x, found.nearest.y) == pytest.approx((0.75, 2.75))


def test_the_nearest_pose_is_the_nearest_as_the_crow_flies_with_how_far_it_is() -> None:
    text = """
        ###########
        #....#....#
        #....#....#
        #....#....#
        #....#.####
        #....#.#..#
        #.......#.#
        ###########
        """
    beyond_the_wall = Pose(4.25, 1.25)
    found = check(beyond_the_wall, text=text)
    assert found.verdict is GoalVerdict.UNREACHABLE
    assert found.nearest is not None
    assert (found.nearest.x, found.nearest.y) == pytest.approx((3.75, 0.75))
    assert "0.7 m off" in say_instead(found)[0]


def test_the_nearest_pose_may_lie_beyond_what_nobody_has_seen() -> None:
    text = """
        #########
        #....???#
        #....???#
        #....???#
        #########
        """
    grid = grid_from_text(text, resolution_m=0.5)
    distances = distances_from(grid, Point(1.25, 1.25), radius_m=0.5)
    found = check_goal(grid, distances, Pose(3.75, 1.25))
    assert found.verdict is GoalVerdict.UNKNOWN
    assert found.nearest is not None
    assert (found.nearest.x, found.nearest.y) == pytest.approx((2.25, 1.25))


def test_a_goal_off_the_map_is_answered_with_a_place_on_it() -> None:
    found = check(Pose(-40.0, 2.75))
    assert found.verdict is GoalVerdict.OFF_MAP
    assert found.nearest is not None
    assert (found.nearest.x, found.nearest.y) == pytest.approx((0.75, 2.75))


def test_in_a_thin_wall_the_side_that_can_be_reached_counts() -> None:
    cells = np.zeros((40, 60), np.int8)
    cells[:, 30:32] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    distances = distances_from(grid, Point(2.5, 1.0), radius_m=0.2)
    found = check_goal(grid, distances, Pose(1.51, 1.025))
    assert found.nearest is not None
    assert found.nearest.x == pytest.approx(1.825)


def test_there_is_no_nearest_pose_where_the_robot_cannot_move_at_all() -> None:
    grid = grid_from_text("###\n#.#\n###")
    distances = distances_from(grid, Point(1.5, 1.5), radius_m=5.0)
    assert check_goal(grid, distances, Pose(1.5, 1.5)).nearest is None


def test_a_goal_inside_a_block_gets_the_place_nearest_to_it_wherever_the_map_begins() -> None:
    text = """
        #########
        #.......#
        #..###..#
        #..###..#
        #..###..#
        #.......#
        #########
        """
    for origin in (Pose(0.0, 0.0), Pose(30.0, 40.0), Pose(-30.0, -40.0)):
        goal = origin @ Pose(2.25, 2.3)
        found = check(goal, text=text, origin=origin)
        assert found.verdict is GoalVerdict.OCCUPIED
        assert found.nearest is not None
        assert goal.y < found.nearest.y < goal.y + 1.0


def test_the_same_is_said_on_a_map_with_a_turned_origin() -> None:
    origin = Pose(3.0, -2.0, 2.5)
    plain = check(Pose(0.25, 2.75))
    moved = check(origin @ Pose(0.25, 2.75), origin=origin)
    assert moved.verdict is plain.verdict
    assert plain.nearest is not None
    assert moved.nearest is not None
    expected = origin @ plain.nearest
    assert (moved.nearest.x, moved.nearest.y) == pytest.approx((expected.x, expected.y))


@given(x=st.floats(-2.0, 10.0), y=st.floats(-2.0, 7.0))
@settings(max_examples=60)
def test_the_pose_that_is_offered_instead_is_accepted(x: float, y: float) -> None:
    found = check(Pose(x, y))
    if found.nearest is not None:
        assert check(found.nearest).is_ok


@st.composite
def drawn_maps(draw: st.DrawFn) -> tuple[OccupancyGrid, Point]:
    """A map of any cells, and a robot on free floor."""
    n_cols, n_rows = draw(st.integers(4, 14)), draw(st.integers(3, 10))
    cells = draw(
        st.lists(st.sampled_from("....##?"), min_size=n_cols * n_rows, max_size=n_cols * n_rows)
    )
    robot = draw(st.integers(0, n_cols * n_rows - 1))
    cells[robot] = "."
    lines = ["".join(cells[first : first + n_cols]) for first in range(0, len(cells), n_cols)]
    grid = grid_from_text("\n".join(lines), resolution_m=draw(st.sampled_from([0.05, 0.25, 0.5])))
    row, col = divmod(robot, n_cols)
    return grid, grid.point_at(Cell(n_rows - 1 - row, col))


@given(drawn=drawn_maps(), share_x=st.floats(-0.2, 1.2), share_y=st.floats(-0.2, 1.2))
@settings(max_examples=150)
def test_what_is_offered_passes_the_same_check_and_nothing_as_roomy_is_nearer(
    drawn: tuple[OccupancyGrid, Point], share_x: float, share_y: float
) -> None:
    grid, robot = drawn
    radius_m = 0.8 * grid.resolution_m
    distances = distances_from(grid, robot, radius_m=radius_m)
    goal = Pose(share_x * grid.width_m, share_y * grid.height_m)
    found = check_goal(grid, distances, goal)
    if found.is_ok:
        return
    rows, cols = np.nonzero(grid.free)
    checks = [
        check_goal(grid, distances, Pose(x, y)) for x, y in grid.points_at(rows, cols).tolist()
    ]
    good = [each for each in checks if each.is_ok]
    assert (found.nearest is None) == (not good)
    if found.nearest is None:
        return
    offered = check_goal(grid, distances, found.nearest)
    assert offered.is_ok
    off_m = found.nearest.point.distance_to(goal.point)
    for each in good:
        is_nearer = each.goal.point.distance_to(goal.point) < off_m - 1e-6
        assert not is_nearer or each.clearance_m < offered.clearance_m
        assert each.goal.point.distance_to(goal.point) > off_m - 0.5 - 1e-6


def test_a_pose_is_offered_where_navigation_has_some_room_to_spare() -> None:
    cells = np.zeros((60, 60), np.int8)
    cells[:, 0] = cells[0, :] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    # On the way from the corner a cell has exactly the robot's radius to both walls.
    distances = distances_from(grid, Point(2.0, 2.0), radius_m=0.3)
    found = check_goal(grid, distances, Pose(0.025, 1.025))
    assert found.nearest is not None
    assert check_goal(grid, distances, found.nearest).clearance_m >= 0.32


@pytest.mark.parametrize(
    ("goal", "verdict"),
    [
        (Point(0.975, 0.5), GoalVerdict.OCCUPIED),
        (Point(0.975, 1.5), GoalVerdict.UNKNOWN),
    ],
)
def test_unseen_space_between_the_faces_of_a_wall_is_in_the_wall(
    goal: Point, verdict: GoalVerdict
) -> None:
    cells = np.zeros((40, 40), np.int8)
    cells[:, 18:22] = -1
    cells[:20, 17] = cells[:20, 22] = cells[20:, 17] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    distances = distances_from(grid, Point(0.4, 0.5), radius_m=0.2)
    assert check_goal(grid, distances, Pose(goal.x, goal.y)).verdict is verdict


def test_a_goal_on_the_border_of_two_cells_is_as_clear_as_the_cell_it_is_taken_for() -> None:
    cells = np.zeros((60, 60), dtype=np.int8)
    cells[:, 0] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(8.7, -10.0))
    distances = distances_from(grid, Point(10.5, -8.5), radius_m=0.28)
    for number in range(1, 30):
        x = 8.7 + 0.05 * number
        check = check_goal(grid, distances, Pose(round(x, 2), -8.5))
        assert check.is_ok == (check.clearance_m >= 0.28), check


@pytest.mark.parametrize("goal", [Pose(2.5, 2.5), Pose(-0.02, 1.0), Pose(9.0, 9.0)])
def test_a_goal_inside_a_thing_or_beside_the_map_has_a_nearest_pose_that_works(
    goal: Pose,
) -> None:
    grid = grid_from_text(
        """
        ##########
        #........#
        #........#
        #..####..#
        #..#??#..#
        #..#??#..#
        #..####..#
        #........#
        #........#
        ##########
        """,
        resolution_m=0.5,
    )
    distances = distances_from(grid, Point(1.0, 1.0), radius_m=0.2)
    check = check_goal(grid, distances, goal)
    assert not check.is_ok
    assert check.nearest is not None
    assert distances.is_reachable(check.nearest.point)


def test_a_number_with_hundreds_of_digits_is_not_repeated() -> None:
    grid = grid_from_text("....", resolution_m=0.5)
    distances = distances_from(grid, Point(0.5, 0.2), radius_m=0.0)
    for far in (1e300, -1e308, 1e7):
        check = check_goal(grid, distances, Pose(far, 0.0))
        assert check.verdict is GoalVerdict.NOT_FINITE
        assert len(say_check(check)) < 100


def test_the_nearest_obstacle_is_told_only_as_far_as_all_are_looked_at() -> None:
    cells = np.zeros((400, 400), dtype=np.int8)
    # In the corner of what is looked at, and nearer beyond its side.
    cells[275, 275] = cells[200, 285] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.1)
    robot = Point(20.0, 20.0)
    found = check_goal(grid, distances_from(grid, robot, radius_m=0.2), Pose(20.05, 20.05))
    assert math.isinf(found.clearance_m)
    assert "more than 8 m from any obstacle" in say_check(found)


def test_beside_a_turned_map_no_span_is_told_that_holds_the_goal() -> None:
    grid = grid_from_text(
        "......\n......\n......", resolution_m=1.0, origin=Pose(0, 0, math.pi / 4)
    )
    distances = distances_from(grid, Point(0.0, 1.0), radius_m=0.2)
    beside = check_goal(grid, distances, Pose(-2.0, 0.1))
    assert beside.verdict is GoalVerdict.OFF_MAP
    assert say_check(beside) == "(-2.00, 0.10) lies off the map."
    assert "spans x" in say_check(check_goal(grid, distances, Pose(-9.0, 0.1)))


def test_on_a_fine_map_the_pose_that_is_told_instead_works_to_the_centimetre() -> None:
    cells = np.zeros((60, 80), dtype=np.int8)
    cells[:, :3] = cells[:3] = cells[:, -3:] = cells[-3:] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.01, origin=Pose(1.234, -2.345, 0.9))
    robot = grid.origin.transform(Point(0.4, 0.3))
    distances = distances_from(grid, robot, radius_m=0.1)
    for n in range(40):
        goal = grid.origin.transform(Point(0.02 * n, 0.01))
        near = check_goal(grid, distances, Pose(goal.x, goal.y)).nearest
        assert near is not None
        told = Point(float(f"{near.x:.2f}"), float(f"{near.y:.2f}"))
        assert distances.is_reachable(told)
