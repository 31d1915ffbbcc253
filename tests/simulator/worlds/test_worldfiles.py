import math
from pathlib import Path

import pytest

from mapspeak.errors import ConfigError
from mapspeak.geometry import Point
from mapspeak.simulator import WorldWall, load_world, world_names
from mapspeak.spatial.rooms import RoomClass

WORKSHOP = """\
title: A workshop with a store.
wall_height_m: 2.8
wall_thickness_m: 0.2
start: {at: [1.5, 2.0], yaw_deg: 90}
walls:
  - line: [[0, 0], [8, 0], [8, 5], [0, 5], [0, 0]]
  - {line: [[5, 0], [5, 5]], height_m: 2.0, thickness_m: 0.1}
doors:
  - {name: store door, at: [5, 2.5], width_m: 1.0}
rooms:
  - {name: workshop, class: open_space, outline: [[0, 0], [5, 0], [5, 5], [0, 5]]}
  - {name: store, class: room, outline: [[5, 0], [8, 0], [8, 5], [5, 5]]}
objects:
  - {name: extinguisher, kind: fire_extinguisher, at: [4.9, 1.2], yaw_deg: 180}
  - {name: high box, kind: first_aid_box, at: [0.1, 3.0], base_height_m: 1.6}
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "workshop.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def pieces_at_x(walls: tuple[WorldWall, ...], x: float) -> list[tuple[float, float]]:
    """Gives from where to where the walls at some x stand, in y."""
    return [
        (round(wall.start.y, 6), round(wall.end.y, 6))
        for wall in walls
        if math.isclose(wall.start.x, x) and math.isclose(wall.end.x, x)
    ]


def test_a_world_file_becomes_a_world(tmp_path: Path) -> None:
    world = load_world(write(tmp_path, WORKSHOP))

    assert world.name == "workshop"
    assert world.title == "A workshop with a store."
    assert world.start.point == Point(1.5, 2.0)
    assert world.start.yaw_rad == pytest.approx(math.pi / 2)
    assert [room.room_class for room in world.rooms] == [RoomClass.OPEN_SPACE, RoomClass.ROOM]
    extinguisher, box = world.objects
    assert extinguisher.kind == "fire_extinguisher"
    assert extinguisher.base_height_m is None
    assert box.base_height_m == 1.6


def test_walls_take_height_and_thickness_from_the_file_or_from_their_own_line(
    tmp_path: Path,
) -> None:
    world = load_world(write(tmp_path, WORKSHOP))

    outer = world.walls[0]
    inner = next(wall for wall in world.walls if wall.start.x == pytest.approx(5))
    assert (outer.height_m, outer.thickness_m) == (2.8, 0.2)
    assert (inner.height_m, inner.thickness_m) == (2.0, 0.1)


def test_a_door_cuts_the_wall_that_it_lies_on(tmp_path: Path) -> None:
    world = load_world(write(tmp_path, WORKSHOP))

    assert pieces_at_x(world.walls, 5.0) == [(-0.05, 2.0), (3.0, 5.05)]
    (door,) = world.doors
    assert (door.name, door.width_m) == ("store door", 1.0)
    assert door.pose.point == Point(5.0, 2.5)


def test_a_door_cuts_all_walls_that_lie_in_line_there(tmp_path: Path) -> None:
    two_pieces = WORKSHOP.replace("[[5, 0], [5, 5]]", "[[5, 0], [5, 2.4], [5, 5]]")

    world = load_world(write(tmp_path, two_pieces))

    assert pieces_at_x(world.walls, 5.0) == [(-0.05, 2.0), (3.0, 5.05)]


def test_walls_reach_half_their_thickness_beyond_corners_so_that_corners_close(
    tmp_path: Path,
) -> None:
    south = load_world(write(tmp_path, WORKSHOP)).walls[0]

    assert south.start.x == pytest.approx(-0.1)
    assert south.end.x == pytest.approx(8.1)


@pytest.mark.parametrize(
    ("wrong", "right", "line", "fault"),
    [
        ("width_m: -1.0", "width_m: 1.0", 9, "doors.0.width_m"),
        ("at: [5.6, 2.5]", "at: [5, 2.5]", 9, "the nearest one is 0.60 m away"),
        ("class: hall", "class: room", 12, "rooms.1.class"),
        ("kind: fire_extingisher", "kind: fire_extinguisher", 14, "perhaps one of fire_exting"),
        ("name: extinguisher, kind: first_aid", "name: high box, kind: first_aid", 15, "is taken"),
        ("at: [0.2, 2.0]", "at: [1.5, 2.0]", 4, "does not fit"),
        ("at: [1.5]", "at: [1.5, 2.0]", 4, "start.at"),
        ("hight_m: 2.0", "height_m: 2.0", 7, "hight_m"),
        ("[[5, 0], [5, 0], [5, 5]]", "[[5, 0], [5, 5]]", 7, "comes twice"),
        (
            "outline: [[5, 0], [8, 0], [5, 0]]",
            "outline: [[5, 0], [8, 0], [8, 5], [5, 5]]",
            12,
            "three",
        ),
        ("at: [.nan, 2.5]", "at: [5, 2.5]", 9, "doors.0.at.0"),
    ],
)
def test_a_fault_is_told_with_its_file_its_line_and_what_is_wrong(
    tmp_path: Path, wrong: str, right: str, line: int, fault: str
) -> None:
    path = write(tmp_path, WORKSHOP.replace(right, wrong))

    with pytest.raises(ConfigError) as caught:
        load_world(path)

    assert f"{path}, line {line}: " in caught.value.message
    assert fault in caught.value.message


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("title: x\nwalls: [\n", 3),
        ("- a list\n", 1),
        ("title: one\ntitle: two\n", 2),
        ("", 1),
        ("title: A world without walls.\nstart: {at: [0, 0]}\n", 1),
    ],
)
def test_text_that_is_no_world_file_is_refused_with_a_line(
    tmp_path: Path, text: str, line: int
) -> None:
    path = write(tmp_path, text)

    with pytest.raises(ConfigError, match=f"line {line}"):
        load_world(path)


def test_an_unknown_world_is_refused_with_the_names_there_are(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        load_world(tmp_path / "nowhere.yaml")

    assert all(name in caught.value.hint for name in world_names())


def test_a_room_contains_the_points_inside_its_outline() -> None:
    kitchen = next(room for room in load_world("office").rooms if room.name == "kitchen")

    assert kitchen.contains(Point(13.0, 3.0))
    assert kitchen.contains(Point(18.5, 5.0))
    assert not kitchen.contains(Point(18.5, 2.0))
    assert not kitchen.contains(Point(12.0, 3.0))
