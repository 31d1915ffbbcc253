import math

import numpy as np
import pytest

from mapspeak.geometry import Pose
from mapspeak.robot import Detection
from mapspeak.simulator.camera.camera import (
    MAX_DETECTION_RANGE_M,
    PinholeCamera,
    SegmentedView,
    SimulatedDetector,
)
from mapspeak.simulator.worlds.world import World, WorldObject
from staging import END_WALL, ROOM_WIDTH_M, START, make_room, make_wall

N_LOOKS = 200


def observe(world: World, pose: Pose = START) -> SegmentedView:
    return PinholeCamera(world).observe(pose, width_px=320, height_px=240)


def detect_often(view: SegmentedView, *, seed: int = 1) -> list[tuple[Detection, ...]]:
    detector = SimulatedDetector(random=np.random.default_rng(seed))
    return [detector.detect(view) for _ in range(N_LOOKS)]


def paint_view(*, n_pixels: int, range_m: float) -> SegmentedView:
    """A view of 100 x 100 pixels with one forklift that shows on the first of them."""
    ids = np.full(10_000, -1)
    ids[:n_pixels] = 0
    return SegmentedView(
        objects=(WorldObject(name="truck", kind="forklift", pose=Pose(0, 0)),),
        object_ids=ids.reshape(100, 100),
        range_m=np.full((100, 100), range_m, dtype=np.float32),
        bearing_rad=np.linspace(0.5, -0.5, 100),
    )


def test_a_thing_in_full_view_is_named_with_its_bearing_and_its_range() -> None:
    looks = detect_often(observe(make_room(("forklift", Pose(5.0, 4.0, 0.0)))))
    found = [detection for look in looks for detection in look]
    assert {detection.label for detection in found} == {"forklift"}
    bearings = np.array([detection.bearing_rad for detection in found])
    ranges = np.array([detection.range_m for detection in found])
    assert bearings.mean() == pytest.approx(math.atan2(1.0, 3.2), abs=0.06)
    assert 2.0 < ranges.mean() < 4.5
    assert bearings.std() > 0
    assert ranges.std() > 0
    assert all(0.5 < detection.confidence_ratio <= 1 for detection in found)


def test_nothing_is_detected_through_a_wall() -> None:
    wall = make_wall((4, 0), (4, ROOM_WIDTH_M))
    view = observe(make_room(("forklift", Pose(6, 3, 0)), walls=[wall]))
    assert all(look == () for look in detect_often(view))


def test_nothing_behind_the_camera_is_detected() -> None:
    view = observe(make_room(("forklift", Pose(6, 3, 0))), Pose(4, 3, math.pi))
    assert all(look == () for look in detect_often(view))


def test_things_are_reported_from_left_to_right() -> None:
    things = (("crate", Pose(5, 1.5, 0)), ("traffic_cone", Pose(4, 4, 0)), ("exit_sign", END_WALL))
    looks = detect_often(observe(make_room(*things)))
    full = next(look for look in looks if len(look) == 3)
    assert [d.label for d in full] == ["traffic cone", "exit sign", "crate"]


def test_a_thing_of_too_few_pixels_is_not_reported() -> None:
    assert all(look == () for look in detect_often(paint_view(n_pixels=5, range_m=3)))
    assert any(look != () for look in detect_often(paint_view(n_pixels=7, range_m=3)))


def test_a_thing_too_far_away_is_not_reported() -> None:
    far = paint_view(n_pixels=500, range_m=MAX_DETECTION_RANGE_M + 0.1)
    assert all(look == () for look in detect_often(far))


def test_small_things_are_missed_more_often_and_trusted_less() -> None:
    small = detect_often(paint_view(n_pixels=7, range_m=3))
    large = detect_often(paint_view(n_pixels=3000, range_m=3))
    assert sum(look == () for look in small) > sum(look == () for look in large) > 0
    trust_in_small, trust_in_large = (
        np.mean([d.confidence_ratio for look in looks for d in look]) for looks in (small, large)
    )
    assert trust_in_small < trust_in_large


def test_the_same_seed_gives_the_same_reports() -> None:
    view = paint_view(n_pixels=50, range_m=4)
    assert detect_often(view, seed=3) == detect_often(view, seed=3)
    assert detect_often(view, seed=3) != detect_often(view, seed=4)
