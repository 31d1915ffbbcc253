import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.places.naming import Place
from mapspeak.places.relations.choosing import check_place, find_place
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door
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
ROBOT = Pose(1.0, 1.3, 0.0)
DESK = Waypoint(name="Desk", pose=Pose(7.0, 1.4, math.pi / 2))
WEST, EAST = Point(2.0, 1.5), Point(7.0, 2.6)


def _world(
    *waypoints: Waypoint, text: str = FLAT, robot: Pose = ROBOT, turn: Pose | None = None
) -> WorldModel:
    origin = turn or Pose(0.0, 0.0)
    grid = grid_from_text(text, resolution_m=0.25, origin=origin)
    memory = SemanticMap(waypoints=waypoints or (DESK,))
    return WorldModel(grid, robot, memory, radius_m=0.2)


def _go(world: WorldModel, words: str) -> tuple[Place, Pose]:
    place = find_place(world, words)
    goal = check_place(world, place)
    assert goal.check.is_ok, goal.check
    return place, goal.pose


SHARED = _world()


def _room_id(world: WorldModel, point: Point) -> str:
    found = world.find_room_id(point)
    assert found is not None
    return found


def _off(pose: Pose, origin: Point, heading_rad: float) -> float:
    return abs(wrap_angle(origin.bearing_to(pose.point) - heading_rad))


def test_north_of_a_door_is_not_behind_a_wall_of_its_rooms() -> None:
    world = _world()
    _, along = _go(world, "north of D1")
    _, beyond = _go(world, "east of D1")
    assert _room_id(world, along.point) == _room_id(world, WEST)
    assert _room_id(world, beyond.point) == _room_id(world, EAST)


@pytest.mark.parametrize(
    ("words", "turn_rad"),
    [
        ("left of", math.pi / 2),
        ("right of", -math.pi / 2),
        ("in front of", 0.0),
        ("behind", math.pi),
    ],
)
def test_the_sides_of_a_remembered_place_are_its_own_and_the_robot_looks_at_it(
    words: str, turn_rad: float
) -> None:
    place, pose = _go(_world(), f"{words} W1")
    assert _off(pose, DESK.pose.point, DESK.pose.yaw_rad + turn_rad) < math.radians(41)
    assert pose.yaw_rad == pytest.approx(pose.point.bearing_to(DESK.pose.point), abs=0.01)
    away_m = pose.point.distance_to(DESK.pose.point)
    assert place.reason == f"{away_m:.1f} m {words} W1 by its own heading, facing it"


def test_what_has_no_front_is_seen_from_the_robot_and_the_answer_says_so() -> None:
    place, pose = _go(_world(), "left of 2.5, 1.3")
    assert pose.y > 1.8
    assert "as seen from the robot, looking east" in place.reason


def test_a_side_may_be_meant_from_another_place() -> None:
    _, pose = _go(_world(), "left of 2.5, 1.3 as seen from D1")
    assert pose.y < 0.9


def test_a_distance_that_was_asked_for_is_kept_or_refused_with_one_that_works() -> None:
    world = _world()
    _, pose = _go(world, "1.5 m west of W1")
    assert pose.point.distance_to(DESK.pose.point) == pytest.approx(1.5, abs=0.2)
    with pytest.raises(GoalError, match=r"nowhere 9 m west of W1.*0\.9 m west of W1"):
        find_place(world, "9 m west of W1")


def test_a_place_beside_a_thing_is_in_its_room_though_another_one_is_nearer() -> None:
    world = _world(Waypoint(name="Shelf", pose=Pose(5.8, 0.7, 0.0)))
    _, pose = _go(world, "behind W1")
    assert world.find_room_id(pose.point) == world.find_room_id(EAST)
    with pytest.raises(GoalError, match="nowhere 2 m behind W1"):
        find_place(world, "2 m behind W1")


def test_left_and_right_of_a_door_are_beside_it_on_the_robots_side() -> None:
    world = _world()
    (door,) = world.rooms.doors
    _, left = _go(world, "left of D1")
    _, right = _go(world, "right of D1")
    assert left.y > door.place.y + door.width_m / 2 - 0.25
    assert right.y < door.place.y - door.width_m / 2 + 0.25
    assert {_room_id(world, each.point) for each in (left, right)} == {_room_id(world, WEST)}


def test_behind_a_door_is_the_other_room() -> None:
    world = _world()
    _, before = _go(world, "in front of D1")
    _, beyond = _go(world, "behind D1")
    assert _room_id(world, before.point) == _room_id(world, WEST)
    assert _room_id(world, beyond.point) == _room_id(world, EAST)


def test_in_front_of_a_room_is_outside_its_door() -> None:
    world = _world()
    east = _room_id(world, EAST)
    place, pose = _go(world, f"in front of {east}")
    assert _room_id(world, pose.point) == _room_id(world, WEST)
    assert f"{east} (its door D1)" in place.reason


def test_a_side_of_the_room_that_the_robot_is_in_is_refused_with_what_would_work() -> None:
    world = _world()
    west = _room_id(world, WEST)
    with pytest.raises(GoalError, match=f"from inside it.*the north wall of {west}"):
        find_place(world, f"left of {west}")


def test_between_two_things_that_see_each_other_is_half_way_on_the_line() -> None:
    place, pose = _go(_world(), "between W1 and 9, 1.4")
    assert pose.x == pytest.approx(8.0, abs=0.3)
    assert "from one and" in place.reason


def test_between_two_rooms_is_the_door_that_joins_them() -> None:
    world = _world()
    place, pose = _go(world, "between R1 and R2")
    assert "in D1" in place.reason
    assert pose.point.distance_to(world.rooms.doors[0].place) < 0.3


def test_between_what_a_wall_parts_is_half_way_on_the_path() -> None:
    world = _world()
    _, pose = _go(world, "between 4, 0.7 and 5.6, 0.7")
    assert world.path_m(pose.point) is not None
    assert pose.y > 0.9


@pytest.mark.parametrize(
    ("words", "corner"),
    [
        ("the south-west corner of this room", Point(0.25, 0.25)),
        ("northwest corner of the room", Point(0.25, 3.25)),
        ("the corner", Point(0.25, 0.25)),
        ("the corner nearest to 4, 3", Point(4.75, 3.25)),
    ],
)
def test_in_a_corner_the_robot_stands_near_both_walls_and_faces_it(
    words: str, corner: Point
) -> None:
    place, pose = _go(_world(), words)
    assert pose.point.distance_to(corner) < 0.9
    assert "corner of" in place.reason


def test_along_a_wall_the_robot_heads_along_it() -> None:
    world = _world()
    place, pose = _go(world, f"along the north wall of {_room_id(world, WEST)}")
    assert pose.y > 2.7
    assert abs(math.sin(pose.yaw_rad)) < 0.1
    assert "heading east along it" in place.reason


def test_the_middle_of_a_room_is_the_middle_and_not_its_widest_point() -> None:
    world = _world()
    _, pose = _go(world, f"the middle of {_room_id(world, EAST)}")
    assert pose.x == pytest.approx(7.5, abs=0.3)
    assert pose.y == pytest.approx(1.75, abs=0.3)


def test_the_nearest_door_and_frontier_are_the_things_themselves() -> None:
    world = _world(text=FLAT.replace(".....................#", "...............??????#"))
    door, frontier = find_place(world, "nearest door"), find_place(world, "nearest frontier")
    assert isinstance(door.thing, Door)
    assert isinstance(frontier.thing, Frontier)
    assert frontier.name == frontier.thing.id
    assert "by path from the robot" in frontier.reason


def test_no_frontier_left_is_said_and_not_made_up() -> None:
    with pytest.raises(GoalError, match="no frontier to go to: none left"):
        find_place(_world(), "nearest unexplored area")


def test_relations_stand_inside_each_other_up_to_four() -> None:
    world = _world()
    place, _ = _go(world, f"0.5 m north of the middle of {_room_id(world, EAST)}")
    assert "north of the middle of" in place.reason
    _go(world, "0.5 m north of 0.5 m west of 0.5 m south of 0.5 m east of W1")
    with pytest.raises(GoalError, match="more than 4 relations"):
        find_place(world, "north of north of north of north of north of W1")


def test_a_thing_with_a_known_position_is_a_thing_to_relate_to() -> None:
    sink = Landmark(label="sink", bearing_rad=0.0, range_m=1.2)
    world = _world(Waypoint(name="Desk", pose=DESK.pose, functional_landmarks=(sink,)))
    place, pose = _go(world, "next to the sink")
    assert pose.point.distance_to(Point(7.0, 2.6)) < 1.2
    assert "sink (T1, seen from W1)" in place.reason


def test_a_thing_of_unknown_direction_is_answered_with_where_it_was_seen_from() -> None:
    lamp = Landmark(label="lamp")
    world = _world(Waypoint(name="Desk", pose=DESK.pose, safety_landmarks=(lamp,)))
    with pytest.raises(GoalError, match="was seen from W1") as error:
        find_place(world, "left of the lamp")
    assert error.value.step is NextStep.LOOK_FROM
    assert error.value.about == "W1"


def test_two_things_of_one_name_are_asked_back_with_their_places() -> None:
    one = Landmark(label="chair", bearing_rad=0.0, range_m=0.5)
    other = Landmark(label="Chair", bearing_rad=0.0, range_m=1.6)
    world = _world(Waypoint(name="Desk", pose=DESK.pose, functional_landmarks=(one, other)))
    with pytest.raises(GoalError, match=r"Several things.*T1 at .*T2 at "):
        find_place(world, "next to the chair")


def test_two_remembered_places_of_one_name_are_asked_back_with_their_ids() -> None:
    world = _world(DESK, Waypoint(name="desk", pose=Pose(8.0, 2.0)))
    for words in ("desk", "left of the desk"):
        with pytest.raises(GoalError, match=r"2 remembered places.*W1 at .*W2 at "):
            find_place(world, words)


def test_a_remembered_name_wins_over_the_relation_it_looks_like() -> None:
    odd = Waypoint(name="left of the desk", pose=Pose(3.0, 2.0))
    place, pose = _go(_world(DESK, odd), "Left of the desk")
    assert not place.reason
    assert pose.point == odd.pose.point


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("left of W9", "no place called 'W9'"),
        ("-2 m from W1", "above zero"),
        ("0 m north of W1", "above zero"),
        ("between W1 and W1", "nothing is between them"),
        ("between W1", "Between what and what"),
        ("corner of W1", "next to W1"),
        ("facing the robot", "cannot face itself"),
        ("north corner of R1", "north-east corner of R1"),
        ("nearest corridor", "no corridor"),
        ("nowhere near", "no place called"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_what_would_work(words: str, says: str) -> None:
    with pytest.raises(GoalError, match=says):
        find_place(_world(), words)


def test_the_room_is_where_the_robot_stands_and_the_corridor_is_asked_back() -> None:
    world = _world()
    assert find_place(world, "this room").name == _room_id(world, WEST)
    assert find_place(world, "the door").name == "D1"
    place, _ = _go(world, "the middle of the room")
    assert f"the middle of {_room_id(world, WEST)}" in place.reason
    with pytest.raises(GoalError, match="which corridor is meant"):
        find_place(world, "the middle of the corridor")


def test_who_says_me_is_asked_who_that_is() -> None:
    with pytest.raises(GoalError, match="no place called 'me'"):
        find_place(_world(), "behind me")


OPERANDS = (
    "W1",
    "the desk",
    "R1",
    "R2",
    "D1",
    "F1",
    "robot",
    "1, 1",
    "40, 40",
    "-1e5, 0",
    "1e9, 3",
    "it",
    "this room",
    "the door",
    "(2, 2)",
    "5, 1, 90",
    "4.8, 1.5",
    "R9",
    "",
    "the corner",
)
FORMS = (
    "left of {}",
    "2 m right of {}",
    "in front of {}",
    "behind {}",
    "north of {}",
    "3 m from {}",
    "next to {}",
    "facing {}",
    "corner of {}",
    "north-east corner of {}",
    "middle of {}",
    "along the west wall of {}",
    "between {} and D1",
    "the corner next to {}",
    "between {}",
    "nearest door to {}",
    "W1 facing {}",
    "left of W1 as seen from {}",
    "1e300 m from {}",
)


@settings(max_examples=120)
@given(
    forms=st.lists(st.sampled_from(FORMS), min_size=1, max_size=5),
    operand=st.sampled_from(OPERANDS),
)
def test_no_phrase_ends_in_anything_but_a_pose_that_works_or_a_reason(
    forms: list[str], operand: str
) -> None:
    words = operand
    for form in forms:
        words = form.format(words)
    try:
        place = find_place(SHARED, words)
    except GoalError as error:
        assert error.hint  # noqa: PT017 - either kind of answer is right here
        return
    assert place.reason
    assert check_place(SHARED, place).check.is_ok


def test_the_same_words_give_the_same_pose() -> None:
    poses = {_go(_world(), "left of W1")[1] for _ in range(3)}
    assert len(poses) == 1


@settings(max_examples=25)
@given(x=st.floats(6.0, 9.0), y=st.floats(1.0, 2.4), yaw_rad=st.floats(-math.pi, math.pi))
def test_left_and_right_are_mirror_images(x: float, y: float, yaw_rad: float) -> None:
    """Mirrors the map about its middle row: the place to the left becomes that to the right."""
    height_m = 14 * 0.25
    here = _world(Waypoint(name="it", pose=Pose(x, y, yaw_rad)))
    there = _world(
        Waypoint(name="it", pose=Pose(x, height_m - y, -yaw_rad)),
        robot=Pose(ROBOT.x, height_m - ROBOT.y, 0.0),
    )
    _, left = _go(here, "left of W1")
    _, right = _go(there, "right of W1")
    thing, mirrored = Point(x, y), Point(x, height_m - y)
    assert _off(left, thing, yaw_rad + math.pi / 2) < math.radians(41)
    assert _off(right, mirrored, -yaw_rad - math.pi / 2) < math.radians(41)
    off_m = left.point.distance_to(thing) - right.point.distance_to(mirrored)
    assert off_m == pytest.approx(0.0, abs=0.26)


@pytest.mark.parametrize(
    "words",
    [
        "0.8 m from W1",
        "next to W1",
        "the south-east corner of {west}",
        "along the north wall of {west}",
        "along the east wall of {east}",
        "the middle of {east}",
        "in front of {east}",
        "between {west} and W1",
    ],
)
def test_a_map_whose_origin_lies_elsewhere_has_its_places_there(words: str) -> None:
    found = []
    for shift in (Pose(0.0, 0.0), Pose(-40.0, 25.0)):
        desk = Waypoint(name="Desk", pose=shift @ DESK.pose)
        world = _world(desk, robot=shift @ ROBOT, turn=shift)
        west, east = (_room_id(world, shift.transform(each)) for each in (WEST, EAST))
        _, pose = _go(world, words.format(west=west, east=east))
        found.append(shift.inverse() @ pose)
    here, there = found
    assert (there.x, there.y) == pytest.approx((here.x, here.y), abs=0.01)
    assert wrap_angle(there.yaw_rad - here.yaw_rad) == pytest.approx(0.0, abs=0.01)


@settings(max_examples=20)
@given(turn_rad=st.floats(-math.pi, math.pi))
def test_turning_the_map_turns_left_but_not_north(turn_rad: float) -> None:
    turn = Pose(3.0, -2.0, turn_rad)
    desk = Waypoint(name="Desk", pose=turn @ DESK.pose)
    turned = _world(desk, robot=turn @ ROBOT, turn=turn)
    _, left = _go(turned, "left of W1")
    back = turn.inverse().transform(left.point)
    _, upright = _go(_world(), "left of W1")
    assert back.distance_to(upright.point) < 0.3
    _, north = _go(turned, "0.8 m north of W1")
    assert _off(north, desk.pose.point, math.pi / 2) < math.radians(41)


@settings(max_examples=25)
@given(
    x=st.floats(0.5, 9.8),
    y=st.floats(0.5, 3.0),
    words=st.sampled_from(
        ["next to {}", "1 m from {}", "facing {}", "left of {}", "north of {}", "between {} and W1"]
    ),
)
def test_whatever_is_asked_for_the_pose_can_be_reached_or_the_answer_says_why_not(
    x: float, y: float, words: str
) -> None:
    world = _world()
    try:
        place, pose = _go(world, words.format(f"{x:.2f}, {y:.2f}"))
    except GoalError as error:
        assert error.hint  # noqa: PT017 - an answer of either kind is right here
        return
    cell = world.grid.cell_at(pose.point)
    assert float(np.asarray(world.map.clearance_m)[cell.row, cell.col]) >= world.radius_m
    assert place.reason


def test_what_lies_behind_a_wall_is_not_faced_through_it() -> None:
    world = _world()
    _go(world, "facing 3.0, 3.4")
    with pytest.raises(GoalError, match="does the robot see"):
        find_place(world, "facing 3.0, 5.0")


@pytest.mark.parametrize("words", ["R1 facing back", "the north wall of R1"])
def test_what_is_advised_instead_is_not_promised_where_no_way_leads(words: str) -> None:
    shut = _world(text=FLAT.replace("#" + "." * 40 + "#", FLAT.split("\n")[2]))
    with pytest.raises(GoalError) as error:
        find_place(shut, words)
    assert "would work" not in str(error.value)
    assert "in the way" not in str(error.value)
