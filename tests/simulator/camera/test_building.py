import math
from dataclasses import replace

import numpy as np
import pytest

from mapspeak.geometry import Pose
from mapspeak.simulator.camera.building import DOOR_M, FRAME, Panel, build_panels
from mapspeak.simulator.camera.camera import PinholeCamera
from mapspeak.simulator.worlds.world import WorldDoor, WorldWall
from staging import ROOM_WIDTH_M, START, make_room, make_wall

DOOR = WorldDoor(name="door", pose=Pose(4, 3, math.pi / 2), width_m=1.0)


def cut_wall() -> list[WorldWall]:
    """A wall across the room with a gap of 1 m in its middle."""
    return [make_wall((4, 0), (4, 2.5)), make_wall((4, 3.5), (4, ROOM_WIDTH_M))]


def column_of_ranges(*doors: WorldDoor) -> np.ndarray:
    """Ranges down the middle column of a picture that looks at the gap from 3 m."""
    world = make_room(walls=cut_wall(), doors=doors)
    view = PinholeCamera(world).observe(START, width_px=161, height_px=121)
    return np.asarray(view.range_m[:, 80])


def test_one_looks_through_a_door_and_not_over_it() -> None:
    ranges = column_of_ranges(DOOR)
    assert ranges[60] == pytest.approx(7.0, abs=0.1)
    # 2.4 m up at 2.95 m, with the camera at 1.1 m.
    focal_px = 161 / 2 / math.tan(math.radians(85) / 2)
    over_the_door = round(60.5 - focal_px * 1.3 / 2.95)
    assert ranges[over_the_door] == pytest.approx(2.95, abs=0.1)
    assert column_of_ranges()[over_the_door] > 3.5


def test_a_wide_opening_gets_no_lintel() -> None:
    wide = WorldDoor(name="gate", pose=Pose(4, 3, math.pi / 2), width_m=5.0)
    walls = [make_wall((4, 0), (4, 0.5)), make_wall((4, 5.5), (4, ROOM_WIDTH_M))]
    with_gate, without = (
        PinholeCamera(make_room(walls=walls, doors=doors)).observe(
            START, width_px=161, height_px=121
        )
        for doors in ([wide], [])
    )
    assert (with_gate.range_m[:, 80] == without.range_m[:, 80]).all()


def test_a_panel_faces_where_right_and_up_make_it() -> None:
    panel = Panel(corner=np.zeros(3), right=np.array([0.0, 2.0, 0.0]), up=np.array([0.0, 0.0, 3.0]))
    assert panel.normal.tolist() == [1.0, 0.0, 0.0]
    assert panel.size_m == (2.0, 3.0)


LOW_WALL = replace(make_wall((1, 1), (3, 2)), height_m=1.0)
NO_LAMPS = np.zeros((0, 3))


def corners_of(panel: Panel) -> np.ndarray:
    steps = (0 * panel.right, panel.right, panel.up, panel.right + panel.up)
    return np.array([panel.corner + step for step in steps])


def test_a_building_that_is_moved_is_the_same_building_elsewhere() -> None:
    moving = Pose(10.0, -7.0, math.pi / 2)
    here = make_room(walls=[*cut_wall(), LOW_WALL], doors=[DOOR])
    there = replace(
        here,
        walls=tuple(
            replace(wall, start=moving.transform(wall.start), end=moving.transform(wall.end))
            for wall in here.walls
        ),
        rooms=(),
        doors=(replace(DOOR, pose=moving @ DOOR.pose),),
        start=moving @ here.start,
    )
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    panels, moved = (build_panels(world, NO_LAMPS, 2.8) for world in (here, there))
    for one, other in zip(panels, moved, strict=True):
        expected = corners_of(one) @ turn.T + (moving.x, moving.y, 0.0)
        away = np.linalg.norm(expected[:, None] - corners_of(other)[None], axis=2)
        assert away.min(axis=1).max() < 1e-9


def test_a_low_wall_is_covered_flush_with_its_sides() -> None:
    panels = build_panels(replace(make_room(), walls=(LOW_WALL,)), NO_LAMPS, 2.8)
    (cover,) = (each for each in panels if each.normal[2] > 0.99 and each.corner[2] > 0)
    sides = np.concatenate([corners_of(each) for each in panels if abs(each.normal[2]) < 0.01])
    rims = {tuple(each) for each in np.round(sides[sides[:, 2] == 1.0], 6).tolist()}
    assert {tuple(each) for each in np.round(corners_of(cover), 6).tolist()} == rims


def test_a_door_frame_is_as_high_at_its_sides_as_at_its_top() -> None:
    panels = build_panels(make_room(walls=cut_wall(), doors=[DOOR]), NO_LAMPS, 2.8)
    tops = [corners_of(each)[:, 2].max() for each in panels if each.colour == FRAME]
    assert len(tops) == 14
    assert tops == pytest.approx([tops[0]] * 14)
    assert tops[0] > DOOR_M


def test_a_lamp_hangs_with_its_middle_where_its_light_is() -> None:
    (lamp,) = (
        each for each in build_panels(make_room(), np.array([[4.0, 3.0, 2.7]]), 2.8) if each.glows
    )
    assert corners_of(lamp).mean(axis=0) == pytest.approx((4.0, 3.0, 2.7))
    assert lamp.normal.tolist() == [0.0, 0.0, -1.0]
