import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drawing import grid_from_text
from mapspeak.driving.routes.planning import RoutePlan, find_candidates, plan_route
from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.worldmodel.model import WorldModel

CORRIDOR = """
############################################
#..........................................#
#..........................................#
#..........................................#
#..........................................#
############################################
"""
ROBOT = Pose(5.0, 0.7, 0.0)


def _place(name: str, x: float, *labels: str) -> Waypoint:
    landmarks = tuple(Landmark(label=label) for label in labels)
    return Waypoint(name=name, pose=Pose(x, 0.7, 0.0), safety_landmarks=landmarks)


WEST = _place("west end", 4.0, "extinguisher")
EAST = _place("east end", 7.0, "extinguisher")
EXIT = _place("way out", 10.0, "exit sign")


def _world(*waypoints: Waypoint, text: str = CORRIDOR) -> WorldModel:
    grid = grid_from_text(text, resolution_m=0.25)
    memory = SemanticMap(waypoints=waypoints or (WEST, EAST, EXIT))
    return WorldModel(grid, ROBOT, memory, radius_m=0.2)


def _names(plan: RoutePlan) -> list[str]:
    return [stop.goal.name for stop in plan.stops]


def test_words_that_fit_several_places_are_taken_where_the_whole_route_is_shortest() -> None:
    plan = plan_route(_world(), ["extinguisher", "exit sign"])
    assert _names(plan) == ["T2", "exit sign"]
    assert [stop.n_candidates for stop in plan.stops] == [2, 1]
    assert plan.total_m == pytest.approx(5.0, abs=0.3)
    assert plan.greedy_m == pytest.approx(7.0, abs=0.3)


def test_the_legs_are_path_lengths_from_the_robot_on() -> None:
    plan = plan_route(_world(), ["W1", "west end", "9.0, 0.7", "0.5 m west of W3"])
    assert [stop.leg_m for stop in plan.stops] == pytest.approx([1.0, 0.0, 5.0, 0.6], abs=0.3)
    assert plan.greedy_m == pytest.approx(plan.total_m)


def test_a_name_that_two_places_have_is_a_choice_on_a_route() -> None:
    twins = (_place("bin", 2.0), _place("Bin", 7.0), EXIT)
    assert _names(plan_route(_world(*twins), ["bin", "W3"])) == ["W2", "W3"]


def test_a_relation_to_an_ambiguous_thing_is_a_choice_too() -> None:
    chairs = [Landmark(label="chair", bearing_rad=0.0, range_m=range_m) for range_m in (0.5, 5.5)]
    seen = Waypoint(name="hall", pose=Pose(2.5, 0.7), functional_landmarks=tuple(chairs))
    plan = plan_route(_world(seen, EXIT), ["next to the chair", "W2"])
    assert plan.stops[0].n_candidates == 2
    assert plan.stops[0].goal.pose.x > 6.0


def test_the_nearest_of_a_kind_is_the_nearest_on_the_route() -> None:
    plan = plan_route(_world(), ["nearest remembered place", "W3"])
    assert [stop.n_candidates for stop in plan.stops] == [3, 1]
    assert plan.total_m == pytest.approx(5.0, abs=0.3)


@pytest.mark.parametrize(
    ("stops", "says"),
    [
        ([], "1 to 20 stops"),
        (["W1"] * 21, "1 to 20 stops"),
        (["W1", "the moon"], "Stop 2: There is no place called 'the moon'"),
        (["W1", "40, 40"], "Stop 2: .*off the map"),
        (["left of W9"], "no place called 'W9'"),
    ],
)
def test_a_route_that_makes_no_sense_is_refused_with_the_stop(stops: list[str], says: str) -> None:
    with pytest.raises(GoalError, match=says):
        plan_route(_world(), stops)


def test_a_meaning_that_cannot_be_reached_is_no_candidate() -> None:
    walled = CORRIDOR.replace("........#\n", "..#.....#\n")
    world = _world(WEST, _place("closet", 10.4, "extinguisher"), text=walled)
    assert [each.name for each in find_candidates(world, "extinguisher")] == ["T2"]


@settings(max_examples=25)
@given(
    places=st.lists(
        st.tuples(st.sampled_from("abc"), st.floats(0.6, 10.2)), min_size=3, max_size=9
    ),
    wanted=st.lists(st.sampled_from("abc"), min_size=1, max_size=4),
)
def test_no_choice_of_places_is_shorter_than_the_one_that_was_planned(
    places: list[tuple[str, float]], wanted: list[str]
) -> None:
    waypoints = [
        _place(f"p{n}", x, f"{kind}-thing") for n, (kind, x) in enumerate([*places, *EACH])
    ]
    world = _world(*waypoints)
    plan = plan_route(world, [f"{kind}-thing" for kind in wanted])
    kinds = [place[0] for place in [*places, *EACH]]
    choices = [
        [each.pose.point for each, name in zip(waypoints, kinds, strict=True) if name == kind]
        for kind in wanted
    ]
    best_m = min(_straight_m(points) for points in itertools.product(*choices))
    assert plan.total_m <= best_m + 0.3 * len(wanted)
    assert plan.total_m <= plan.greedy_m + 1e-6


EACH = (("a", 1.0), ("b", 5.5), ("c", 9.0))


def _straight_m(points: tuple[Point, ...]) -> float:
    """Gives the way past points of the corridor, in which straight is shortest."""
    return math.fsum(a.distance_to(b) for a, b in itertools.pairwise((ROBOT.point, *points)))
