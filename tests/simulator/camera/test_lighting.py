from dataclasses import replace

import numpy as np
import pytest

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.camera.building import Panel
from mapspeak.simulator.camera.lighting import Light, cast_on_wall, find_light
from mapspeak.simulator.worlds.world import TrueRoom, WorldObject
from mapspeak.spatial.rooms import RoomClass
from staging import ROOM_WIDTH_M, make_room, make_wall


def floor_light(light: Light, x: float, y: float) -> float:
    return float(light.on(np.array([[x, y, 0.0]]), np.array([[0.0, 0.0, 1.0]]))[0])


def test_the_floor_under_a_thing_is_darker_than_beside_it() -> None:
    light = find_light(make_room(("sofa", Pose(4, 3, 0))))
    assert floor_light(light, 4, 3) < 0.7 * floor_light(light, 5.5, 3)


def test_a_wall_holds_back_the_light_of_the_room_beyond() -> None:
    lit = TrueRoom(
        name="lit",
        room_class=RoomClass.ROOM,
        outline=(Point(0, 0), Point(4, 0), Point(4, ROOM_WIDTH_M), Point(0, ROOM_WIDTH_M)),
    )
    open_plan = replace(make_room(), rooms=(lit,))
    divided = replace(make_room(walls=[make_wall((4, 0), (4, ROOM_WIDTH_M))]), rooms=(lit,))
    beyond = [floor_light(find_light(world), 5.5, 3) for world in (open_plan, divided)]
    assert beyond[1] < 0.95 * beyond[0]
    before = [floor_light(find_light(world), 2.5, 3) for world in (open_plan, divided)]
    assert before[1] > 0.9 * before[0]


def test_lamps_hang_inside_rooms_and_clear_of_walls() -> None:
    light = find_light(make_room(walls=[make_wall((2, 0), (2, ROOM_WIDTH_M))]))
    assert len(light.lamps) >= 4
    assert (np.abs(light.lamps[:, 0] - 2) > 0.3).all()
    assert (light.lamps[:, :2] > 0).all()
    assert (light.lamps[:, :2] < (8, 6)).all()


def test_the_floor_of_a_symmetric_room_is_lit_alike_on_all_sides() -> None:
    light = find_light(make_room(("sofa", Pose(4, 3, 0)), ("sofa", Pose(4, 3, np.pi))))
    for x, y in ((1.0, 1.0), (2.5, 2.0), (3.0, 0.4)):
        here = floor_light(light, x, y)
        mirrored = [floor_light(light, 8 - x, y), floor_light(light, x, 6 - y)]
        assert mirrored == pytest.approx([here, here], rel=0.02)


def shadow_on_wall(length_m: float, at_m: float) -> np.ndarray:
    """Columns of a wall from (0, 0) along x, where a box that faces +y hangs at `at_m`."""
    wall = Panel(
        corner=np.array([length_m, 0.0, 0.0]),
        right=np.array([-length_m, 0.0, 0.0]),
        up=np.array([0.0, 0.0, 2.8]),
    )
    n_columns = round(length_m / 0.05) + 1
    thing = WorldObject(name="box", kind="first_aid_box", pose=Pose(at_m, 0.0, np.pi / 2))
    lit = cast_on_wall(np.ones((57, n_columns), dtype=np.float32), wall, [thing])
    return np.asarray(lit.min(axis=0)[::-1])


@pytest.mark.parametrize(("length_m", "at_m"), [(6.0, 1.5), (6.0, 4.5), (2.0, 1.0)])
def test_a_wall_is_darker_around_what_hangs_on_it_and_nowhere_else(
    length_m: float, at_m: float
) -> None:
    columns = shadow_on_wall(length_m, at_m)
    assert np.argmin(columns) * 0.05 == pytest.approx(at_m, abs=0.4)
    assert 0.5 < columns.min() < 0.95
    far = np.abs(np.arange(len(columns)) * 0.05 - at_m) > 0.9
    assert columns[far] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("at_m", [-0.5, 6.5])
def test_what_hangs_beside_a_wall_darkens_nothing_of_it(at_m: float) -> None:
    assert (shadow_on_wall(6.0, at_m) == 1.0).all()
