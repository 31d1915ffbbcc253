import math

import numpy as np
import pytest

from mapspeak.geometry import Pose
from mapspeak.simulator.camera.building import Panel
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
