"""A thing that later looks miss where it stood, and that is new elsewhere, is one that moved."""

import math
from datetime import UTC, datetime, timedelta

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.places.asking import RecallQuery, recall
from mapspeak.places.relations.choosing import find_place
from mapspeak.worldmodel.model import WorldModel

ROOM = """
    ####################
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    ####################
"""
OLD, NEW = Point(1.5, 1.9), Point(4.0, 1.6)
BEFORE_OLD = (Point(0.6, 0.6), Point(1.5, 0.5), Point(2.4, 0.7))
BEFORE_NEW = (Point(3.4, 0.7), Point(4.2, 0.5))
MONDAY = datetime(2026, 11, 23, 9, 0, tzinfo=UTC)


def look(name: str, stand: Point, at: Point, *labels: str, day: int) -> Waypoint:
    seen = tuple(
        Landmark(label=each, bearing_rad=0.0, range_m=stand.distance_to(at)) for each in labels
    )
    return Waypoint(
        name=name,
        pose=Pose(stand.x, stand.y, stand.bearing_to(at)),
        functional_landmarks=seen,
        recorded_at=MONDAY + timedelta(days=day),
        picture=f"{name}.jpg",
    )


def seen_at(at: Point, stands: tuple[Point, ...], *labels: str, day: int) -> list[Waypoint]:
    return [
        look(f"{at.x} on day {day} by {number}", stand, at, *labels, day=day)
        for number, stand in enumerate(stands)
    ]


def room_of(*waypoints: Waypoint) -> WorldModel:
    grid = grid_from_text(ROOM, resolution_m=0.25)
    return WorldModel(grid, Pose(2.5, 1.2), SemanticMap(waypoints=waypoints), radius_m=0.2)


def test_a_fridge_that_was_moved_is_one_candidate_where_it_stands_now() -> None:
    world = room_of(
        *seen_at(OLD, BEFORE_OLD, "fridge", day=0),
        *seen_at(OLD, BEFORE_OLD, day=7),
        *seen_at(NEW, BEFORE_NEW, "refrigerator", day=8),
    )

    answer = recall(world, RecallQuery(words="fridge"))

    (fridge,) = answer.candidates
    assert fridge.position is not None
    assert fridge.position.distance_to(NEW) < 0.5
    assert answer.answer.n_meant == 1


def test_the_old_id_of_a_moved_thing_and_its_name_lead_to_where_it_stands_now() -> None:
    world = room_of(
        *seen_at(OLD, BEFORE_OLD, "fridge", day=0),
        *seen_at(OLD, BEFORE_OLD, day=7),
        *seen_at(NEW, BEFORE_NEW, "fridge", day=8),
    )
    old = min(world.things, key=lambda each: each.point.distance_to(OLD))

    for words in (old.id, "fridge", "nearest fridge"):
        assert find_place(world, words).point.distance_to(NEW) < 0.5


def test_a_fridge_that_is_new_while_the_old_one_was_not_missed_is_another() -> None:
    world = room_of(
        *seen_at(OLD, BEFORE_OLD, "fridge", day=0),
        *seen_at(NEW, BEFORE_NEW, "fridge", day=8),
    )

    assert len(recall(world, RecallQuery(words="fridge")).candidates) == 2


def test_a_fridge_that_may_have_gone_to_two_places_stays_by_itself() -> None:
    between = Point(2.6, 0.3)
    world = room_of(
        *seen_at(OLD, BEFORE_OLD, "fridge", day=0),
        *seen_at(OLD, BEFORE_OLD, day=7),
        *seen_at(NEW, BEFORE_NEW, "fridge", day=8),
        *seen_at(between, (Point(2.6, 1.5), Point(3.2, 1.2)), "fridge", day=8),
    )

    assert len(recall(world, RecallQuery(words="fridge")).candidates) == 3


def test_gate_4_is_not_gate_3_that_moved() -> None:
    world = room_of(
        *seen_at(OLD, BEFORE_OLD, "gate 3", day=0),
        *seen_at(OLD, BEFORE_OLD, day=7),
        *seen_at(NEW, BEFORE_NEW, "gate 4", day=8),
    )
    assert math.isclose(find_place(world, "gate 3").point.distance_to(OLD), 0.0, abs_tol=0.5)
