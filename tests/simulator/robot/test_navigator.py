"""The robot's own navigation on maps drawn as text, in worlds that are as the map says."""

import math

import numpy as np
import pytest

from causes import quote_of
from drawing import grid_from_text
from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, GoalStatus
from mapspeak.simulator.robot.controller import Obstacles
from mapspeak.simulator.robot.lidar import LidarScan, measure_ranges
from mapspeak.simulator.robot.navigator import Navigator, Senses
from mapspeak.simulator.robot.physics import RobotBody
from mapspeak.simulator.worlds.slices import Slice
from mapspeak.spatial import OccupancyGrid

TICK_S = 0.05

TWO_ROOMS = """
    #####################
    #.........#.........#
    #.........#.........#
    #.........#.........#
    #...................#
    #...................#
    #.........#.........#
    #.........#.........#
    #.........#.........#
    #####################
"""
CLOSED_ROOMS = TWO_ROOMS.replace("#...................#", "#.........#.........#")


def draw(text: str) -> OccupancyGrid:
    """Reads a drawing with half a metre to each sign as a map with cells of 5 cm."""
    rough = grid_from_text(text, resolution_m=0.5)
    return OccupancyGrid(cells=np.kron(rough.cells, np.ones((10, 10), np.int8)), resolution_m=0.05)


def solids_of(text: str) -> Slice:
    rows, cols = np.nonzero(grid_from_text(text).occupied)
    square = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
    corners = 0.5 * np.stack([cols, rows], axis=1)
    return Slice(tuple(square + corner for corner in corners))


class Course:
    """A robot that knows its pose and a map, in a world that may differ from the map."""

    def __init__(self, text: str, start: Pose, *, known: str | None = None) -> None:
        self.grid = draw(known or text)
        self.solids = solids_of(text)
        self.body = RobotBody(self.solids, start)
        self.navigator = Navigator()
        self.now_s = 0.0

    def step(self) -> None:
        scan = LidarScan(measure_ranges(self.solids.edges, self.body.world_from_base), self.now_s)
        senses = Senses(
            now_s=self.now_s,
            pose=self.body.world_from_base,
            speed_mps=self.body.velocity.speed_mps,
            obstacles=Obstacles(scan.points_in_base),
            map=self.grid,
        )
        self.body.move(self.navigator.steer(senses), TICK_S)
        self.now_s += TICK_S

    def drive_to(self, goal: Pose, *, timeout_s: float = 90.0) -> GoalStatus:
        self.navigator.start(goal)
        while self.navigator.is_driving and self.now_s < timeout_s:
            self.step()
        return self.navigator.status


@pytest.mark.parametrize("yaw_rad", [0.0, 2.5, -1.5, math.pi])
def test_a_drive_through_a_door_ends_on_the_goal_with_its_heading(yaw_rad: float) -> None:
    course = Course(TWO_ROOMS, Pose(1.5, 1.5, 1.0))
    goal = Pose(9.0, 4.0, yaw_rad)

    status = course.drive_to(goal)

    assert status.state is GoalState.ARRIVED
    assert course.body.world_from_base.point.distance_to(goal.point) <= 0.15
    turn_left = math.remainder(course.body.world_from_base.yaw_rad - yaw_rad, math.tau)
    assert abs(turn_left) <= 0.1
    assert (course.body.n_collisions, status.n_recoveries) == (0, 0)


def test_the_robot_keeps_off_the_walls_that_it_passes() -> None:
    course = Course(TWO_ROOMS, Pose(1.5, 1.5))
    course.navigator.start(Pose(9.0, 1.5))
    nearest = math.inf
    while course.navigator.is_driving:
        course.step()
        nearest = min(nearest, course.solids.distance_to(course.body.world_from_base.point))

    assert nearest > 0.33


def test_a_goal_where_the_robot_already_stands_is_reached_by_turning() -> None:
    course = Course(TWO_ROOMS, Pose(2.0, 2.0, 0.0))

    status = course.drive_to(Pose(2.0, 2.0, 2.0))

    assert status.state is GoalState.ARRIVED
    assert course.body.driven_m < 0.05


@pytest.mark.parametrize(
    ("goal", "reason"),
    [
        (Pose(9.0, 2.0), "No way"),
        (Pose(5.2, 4.0), "does not fit"),
        (Pose(0.6, 2.0), "does not fit"),
        (Pose(50.0, 2.0), "knows nothing"),
    ],
)
def test_a_goal_that_cannot_be_reached_is_blocked_at_once_with_the_reason(
    goal: Pose, reason: str
) -> None:
    course = Course(CLOSED_ROOMS, Pose(2.0, 2.0))

    status = course.drive_to(goal)

    assert status.state is GoalState.BLOCKED
    assert reason in quote_of(status)
    assert course.body.driven_m == 0


def test_unknown_floor_is_not_driven_over() -> None:
    course = Course(
        TWO_ROOMS,
        Pose(2.0, 2.0),
        known=TWO_ROOMS.replace("#...................#", "#.........?.........#"),
    )

    assert course.drive_to(Pose(9.0, 2.0)).state is GoalState.BLOCKED


def test_a_door_that_is_shut_against_the_map_blocks_the_drive_without_a_collision() -> None:
    course = Course(CLOSED_ROOMS, Pose(2.0, 2.0), known=TWO_ROOMS)

    status = course.drive_to(Pose(9.0, 2.0))

    assert status.state is GoalState.BLOCKED
    assert status.n_recoveries > 0
    assert "no progress" in quote_of(status)
    assert course.body.n_collisions == 0


def test_a_map_that_changes_on_the_way_makes_the_robot_plan_anew() -> None:
    detour = """
        #####################
        #...................#
        #...................#
        #.........#.........#
        #.........#.........#
        #.........#.........#
        #.........#.........#
        #...................#
        #...................#
        #####################
    """
    shut_below = """
        #####################
        #...................#
        #...................#
        #.........#.........#
        #.........#.........#
        #.........#.........#
        #.........#.........#
        #.........#.........#
        #.........#.........#
        #####################
    """
    course = Course(shut_below, Pose(2.0, 1.0), known=detour)
    course.navigator.start(Pose(9.0, 1.0))
    for _ in range(60):
        course.step()
    course.grid = draw(shut_below)
    while course.navigator.is_driving and course.now_s < 90:
        course.step()

    assert course.navigator.status.state is GoalState.ARRIVED
    assert course.navigator.status.n_recoveries == 0


def test_a_robot_that_stands_too_near_to_a_wall_drives_away_from_it() -> None:
    course = Course(TWO_ROOMS, Pose(0.5 + 0.285, 2.0, math.pi))

    status = course.drive_to(Pose(3.0, 2.0))

    assert status.state is GoalState.ARRIVED
    assert course.body.n_collisions == 0


def test_a_drive_that_is_given_up_ends_with_the_reason_and_stands() -> None:
    course = Course(TWO_ROOMS, Pose(2.0, 2.0))
    course.navigator.start(Pose(9.0, 2.0))
    course.step()

    course.navigator.give_up(GoalState.CANCELLED, "Enough.")

    assert course.navigator.status.state is GoalState.CANCELLED
    assert quote_of(course.navigator.status) == "Enough."
    assert not course.navigator.is_driving


def test_the_distance_left_shrinks_to_nothing() -> None:
    course = Course(TWO_ROOMS, Pose(1.5, 2.4))
    course.navigator.start(Pose(9.0, 2.4))
    left = []
    while course.navigator.is_driving:
        course.step()
        left.append(course.navigator.status.distance_left_m)

    distances = [distance for distance in left if distance is not None]
    assert distances[0] == pytest.approx(7.5, abs=0.3)
    assert distances[-1] < 0.2
    assert distances == sorted(distances, reverse=True)


NOOK = """
    ###############
    #....#........#
    #.............#
    #.............#
    #....#........#
    ###############
"""


@pytest.mark.parametrize(("n_cells", "state"), [(10, GoalState.ARRIVED), (6, GoalState.BLOCKED)])
def test_a_robot_gets_out_of_a_nook_by_a_gap_that_its_map_shows_a_cell_too_narrow(
    n_cells: int, state: GoalState
) -> None:
    course = Course(NOOK, Pose(1.5, 1.5))
    cells = course.grid.cells.copy()
    cells[20 : 30 - n_cells // 2, 50:60] = cells[30 + n_cells // 2 : 40, 50:60] = 100
    course.grid = OccupancyGrid(cells=cells, resolution_m=0.05)

    assert course.drive_to(Pose(5.0, 1.5)).state is state
    assert course.body.n_collisions == 0
