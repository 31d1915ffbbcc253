import math
from functools import cached_property

import numpy as np
import pytest

from mapspeak.errors import GoalError
from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, GoalStatus
from mapspeak.simulator import (
    HORIZONTAL_FOV_RAD,
    TICK_S,
    BodyVelocity,
    Simulation,
    World,
    load_world,
)
from mapspeak.simulator.camera.camera import PinholeCamera
from mapspeak.spatial.rooms import RoomClass


@pytest.fixture(scope="module")
def warehouse() -> World:
    return load_world("warehouse")


def drive(simulation: Simulation, goal: Pose, *, timeout_s: float = 60.0) -> GoalStatus:
    goal_id = simulation.start_goal(goal)
    until_s = simulation.time_s + timeout_s
    while simulation.goal_status(goal_id).state is GoalState.DRIVING:
        assert simulation.time_s < until_s
        simulation.step()
    return simulation.goal_status(goal_id)


def step_for(simulation: Simulation, duration_s: float) -> None:
    for _ in range(round(duration_s / TICK_S)):
        simulation.step()


def test_a_new_simulation_has_a_first_map_and_stands_at_its_origin(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)

    assert simulation.time_s == 0
    assert simulation.pose_in_map == Pose(0.0, 0.0, 0.0)
    assert simulation.map().free.sum() * 0.05**2 > 50
    assert simulation.world_name == "warehouse"


def test_each_step_is_one_tick(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)

    step_for(simulation, 1.0)

    assert simulation.time_s == pytest.approx(1.0)
    assert simulation.scan.stamp_s == pytest.approx(1.0)


def test_a_turn_of_the_lidar_was_made_where_slam_took_the_robot_to_be_then(
    warehouse: World,
) -> None:
    simulation = Simulation(warehouse, seed=0)
    simulation.start_goal(Pose(3.0, 0.0))
    for _ in range(8):
        simulation.step()
    at_scan = simulation.pose_in_map
    assert simulation.scan.stamp_s == simulation.time_s
    assert simulation.pose_of_scan.point.distance_to(at_scan.point) < 1e-9

    simulation.step()

    assert simulation.scan.stamp_s < simulation.time_s
    assert simulation.pose_in_map.x > at_scan.x + 0.005
    assert simulation.pose_of_scan.point.distance_to(at_scan.point) < 1e-6


def test_the_map_is_the_same_value_until_slam_has_changed_it(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)
    first = simulation.map()

    step_for(simulation, 3.0)
    assert simulation.map() is first
    simulation.start_goal(Pose(3.0, 0.0))
    step_for(simulation, 2.0)

    assert simulation.map() is not first


def test_a_drive_through_the_warehouse_arrives_without_a_collision(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)

    first = drive(simulation, Pose(5.0, 3.2, 0.0))
    second = drive(simulation, Pose(9.6, 2.6, -1.0))

    assert (first.state, second.state) == (GoalState.ARRIVED, GoalState.ARRIVED)
    truth = simulation.truth
    assert truth.n_collisions == 0
    assert truth.slam_error_m < 0.1
    assert truth.pose.point.distance_to(Pose(9.6, 2.6).point) < 0.25
    assert truth.driven_m > 9


def test_the_same_seed_gives_the_same_run_and_another_one_another(warehouse: World) -> None:
    def run(seed: int) -> tuple[Pose, Pose, np.ndarray[tuple[int, int], np.dtype[np.int8]]]:
        simulation = Simulation(warehouse, seed=seed)
        simulation.start_goal(Pose(3.0, 1.0, 0.5))
        step_for(simulation, 4.0)
        return simulation.pose_in_map, simulation.truth.pose, simulation.map().cells

    first, again, other = run(7), run(7), run(8)

    assert first[:2] == again[:2]
    assert np.array_equal(first[2], again[2])
    assert first[0] != other[0]


def test_a_newer_goal_replaces_the_drive_and_both_can_be_asked_about(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)

    first = simulation.start_goal(Pose(5.0, 3.0))
    second = simulation.start_goal(Pose(2.0, 1.0))
    simulation.step()

    assert simulation.goal_status(first).state is GoalState.PREEMPTED
    assert simulation.goal_status(second).state is GoalState.DRIVING


def test_a_cancelled_drive_ends_and_the_robot_comes_to_a_stand(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)
    goal_id = simulation.start_goal(Pose(5.0, 3.0))
    step_for(simulation, 3.0)
    assert simulation.velocity.speed_mps > 0

    simulation.cancel_goal(goal_id)
    step_for(simulation, 1.5)

    assert simulation.goal_status(goal_id).state is GoalState.CANCELLED
    assert simulation.velocity == BodyVelocity(0.0, 0.0)


def test_stop_ends_a_drive(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)
    goal_id = simulation.start_goal(Pose(5.0, 3.0))
    step_for(simulation, 2.0)

    simulation.stop()
    step_for(simulation, 1.5)

    assert simulation.goal_status(goal_id).state is GoalState.CANCELLED
    assert simulation.velocity == BodyVelocity(0.0, 0.0)


@pytest.mark.parametrize("goal_id", [0, 7, -1])
def test_an_unknown_drive_is_refused(warehouse: World, goal_id: int) -> None:
    simulation = Simulation(warehouse, seed=0)

    with pytest.raises(GoalError):
        simulation.goal_status(goal_id)
    with pytest.raises(GoalError):
        simulation.cancel_goal(goal_id)


def test_the_camera_looks_ahead_and_the_simulated_detector_reports_it(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)

    picture = simulation.take_picture()
    labels = {seen.label for seen in simulation.detect()}

    assert picture.shape == (480, 640, 3)
    assert math.radians(60) < HORIZONTAL_FOV_RAD < math.radians(100)
    assert "forklift" in labels


def test_truth_knows_areas_and_what_a_perfect_robot_could_map(warehouse: World) -> None:
    floor = Simulation(warehouse, seed=0).truth.floor
    rooms = {room.room.name: room for room in floor.rooms}

    assert rooms["staff room"].outline_area_m2 == pytest.approx(24.5, rel=0.01)
    assert rooms["staff room"].free_area_m2 < 24.5
    assert rooms["staff room"].room.room_class is RoomClass.ROOM
    visible = floor.visible
    assert 0.9 < visible.free.sum() * 0.05**2 / sum(r.free_area_m2 for r in floor.rooms) <= 1.0
    here = visible.cell_at(Pose(0.0, 0.0).point)
    assert visible.cells[here.row, here.col] == 0
    outside = visible.cell_at(warehouse.start.inverse().transform(Pose(-0.4, 5.0).point))
    assert visible.cells[outside.row, outside.col] == -1


def test_a_first_map_shows_as_free_only_what_is_free(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=3)
    grid, solid = simulation.map(), simulation.truth.floor.solid

    rows, cols = solid.cells_at(grid.points_at(*np.nonzero(grid.free)))

    assert (solid.cells[rows, cols] == 0).mean() > 0.995


def test_the_rear_camera_sees_what_the_front_one_sees_after_half_a_turn() -> None:
    ahead = Simulation(load_world("flat_1"), seed=1, start=Pose(2.0, 2.0, math.pi))
    behind = Simulation(load_world("flat_1"), seed=1, start=Pose(2.0, 2.0, 0.0))
    differs = ahead.take_picture() != behind.take_picture("rear")
    assert differs.mean() < 0.01


def test_the_path_that_is_driven_is_told_until_the_drive_ends(warehouse: World) -> None:
    simulation = Simulation(warehouse, seed=0)
    assert not simulation.planned_path
    goal = simulation.pose_in_map @ Pose(1.0, 0.0)
    simulation.start_goal(goal)
    step_for(simulation, 0.5)
    *_, end = simulation.planned_path
    assert end.distance_to(goal.point) < 0.1
    simulation.stop()
    assert not simulation.planned_path


class BusySimulation(Simulation):
    """One that goes on for two seconds while its camera is prepared."""

    @cached_property
    def _camera(self) -> PinholeCamera:
        step_for(self, 2.0)
        return PinholeCamera(self._world)


def test_a_picture_shows_what_was_ahead_when_it_was_asked_for(warehouse: World) -> None:
    simulation = BusySimulation(warehouse, seed=0)
    simulation.start_goal(Pose(2.0, 0.0))
    step_for(simulation, 1.0)
    asked_at = simulation.truth.pose_in_world
    picture = simulation.take_picture()
    assert simulation.truth.pose_in_world.point.distance_to(asked_at.point) > 0.5
    assert (picture == PinholeCamera(warehouse).render(asked_at)).all()
