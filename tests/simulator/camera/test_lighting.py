from dataclasses import replace

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.camera.lighting import Light, find_light
from mapspeak.simulator.worlds.world import TrueRoom
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
