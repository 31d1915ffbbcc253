import math
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given, settings

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import (
    Confidence,
    Landmark,
    Waypoint,
    group_views,
    merge_waypoint,
    seen_from,
)
from waypoints import waypoints

HERE = Pose(1.0, 2.0, 0.5)


def dock(*landmarks: Landmark, **more: object) -> Waypoint:
    told = {"pose": HERE, "functional_landmarks": landmarks, **more}
    return Waypoint(name="dock", **told)  # type: ignore[arg-type]


def thing(
    label: str,
    bearing_deg: float | None = None,
    range_m: float | None = None,
    confidence: Confidence | None = None,
) -> Landmark:
    bearing_rad = None if bearing_deg is None else math.radians(bearing_deg)
    return Landmark(label=label, bearing_rad=bearing_rad, range_m=range_m, confidence=confidence)


def point_of(landmark: Landmark, pose: Pose) -> Point:
    assert landmark.bearing_rad is not None
    assert landmark.range_m is not None
    x, y = math.cos(landmark.bearing_rad), math.sin(landmark.bearing_rad)
    return pose.transform(Point(landmark.range_m * x, landmark.range_m * y))


def test_a_place_that_is_new_is_remembered_as_it_was_told() -> None:
    told = dock(thing("sink"))

    merge = merge_waypoint(None, told)

    assert merge.waypoint == told
    assert merge.new == told.landmarks


def test_the_same_label_near_the_same_bearing_is_the_same_thing() -> None:
    merge = merge_waypoint(dock(thing("exit sign", 20, 3.0)), dock(thing("Exit  sign", 35)))

    (sign,) = merge.waypoint.landmarks
    assert sign.bearing_rad == pytest.approx(math.radians(35))
    assert sign.range_m == 3.0
    assert len(merge.merged) == 1
    assert not merge.new
    assert not merge.kept


def test_the_same_label_elsewhere_is_another_thing() -> None:
    merge = merge_waypoint(
        dock(thing("exit sign", 20), thing("rack", 0, 2.0)),
        dock(thing("exit sign", -60), thing("rack", 0, 8.0)),
    )

    assert [each.label for each in merge.waypoint.landmarks] == ["exit sign", "rack"] * 2
    assert len(merge.new) == len(merge.kept) == 2


def test_two_things_of_one_label_keep_apart_when_both_are_seen_again() -> None:
    before = dock(thing("extinguisher", 10), thing("extinguisher", 25))

    merge = merge_waypoint(before, dock(thing("extinguisher", 27), thing("extinguisher", 12)))

    assert [round(math.degrees(r.before.bearing_rad or 0)) for r in merge.merged] == [25, 10]
    assert len(merge.waypoint.landmarks) == 2


def test_a_label_alone_is_the_thing_of_that_label_that_is_known() -> None:
    known = thing("sink", 20, 1.5, Confidence.CERTAIN)

    merge = merge_waypoint(dock(known), dock(thing("sink")))

    assert merge.waypoint.landmarks == (known,)


@pytest.mark.parametrize(
    ("before", "now", "bearing_deg", "confidence"),
    [
        (Confidence.CERTAIN, Confidence.UNSURE, 20, Confidence.CERTAIN),
        (Confidence.UNSURE, Confidence.CERTAIN, 30, Confidence.CERTAIN),
        (Confidence.LIKELY, Confidence.LIKELY, 30, Confidence.LIKELY),
        (Confidence.LIKELY, None, 30, Confidence.LIKELY),
        (Confidence.UNSURE, None, 30, None),
        (None, Confidence.UNSURE, 20, None),
    ],
)
def test_the_surer_look_counts_and_of_equals_the_later(
    before: Confidence | None,
    now: Confidence | None,
    bearing_deg: float,
    confidence: Confidence | None,
) -> None:
    merge = merge_waypoint(dock(thing("sink", 20, 2.0, before)), dock(thing("sink", 30, None, now)))

    (sink,) = merge.waypoint.landmarks
    assert sink.bearing_rad == pytest.approx(math.radians(bearing_deg))
    assert sink.confidence is confidence
    assert sink.range_m == 2.0


def test_what_is_not_named_is_kept_with_the_time_it_was_last_seen() -> None:
    monday = datetime(2026, 11, 2, 9, 0, tzinfo=UTC)
    before = dock(thing("hose"), stamp_s=5.0, recorded_at=monday, picture="P1.jpg")

    merge = merge_waypoint(before, dock(thing("tap"), stamp_s=90.0, picture="P9.jpg"))

    tap, hose = merge.waypoint.landmarks
    assert (tap.label, tap.stamp_s) == ("tap", None)
    assert (hose.stamp_s, hose.recorded_at, hose.picture) == (5.0, monday, "P1.jpg")
    assert merge.kept == ((hose,),)


def test_what_is_said_to_be_gone_is_taken_out_unless_it_is_seen_again() -> None:
    before = dock(thing("hose"), thing("tap"))

    merge = merge_waypoint(before, dock(thing("tap")), gone=["Hose", "tap"])

    assert [each.label for each in merge.waypoint.present().landmarks] == ["tap"]
    assert [each.label for each in merge.gone] == ["hose"]


def test_a_thing_moves_to_the_list_that_it_is_named_in_now() -> None:
    before = dock(thing("tap"), safety_landmarks=(thing("hose"),))

    merge = merge_waypoint(before, dock(safety_landmarks=(thing("tap"),)))

    assert [each.label for each in merge.waypoint.safety_landmarks] == ["tap", "hose"]
    assert merge.waypoint.functional_landmarks == ()


def test_the_layout_is_said_anew_as_a_whole_or_stays() -> None:
    before = dock(geometric_features=("long corridor",))

    assert merge_waypoint(before, dock()).waypoint.geometric_features == ("long corridor",)
    merge = merge_waypoint(before, dock(geometric_features=("corner",)))
    assert merge.waypoint.geometric_features == ("corner",)


def test_a_thing_with_range_and_bearing_stays_where_it_is_when_the_pose_moves() -> None:
    there = Pose(-3.0, 4.0, -2.0)
    sink = thing("sink", 40, 2.5)

    moved = seen_from(sink, HERE, there)

    assert point_of(moved, there).distance_to(point_of(sink, HERE)) < 1e-9


def test_a_bearing_alone_turns_with_the_robot_and_is_left_out_when_it_has_moved() -> None:
    sink = thing("sink", 40)

    turned = seen_from(sink, HERE, Pose(1.1, 2.0, 0.5 + math.radians(30)))
    moved = seen_from(sink, HERE, Pose(3.0, 2.0, 0.5))

    assert turned.bearing_rad == pytest.approx(math.radians(10))
    assert moved.bearing_rad is None
    assert moved.label == "sink"


@settings(max_examples=60)
@given(waypoints())
def test_telling_the_same_again_changes_nothing_but_the_time(waypoint: Waypoint) -> None:
    merge = merge_waypoint(waypoint, waypoint)

    assert [*merge.new, *merge.kept, *merge.gone] == []
    assert [each.label for each in merge.waypoint.landmarks] == [
        each.label for each in waypoint.landmarks
    ]
    assert merge.waypoint.description == waypoint.description


@settings(max_examples=60)
@given(waypoints(), waypoints())
def test_no_label_is_ever_lost_or_doubled(before: Waypoint, now: Waypoint) -> None:
    merge = merge_waypoint(before, replace(now, name=before.name))

    n_kept = sum(len(views) for views in merge.kept)
    n_further = sum(len(reunion.further) for reunion in merge.merged)
    n_after = len(merge.waypoint.landmarks)
    assert n_after == len(now.landmarks) + n_further + n_kept
    assert n_after == len(before.landmarks) + len(merge.new) + n_further
    assert len(merge.merged) + n_kept == len(before.landmarks)
    assert merge.waypoint.pose == now.pose


ELSEWHERE = Pose(2.2, 2.0, -1.0)


def test_what_is_not_named_from_elsewhere_keeps_its_bearing_and_the_pose_it_was_seen_from() -> None:
    merge = merge_waypoint(dock(thing("tap", 40)), dock(thing("rack"), pose=ELSEWHERE))

    _, tap = merge.waypoint.landmarks
    assert tap.bearing_rad == pytest.approx(math.radians(40))
    assert merge.waypoint.pose_of(tap) == HERE


def test_a_look_from_elsewhere_is_a_further_view_of_the_thing() -> None:
    merge = merge_waypoint(dock(thing("tap", 40)), dock(thing("tap", -20), pose=ELSEWHERE))

    latest, earlier = merge.waypoint.landmarks
    assert latest.bearing_rad == pytest.approx(math.radians(-20))
    assert earlier.bearing_rad == pytest.approx(math.radians(40))
    assert (latest.pose, earlier.pose) == (None, HERE)
    assert [len(reunion.further) for reunion in merge.merged] == [1]
    assert not merge.new
    assert not merge.kept


def test_a_look_from_near_by_takes_the_place_of_the_view_from_there() -> None:
    seen = merge_waypoint(dock(thing("tap", 40)), dock(thing("tap", -20), pose=ELSEWHERE)).waypoint
    near = Pose(HERE.x + 0.2, HERE.y, HERE.yaw_rad)

    merge = merge_waypoint(seen, dock(thing("tap", 45), pose=near))

    assert [merge.waypoint.pose_of(each) for each in merge.waypoint.landmarks] == [near, ELSEWHERE]


def test_a_thing_has_no_more_views_than_count_and_those_are_apart() -> None:
    place = dock(thing("tap", 0), pose=Pose(0.0, 0.0, 0.0))
    for x in (0.6, 1.2, 6.0, 9.0, 9.6):
        place = merge_waypoint(place, dock(thing("tap", 0), pose=Pose(x, 0.0, 0.0))).waypoint

    assert [place.pose_of(each).x for each in place.landmarks] == [9.6, 6.0, 1.2, 0.0]


def test_two_of_one_label_from_one_spot_stay_two_things_with_their_own_views() -> None:
    before = dock(thing("sign", 60, 4.0), thing("sign", -60, 4.0))
    there = Pose(2.0, 2.5, 0.5)
    now = [seen_from(each, HERE, there) for each in before.landmarks]

    merge = merge_waypoint(before, dock(*now, pose=there))

    assert [len(views) for views in group_views(merge.waypoint)] == [2, 2]
    assert not merge.new
    assert not merge.kept


def test_a_label_alone_from_elsewhere_leaves_the_view_as_it_was() -> None:
    merge = merge_waypoint(dock(thing("tap", 40)), dock(thing("tap"), pose=ELSEWHERE))

    (tap,) = merge.waypoint.landmarks
    assert tap.bearing_rad == pytest.approx(math.radians(40))
    assert tap.pose == HERE


def test_a_thing_with_several_views_is_gone_as_a_whole() -> None:
    seen = merge_waypoint(dock(thing("tap", 40)), dock(thing("tap", -20), pose=ELSEWHERE)).waypoint

    merge = merge_waypoint(seen, dock(thing("rack")), gone=["tap"])

    assert [each.label for each in merge.waypoint.present().landmarks] == ["rack"]
    assert [each.label for each in merge.gone] == ["tap"]


@settings(max_examples=60)
@given(waypoints(), waypoints())
def test_moving_there_and_back_is_the_way_it_was(one: Waypoint, other: Waypoint) -> None:
    near = Pose(one.pose.x + 0.3, one.pose.y, other.pose.yaw_rad)
    for landmark in one.landmarks:
        back = seen_from(seen_from(landmark, one.pose, near), near, one.pose)
        if landmark.bearing_rad is not None and (landmark.range_m is None or landmark.range_m > 1):
            assert back.bearing_rad is not None
            assert abs(wrap_angle(back.bearing_rad - landmark.bearing_rad)) < 1e-6
