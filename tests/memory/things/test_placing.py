"""How far one view alone says where a thing is."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.memory.things.finding import find_things
from mapspeak.memory.things.thing import Thing

CORRIDOR = """
    ##################################################
    #................................................#
    #................................................#
    #................................................#
    #................................................#
    #................................................#
    #................................................#
    #................................................#
    ##################################################
"""


WITH_A_TABLE = """
    ##################################################
    #................................................#
    #................................................#
    #....................####........................#
    #....................####........................#
    #....................####........................#
    #................................................#
    #................................................#
    ##################################################
"""


def seen_down_the_corridor(
    range_m: float | None, *, label: str = "chair", source: str | None = None, text: str = CORRIDOR
) -> Thing:
    mark = Landmark(label=label, bearing_rad=0.0, range_m=range_m, bearing_from=source)
    place = Waypoint(name="a", pose=Pose(1.0, 1.2, 0.0), functional_landmarks=(mark,))
    grid = grid_from_text(text, resolution_m=0.25)
    (thing,) = find_things(SemanticMap(waypoints=(place,)), grid).things
    return thing


def test_what_hangs_on_walls_is_placed_at_the_wall_behind_a_table_and_not_at_the_table() -> None:
    on_wall = seen_down_the_corridor(
        None, label="fire extinguisher", source="picture", text=WITH_A_TABLE
    )
    standing = seen_down_the_corridor(None, label="crate", source="picture", text=WITH_A_TABLE)
    assert on_wall.position is not None
    assert on_wall.position.x > 10.0
    assert standing.position is not None
    assert standing.position.x < 7.0


def test_a_table_is_placed_at_what_stands_free_more_surely_than_a_crate() -> None:
    table, crate = (
        seen_down_the_corridor(None, label=label, source="picture", text=WITH_A_TABLE)
        for label in ("table", "crate")
    )
    assert table.position is not None
    assert table.position.x < 7.0
    assert table.uncertainty_m is not None
    assert crate.uncertainty_m is not None
    assert table.uncertainty_m < crate.uncertainty_m - 1.0


HIDDEN_WALL = """
    ########################################
    #..................#...................#
    #..................#...................#
    #................##?##.................#
    #................##?##.................#
    #................##?##.................#
    #................##?##.................#
    #..................#...................#
    #..................#...................#
    ########################################
"""


def test_nothing_is_seen_through_a_wall_that_furniture_hides_on_both_sides() -> None:
    clock = seen_down_the_corridor(None, label="clock", source="picture", text=HIDDEN_WALL)
    assert clock.position is not None
    assert clock.uncertainty_m is not None
    assert clock.position.x + clock.uncertainty_m < 7.0


ROW_AT_THE_WALL = """
    ##################################################
    #................................................#
    #................................................#
    #................................................#
    #................................................#
    #.............################...................#
    #.............################...................#
    #.............################...................#
    ##################################################
"""


def test_what_hangs_behind_a_row_of_pallets_at_the_wall_is_seen_over_them() -> None:
    alarm, place = 8.5, Pose(1.0, 0.9, 0.0)
    bearing_rad = math.atan2(0.25 - place.y, alarm - place.x)
    mark = Landmark(
        label="fire alarm", bearing_rad=bearing_rad, range_m=7.5, bearing_from="detector"
    )
    seen = Waypoint(name="a", pose=place, safety_landmarks=(mark,))
    grid = grid_from_text(ROW_AT_THE_WALL, resolution_m=0.25)
    (thing,) = find_things(SemanticMap(waypoints=(seen,)), grid).things
    assert thing.position is not None
    assert thing.position.x == pytest.approx(alarm, abs=1.0)


def test_a_thing_right_before_the_robot_has_a_place() -> None:
    mark = Landmark(label="chair", bearing_rad=-1.628, bearing_from="picture")
    place = Waypoint(name="a", pose=Pose(4.78, 0.63, 0.0), functional_landmarks=(mark,))
    grid = grid_from_text(WITH_A_TABLE, resolution_m=0.25)
    (thing,) = find_things(SemanticMap(waypoints=(place,)), grid).things
    assert thing.position is not None
    assert thing.position.distance_to(place.pose.point) < 0.8


def test_a_direction_that_was_measured_says_more_than_one_that_was_judged() -> None:
    judged = seen_down_the_corridor(3.0)
    measured = seen_down_the_corridor(3.0, source="picture")
    assert measured.uncertainty_m is not None
    assert judged.uncertainty_m is not None
    assert measured.uncertainty_m < judged.uncertainty_m


@pytest.mark.parametrize(("range_m", "radius_m"), [(0.5, 0.6), (1.0, 0.8), (2.0, 1.4)])
def test_a_lone_range_places_a_thing_on_open_floor_and_says_how_well(
    range_m: float, radius_m: float
) -> None:
    chair = seen_down_the_corridor(range_m)
    assert chair.position is not None
    assert chair.position.x == pytest.approx(1.0 + range_m, abs=0.4)
    assert chair.uncertainty_m is not None
    assert chair.uncertainty_m < radius_m


def test_without_a_range_the_same_direction_says_little() -> None:
    chair = seen_down_the_corridor(None)
    assert chair.uncertainty_m is not None
    assert chair.uncertainty_m > 3.0


def test_a_range_that_fits_nothing_in_sight_leaves_the_direction_its_say() -> None:
    chair = seen_down_the_corridor(30.0)
    assert chair.position is not None
    assert chair.position.x > 2.0


@pytest.mark.parametrize("at_x", [5.0, 7.0, 9.0])
def test_what_two_looks_down_a_corridor_have_between_them_is_placed_there(at_x: float) -> None:
    long_wall = [*["#" * 80], *["#" + "." * 78 + "#"] * 8, *["#" * 80]]
    grid = grid_from_text("\n".join(long_wall), resolution_m=0.25)
    looks = tuple(
        Waypoint(
            name=name,
            pose=Pose(at_x + ahead_m, 0.5, 0.0),
            safety_landmarks=(
                Landmark(
                    label="fire extinguisher",
                    bearing_rad=math.atan2(-0.25, -ahead_m),
                    bearing_from="picture",
                ),
            ),
        )
        for name, ahead_m in (("a", -3.0), ("b", 4.5))
    )

    (thing,) = find_things(SemanticMap(waypoints=looks), grid).things

    assert thing.position is not None
    assert thing.position.x == pytest.approx(at_x, abs=0.6)
    assert all(view.off_rad is not None and view.off_rad < 0.1 for view in thing.supporting)


BEARINGS = st.floats(-math.pi, math.pi)
SPOTS = st.tuples(st.floats(0.6, 11.5), st.floats(0.6, 1.6))
A_LITTLE = st.floats(-math.radians(3), math.radians(3))


@given(first=SPOTS, second=SPOTS, one=BEARINGS, off_rad=A_LITTLE)
def test_a_second_view_that_points_at_a_thing_never_enlarges_its_radius(
    first: tuple[float, float], second: tuple[float, float], one: float, off_rad: float
) -> None:
    grid = grid_from_text(WITH_A_TABLE, resolution_m=0.25)

    def look(name: str, spot: tuple[float, float], bearing: float) -> Waypoint:
        mark = Landmark(label="chair", bearing_rad=bearing, bearing_from="picture")
        return Waypoint(name=name, pose=Pose(*spot, 0.0), functional_landmarks=(mark,))

    seen = look("a", first, one)
    (alone,) = find_things(SemanticMap(waypoints=(seen,)), grid).things
    assert alone.position is not None
    again = look("b", second, Point(*second).bearing_to(alone.position) + off_rad)
    both = find_things(SemanticMap(waypoints=(seen, again)), grid).things

    (now,) = (thing for thing in both if "a" in thing.waypoints)
    assert now.uncertainty_m is not None
    assert alone.uncertainty_m is not None
    assert now.uncertainty_m <= alone.uncertainty_m + 1e-9
