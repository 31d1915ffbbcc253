"""What the worlds that come with mapspeak promise."""

from collections import Counter

import numpy as np
import pytest

from mapspeak.geometry import Pose
from mapspeak.simulator import TrueFloor, World, load_world, world_names
from mapspeak.spatial.rooms import RoomClass

PAPER_NEEDS = {"loaded_shelf": 4, "forklift": 2, "fire_extinguisher": 3, "first_aid_box": 1}
OFFICE_NEEDS = {"fire_extinguisher": 3, "first_aid_box": 1, "fridge": 1, "toilet": 1, "printer": 1}


@pytest.fixture(scope="module", params=world_names())
def world(request: pytest.FixtureRequest) -> World:
    return load_world(request.param)


@pytest.fixture(scope="module")
def floor(world: World) -> TrueFloor:
    return TrueFloor(world)


def test_the_smallest_room_is_clearly_the_smallest(floor: TrueFloor) -> None:
    rooms = [room for room in floor.rooms if room.room.room_class is RoomClass.ROOM]

    for areas in ([room.free_area_m2 for room in rooms], [room.outline_area_m2 for room in rooms]):
        smallest, second = sorted(areas)[:2]
        assert second >= 1.15 * smallest


def test_the_same_room_is_smallest_by_outline_and_by_free_floor(floor: TrueFloor) -> None:
    rooms = [room for room in floor.rooms if room.room.room_class is RoomClass.ROOM]

    assert min(rooms, key=lambda room: room.free_area_m2) is min(
        rooms, key=lambda room: room.outline_area_m2
    )


def test_the_robot_can_get_into_every_room(world: World, floor: TrueFloor) -> None:
    places = floor.solid.points_at(*np.nonzero(floor.standable))
    stands = [world.start.transform(Pose(float(x), float(y)).point) for x, y in places[::7]]

    for room in world.rooms:
        assert any(room.contains(point) for point in stands), room.name


def test_no_object_stands_within_another_or_in_a_wall_that_bars_the_way(floor: TrueFloor) -> None:
    standable_m2 = floor.standable.sum() * floor.solid.resolution_m**2
    indoors_m2 = sum(room.free_area_m2 for room in floor.rooms)

    assert standable_m2 / indoors_m2 > 0.5


def test_every_object_lies_in_a_room(world: World) -> None:
    for thing in world.objects:
        front = (thing.pose @ Pose(0.2, 0.0)).point
        assert any(room.contains(front) for room in world.rooms), thing.name


def test_doors_let_the_robot_through(world: World) -> None:
    assert world.doors
    assert all(door.width_m >= 0.9 for door in world.doors)


@pytest.mark.parametrize(("name", "needs"), [("warehouse", PAPER_NEEDS), ("office", OFFICE_NEEDS)])
def test_a_world_holds_what_its_tasks_ask_for(name: str, needs: dict[str, int]) -> None:
    kinds = Counter(thing.kind for thing in load_world(name).objects)

    assert all(kinds[kind] >= count for kind, count in needs.items())


def test_the_warehouse_is_the_scene_of_the_paper() -> None:
    classes = [room.room_class for room in load_world("warehouse").rooms]

    assert classes.count(RoomClass.ROOM) == 2
    assert classes.count(RoomClass.CORRIDOR) == 1


def test_the_office_has_eight_rooms_or_more() -> None:
    classes = [room.room_class for room in load_world("office").rooms]

    assert classes.count(RoomClass.ROOM) >= 8
