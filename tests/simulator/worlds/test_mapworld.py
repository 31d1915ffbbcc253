from pathlib import Path

import pytest

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import Simulation, TrueFloor, load_world
from mapspeak.simulator.worlds.slices import slice_world
from mapspeak.simulator.worlds.world import build_map_world, find_floor
from mapspeak.spatial.mapwriting import write_map

ROOM = """
##########
#........#
#........#
#...##...#
#...##...#
#........#
##########
"""


def test_occupied_cells_become_walls_where_they_are_on_the_map() -> None:
    grid = grid_from_text(ROOM, resolution_m=0.5, origin=Pose(3.0, -2.0, 0.5))
    solids = slice_world(build_map_world(grid, name="room"), low_m=0.1, high_m=1.0)
    rows, cols = (range(grid.n_rows), range(grid.n_cols))
    points = {
        (row, col): grid.origin.transform(Point((col + 0.5) * 0.5, (row + 0.5) * 0.5))
        for row in rows
        for col in cols
    }
    assert all(
        solids.is_solid_at(point) == bool(grid.occupied[cell]) for cell, point in points.items()
    )


def test_what_the_map_does_not_know_is_closed_off() -> None:
    grid = grid_from_text("\n".join(["......"] * 6), resolution_m=0.5)
    floor = TrueFloor(build_map_world(grid, name="open"))
    assert 0.5 < floor.standable.sum() * 0.05**2 < 4.0


def test_the_robot_starts_where_it_has_most_room() -> None:
    grid = grid_from_text(ROOM, resolution_m=0.5)
    world = build_map_world(grid, name="room")
    simulation = Simulation(world, seed=1)
    assert simulation.scan.ranges_m.min() > 0.6


def test_floor_that_cannot_be_reached_from_the_largest_piece_does_not_count() -> None:
    grid = grid_from_text(
        """
        ##############
        #.........#..#
        #.........#..#
        #.........#..#
        ##############
        """,
        resolution_m=0.5,
    )
    floor = find_floor(grid)
    assert floor[2, 5]
    assert not floor[2, 11]


def test_a_map_on_which_the_robot_does_not_fit_is_refused() -> None:
    with pytest.raises(MapError, match="no free floor on which the robot"):
        build_map_world(grid_from_text("###\n#.#\n###", resolution_m=0.25), name="hole")


def test_a_map_file_is_loaded_as_a_world(tmp_path: Path) -> None:
    write_map(grid_from_text(ROOM, resolution_m=0.5), tmp_path / "hall.yaml")
    world = load_world(tmp_path / "hall.yaml")
    assert world.name == "hall"
    assert world.walls
    assert world.objects == ()
