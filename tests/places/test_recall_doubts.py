"""When what was found is not sure."""

import math
from dataclasses import replace

from mapspeak.geometry import Point, wrap_angle
from mapspeak.memory.things.approach import LOOK_AGAIN_M
from mapspeak.places.asking import RecallQuery, recall
from mapspeak.places.candidate import RecallDoubt, find_doubt
from mapspeak.places.goalcheck import GoalVerdict
from remembering import EXTINGUISHER, look, looks_at, world_of

LOOKS = looks_at("fire extinguisher", EXTINGUISHER)


def test_a_thing_is_not_sure_to_be_faced_where_most_of_where_it_may_be_is_out_of_sight() -> None:
    (first, *_) = recall(world_of(*LOOKS), RecallQuery(words="fire extinguisher")).candidates
    assert first.faced_ratio > 0.7
    assert find_doubt(first, room_id=None) is None
    doubt = find_doubt(replace(first, faced_ratio=0.2), room_id=None)
    assert doubt is RecallDoubt.HARDLY_IN_SIGHT


def test_a_thing_that_may_be_anywhere_on_a_line_is_looked_for_from_where_it_is_in_view() -> None:
    world = world_of(look("west", 0.7, 2.3, ("crate", EXTINGUISHER)))
    (first, *_) = recall(world, RecallQuery(words="crate")).candidates
    assert first.uncertainty_m is not None
    assert first.uncertainty_m > LOOK_AGAIN_M
    assert not first.is_faced
    (crate,) = world.things
    assert crate.thing.whereabouts is not None
    ways = [first.pose.point.bearing_to(Point(x, y)) for x, y in crate.thing.whereabouts.tolist()]
    off_rad = sorted(abs(wrap_angle(way - first.pose.yaw_rad)) for way in ways)
    assert off_rad[len(off_rad) // 2] < math.radians(30)


def test_what_nobody_can_drive_to_is_told_as_that_and_not_as_out_of_sight() -> None:
    (first, *_) = recall(world_of(*LOOKS), RecallQuery(words="fire extinguisher")).candidates
    blocked = replace(first.check, verdict=GoalVerdict.UNREACHABLE)
    shut_in = replace(first, is_faced=False, faced_ratio=0.0, check=blocked)
    assert find_doubt(shut_in, room_id=None) is None
