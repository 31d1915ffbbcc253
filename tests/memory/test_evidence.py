"""What later looks should have shown, and did not."""

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.memory.consistency.checking import check_memory
from mapspeak.memory.consistency.findings import FindingKind, judge_trust
from mapspeak.memory.merging import merge_waypoint
from mapspeak.memory.things.finding import find_things

GRID = grid_from_text(
    """
    ####################
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    ####################
    """,
    resolution_m=0.25,
)
BIN = Point(2.5, 1.9)
STANDS = (Point(1.5, 0.6), Point(2.5, 0.5), Point(3.4, 0.7), Point(2.0, 0.4))
MONDAY = datetime(2026, 11, 23, 9, 0, tzinfo=UTC)


def look(name: str, stand: Point, *labels: str, day: int, is_away: bool = False) -> Waypoint:
    """A look with a picture at where the bin stands, or away from it."""
    pose = Pose(stand.x, stand.y, stand.bearing_to(BIN) + (math.pi if is_away else 0.0))
    seen = tuple(
        Landmark(label=each, bearing_rad=0.0, range_m=stand.distance_to(BIN)) for each in labels
    )
    return Waypoint(
        name=name,
        pose=pose,
        functional_landmarks=seen,
        recorded_at=MONDAY + timedelta(days=day),
        picture=f"{name} {day}.jpg",
    )


def trust(*waypoints: Waypoint) -> float:
    memory = SemanticMap(waypoints=waypoints)
    found = find_things(memory, GRID)
    (thing,) = (each for each in found.things if each.label == "trash bin")
    return judge_trust(thing, check_memory(memory, found)).ratio


def seen() -> list[Waypoint]:
    return [look(f"stand {i}", at, "trash bin", day=0) for i, at in enumerate(STANDS)]


def again(record: Waypoint, day: int, *labels: str) -> Waypoint:
    """The record after another look from its place."""
    now = look(record.name, record.pose.point, *labels, day=day)
    return merge_waypoint(record, now).waypoint


def test_after_three_later_looks_what_was_seen_often_is_doubted() -> None:
    later = [look(f"later {i}", at, day=7 + i) for i, at in enumerate(STANDS[:3])]

    assert trust(*seen()) > 0.99
    assert 0.8 < trust(*seen(), *later[:1]) < 0.96
    assert trust(*seen(), *later) < 0.3


def test_looks_under_one_name_are_counted_in_its_record() -> None:
    first, *others = seen()
    record = first
    for day in (7, 8, 9):
        record = again(record, day)

    (kept,) = record.landmarks
    assert kept.n_missed == 3
    assert trust(record, *others) < 0.3


def test_what_is_seen_again_is_not_doubted_any_more() -> None:
    first, *others = seen()
    record = again(again(again(first, 7), 8), 9, "trash bin")

    (kept,) = record.landmarks
    assert kept.n_missed == 0
    assert trust(record, *others) > 0.99


@pytest.mark.parametrize("day", [-7, 7])
def test_earlier_looks_and_looks_elsewhere_say_little(day: int) -> None:
    is_away = day > 0
    looks = [look(f"look {i}", at, day=day, is_away=is_away) for i, at in enumerate(STANDS[:3])]

    assert trust(*seen(), *looks) > 0.9


def test_looks_without_a_time_say_as_little_as_ever() -> None:
    later = [look(f"later {i}", at, day=7) for i, at in enumerate(STANDS[:3])]
    timeless = [replace(each, recorded_at=None) for each in (*seen(), *later)]

    assert trust(*timeless) > 0.9


TABLE_GRID = grid_from_text(
    """
    ####################
    #..................#
    #..................#
    #.......####.......#
    #.......####.......#
    #..................#
    #..................#
    #..................#
    ####################
    """,
    resolution_m=0.25,
)


def test_looks_over_a_table_count_as_looks() -> None:
    later = [look(f"later {i}", at, day=7 + i) for i, at in enumerate(STANDS[:3])]
    across = [
        replace(each, pose=Pose(x, 0.5, Point(x, 0.5).bearing_to(BIN)))
        for each, x in zip(later, (2.3, 2.5, 2.7), strict=True)
    ]
    memory = SemanticMap(waypoints=(*seen(), *across))
    found = find_things(memory, TABLE_GRID)
    (thing,) = found.things

    assert judge_trust(thing, check_memory(memory, found)).ratio < 0.4


@pytest.mark.parametrize(
    ("label", "hours", "least", "most"),
    [
        ("forklift", 8, 0.2, 0.3),
        ("sack trolley", 8, 0.2, 0.3),
        ("fire extinguisher", 24 * 7, 0.97, 0.999),
        ("fire extinguisher", 24 * 365, 0.4, 0.6),
        ("sink", 24 * 365, 0.8, 0.95),
    ],
)
def test_trust_falls_with_age_by_the_kind_of_thing(
    label: str, hours: float, least: float, most: float
) -> None:
    memory = SemanticMap(
        waypoints=tuple(look(f"stand {i}", at, label, day=0) for i, at in enumerate(STANDS))
    )
    (thing,) = find_things(memory, GRID).things

    assert judge_trust(thing, (), now=None).ratio > 0.99
    assert least < judge_trust(thing, (), now=MONDAY + timedelta(hours=hours)).ratio < most


def test_a_thing_that_was_moved_is_the_one_that_is_new_elsewhere() -> None:
    there = Point(4.0, 1.6)
    later = [look(f"later {i}", at, day=7 + i) for i, at in enumerate(STANDS[:3])]
    moved = [
        replace(
            look(f"moved {i}", at, "trash bin", day=8),
            pose=Pose(at.x, at.y, at.bearing_to(there)),
            functional_landmarks=(
                Landmark(label="trash bin", bearing_rad=0.0, range_m=at.distance_to(there)),
            ),
        )
        for i, at in enumerate((Point(3.4, 0.7), Point(4.2, 0.5)))
    ]
    memory = SemanticMap(waypoints=(*seen(), *later, *moved))
    found = find_things(memory, GRID)

    (finding,) = (each for each in check_memory(memory, found) if each.kind is FindingKind.MOVED)
    old, new = finding.things
    assert old.position is not None
    assert old.position.distance_to(BIN) < 0.4
    assert new.position is not None
    assert new.position.distance_to(there) < 0.5
