import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint, merge_waypoint
from mapspeak.memory.things.approach import find_stands
from mapspeak.memory.things.finding import find_things
from mapspeak.memory.things.labels import group_names, name_the_same
from mapspeak.memory.things.sight import build_sight_map
from mapspeak.memory.things.thing import Category, Thing
from mapspeak.memory.waypoint import Confidence
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import distances_from

ROOM = """
    #########################
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #########################
"""
TWO_ROOMS = """
    #########################
    #...........#...........#
    #...........#...........#
    #...........#...........#
    #...........#...........#
    #...........#...........#
    #...........#...........#
    #...........#...........#
    #.......................#
    #...........#...........#
    #########################
"""
LOW_TABLE = """
    #########################
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #..........####.........#
    #.......................#
    #.......................#
    #.......................#
    #.......................#
    #########################
"""
HALL = """
    ################################################################################
    #..............................................................................#
    #............................................##................................#
    #............................................##................................#
    #............................................##................................#
    #............................................##................................#
    #..............................................................................#
    #..............................................................................#
    #..............................................................................#
    #..............................................................................#
    #..............................................................................#
    #..............................................................................#
    #..............................................................................#
    ################################################################################
"""
CELL_M = 0.25
ON_NORTH_WALL = Point(3.1, 2.6)


def drawn(text: str) -> OccupancyGrid:
    return grid_from_text(text, resolution_m=CELL_M)


def look(
    name: str,
    x: float,
    y: float,
    *things: tuple[str, Point],
    off_deg: float = 0.0,
    has_range: bool = False,
) -> Waypoint:
    """A waypoint that looks north and names things in their true directions, or beside them."""
    pose = Pose(x, y, math.pi / 2)
    landmarks = tuple(
        Landmark(
            label=label,
            bearing_rad=pose.point.bearing_to(point) - pose.yaw_rad + math.radians(off_deg),
            range_m=pose.point.distance_to(point) if has_range else None,
        )
        for label, point in things
    )
    return Waypoint(name=name, pose=pose, functional_landmarks=landmarks)


def things_of(*waypoints: Waypoint, text: str = ROOM) -> tuple[Thing, ...]:
    return find_things(SemanticMap(waypoints=waypoints), drawn(text)).things


def three_looks(thing: str = "printer", at: Point = ON_NORTH_WALL) -> tuple[Waypoint, ...]:
    return (
        look("a", 1.5, 0.8, (thing, at)),
        look("b", 3.4, 0.6, (thing, at)),
        look("c", 5.0, 1.0, (thing, at)),
    )


def off_m(thing: Thing, point: Point) -> float:
    assert thing.position is not None
    return thing.position.distance_to(point)


def test_three_views_of_one_thing_make_one_thing_where_they_meet() -> None:
    (printer,) = things_of(*three_looks())
    assert off_m(printer, ON_NORTH_WALL) < 0.25
    assert printer.uncertainty_m is not None
    assert printer.uncertainty_m < 1.0
    assert printer.waypoints == ("a", "b", "c")
    assert printer.confidence_ratio > 0.99


def test_one_bearing_meets_the_first_wall_and_says_how_little_it_knows() -> None:
    (sure,) = things_of(*three_looks())
    (printer,) = things_of(look("a", 3.1, 0.8, ("printer", ON_NORTH_WALL)))
    assert off_m(printer, ON_NORTH_WALL) < 0.4
    assert printer.uncertainty_m is not None
    assert sure.uncertainty_m is not None
    assert printer.uncertainty_m > sure.uncertainty_m
    assert printer.confidence_ratio == pytest.approx(0.8)


def test_a_range_places_a_thing_in_the_middle_of_the_floor() -> None:
    at = Point(3.1, 1.6)
    looks = [
        look("a", 1.0, 1.2, ("table", at), has_range=True),
        look("b", 5.0, 1.2, ("table", at), has_range=True),
        look("c", 3.0, 0.4, ("table", at), has_range=True),
    ]
    (table,) = things_of(*looks)
    assert off_m(table, at) < 0.35


@settings(max_examples=60)
@given(st.floats(-180, 180), st.sampled_from([0, 1, 2]))
def test_a_wrong_view_among_three_hardly_moves_the_place_however_wrong_it_is(
    wrong_deg: float, which: int
) -> None:
    looks = list(three_looks())
    wrong = looks.pop(which)
    (mark,) = wrong.functional_landmarks
    mark = replace(mark, bearing_rad=(mark.bearing_rad or 0.0) + math.radians(wrong_deg))
    (before,) = things_of(*looks)
    after = things_of(*looks, replace(wrong, functional_landmarks=(mark,)))[0]
    assert before.position is not None
    assert set(before.waypoints) <= set(after.waypoints)
    # A view 3 sigma off may still be a right one, and pulls a little.
    assert off_m(after, before.position) <= 0.6


def test_a_view_that_points_past_a_thing_in_plain_sight_speaks_against_it() -> None:
    right = three_looks()
    wrong = look("d", 3.4, 1.4, ("printer", Point(6.1, 1.4)))
    printer, ghost = things_of(*right, wrong)
    assert [view.waypoint for view in printer.conflicting] == ["d"]
    assert math.degrees(printer.conflicting[0].off_rad or 0.0) > 5
    assert ghost.waypoints == ("d",)
    assert ghost.conflicting == ()


def test_a_view_that_looked_another_way_says_nothing_against_a_thing() -> None:
    aside = look("d", 3.4, 1.4, ("printer", Point(6.1, 1.4)))
    turned = replace(aside, pose=Pose(3.4, 1.4, 0.0))
    (mark,) = aside.functional_landmarks
    ahead = replace(turned, functional_landmarks=(replace(mark, bearing_rad=0.0),))
    printer, _other = things_of(*three_looks(), ahead)
    assert printer.conflicting == ()


def test_two_equal_things_seen_from_one_place_stay_two() -> None:
    left, right = Point(1.5, 2.6), Point(4.5, 2.6)
    looks = [
        look("a", 2.0, 0.8, ("extinguisher", left), ("extinguisher", right)),
        look("b", 3.5, 0.8, ("fire extinguisher", left), ("fire extinguisher", right)),
    ]
    found = sorted(things_of(*looks), key=lambda thing: thing.position.x if thing.position else 0)
    assert [thing.waypoints for thing in found] == [("a", "b"), ("a", "b")]
    assert off_m(found[0], left) < 0.4
    assert off_m(found[1], right) < 0.4


def test_a_view_of_a_near_thing_is_not_joined_to_a_like_one_seventeen_metres_behind_it() -> None:
    west, pillar = Point(0.25, 0.8), Point(11.75, 2.4)
    found = things_of(
        look("a", 1.6, 1.2, ("extinguisher", west)),
        look("b", 17.0, 1.2, ("extinguisher", pillar)),
        text=HALL,
    )
    assert sorted(thing.waypoints for thing in found) == [("a",), ("b",)]


def test_told_ranges_weigh_more_than_lines_of_sight_that_happen_to_cross() -> None:
    mark = Landmark(label="chair", bearing_rad=0.0, range_m=0.5)
    along = [
        Waypoint(name=name, pose=Pose(x, 1.4, 0.0), functional_landmarks=(mark,))
        for name, x in (("a", 0.8), ("b", 4.3))
    ]
    found = sorted(things_of(*along), key=lambda thing: thing.waypoints)
    assert [thing.waypoints for thing in found] == [("a",), ("b",)]
    assert off_m(found[0], Point(1.3, 1.4)) < 0.4
    assert off_m(found[1], Point(4.8, 1.4)) < 0.4


def test_ranges_that_differ_by_less_than_their_noise_are_of_one_thing() -> None:
    at = Point(3.1, 1.6)
    a, b, c = (
        look(name, x, y, ("table", at), has_range=True)
        for name, x, y in (("a", 1.0, 1.2), ("b", 5.0, 1.2), ("c", 3.0, 0.4))
    )
    (mark,) = b.functional_landmarks
    far = replace(mark, range_m=(mark.range_m or 0.0) * 1.25)
    (table,) = things_of(a, replace(b, functional_landmarks=(far,)), c)
    assert table.waypoints == ("a", "b", "c")


@pytest.mark.parametrize("has_range", [True, False])
def test_two_equal_things_a_metre_apart_stay_two_when_every_view_names_both(
    *, has_range: bool
) -> None:
    left, right = Point(2.6, 2.6), Point(3.6, 2.6)
    pair = (("chair", left), ("chair", right))
    found = things_of(
        *(
            look(name, x, y, *pair, off_deg=off_deg, has_range=has_range)
            for name, x, y, off_deg in (("a", 1.5, 0.8, 5), ("b", 3.4, 0.6, -5), ("c", 5.0, 1.0, 5))
        )
    )
    assert [len(thing.supporting) for thing in found] == [3, 3]
    for at in (left, right):
        assert min(off_m(thing, at) for thing in found) < 0.4


def test_two_of_a_kind_that_one_place_names_stay_two_though_its_pose_was_estimated_anew() -> None:
    left, right = Point(2.8, 2.6), Point(3.4, 2.6)
    here = look("desk", 3.1, 0.8, ("chair", left))
    moved = replace(here.pose, x=here.pose.x + 0.02)
    bearing_rad = moved.point.bearing_to(right) - moved.yaw_rad
    second = Landmark(label="chair", bearing_rad=bearing_rad, pose=moved)
    both = replace(here, functional_landmarks=(*here.functional_landmarks, second))
    assert len(things_of(both)) == 2


def test_three_views_that_agree_from_three_places_are_counted() -> None:
    (printer,) = things_of(*three_looks())
    assert printer.n_agreeing == 3
    (lone,) = things_of(look("a", 3.1, 0.8, ("printer", ON_NORTH_WALL)))
    assert lone.n_agreeing == 0


def test_a_range_says_that_a_thing_was_seen_over_low_furniture() -> None:
    poster = Point(3.1, 2.6)
    mark = ("poster", poster)
    (before,) = things_of(look("a", 3.1, 0.5, mark), text=LOW_TABLE)
    (behind,) = things_of(look("a", 3.1, 0.5, mark, has_range=True), text=LOW_TABLE)
    assert before.uncertainty_m is not None
    assert behind.uncertainty_m is not None
    assert behind.uncertainty_m < 0.8 * before.uncertainty_m
    assert off_m(behind, poster) < 0.4


def test_things_on_both_sides_of_a_wall_stay_two() -> None:
    west = look("a", 1.5, 1.5, ("socket", Point(3.1, 1.9)))
    east = look("b", 4.7, 1.5, ("socket", Point(3.1, 1.9)))
    far = look("c", 5.0, 2.2, ("socket", Point(6.1, 1.6)))
    found = things_of(west, east, far, text=TWO_ROOMS)
    assert all(
        thing.position is not None and thing.position.x < 3.3
        for thing in found
        if "a" in thing.waypoints
    )
    assert not any({"a", "c"} <= set(thing.waypoints) for thing in found)


def test_nothing_is_placed_behind_a_wall() -> None:
    (plant,) = things_of(look("a", 1.0, 1.8, ("plant", Point(6.0, 1.8))), text=TWO_ROOMS)
    assert plant.position is not None
    assert plant.position.x < 3.4


def test_a_thing_is_called_what_most_call_it() -> None:
    a, b, c = three_looks("fire extinguisher")
    c = look("c", c.pose.x, c.pose.y, ("red extinguisher", ON_NORTH_WALL))
    (thing,) = things_of(a, b, c)
    assert thing.label == "fire extinguisher"
    assert thing.other_labels == ("red extinguisher",)


def test_labels_that_only_a_third_one_joins_are_not_one_thing() -> None:
    at = ON_NORTH_WALL
    found = things_of(
        look("a", 1.5, 0.8, ("coffee machine", at)), look("b", 4.5, 0.8, ("washing machine", at))
    )
    assert len(found) == 2


def test_category_and_purposes_are_gathered() -> None:
    mark = Landmark(label="kit", purpose="used for cuts", bearing_rad=0.0)
    places = [
        Waypoint(name=name, pose=Pose(3.1, y, math.pi / 2), safety_landmarks=(mark,))
        for name, y in (("a", 0.5), ("b", 1.2))
    ]
    (kit,) = things_of(*places)
    assert kit.category is Category.SAFETY
    assert kit.purposes == ("used for cuts",)


def test_a_label_without_a_direction_joins_the_thing_near_by() -> None:
    lost = Waypoint(
        name="z", pose=Pose(3.0, 1.5), functional_landmarks=(Landmark(label="printer"),)
    )
    (printer,) = things_of(*three_looks(), lost)
    assert printer.waypoints == ("a", "b", "c", "z")


def test_a_label_without_a_direction_alone_has_no_place() -> None:
    lost = Waypoint(
        name="z", pose=Pose(3.0, 1.5), functional_landmarks=(Landmark(label="printer"),)
    )
    (printer,) = things_of(lost)
    assert printer.position is None
    assert printer.uncertainty_m is None


def test_an_unsure_observer_counts_less() -> None:
    mark = Landmark(label="sink", bearing_rad=0.0, confidence=Confidence.UNSURE)
    pose = Pose(3.1, 0.8, math.pi / 2)
    (unsure,) = things_of(Waypoint(name="a", pose=pose, functional_landmarks=(mark,)))
    assert unsure.confidence_ratio == pytest.approx(0.6)


def test_a_waypoint_off_the_map_or_in_a_wall_harms_nobody() -> None:
    off = look("off", 500.0, -40.0, ("printer", ON_NORTH_WALL))
    inside = look("inside", 0.1, 0.1, ("printer", ON_NORTH_WALL))
    found = things_of(*three_looks(), off, inside)
    assert found[0].waypoints[:3] == ("a", "b", "c")


def test_no_waypoints_are_no_things() -> None:
    assert things_of() == ()


@settings(max_examples=15)
@given(st.permutations([0, 1, 2, 3, 4]))
def test_the_order_of_waypoints_does_not_matter(order: list[int]) -> None:
    looks = (
        *three_looks(),
        look("d", 2.0, 1.4, ("printer", Point(0.2, 1.0))),
        look("e", 4.0, 1.4, ("sink", Point(6.1, 1.0)), ("printer", ON_NORTH_WALL)),
    )
    assert things_of(*(looks[i] for i in order)) == things_of(*looks)


@settings(max_examples=25)
@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1))
def test_a_turned_and_shifted_world_turns_and_shifts_the_places(
    x: float, y: float, yaw_rad: float
) -> None:
    moved_from_map = Pose(x, y, yaw_rad)
    looks = three_looks()
    grid = drawn(ROOM)
    moved_grid = OccupancyGrid(cells=grid.cells, resolution_m=CELL_M, origin=moved_from_map)
    moved = tuple(replace(each, pose=moved_from_map @ each.pose) for each in looks)
    (here,) = find_things(SemanticMap(waypoints=looks), grid).things
    (there,) = find_things(SemanticMap(waypoints=moved), moved_grid).things
    assert here.position is not None
    assert off_m(there, moved_from_map.transform(here.position)) < 0.05


EDITS = st.lists(
    st.tuples(
        st.sampled_from("abcdef"),
        st.one_of(
            st.none(),
            st.lists(
                st.tuples(
                    st.sampled_from(["printer", "sink", "sink 2"]),
                    st.one_of(st.none(), st.sampled_from([-1.2, -0.3, 0.0, 0.4, 1.5])),
                    st.one_of(st.none(), st.just(0.9)),
                ),
                max_size=3,
            ),
        ),
        st.sampled_from([(0.6, 0.8), (1.5, 1.4), (2.5, 0.6), (4.0, 1.2), (5.5, 2.0)]),
    ),
    min_size=1,
    max_size=6,
)


@settings(max_examples=40)
@given(EDITS)
def test_after_any_writes_edits_and_forgets_the_things_are_those_of_a_joining_from_nothing(
    edits: list[
        tuple[str, list[tuple[str, float | None, float | None]] | None, tuple[float, float]]
    ],
) -> None:
    grid = drawn(TWO_ROOMS)
    known: dict[str, Waypoint] = {each.name: each for each in three_looks()}
    found = find_things(SemanticMap(waypoints=tuple(known.values())), grid)
    for name, told, (x, y) in edits:
        known.pop(name, None)
        if told is not None:
            marks = tuple(
                Landmark(label=label, bearing_rad=bearing, range_m=bearing and range_m)
                for label, bearing, range_m in told
            )
            known[name] = Waypoint(name=name, pose=Pose(x, y, 1.0), functional_landmarks=marks)
        memory = SemanticMap(waypoints=tuple(known.values()))
        found = find_things(memory, grid, earlier=found)
        assert found.things == find_things(memory, grid).things


def test_a_write_joins_only_the_views_that_it_touches() -> None:
    grid = drawn(TWO_ROOMS)
    west = [look(each, 1.5, y, ("sink", Point(0.2, 1.2))) for each, y in (("a", 0.8), ("b", 1.6))]
    east = look("c", 5.0, 0.8, ("sink", Point(6.1, 1.2)), has_range=True)
    earlier = find_things(SemanticMap(waypoints=(*west, east)), grid)
    more = look("d", 5.2, 1.6, ("sink", Point(6.1, 1.2)), has_range=True)

    later = find_things(SemanticMap(waypoints=(*west, east, more)), grid, earlier=earlier)

    assert later.n_joined == 2
    known = {id(thing) for thing in earlier.things}
    assert [thing.waypoints for thing in later.things if id(thing) in known] == [("a", "b")]


def test_what_no_changed_waypoint_touches_is_not_worked_out_again() -> None:
    grid = drawn(ROOM)
    sink = look("d", 2.0, 1.4, ("sink", Point(0.2, 1.0)))
    earlier = find_things(SemanticMap(waypoints=(*three_looks(), sink)), grid)
    moved = replace(sink, pose=Pose(2.2, 1.4, math.pi / 2))
    later = find_things(SemanticMap(waypoints=(*three_looks(), moved)), grid, earlier=earlier)
    known = {id(thing) for thing in earlier.things}
    assert [thing.label for thing in later.things if id(thing) in known] == ["printer"]


@pytest.mark.parametrize(
    ("label", "other", "is_same"),
    [
        ("fire extinguisher", "extinguisher", True),
        ("red extinguisher", "fire extinguishers", True),
        ("Exit sign", "green exit sign on the wall", True),
        ("coffee machine", "washing machine", False),
        ("fire hose", "fire extinguisher", False),
        ("table", "cable", False),
        ("red", "red", True),
        ("소화기", "소화기", True),
        ("!", "!", True),
        ("gate 3", "gate 4", False),
        ("gate 3", "gate 03", True),
        ("gate 3", "gate", True),
        ("gate B", "gate C", False),
        ("pump P1", "pump P2", False),
        ("pump P1", "red pump P1", True),
        ("left door", "right door", False),
        ("left door", "door", True),
        ("rack 1, upper shelf", "rack 1", True),
        ("2 chairs", "3 chairs", True),
        ("a box", "box", True),
        ("1.5 m shelf", "2 m shelf", True),
        ("first aid kit", "first aid box", True),
        ("fridge", "refrigerator", True),
        ("red couch", "sofa", True),
        ("night stand", "bedside table", True),
        ("dining table", "tennis table", False),
    ],
)
def test_labels_name_the_same_by_their_words(label: str, other: str, *, is_same: bool) -> None:
    assert name_the_same(label, other) is is_same
    assert name_the_same(other, label) is is_same


def test_one_stands_on_the_side_from_which_a_thing_was_seen_and_faces_it() -> None:
    grid = drawn(TWO_ROOMS)
    distances = distances_from(grid, Point(1.0, 1.0), radius_m=0.2)
    sight = build_sight_map(grid)
    on_wall = Point(3.1, 1.9)
    for viewer, is_west in ((Point(1.0, 1.5), True), (Point(5.0, 1.5), False)):
        pose = find_stands(sight, distances, on_wall, [viewer]).choose(distances)
        assert pose is not None
        assert (pose.x < 3.0) is is_west
        assert pose.point.distance_to(on_wall) <= 1.5
        assert pose.yaw_rad == pytest.approx(pose.point.bearing_to(on_wall))


def test_nobody_is_sent_to_where_the_robot_cannot_get_to() -> None:
    grid = drawn(TWO_ROOMS.replace(".......................", "...........#...........", 1))
    cells = np.where(np.arange(grid.n_cols) == 12, 100, grid.cells)
    closed = OccupancyGrid(cells=cells.astype(np.int8), resolution_m=CELL_M)
    distances = distances_from(closed, Point(1.0, 1.0), radius_m=0.2)
    target, viewer = Point(6.0, 1.5), Point(4.5, 1.5)
    assert (
        find_stands(build_sight_map(closed), distances, target, [viewer]).choose(distances) is None
    )


def test_views_of_one_place_from_two_poses_meet_as_those_of_two_places_do() -> None:
    west = look("desk", 1.5, 0.8, ("printer", ON_NORTH_WALL))
    east = look("desk", 5.0, 1.0, ("printer", ON_NORTH_WALL))
    (printer,) = things_of(merge_waypoint(west, east).waypoint)
    (apart,) = things_of(west, replace(east, name="shelf"))
    assert off_m(printer, ON_NORTH_WALL) < 0.3
    assert printer.position == apart.position
    assert printer.confidence_ratio == pytest.approx(apart.confidence_ratio)
    assert len(printer.supporting) == 2
    assert printer.waypoints == ("desk",)


def test_what_a_place_keeps_stays_where_it_is_when_the_place_is_noted_from_elsewhere() -> None:
    before = look("desk", 3.1, 0.8, ("printer", ON_NORTH_WALL))
    now = look("desk", 5.0, 0.8, ("sink", Point(5.0, 2.6)))
    (there,) = things_of(before)
    after = {thing.label: thing for thing in things_of(merge_waypoint(before, now).waypoint)}
    assert after["printer"].position == there.position


def test_what_is_known_of_a_place_with_several_poses_changes_no_answer() -> None:
    west = look("desk", 1.5, 0.8, ("printer", ON_NORTH_WALL))
    both = merge_waypoint(west, look("desk", 5.0, 1.0, ("printer", ON_NORTH_WALL))).waypoint
    grid = drawn(ROOM)
    places = SemanticMap(waypoints=(both,))
    earlier = find_things(SemanticMap(waypoints=(west,)), grid)
    assert find_things(places, grid, earlier=earlier).things == find_things(places, grid).things


def test_neighbours_with_numbers_are_things_of_their_own() -> None:
    grid = drawn(ROOM)
    at = {f"charger {number}": Point(0.6 + 0.8 * number, 0.2) for number in range(1, 5)}
    looks = [
        look(f"{label} {side}", place.x + side, 1.4, (label, place))
        for label, place in at.items()
        for side in (-0.4, 0.4)
    ]

    things = find_things(SemanticMap(waypoints=tuple(looks)), grid).things

    assert sorted(each.label for each in things) == sorted(at)
    assert all(
        each.position is not None and each.position.distance_to(at[each.label]) < 0.3
        for each in things
    )


def test_a_thing_with_two_names_in_one_spot_is_one_thing() -> None:
    grid = drawn(ROOM)
    place = Point(0.2, 1.0)
    looks = [
        look("a", 1.6, 1.4, ("fridge", place)),
        look("b", 1.2, 0.6, ("refrigerator", place)),
        look("c", 1.8, 1.0, ("fridge", place)),
    ]

    (thing,) = find_things(SemanticMap(waypoints=tuple(looks)), grid).things

    assert (thing.label, thing.other_labels) == ("fridge", ("refrigerator",))


def test_labels_are_grouped_as_if_each_was_compared_with_all() -> None:
    labels = ["sink 1", "sink 2", "red sink 2", "tap", "faucet", "gate", "gate 3", "gate 4"]

    assert sorted(map(sorted, group_names(labels))) == [
        ["faucet", "tap"],
        ["gate", "gate 3", "gate 4"],
        ["red sink 2", "sink 2"],
        ["sink 1"],
    ]


def test_views_that_only_seem_to_meet_beyond_what_nobody_saw_are_of_two_things() -> None:
    unseen_between = [
        "#" * 41,
        *["#" + "." * 14 + "#" + "." * 24 + "#"] * 7,
        *["#" + "." * 14 + "?" + "." * 24 + "#"] * 3,
        *["#" + "." * 14 + "#" + "." * 24 + "#"] * 2,
        "#" * 16 + "?" * 10 + "#" * 15,
        *["#" + "." * 14 + "#" + "?" * 8 + "." * 16 + "#"] * 6,
        *["#" + "." * 38 + "##"] * 12,
        "#" * 41,
    ]
    one = look("a", 0.879, 6.291, ("waste bin", Point(1.821, 4.8)))
    other = look("b", 6.723, 1.092, ("waste bin", Point(0.2, 2.411)))
    assert len(things_of(one, other, text="\n".join(unseen_between))) == 2


@pytest.mark.parametrize("slit_col", [18, 19, 21, 22, 23, 25])
def test_a_chair_of_a_hall_is_not_taken_for_one_that_a_slit_in_the_wall_would_show(
    slit_col: int,
) -> None:
    def room(n_rows: int, table: slice, at_rows: range) -> list[str]:
        row = "#" + "." * 58 + "#"
        with_table = row[: table.start] + "#" * (table.stop - table.start) + row[table.stop :]
        return [with_table if number in at_rows else row for number in range(n_rows)]

    slit = "#" * slit_col + "." + "#" * (59 - slit_col)
    hall, office = room(60, slice(18, 28), range(38, 46)), room(40, slice(16, 24), range(24, 31))
    text = "\n".join(["#" * 60, *hall, slit, slit, *office, "#" * 60])
    looks = [
        Waypoint(
            name=name,
            pose=pose,
            functional_landmarks=(
                Landmark(
                    label="chair",
                    bearing_rad=pose.point.bearing_to(at),
                    bearing_from="picture",
                ),
            ),
        )
        for name, pose, at in (
            ("hall", Pose(2.4, 9.75, 0.0), Point(2.3, 6.1)),
            ("office", Pose(2.8, 3.0, 0.0), Point(2.0, 1.3)),
        )
    ]

    things = find_things(
        SemanticMap(waypoints=tuple(looks)), grid_from_text(text, resolution_m=0.1)
    ).things

    assert sorted(thing.waypoints for thing in things) == [("hall",), ("office",)]
