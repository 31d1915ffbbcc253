import math
from dataclasses import replace

import numpy as np
import pytest

from mapspeak.geometry import Pose
from mapspeak.simulator.camera.camera import CAMERA_HEIGHT_M, PinholeCamera
from mapspeak.simulator.worlds.models import find_kind, kind_names
from staging import END_WALL, ROOM_LENGTH_M, ROOM_WIDTH_M, START, make_room, make_wall

SMALL = {"width_px": 160, "height_px": 120}
RIGHT_ANGLE = math.radians(90)


def test_a_picture_has_the_size_asked_for() -> None:
    camera = PinholeCamera(make_room())
    assert camera.render(START, width_px=101, height_px=77).shape == (77, 101, 3)


def test_the_same_view_gives_the_same_picture() -> None:
    room = make_room(("forklift", Pose(5, 3, 2.0)))
    assert (
        PinholeCamera(room).render(START, **SMALL) == PinholeCamera(room).render(START, **SMALL)
    ).all()


def test_a_fire_extinguisher_shows_red_where_it_hangs() -> None:
    picture = PinholeCamera(make_room(("fire_extinguisher", END_WALL))).render(Pose(6, 3, 0))
    # The bottle's middle is 0.25 m over its foot and 0.125 m before the wall.
    focal_px = 320 / math.tan(math.radians(85) / 2)
    row = round(240 + focal_px * (CAMERA_HEIGHT_M - 0.75 - 0.42) / (2 - 0.2))
    red, green, blue = picture[row, 320].astype(int)
    assert red > 150
    assert green < 60
    assert blue < 60


def test_what_lies_to_the_left_shows_on_the_left() -> None:
    view = PinholeCamera(make_room(("crate", Pose(4, 4, 0)))).observe(START, **SMALL)
    columns = np.nonzero(view.object_ids == 0)[1]
    assert columns.max() < 80
    assert view.bearing_rad[columns].mean() == pytest.approx(math.atan2(1, 3), abs=0.05)


def test_ranges_to_a_wall_are_those_on_the_plan() -> None:
    view = PinholeCamera(make_room()).observe(START, **SMALL)
    assert view.range_m[60, 80] == pytest.approx(ROOM_LENGTH_M - START.x, abs=0.03)
    side = PinholeCamera(make_room()).observe(Pose(4, 3, RIGHT_ANGLE), **SMALL)
    assert side.range_m[60, :] * np.cos(side.bearing_rad) == pytest.approx(3.0, abs=0.02)


def test_a_nearer_thing_hides_a_farther_one() -> None:
    things = (("cabinet", Pose(3, 3, math.pi)), ("traffic_cone", Pose(6, 3, 0)))
    view = PinholeCamera(make_room(*things)).observe(START, **SMALL)
    assert (view.object_ids == 0).any()
    assert not (view.object_ids == 1).any()


def test_nothing_is_seen_through_a_wall() -> None:
    wall = make_wall((4, 0), (4, ROOM_WIDTH_M))
    view = PinholeCamera(make_room(("forklift", Pose(6, 3, 0)), walls=[wall])).observe(
        START, **SMALL
    )
    assert (view.object_ids == -1).all()


def test_a_low_wall_lets_one_look_over_it() -> None:
    low = replace(make_wall((4, 0), (4, ROOM_WIDTH_M)), height_m=0.9)
    view = PinholeCamera(make_room(("forklift", Pose(6, 3, 0)), walls=[low])).observe(
        START, **SMALL
    )
    assert (view.object_ids == 0).any()


def test_a_thing_hung_higher_shows_higher() -> None:
    usual = make_room(("first_aid_box", END_WALL))
    lifted = replace(usual.objects[0], base_height_m=find_kind("first_aid_box").base_height_m + 0.5)
    rows = [
        np.nonzero(PinholeCamera(world).observe(START, **SMALL).object_ids == 0)[0].mean()
        for world in (usual, replace(usual, objects=(lifted,)))
    ]
    assert rows[1] < rows[0]


@pytest.mark.parametrize("kind", kind_names())
def test_every_kind_shows_from_its_front(kind: str) -> None:
    place = END_WALL if find_kind(kind).is_wall_hung else Pose(6, 3, math.pi)
    view = PinholeCamera(make_room((kind, place))).observe(Pose(3.5, 3, 0), **SMALL)
    assert np.count_nonzero(view.object_ids == 0) > 40


def test_a_world_without_rooms_is_lit_as_well() -> None:
    dark = replace(make_room(), rooms=())
    assert PinholeCamera(dark).render(START, **SMALL).mean() > 100


def test_rooms_without_things_have_no_holes() -> None:
    camera = PinholeCamera(make_room())
    for step in range(12):
        view = camera.observe(Pose(0.3, 0.3, step * math.tau / 12), **SMALL)
        assert np.isfinite(view.range_m).all()


def test_a_camera_within_a_thing_still_gives_a_picture() -> None:
    picture = PinholeCamera(make_room(("loaded_shelf", Pose(3, 3, 0)))).render(
        Pose(3, 3, 1), **SMALL
    )
    assert picture.shape == (120, 160, 3)


def test_half_the_pixels_show_the_same_scene() -> None:
    camera = PinholeCamera(make_room(("forklift", Pose(5, 3, 2.5)), ("exit_sign", END_WALL)))
    fine = camera.render(START, width_px=320, height_px=240).astype(float)
    halved = fine.reshape(120, 2, 160, 2, 3).mean(axis=(1, 3))
    assert np.abs(halved - camera.render(START, **SMALL)).mean() < 3
