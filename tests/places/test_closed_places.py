"""What is said of places that a closure keeps the robot from."""

import pytest

from closing import RADIUS_M, event, revision_with, world_on
from drawing import grid_from_text
from guarding import corners
from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMap
from mapspeak.memory.events import Effect
from mapspeak.places.relations.choosing import choose_goal, find_place
from mapspeak.server.text.world.descriptions import describe_place
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.model import WorldModel

SOUTH = corners((8.5, 1.0), (15.5, 3.5))
BOTH = (event(Effect.CLOSED, id="E2"), event(Effect.CLOSED, outlines=(SOUTH,), id="E3"))


def test_too_few_that_can_be_reached_are_told_with_what_is_closed() -> None:
    world = world_on(revision_with(*BOTH))
    with pytest.raises(GoalError, match=r"can be reached.* closed by event E"):
        find_place(world, "second-nearest room")


def test_where_no_door_is_passed_no_place_is_offered_that_does_not_work_either() -> None:
    text = "\n".join(["############", *["#....#.....#"] * 5, "############"])
    drawn = grid_from_text(text, resolution_m=1.0)
    cells = drawn.cells.repeat(10, axis=0).repeat(10, axis=1).copy()
    cells[30:34, 50:60] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.1)
    world = WorldModel(grid, Pose(2.0, 3.0), SemanticMap(), radius_m=RADIUS_M)
    # Its only door is too narrow.
    (far,) = (each for each in world.rooms.regions if each.widest.x > 6.0)
    with pytest.raises(GoalError, match="gets through no door") as caught:
        find_place(world, f"{far.id} looking back through its door")
    assert far.id not in caught.value.hint


def test_a_room_that_is_cut_off_names_what_closes_it_and_no_pose_behind_its_wall() -> None:
    world = world_on(revision_with(*BOTH))
    east = max(world.rooms.regions, key=lambda each: each.widest.x)
    with pytest.raises(GoalError, match="closed by event E") as caught:
        choose_goal(world, place=east.id, x=None, y=None, yaw_deg=None)
    assert caught.value.step is NextStep.END_EVENT
    assert "nearest pose" not in caught.value.hint


def test_no_pose_on_the_other_side_of_a_wall_is_offered() -> None:
    text = "\n".join(["############", *["#....#.....#"] * 5, "############"])
    drawn = grid_from_text(text, resolution_m=1.0)
    world = WorldModel(drawn, Pose(2.0, 3.0), SemanticMap(), radius_m=RADIUS_M)
    with pytest.raises(GoalError) as caught:
        choose_goal(world, place=None, x=7.5, y=3.5, yaw_deg=None)
    assert "nearest pose" not in caught.value.hint


def test_for_a_closed_place_no_pose_on_the_other_side_of_its_wall_is_offered() -> None:
    north = event(Effect.CLOSED, outlines=(corners((8.2, 7.6), (15.8, 10.4)),), id="E2")
    with pytest.raises(GoalError, match="closed by event E2") as caught:
        choose_goal(world_on(revision_with(north)), place=None, x=8.9, y=9.0, yaw_deg=None)
    assert "nearest pose" not in caught.value.hint
    assert caught.value.step is NextStep.END_EVENT


def test_closed_floor_is_as_far_from_obstacles_as_it_was() -> None:
    world = world_on(revision_with(*BOTH))
    told = describe_place(world, find_place(world, "12, 6.5"), picture_ids={})
    assert "0.00 m from any obstacle" not in told
    assert "closed by event E2" in told
