"""Orders such as "the nearest charger": none is answered with another thing, place or way."""

import pytest

from drawing import grid_from_text
from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.places.naming import Place
from mapspeak.places.relations.choosing import check_place, find_place, find_places
from mapspeak.worldmodel.model import WorldModel

FLAT = """
##########################################
#..................#.....................#
#..................#.....................#
#..................#.....................#
#..................#.....................#
#........................................#
#........................................#
#........................................#
#........................................#
#..................#.....................#
#..................#.....................#
#..................#.....................#
#..................#.....................#
##########################################
"""
WEST, EAST = Point(2.0, 1.5), Point(7.0, 2.6)


def seen(name: str, x: float, y: float, label: str, at: Point) -> Waypoint:
    """A waypoint from which a thing was seen, with its distance."""
    away_m = Point(x, y).distance_to(at)
    thing = Landmark(label=label, bearing_rad=0.0, range_m=away_m)
    pose = Pose(x, y, Point(x, y).bearing_to(at))
    return Waypoint(name=name, pose=pose, functional_landmarks=(thing,))


def world_of(
    *waypoints: Waypoint, text: str = FLAT, robot: Pose | None = None, radius_m: float = 0.2
) -> WorldModel:
    grid = grid_from_text(text, resolution_m=0.25)
    memory = SemanticMap(waypoints=waypoints)
    return WorldModel(grid, robot or Pose(1.0, 1.3, 0.0), memory, radius_m=radius_m)


CHARGERS = (
    seen("a", 3.0, 0.6, "charger", Point(4.6, 0.6)),
    seen("b", 6.0, 0.9, "charger", Point(5.1, 0.6)),
    seen("c", 8.5, 0.9, "charger", Point(10.2, 0.9)),
)


def test_there_is_no_second_of_one_thing() -> None:
    world = world_of(CHARGERS[2])
    assert find_place(world, "nearest charger").thing is world.things[0]
    with pytest.raises(GoalError, match=r"only one thing called 'charger'.*T1 in R1"):
        find_place(world, "second-nearest charger")


def test_the_nearest_thing_to_the_robot_is_the_nearest_by_path() -> None:
    world = world_of(*CHARGERS, robot=Pose(4.4, 0.8, 0.0))
    nearest = find_place(world, "nearest charger")
    for words in ("nearest charger to the robot", "nearest charger to robot", "closest charger"):
        place = find_place(world, words)
        assert (place.thing, place.reason) == (nearest.thing, nearest.reason)


def test_what_is_nearest_to_a_thing_or_a_place_is_another_one() -> None:
    world = world_of(*CHARGERS)
    for words in ("nearest charger to T1", "the nearest remembered place to W1"):
        assert find_place(world, words).point != find_place(world, words[-2:]).point


def test_what_has_no_other_of_its_kind_is_told_so() -> None:
    world = world_of(CHARGERS[2])
    for words, kind in (
        ("nearest charger to T1", "thing called 'charger'"),
        ("nearest remembered place to W1", "remembered place"),
        ("nearest door to D1", "door"),
    ):
        with pytest.raises(GoalError, match=f"There is no other {kind}"):
            find_place(world, words)
    with pytest.raises(GoalError, match="There is only one other room"):
        find_place(world, "second-nearest room to R1")


def test_an_order_may_stand_inside_a_relation() -> None:
    world = world_of(*CHARGERS)
    nearest = find_place(world, "nearest charger")
    beside = find_place(world, "next to the nearest charger")
    assert beside.point.distance_to(nearest.point) < 1.2


ROUND_A_ROOM = """
##########################################
#........................................#
#........................................#
#........................................#
#........................................#
#....##############################......#
#....#............................#......#
#....#............................#......#
#....#............................#......#
#....#............................#......#
#....#............................#......#
#....#............................#......#
#.................................#......#
#.................................#......#
#.................................#......#
#....#............................#......#
#....#............................#......#
##################################....####
                                 #......##
                                 #......##
                                 #......##
                                 #......##
                                 #########
"""


def test_of_a_corridor_round_a_room_ways_begin_and_robots_stand_in_the_corridor() -> None:
    world = world_of(text=ROUND_A_ROOM, robot=Pose(0.7, 1.6, 0.0))
    (corridor,) = (each for each in world.rooms.regions if each.id.startswith("C"))
    for words in (f"{corridor.id} facing D2", "the corridor facing D2"):
        goal = check_place(world, find_place(world, words))
        assert world.find_room_id(goal.pose.point) == corridor.id
    nearest = find_place(world, f"nearest room to {corridor.id}")
    (path_m,) = (float(word) for word in nearest.reason.split() if word[0].isdigit())
    assert path_m > 0.3
    between = find_place(world, f"between {corridor.id} and 0.6, 5.2")
    assert world.find_room_id(between.point) == corridor.id


def test_too_few_are_told_apart_from_those_without_a_way() -> None:
    with pytest.raises(
        GoalError, match=r"There are only 2 rooms\. .*nearest room or second-nearest room"
    ):
        find_place(world_of(), "third-nearest room")
    shut = FLAT.replace("#........................................#", FLAT.split("\n")[2])
    with pytest.raises(GoalError, match=r"Only 1 of the 2 rooms can be reached"):
        find_place(world_of(text=shut), "second-nearest room")


HALL_WITH_TWO_ROOMS = "\n".join(
    [
        "#" * 66,
        *["#" + "." * 64 + "#"] * 42,
        "#" * 12 + "...." + "#" * 30 + "...." + "#" * 16,
        *["#" + "." * 30 + "#" + "." * 33 + "#"] * 14,
        "#" * 66,
    ]
)


def test_where_more_rooms_are_meant_than_there_are_open_spaces_count_too() -> None:
    world = world_of(text=HALL_WITH_TWO_ROOMS, robot=Pose(8.0, 8.0))
    assert [each.id[0] for each in world.rooms.regions].count("O") == 1
    two = {each.name for each in find_places(world, "two nearest rooms")}
    three = {each.name for each in find_places(world, "three nearest rooms")}
    assert [each[0] for each in two] == ["R", "R"]
    assert three == {each.name for each in find_places(world, "all rooms")}


WITH_A_FRONTIER = FLAT.replace("....................#\n", "....................?\n")


def test_a_room_without_a_frontier_is_not_told_as_a_map_without_any() -> None:
    world = world_of(text=WITH_A_FRONTIER)
    (frontier, *_) = find_places(world, "all frontiers")
    east = world.find_room_id(EAST)
    assert frontier.name in {each.name for each in find_places(world, f"all frontiers in {east}")}
    west = world.find_room_id(WEST)
    with pytest.raises(GoalError, match=f"{west} has no frontier"):
        find_places(world, f"all frontiers in {west}")


HALF_SEEN = """
##########################################
#..................#...............???????
#..................#...............???????
#..................#...............???????
#..................#...............???????
#..................................???????
#..................................???????
#..................................???????
#..................................???????
#..................#...............???????
#..................#...............???????
#..................#...............???????
#..................#...............???????
##########################################
"""


def test_the_largest_room_is_told_with_those_that_may_be_larger_once_seen() -> None:
    world = world_of(text=HALF_SEEN)
    west, east = (world.find_room_id(each) for each in (WEST, EAST))
    largest = find_place(world, "largest room")
    assert largest.name == west
    assert f"{east} (" in largest.reason
    assert largest.reason.endswith("is not all seen and may be larger")
    assert "may be larger" not in find_place(world, "smallest room").reason


@pytest.mark.parametrize(
    "words",
    [
        "charger in R9",
        "charger in the attic",
        "charger of R2",
        "charger near D1",
        "all chargers in R9",
        "nearest charger in the attic",
        "two nearest red chargers",
        "next to the charger in R2",
    ],
)
def test_a_thing_is_not_taken_for_one_that_is_asked_for_elsewhere_or_otherwise(words: str) -> None:
    world = world_of(CHARGERS[2])
    assert world.rooms_before(world.things[0]) == ("R1",)
    with pytest.raises(GoalError):
        find_places(world, words)


def test_between_the_doors_of_a_room_is_meant_in_any_case_of_letters() -> None:
    world = world_of(text=ROUND_A_ROOM, robot=Pose(3.0, 3.0, 0.0))
    (corridor,) = (each for each in world.rooms.regions if each.id.startswith("C"))
    places: list[Place] = [
        find_place(world, f"between {words} of {corridor.id}")
        for words in ("the doors", "the Doors", "Doors", "the two doors")
    ]
    assert len({each.point for each in places}) == 1


def test_a_number_of_any_length_is_a_place_or_none() -> None:
    world = world_of()
    for words in (f"0, 0, {'9' * 400}", f"{'9' * 400}, 0", f"F{'9' * 5000}", f"T{'9' * 5000}"):
        with pytest.raises(GoalError, match="no place called"):
            find_place(world, words)
