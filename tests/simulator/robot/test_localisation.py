from dataclasses import replace

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalState
from mapspeak.simulator import Simulation, TrueFloor, World, WorldObject
from mapspeak.simulator.robot.gridmap import LogOddsMap
from mapspeak.simulator.robot.scanmatch import FinishedField, SurfaceField
from sites import make_flat

START = Pose(3.0, 1.5, 1.0)
MOST_TICKS = 4000


@pytest.fixture(scope="module")
def flat(tmp_path_factory: pytest.TempPathFactory) -> World:
    """A small flat."""
    return make_flat(tmp_path_factory.mktemp("flat"))


def drive(simulation: Simulation, goal: Pose) -> GoalState:
    """Drives to a goal, and gives how that ended."""
    goal_id = simulation.start_goal(goal)
    for _ in range(MOST_TICKS):
        if simulation.goal_status(goal_id).state is not GoalState.DRIVING:
            break
        simulation.step()
    return simulation.goal_status(goal_id).state


def test_a_robot_finds_its_place_in_a_known_map_and_keeps_it(flat: World) -> None:
    known = TrueFloor(flat).visible
    simulation = Simulation(flat, seed=1, known=known, start=START)
    assert drive(simulation, Pose(5.5, 3.5)) is GoalState.ARRIVED
    assert simulation.truth.slam_error_m < 0.06
    assert simulation.truth.pose.point.distance_to(Point(5.5, 3.5)) < 0.2
    assert simulation.map() is known


def test_it_is_told_its_place_with_an_error_and_not_the_truth(flat: World) -> None:
    known = TrueFloor(flat).visible
    poses = {Simulation(flat, seed=seed, known=known, start=START).pose_in_map for seed in range(3)}
    assert len(poses) == 3


def test_without_a_map_the_frame_begins_where_the_robot_starts(flat: World) -> None:
    simulation = Simulation(flat, seed=1, start=START)
    assert simulation.pose_in_map == Pose(0.0, 0.0, 0.0)
    assert simulation.truth.pose_in_world == START


def test_what_the_map_does_not_know_is_driven_around(flat: World) -> None:
    crate = WorldObject(name="crate", kind="crate", pose=Pose(4.0, 1.0))
    changed = replace(flat, objects=(*flat.objects, crate))
    known = TrueFloor(flat).visible
    simulation = Simulation(changed, seed=1, known=known, start=Pose(1.5, 0.9))
    assert drive(simulation, Pose(5.5, -0.1)) is GoalState.ARRIVED
    assert simulation.truth.n_collisions == 0


def test_a_way_that_is_blocked_ends_blocked(flat: World) -> None:
    crates = tuple(
        WorldObject(name=f"crate {x}", kind="crate", pose=Pose(x, 3.0)) for x in (1.6, 2.4)
    )
    changed = replace(flat, objects=(*flat.objects, *crates))
    known = TrueFloor(flat).visible
    simulation = Simulation(changed, seed=1, known=known, start=START)
    assert drive(simulation, Pose(1.5, 3.5)) is GoalState.BLOCKED
    assert simulation.truth.n_collisions == 0


def test_lines_fitted_beforehand_are_those_fitted_when_asked_for(flat: World) -> None:
    cells = LogOddsMap.of(TrueFloor(flat).visible)
    points = np.random.default_rng(0).uniform((-1.0, -1.0), (10.0, 5.0), (500, 2))
    ready, fresh = FinishedField(cells).find_lines(points), SurfaceField(cells).find_lines(points)
    assert (ready.is_near == fresh.is_near).all()
    assert (ready.is_line == fresh.is_line).all()
    # Of two surfaces that are equally near, either may be chosen.
    is_same = np.isclose(ready.offsets_m, fresh.offsets_m) & ready.is_near
    assert is_same.sum() > 0.95 * ready.is_near.sum()


def test_a_map_of_other_cells_is_refused() -> None:
    with pytest.raises(MapError, match=r"cells of 0\.05 m"):
        LogOddsMap.of(grid_from_text("...\n...", resolution_m=0.1))
