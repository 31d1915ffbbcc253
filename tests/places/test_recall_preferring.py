"""Which of several things of one name is known so well that it is the answer."""

import pytest

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMap, Waypoint
from mapspeak.memory.search.answer import Verdict
from mapspeak.places.asking import RecallQuery, recall
from mapspeak.worldmodel.model import WorldModel
from remembering import look

HALL = """
    ################################
    #..............................#
    #..............................#
    #..............................#
    #..............................#
    #..............................#
    #..............................#
    #..............................#
    #..............................#
    ################################
"""
ON_NORTH_WALL = Point(2.5, 2.3)
WEST = Pose(1.0, 1.0, 0.0)


def hall_of(*waypoints: Waypoint, robot: Pose = WEST) -> WorldModel:
    return WorldModel(
        grid_from_text(HALL, resolution_m=0.25),
        robot,
        SemanticMap(waypoints=waypoints),
        radius_m=0.2,
    )


def seen(name: str, x: float, y: float, at: Point) -> Waypoint:
    far_m = Point(x, y).distance_to(at)
    return look(name, x, y, ("hydrant", at), yaw_deg=90, range_m=far_m)


@pytest.mark.parametrize(
    ("away_m", "verdict"), [(1.7, Verdict.SEVERAL), (2.4, Verdict.FOUND), (4.0, Verdict.FOUND)]
)
def test_the_best_known_of_a_name_is_found_only_where_no_other_of_the_name_is_within_two_metres(
    away_m: float, verdict: Verdict
) -> None:
    three = [
        seen(name, x, y, ON_NORTH_WALL)
        for name, x, y in (("a", 1.5, 1.0), ("b", 2.5, 0.9), ("c", 3.5, 1.0))
    ]
    other = Point(ON_NORTH_WALL.x + away_m, ON_NORTH_WALL.y)
    world = hall_of(*three, seen("d", other.x + 0.3, 1.5, other))
    first, second = (each.thing for each in world.things)
    assert first.position is not None
    assert second.position is not None
    assert first.position.distance_to(second.position) == pytest.approx(away_m, abs=0.2)
    answer = recall(world, RecallQuery(words="hydrant"))
    assert answer.answer.n_meant == 2
    assert answer.verdict is verdict


@pytest.mark.parametrize(
    ("robot_x", "verdict", "first_x"),
    [(1.0, Verdict.FOUND, 2.5), (7.0, Verdict.SEVERAL, 6.5)],
)
def test_of_two_sure_ones_of_a_name_the_nearer_comes_first_though_more_looks_speak_for_the_other(
    robot_x: float, verdict: Verdict, first_x: float
) -> None:
    other = Point(6.5, 2.3)
    looks = [("a", 1.5, 1.0), ("b", 2.5, 0.9), ("c", 3.5, 1.0)]
    three = [seen(name, x, y, ON_NORTH_WALL) for name, x, y in looks]
    two = [seen("d", 6.0, 0.9, other), seen("e", 7.0, 1.0, other)]
    world = hall_of(*three, *two, robot=Pose(robot_x, 1.0, 0.0))
    assert [each.thing.n_agreeing for each in world.things] == [3, 2]
    answer = recall(world, RecallQuery(words="hydrant"))
    first = answer.candidates[0]
    assert answer.verdict is verdict
    assert first.position is not None
    assert first.position.x == pytest.approx(first_x, abs=0.5)
