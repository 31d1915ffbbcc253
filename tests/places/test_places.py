import math
from pathlib import Path

import numpy as np
import pytest

from drawing import grid_from_text
from fakes import two_rooms
from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, SemanticMapStore, Waypoint
from mapspeak.places.naming import AmbiguousPlaceError, Place, Spot, is_taken_name
from mapspeak.places.relations.choosing import (
    check_place,
    choose_goal,
    find_place,
    find_places,
)
from mapspeak.places.standing import find_overlook_of
from mapspeak.places.things import forget
from mapspeak.places.ways import find_way
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedThing
from remembering import look, world_of

DOCK = Waypoint(name="Dock corner", pose=Pose(6.0, 1.5, 0.5))
ROBOT = Pose(1.5, 1.4, 0.0)


def _world(memory: SemanticMap | None = None) -> WorldModel:
    return WorldModel(two_rooms(), ROBOT, memory or SemanticMap(waypoints=(DOCK,)), radius_m=0.2)


@pytest.mark.parametrize(
    ("words", "name", "point"),
    [
        ("R1", "R1", None),
        (" r1 ", "R1", None),
        ("r 1", "R1", None),
        ("R-1", "R1", None),
        ("D1", "D1", None),
        ("W1", "W1", Point(6.0, 1.5)),
        ("dock  CORNER", "dock  CORNER", Point(6.0, 1.5)),
        ("1.5, 2", "(1.50, 2.00)", Point(1.5, 2.0)),
        ("(1.5 2)", "(1.50, 2.00)", Point(1.5, 2.0)),
        ("x=1.5, y=-.5", "(1.50, -0.50)", Point(1.5, -0.5)),
        ("robot", "robot", ROBOT.point),
        ("here", "robot", ROBOT.point),
    ],
)
def test_a_place_is_an_id_a_name_coordinates_or_the_robot(
    words: str, name: str, point: Point | None
) -> None:
    place = find_place(_world(), words)
    assert place.name == name
    assert point is None or place.point == point


def test_a_misspelt_phrase_or_id_gets_what_was_most_likely_meant() -> None:
    for words, says in (
        ("smalest room", "Such words can be read: 'smallest room',"),
        ("midle of R1", "Such words can be read: 'middle of R1',"),
        ("R11", "R1 is spelt most like it."),
    ):
        with pytest.raises(GoalError) as caught:
            find_place(_world(), words)
        assert says in caught.value.hint


def test_coordinates_may_come_with_a_heading() -> None:
    spot = find_place(_world(), "1.5, 2, 90 deg").thing
    assert isinstance(spot, Spot)
    assert spot.yaw_rad == pytest.approx(1.5708, abs=1e-3)


def test_a_remembered_name_wins_over_coordinates_that_it_looks_like() -> None:
    odd = Waypoint(name="3, 4", pose=Pose(6.0, 1.0))
    assert find_place(_world(SemanticMap(waypoints=(odd,))), "3, 4").point == Point(6.0, 1.0)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("R9", "Known are rooms and corridors R1 R2."),
        ("D7", "Known are doors D1."),
        ("F3", "Known are rooms and corridors R1 R2; doors D1"),
        ("the moon", "'nearest room'"),
        ("", "'nearest room'"),
        ("1.5", "'nearest room'"),
        ("nan, 2", "'nearest room'"),
        ("blue door of R1", "'all doors of R1'"),
        ("somewhere to the left", "'left of the robot'"),
    ],
)
def test_a_place_that_is_not_there_is_answered_with_those_that_are(words: str, told: str) -> None:
    with pytest.raises(GoalError) as caught:
        find_place(_world(), words)
    assert told in caught.value.hint


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("Room 1", "R1"),
        ("the room R2", "R2"),
        ("door 1", "D1"),
        ("waypoint 1", "W1"),
        ("door between R1 and R2", "D1"),
    ],
)
def test_a_place_is_meant_by_its_kind_and_number_or_by_what_it_joins(words: str, name: str) -> None:
    assert find_place(_world(), words).name == name


def test_several_ids_are_answered_with_no_other_place() -> None:
    with pytest.raises(GoalError) as caught:
        find_place(_world(), "R1, R2")
    assert "W1" not in caught.value.hint


@pytest.mark.parametrize("name", ["R3", "w12", "1, 2", "(1.0; -2)", "robot", "Here"])
def test_no_remembered_place_may_be_called_what_means_something_else(name: str) -> None:
    assert is_taken_name(name)


@pytest.mark.parametrize("name", ["room 3", "Dock corner", "R3 corner", "1 chair, 2 tables"])
def test_words_are_free_for_remembered_places(name: str) -> None:
    assert not is_taken_name(name)


def test_a_room_without_a_way_is_no_goal_and_the_answer_names_one_that_works() -> None:
    grid = grid_from_text(
        """
        ################
        #......#.......#
        #......#.......#
        #......#.......#
        #......#.......#
        ################
        """,
        resolution_m=0.5,
    )
    world = WorldModel(grid, Pose(1.5, 1.5), SemanticMap(), radius_m=0.2)
    closed = world.rooms.find_region_at(Point(6.0, 1.5))
    assert closed is not None
    with pytest.raises(GoalError, match=rf"{closed.id}: no known way .* leads to"):
        choose_goal(world, place=closed.id, x=None, y=None, yaw_deg=None)


def test_a_robot_sent_to_a_room_looks_into_it_not_at_its_wall() -> None:
    grid = grid_from_text(
        """
        ####################
        #.........#........#
        #.........#........#
        #..................#
        #.........#........#
        #.........#........#
        #.........#........#
        #.........#........#
        #.........#........#
        #.........#........#
        #.........#........#
        #.........#........#
        ####################
        """,
        resolution_m=0.5,
    )
    world = WorldModel(grid, Pose(2.0, 4.5), SemanticMap(), radius_m=0.2)
    room = world.rooms.find_region_at(Point(7.0, 1.5))
    assert room is not None
    goal = check_place(world, Place(room.id, room))
    assert goal.check.is_ok
    looks_at = goal.pose.transform(Point(1.5, 0.0))
    assert world.find_room_id(looks_at) == room.id
    assert abs(goal.pose.yaw_deg) == pytest.approx(90, abs=20)


def test_the_way_between_two_rooms_names_the_door_and_is_no_shorter_than_straight() -> None:
    world = _world()
    way = find_way(world, find_place(world, "R1"), find_place(world, "R2"))
    assert way.through == ("R1", "D1", "R2")
    assert way.path_m is not None
    assert way.straight_m is not None
    assert way.path_m >= way.straight_m


def test_a_place_ahead_of_the_robot_is_come_to_straight_on() -> None:
    world = _world()
    goal = check_place(world, find_place(world, "1 m in front of the robot"))
    assert abs(goal.pose.yaw_rad) < 0.2


def test_a_way_through_a_door_has_no_more_room_than_half_of_the_door() -> None:
    cells = np.zeros((60, 80), dtype=np.int8)
    cells[:, :2] = cells[:2] = cells[:, -2:] = cells[-2:] = cells[:, 40:42] = 100
    cells[22:37, 40:42] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    world = WorldModel(grid, Pose(1.0, 1.5), SemanticMap(), radius_m=0.2)
    (door,) = world.rooms.doors
    way = find_way(world, find_place(world, "robot"), find_place(world, "3.0, 1.5"))
    assert door.id in way.through
    assert way.clearance_m is not None
    assert way.clearance_m <= door.width_m / 2


def test_ways_are_as_long_there_as_back() -> None:
    world = _world()
    one, other = find_place(world, "R1"), find_place(world, "R2")
    there, back = find_way(world, one, other), find_way(world, other, one)
    assert there.path_m == pytest.approx(back.path_m, abs=0.01)
    assert there.through == tuple(reversed(back.through))


def test_no_way_begins_in_a_wall() -> None:
    world = _world()
    way = find_way(world, find_place(world, "3.3, 0.5"), find_place(world, "R2"))
    assert way.path_m is None


def test_what_does_not_depend_on_the_robot_is_not_computed_again_when_it_moves() -> None:
    first = _world()
    assert first.rooms.regions
    same_map = two_rooms()
    second = WorldModel(same_map, Pose(6.0, 1.5), SemanticMap(), radius_m=0.2, previous=first)
    assert second.rooms is first.rooms
    assert second.path_m(Point(6.0, 1.5)) == pytest.approx(0.0, abs=0.3)


BENT = """
    ##############
    #............#
    #............#
    #............#
    #######......#
    #######......#
    #######......#
    #######......#
    #######......#
    ##############
"""


def _world_of(text: str, robot: Pose) -> WorldModel:
    grid = grid_from_text(text, resolution_m=0.5)
    return WorldModel(grid, robot, SemanticMap(), radius_m=0.3)


def test_a_robot_sent_to_a_point_arrives_in_the_direction_of_the_way() -> None:
    world = _world_of(BENT, Pose(0.8, 4.2, math.pi))
    ahead = check_place(world, find_place(world, "4.3, 4.2"))
    down = check_place(world, find_place(world, "4.75, 0.8"))
    assert ahead.pose.yaw_deg == pytest.approx(0, abs=30)
    assert down.pose.yaw_deg == pytest.approx(-75, abs=25)


@pytest.mark.parametrize("goal", [Point(4.0, 0.5), Point(6.03, 0.45), Point(9.01, 0.4)])
def test_a_way_along_a_wall_that_ends_with_a_step_towards_it_turns_no_robot_to_it(
    goal: Point,
) -> None:
    hall = np.zeros((120, 240), np.int8)
    hall[[0, -1]] = hall[:, [0, -1]] = 100
    grid = OccupancyGrid(cells=hall, resolution_m=0.05)
    world = WorldModel(grid, Pose(1.0, 0.6, math.pi), SemanticMap(), radius_m=0.3)
    arrived = check_place(world, Place("there", Spot(goal))).pose
    assert -40 < arrived.yaw_deg < 0


def test_what_is_offered_instead_of_a_point_without_heading_has_none_either() -> None:
    world = _world_of(BENT, Pose(0.8, 4.2, math.pi))
    with pytest.raises(GoalError) as free:
        choose_goal(world, place=None, x=6.9, y=1.0, yaw_deg=None)
    with pytest.raises(GoalError) as asked:
        choose_goal(world, place=None, x=6.9, y=1.0, yaw_deg=30.0)
    assert "yaw_deg" not in free.value.hint
    assert "yaw_deg=30" in asked.value.hint


def test_the_nearest_pose_of_a_point_in_a_wall_is_come_to_straight_on() -> None:
    world = _world_of(BENT, Pose(0.8, 4.2, math.pi))
    nearest = check_place(world, find_place(world, "4.75, -0.1")).check.nearest
    assert nearest is not None
    assert nearest.yaw_deg == pytest.approx(-75, abs=25)


CHARGERS = (
    ("a", 1.0, "charger 1", 0.0),
    ("b", 2.2, "charger 2", math.pi / 2),
    ("c", 4.5, "charger", math.pi / 2),
)


def world_of_chargers() -> WorldModel:
    waypoints = tuple(
        Waypoint(
            name=name,
            pose=Pose(x, 1.4),
            functional_landmarks=(Landmark(label=label, bearing_rad=bearing_rad, range_m=0.8),),
        )
        for name, x, label, bearing_rad in CHARGERS
    )
    return WorldModel(two_rooms(), Pose(1.5, 1.4), SemanticMap(waypoints=waypoints), radius_m=0.2)


@pytest.mark.parametrize(
    ("words", "labels"),
    [
        ("nearest charger", ["charger 1"]),
        ("the second-nearest charger", ["charger 2"]),
        ("the farthest charger", ["charger"]),
        ("second farthest charger", ["charger 2"]),
        ("charger 2", ["charger 2"]),
        ("the two nearest chargers", ["charger 1", "charger 2"]),
        ("the two farthest chargers", ["charger", "charger 2"]),
    ],
)
def test_of_numbered_things_the_one_in_the_order_asked_for_is_meant(
    words: str, labels: list[str]
) -> None:
    found = find_places(world_of_chargers(), words)
    assert [each.thing.thing.label for each in found] == labels  # type: ignore[union-attr]


def test_every_thing_of_a_name_is_meant_whether_it_is_numbered_or_not() -> None:
    assert len(find_places(world_of_chargers(), "every charger")) == 3
    assert len(find_places(world_of_chargers(), "all remembered chargers")) == 3


def test_how_far_the_nearest_is_and_of_how_many_is_told() -> None:
    found = find_place(world_of_chargers(), "nearest charger")
    assert found.reason.endswith("m by path from the robot, of 3")


def test_a_thing_is_meant_by_another_name_of_its_kind_where_none_is_called_so() -> None:
    box = Landmark(label="first-aid box", bearing_rad=0.0, range_m=0.8)
    place = Waypoint(name="hall", pose=Pose(1.0, 1.4), functional_landmarks=(box,))
    memory = SemanticMap(waypoints=(place,))
    world = WorldModel(two_rooms(), Pose(1.5, 1.4), memory, radius_m=0.2)
    found = find_place(world, "the first-aid kit")
    assert isinstance(found.thing, RememberedThing)
    assert found.thing.thing.label == "first-aid box"
    with pytest.raises(GoalError, match="no place called"):
        find_place(world, "the kit")


@pytest.mark.parametrize("words", ["fourth-nearest charger", "the four nearest chargers"])
def test_more_things_than_there_are_is_an_error(words: str) -> None:
    with pytest.raises(GoalError, match=r"only 3 things called 'chargers?'"):
        find_places(world_of_chargers(), words)


BEHIND_A_SLOT = """
    ####################
    #..........#.......#
    #..........#.......#
    #..................#
    #..........#.......#
    #..........#.......#
    ####################
    """


def test_a_thing_that_cannot_be_come_near_to_is_gone_to_as_near_as_it_is_in_sight() -> None:
    grid = grid_from_text(BEHIND_A_SLOT, resolution_m=0.5)
    station = Landmark(label="charging station", bearing_rad=0.0, range_m=8.5)
    seen = Waypoint(name="far end", pose=Pose(0.75, 1.75, 0.0), functional_landmarks=(station,))
    world = WorldModel(grid, seen.pose, SemanticMap(waypoints=(seen,)), radius_m=0.6)
    goal = check_place(world, find_place(world, "charging station"))
    assert goal.check.is_ok
    assert goal.pose.x > 3.5
    assert abs(goal.pose.yaw_rad) < 0.3
    assert "the nearest place in sight of it" in goal.place.reason


BEHIND_UNSEEN_FLOOR = """
    ########################
    #........??............#
    #........??............#
    #........??............#
    #........??............#
    ########################
    """


def test_a_thing_that_is_in_sight_from_no_place_is_looked_for_from_the_nearest_that_saw_it() -> (
    None
):
    grid = grid_from_text(BEHIND_UNSEEN_FLOOR, resolution_m=0.5)
    looks = tuple(
        Waypoint(
            name=f"from {x}",
            pose=Pose(x, 1.5, math.pi),
            functional_landmarks=(Landmark(label="printer", bearing_rad=0.0, range_m=x - 0.5),),
        )
        for x in (11.0, 7.0)
    )
    world = WorldModel(grid, looks[0].pose, SemanticMap(waypoints=looks), radius_m=0.3)
    goal = check_place(world, find_place(world, "printer"))
    assert goal.pose.x == 7.0


BEHIND_A_SLOT_ON_A_WALL = """
    ########################
    #......................#
    #......................#
    #......................#
    #......#############...#
    #......#...#...........#
    #......#...#...........#
    #......#...............#
    #......#...#...........#
    #......#...#...........#
    ########################
    """


def test_a_thing_that_cannot_be_come_near_to_is_not_gone_to_behind_its_wall() -> None:
    grid = grid_from_text(BEHIND_A_SLOT_ON_A_WALL, resolution_m=0.5)
    printer = Landmark(label="printer", bearing_rad=0.0, range_m=4.9)
    seen = Waypoint(name="far", pose=Pose(8.75, 1.75, math.pi), functional_landmarks=(printer,))
    world = WorldModel(grid, seen.pose, SemanticMap(waypoints=(seen,)), radius_m=0.6)
    assert world.find_approach(world.things[0]) is None
    goal = check_place(world, find_place(world, "printer"))
    assert goal.check.is_ok
    assert goal.pose.x > 5.5


def test_what_is_looked_for_from_afar_is_not_told_as_gone_to_as_near_as_it_is_in_sight() -> None:
    grid = grid_from_text(BEHIND_A_SLOT, resolution_m=0.5)
    crate = Landmark(label="crate", bearing_rad=0.0)
    seen = Waypoint(name="far end", pose=Pose(3.0, 1.75, 0.0), functional_landmarks=(crate,))
    world = WorldModel(grid, seen.pose, SemanticMap(waypoints=(seen,)), radius_m=0.6)
    (thing,) = world.things
    assert world.find_approach(thing) is None
    assert find_overlook_of(world, thing) is not None
    assert "so the goal is" not in find_place(world, "crate").reason


def test_a_thing_is_looked_at_from_where_no_other_known_thing_stands_before_it() -> None:
    target, other = Point(7.4, 1.5), Point(6.9, 1.5)
    looks = (
        look("east a", 4.5, 0.6, ("fire extinguisher", target), range_m=3.0),
        look("east b", 5.5, 2.2, ("fire extinguisher", target), range_m=2.0),
    )
    alone = world_of(*looks)
    before = check_place(alone, find_place(alone, "fire extinguisher")).pose
    stool = look("east c", 6.9, 2.6, ("stool", other), yaw_deg=-90.0, range_m=1.1)
    world = world_of(*looks, stool, previous=alone)
    (at,) = (each.point for each in world.things if each.thing.label == "stool")
    pose = check_place(world, find_place(world, "fire extinguisher")).pose
    assert _aside_m(before, target, at) < 0.3 < _aside_m(pose, target, at)


def _aside_m(pose: Pose, target: Point, other: Point) -> float:
    off_rad = pose.point.bearing_to(other) - pose.point.bearing_to(target)
    return abs(math.sin(off_rad)) * pose.point.distance_to(other)


def test_of_two_places_that_differ_in_case_alone_none_is_forgotten_by_name(tmp_path: Path) -> None:
    world = _world(SemanticMap(waypoints=(DOCK, Waypoint(name="dock corner", pose=ROBOT))))
    store = SemanticMapStore(tmp_path / "places.yaml")
    with pytest.raises(AmbiguousPlaceError, match="2 remembered places are called"):
        forget(world, store, "dock corner")


def test_a_number_that_is_none_is_no_goal() -> None:
    for x, y in ((1.0, math.nan), (math.nan, 1.0), (1.0, math.inf)):
        with pytest.raises(GoalError, match="not a valid goal"):
            choose_goal(_world(), place=None, x=x, y=y, yaw_deg=None)
