"""What events do to ways: closed floor is never driven, burdened floor only where it must be."""

from datetime import timedelta

import pytest

from closing import EAST, NOW, RADIUS_M, WEST, event, goes_north, office, revision_with, world_on
from guarding import corners
from mapspeak.geometry import Point, Pose
from mapspeak.memory.events import Effect, Event
from mapspeak.places.recall.events import (
    close_floor_of,
    say_unplaced,
)
from mapspeak.places.relations.choosing import find_place
from mapspeak.places.ways import find_way
from mapspeak.safety.planning import plan_legs
from mapspeak.worldmodel.revision import MapRevision


def test_without_events_the_shorter_way_is_taken() -> None:
    assert goes_north(revision_with())


@pytest.mark.parametrize("effect", [Effect.CLOSED, Effect.AVOID, Effect.SLOW])
def test_a_way_round_is_taken_where_there_is_one(effect: Effect) -> None:
    assert not goes_north(revision_with(event(effect)))


def test_a_mere_note_changes_nothing() -> None:
    revision = revision_with(Event(text="the coffee machine is broken", place="C1"))

    assert revision.areas == ()
    assert revision.hindrances == ()
    assert goes_north(revision)


@pytest.mark.parametrize("effect", list(Effect))
def test_an_event_that_is_over_changes_nothing(effect: Effect) -> None:
    over = event(effect, begins=NOW - timedelta(hours=2), until=NOW)

    assert goes_north(revision_with(over))


def test_what_is_to_be_avoided_is_driven_over_where_there_is_no_other_way() -> None:
    south = corners((8.5, 1.0), (15.5, 3.5))
    both = revision_with(event(Effect.AVOID), event(Effect.CLOSED, outlines=(south,)))

    assert goes_north(both)


def test_what_is_closed_is_not_driven_over_where_there_is_no_other_way() -> None:
    south = corners((8.5, 1.0), (15.5, 3.5))
    both = revision_with(event(Effect.CLOSED), event(Effect.CLOSED, outlines=(south,)))

    assert both.find_path(WEST, EAST) is None


def test_a_goal_in_what_is_to_be_avoided_is_reached() -> None:
    assert revision_with(event(Effect.AVOID)).find_path(WEST, Point(12.0, 6.5)) is not None


def test_a_way_tells_its_own_length_not_what_it_counts() -> None:
    plain, hindered = (world_on(revision_with(*each)) for each in ((), (event(Effect.AVOID),)))
    ways = [
        find_way(each, find_place(each, "robot"), find_place(each, f"{EAST.x}, {EAST.y}"))
        for each in (plain, hindered)
    ]

    assert ways[0].path_m is not None
    assert ways[1].path_m is not None
    assert ways[0].path_m < ways[1].path_m < ways[0].path_m + 8.0


def test_a_robot_is_led_round_by_legs() -> None:
    goal = Pose(EAST.x, EAST.y)

    assert plan_legs(revision_with(), WEST, goal) == (goal,)
    legs = plan_legs(revision_with(event(Effect.AVOID)), WEST, goal)
    assert len(legs) > 1
    assert any(leg.y < 4.0 for leg in legs)


def test_a_robot_that_must_cross_gets_its_goal_alone() -> None:
    goal = Pose(12.0, 6.5)

    assert plan_legs(revision_with(event(Effect.AVOID)), WEST, goal) == (goal,)


def test_an_event_without_an_outline_is_where_its_id_is_now() -> None:
    revision = MapRevision(office(), radius_m=RADIUS_M)
    room = revision.rooms.find_region_at(WEST)
    assert room is not None

    (area,) = close_floor_of([event(Effect.CLOSED, place=room.id, outlines=())], revision, NOW)

    assert area.contains(WEST)
    assert not area.contains(EAST)


def test_an_event_at_no_place_of_this_map_closes_nothing_and_is_said() -> None:
    revision = MapRevision(office(), radius_m=RADIUS_M)
    lost = event(Effect.CLOSED, id="E7", place="C99", outlines=())

    assert tuple(close_floor_of([lost], revision, NOW)) == ()
    assert "E7 names no place on this map" in say_unplaced([lost], revision, NOW)[0]
