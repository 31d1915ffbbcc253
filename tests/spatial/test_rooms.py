import math

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomClass, find_rooms

CELL_M = 0.25

TWO_ROOMS = """
    ################################
    #...............#..............#
    #...............#..............#
    #...............#..............#
    #...............#..............#
    #..............................#
    #..............................#
    #..............................#
    #..............................#
    #...............#..............#
    #...............#..............#
    #...............#..............#
    #...............#..............#
    ################################
"""

OFFICE = """
    ##################################################
    #...............#...............#................#
    #...............#...............#................#
    #...............#...............#................#
    #...............#...............#................#
    #...............#...............#................#
    #...............#...............#................#
    #...............#...............#................#
    #...............#...............#................#
    #...............#...............#................#
    #####....###########....###########....###########
    #................................................#
    #................................................#
    #................................................#
    #................................................#
    #................................................#
    #................................................#
    #######....####################....###############
    #......................#.........................#
    #......................#.........................#
    #......................#.........................#
    #......................#.........................#
    #......................#.........................#
    #......................#.........................#
    #......................#.........................#
    #......................#.........................#
    #......................#.........................#
    #......................#.........................#
    ##################################################
"""

FURNISHED = """
    ################################
    #...............#..............#
    #..#..#..#..#...#..............#
    #...............#....######....#
    #..#..#..#..#...#..............#
    #..............................#
    #............................#.#
    #......####..................#.#
    #......#..#....................#
    #......####.....#..............#
    #...............#....#...#.....#
    #.#.#...........#..............#
    #...............#....#...#.....#
    ################################
"""


def drawn(text: str, **options: Pose | None) -> OccupancyGrid:
    return grid_from_text(text, resolution_m=CELL_M, **options)


def test_a_door_divides_two_rooms() -> None:
    rooms = find_rooms(drawn(TWO_ROOMS))

    assert [region.room_class for region in rooms.regions] == [RoomClass.ROOM, RoomClass.ROOM]
    assert [region.neighbour_ids for region in rooms.regions] == [("R2",), ("R1",)]
    (door,) = rooms.doors
    assert set(door.region_ids) == {"R1", "R2"}
    assert door.width_m == pytest.approx(1.0, abs=0.15)
    assert door.place.distance_to(Point(16.5 * CELL_M, 7 * CELL_M)) < 0.3


def test_areas_and_shape_are_those_of_the_drawing() -> None:
    larger = find_rooms(drawn(TWO_ROOMS)).regions[0]

    assert larger.free_area_m2 == pytest.approx(15 * 12 * CELL_M**2, rel=0.05)
    assert larger.floor_area_m2 == pytest.approx(larger.free_area_m2)
    assert larger.length_m == pytest.approx(15 * CELL_M, abs=0.4)
    assert larger.width_m == pytest.approx(12 * CELL_M, abs=0.2)


def test_the_widest_point_lies_in_the_middle() -> None:
    larger = find_rooms(drawn(TWO_ROOMS)).regions[0]

    assert larger.clearance_m == pytest.approx(1.5, abs=0.1)
    assert larger.widest.y == pytest.approx(7 * CELL_M, abs=0.2)
    assert 1.5 < larger.widest.x < 3.0


def test_offices_open_on_a_corridor() -> None:
    rooms = find_rooms(drawn(OFFICE))

    corridor = rooms.region("C1")
    assert corridor.room_class is RoomClass.CORRIDOR
    assert corridor.neighbour_ids == ("R2", "R3", "R4", "R5", "R6")
    assert len(rooms.doors) == 5
    assert (corridor.length_m, corridor.width_m) == pytest.approx((12.3, 1.5), abs=0.05)


def test_labels_say_which_region_a_cell_belongs_to() -> None:
    grid = drawn(OFFICE)
    rooms = find_rooms(grid)

    assert rooms.labels.shape == grid.cells.shape
    assert (rooms.labels[grid.free] > 0).all()
    assert (rooms.labels[grid.occupied] == 0).all()
    for region in rooms.regions:
        assert rooms.find_region_at(region.widest) == region


def test_furniture_divides_nothing_and_counts_as_floor_of_its_room() -> None:
    rooms = find_rooms(drawn(FURNISHED))
    plain = find_rooms(drawn(TWO_ROOMS))

    assert len(rooms.regions) == 2
    for furnished, empty in zip(rooms.regions, plain.regions, strict=True):
        assert furnished.free_area_m2 < furnished.floor_area_m2
        assert furnished.floor_area_m2 == pytest.approx(empty.floor_area_m2, rel=0.1)


def test_an_unseen_pocket_inside_a_room_counts_as_floor() -> None:
    text = FURNISHED.replace("#..#....", "#??#....")

    rooms = find_rooms(drawn(text))

    pocket = rooms.grid.cell_at(Point(8.5 * CELL_M, 5.5 * CELL_M))
    assert rooms.grid.unknown[pocket.row, pocket.col]
    assert rooms.labels[pocket.row, pocket.col] == rooms.region("R1").index


def test_a_half_explored_room_is_a_room() -> None:
    lines = [line[:26] + "?" * 6 for line in TWO_ROOMS.strip("\n").split("\n")]

    rooms = find_rooms(drawn("\n".join(lines)))

    assert [region.id for region in rooms.regions] == ["R1", "R2"]
    assert len(rooms.doors) == 1


def test_a_large_hall_is_an_open_space() -> None:
    hall = np.full((44, 64), 0, np.int8)
    hall[[0, -1]] = hall[:, [0, -1]] = 100

    (region,) = find_rooms(OccupancyGrid(cells=hall, resolution_m=CELL_M)).regions

    assert region.id == "O1"
    assert region.room_class is RoomClass.OPEN_SPACE
    assert (region.length_m, region.width_m) == pytest.approx((15.5, 10.5), abs=0.05)
    assert 2 * region.clearance_m == pytest.approx(10.0, abs=0.5)


def test_places_are_given_in_the_map_frame_of_a_turned_map() -> None:
    origin = Pose(3.0, -7.0, 0.8)
    straight, turned = find_rooms(drawn(OFFICE)), find_rooms(drawn(OFFICE, origin=origin))

    for here, there in zip(straight.regions, turned.regions, strict=True):
        assert origin.transform(here.widest).distance_to(there.widest) < 1e-6
        assert math.remainder(there.heading_rad - here.heading_rad - 0.8, math.pi) == (
            pytest.approx(0.0, abs=1e-6)
        )
    for door, other in zip(straight.doors, turned.doors, strict=True):
        assert origin.transform(door.place).distance_to(other.place) < 1e-6


def test_the_doors_between_two_rooms_are_found() -> None:
    rooms = find_rooms(drawn(OFFICE))

    assert len(rooms.doors_between("R2", "C1")) == 1
    assert rooms.doors_between("R2", "R6") == ()


def test_a_closed_room_has_no_doors() -> None:
    rooms = find_rooms(drawn(TWO_ROOMS.replace("." * 30, "." * 15 + "#" + "." * 14)))

    assert rooms.doors == ()


def test_an_unknown_id_is_refused_with_the_ids_there_are() -> None:
    rooms = find_rooms(drawn(TWO_ROOMS))

    with pytest.raises(MapError, match="no region R9") as error:
        rooms.region("R9")
    assert error.value.hint == "Its regions are: R1, R2."


def test_a_point_in_a_wall_or_off_the_map_lies_in_no_region() -> None:
    rooms = find_rooms(drawn(TWO_ROOMS))

    assert rooms.find_region_at(Point(0.1, 0.1)) is None
    assert rooms.find_region_at(Point(-50.0, 3.0)) is None


@pytest.mark.parametrize(
    ("shape", "value"),
    [((0, 0), 0), ((0, 7), 0), ((1, 1), 0), ((1, 1), 100), ((60, 60), -1), ((60, 60), 100)],
)
def test_a_map_without_floor_has_no_rooms(shape: tuple[int, int], value: int) -> None:
    grid = OccupancyGrid(cells=np.full(shape, value, np.int8), resolution_m=0.05)

    rooms = find_rooms(grid)

    assert rooms.regions == ()
    assert rooms.doors == ()
    assert rooms.labels.shape == shape


def test_a_map_without_walls_is_one_region() -> None:
    grid = OccupancyGrid(cells=np.zeros((200, 200), np.int8), resolution_m=0.05)

    (region,) = find_rooms(grid).regions

    assert region.free_area_m2 == pytest.approx(100.0)
    assert region.clearance_m == pytest.approx(5.0, abs=0.1)


def test_a_map_too_large_for_the_fine_raster_is_still_divided() -> None:
    fine = np.kron(drawn(TWO_ROOMS).cells, np.ones((80, 80), np.int8))

    rooms = find_rooms(OccupancyGrid(cells=fine, resolution_m=CELL_M / 80))

    assert [region.id for region in rooms.regions] == ["R1", "R2"]
    assert rooms.labels.shape == fine.shape
    assert rooms.doors[0].width_m == pytest.approx(1.0, abs=0.15)


def test_the_labels_cannot_be_written_to() -> None:
    rooms = find_rooms(drawn(TWO_ROOMS))

    with pytest.raises(ValueError, match="read-only"):
        rooms.labels[0, 0] = 1


def test_a_corridor_that_bends_is_as_long_as_the_way_along_it() -> None:
    bend = np.full((120, 120), 100, np.int8)
    bend[10:30, 10:110] = bend[10:110, 10:30] = 0

    (corridor,) = find_rooms(OccupancyGrid(cells=bend, resolution_m=0.1)).regions

    assert corridor.id == "C1"
    assert corridor.width_m == pytest.approx(2.0, abs=0.2)
    assert corridor.length_m == pytest.approx(18.0, abs=1.5)


@pytest.mark.parametrize("resolution_m", [0.001, 0.01, 1.0, 20.0])
def test_any_resolution_gives_an_answer(resolution_m: float) -> None:
    grid = grid_from_text(OFFICE, resolution_m=resolution_m)

    rooms = find_rooms(grid)

    assert rooms.labels.shape == grid.cells.shape
    assert all(region.floor_area_m2 >= 1.5 for region in rooms.regions)


def test_noise_has_no_rooms_worth_a_name() -> None:
    noise = np.random.default_rng(3).integers(-1, 101, (300, 300)).astype(np.int8)

    assert len(find_rooms(OccupancyGrid(cells=noise, resolution_m=0.05)).regions) <= 3


def test_a_partition_that_stands_free_makes_no_corridor_of_a_room() -> None:
    room = np.full((180, 180), 100, np.int8)
    room[4:-4, 4:-4] = 0
    room[88:91, 62:118] = 100

    (region,) = find_rooms(OccupancyGrid(cells=room, resolution_m=0.05)).regions

    assert region.room_class is RoomClass.ROOM
    assert (region.length_m, region.width_m) == pytest.approx((8.6, 8.6), abs=0.05)


CORRIDOR_WITH_OFFICES = np.full((140, 400), 100, np.int8)
CORRIDOR_WITH_OFFICES[4:96, 4:-4] = CORRIDOR_WITH_OFFICES[100:136, 4:-4] = 0
CORRIDOR_WITH_OFFICES[4:96, 130:134] = CORRIDOR_WITH_OFFICES[4:96, 264:268] = 100
CORRIDOR_WITH_OFFICES[96:100, 40:60] = CORRIDOR_WITH_OFFICES[96:100, 190:210] = 0
CORRIDOR_WITH_OFFICES[96:100, 330:350] = 0


def test_a_corridor_goes_on_past_a_pillar() -> None:
    cells = CORRIDOR_WITH_OFFICES.copy()
    cells[132:136, 130:134] = cells[100:104, 130:134] = 100

    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05))

    assert [region.id for region in rooms.regions] == ["C1", "R2", "R3", "R4"]


def test_a_plant_in_line_with_a_wall_divides_no_corridor() -> None:
    cells = CORRIDOR_WITH_OFFICES.copy()
    cells[100:108, 128:136] = 100

    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05))

    assert [region.id for region in rooms.regions] == ["C1", "R2", "R3", "R4"]


def test_a_crack_in_a_wall_is_no_door() -> None:
    cells = CORRIDOR_WITH_OFFICES.copy()
    cells[50:53, 130:134] = 0

    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05))

    assert len(rooms.doors) == 3
    assert all(door.width_m > 0.8 for door in rooms.doors)


def test_a_wall_seen_only_in_pieces_is_wall_all_along() -> None:
    cells = np.full((134, 204), 100, np.int8)
    cells[4:-4, 4:-4] = 0
    cells[4:30, 100:103] = cells[104:130, 100:103] = 100
    for row in range(38, 96, 16):
        cells[row : row + 8, 100:103] = 100

    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05))

    assert [region.id for region in rooms.regions] == ["R1", "R2"]
    assert max(door.width_m for door in rooms.doors) < 0.5


def test_a_few_specks_askew_that_vanish_on_the_raster_are_no_rooms() -> None:
    cells = np.full((40, 40), -1, np.int8)
    cells[range(2, 38, 9), range(1, 17, 4)] = cells[1, 1] = 100

    assert find_rooms(OccupancyGrid(cells=cells, resolution_m=0.01)).regions == ()


@pytest.mark.slow
def test_a_map_of_ten_thousand_cells_a_side_is_divided() -> None:
    grid = OccupancyGrid(cells=np.zeros((10_000, 10_000), np.int8), resolution_m=0.05)

    (region,) = find_rooms(grid).regions

    assert region.free_area_m2 == pytest.approx(250_000)


@pytest.mark.slow
def test_a_map_of_too_many_cells_is_refused_with_what_to_do() -> None:
    grid = OccupancyGrid(cells=np.full((11_000, 11_000), -1, np.int8), resolution_m=0.05)

    with pytest.raises(MapError, match="121000000 cells, more than 120000000") as error:
        find_rooms(grid)
    assert error.value.hint == "Ask for a part of it, or for a map at a coarser resolution."


def test_a_map_with_too_long_a_side_is_refused_with_what_to_do() -> None:
    grid = OccupancyGrid(cells=np.zeros((20, 33_000), np.int8), resolution_m=0.05)

    with pytest.raises(MapError, match="33000 cells, more than 32000") as error:
        find_rooms(grid)
    assert error.value.hint == "Ask for a part of it, or for a map at a coarser resolution."


def test_a_tunnel_of_coarse_cells_is_divided_however_long() -> None:
    cells = np.full((14, 9000), 100, np.int8)
    cells[2:12, 2:-2] = 0

    (tunnel,) = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.2)).regions

    assert tunnel.free_area_m2 == pytest.approx(10 * 8996 * 0.2**2)


@pytest.mark.slow
def test_of_more_rooms_than_labels_can_tell_apart_the_rest_is_left_out() -> None:
    cells = np.zeros((6000, 6000), np.int8)
    cells[::31] = cells[:, ::31] = 100

    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05))

    assert len(rooms.regions) == 32_767
    assert rooms.labels.min() == 0
