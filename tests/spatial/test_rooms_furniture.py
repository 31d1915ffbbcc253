"""Furniture divides no room, and walls behind it still do."""

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomClass, find_rooms

CELL_M = 0.25

TABLE_IN_THE_MIDDLE = """
    ##############################
    #............................#
    #............................#
    #............................#
    #............................#
    #............####............#
    #............####............#
    #............####............#
    #............####............#
    #............####............#
    #............####............#
    #............####............#
    #............####............#
    #............................#
    #............................#
    #............................#
    #............................#
    ##############################
"""

CUPBOARDS_FACE_TO_FACE = """
    ##############################
    #............####............#
    #............####............#
    #............####............#
    #............####............#
    #............####............#
    #............................#
    #............................#
    #............................#
    #............................#
    #............................#
    #............####............#
    #............####............#
    #............####............#
    #............####............#
    ##############################
"""

UNSEEN_INSIDE = CUPBOARDS_FACE_TO_FACE.replace("####....", "#??#....").replace("##.#", "####")

CUPBOARD_AT_A_WALL_BETWEEN_ROOMS = """
    ##############################
    #..............#.............#
    #..............#.............#
    #..............#.............#
    #..............#.............#
    #..............####..........#
    #..............####..........#
    #..............####..........#
    #..............####..........#
    #..............####..........#
    #..............####..........#
    #..............#.............#
    #............................#
    #............................#
    #............................#
    #..............#.............#
    ##############################
"""

CABINETS_BACK_TO_BACK = """
    ####################################################
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................#????????????#..................#
    #..................######???????#..................#
    #........................#??????#..................#
    #........................########..................#
    #........................##........................#
    #........................##........................#
    #........................##........................#
    #........................##........................#
    #........................##........................#
    #........................##........................#
    ####################################################
"""

SHELVES_IN_ROWS = """
    ##################################
    #................................#
    #................................#
    #................................#
    #......####......####......####..#
    #......####......####......####..#
    #......####......####......####..#
    #......####......####......####..#
    #......####......####......####..#
    #......####......####......####..#
    #......####......####......####..#
    #......####......####......####..#
    #......####......####......####..#
    #......####......####......####..#
    #................................#
    #................................#
    ##################################
"""

SHADOW_BEHIND_THE_WALL = """
    ##########################
    #......#............#....#
    #......#............#....#
    #......#............#....#
    #......#............#....#
    #......#............#....#
    #......#........#####???.#
    #...............#####....#
    #...............#####....#
    #...................#....#
    #......#............#....#
    #......#............#....#
    #......#............#....#
    #......#............#.....
    #......#............#.....
    #......#............#.....
    #......#............#....#
    ##########################
"""


def _grid(text: str) -> OccupancyGrid:
    return grid_from_text(text, resolution_m=CELL_M)


@pytest.mark.parametrize(
    "text",
    [TABLE_IN_THE_MIDDLE, CUPBOARDS_FACE_TO_FACE, UNSEEN_INSIDE, SHELVES_IN_ROWS],
    ids=["table", "cupboards", "cupboards of unseen inside", "shelves"],
)
def test_furniture_divides_no_room(text: str) -> None:
    (room,) = find_rooms(_grid(text)).regions

    assert room.room_class is not RoomClass.CORRIDOR


def test_the_floor_of_a_room_includes_what_stands_in_it() -> None:
    grid = _grid(TABLE_IN_THE_MIDDLE)
    (room,) = find_rooms(grid).regions

    assert room.floor_area_m2 - room.free_area_m2 == pytest.approx(4 * 8 * CELL_M**2)


def test_a_wall_goes_on_behind_a_cupboard() -> None:
    rooms = find_rooms(_grid(CUPBOARD_AT_A_WALL_BETWEEN_ROOMS))

    assert len(rooms.regions) == 2
    (door,) = rooms.doors
    assert door.width_m == pytest.approx(0.75, abs=0.2)


def test_a_wall_between_cupboards_on_both_sides_divides_two_rooms() -> None:
    """Two rooms of 5.4 by 4.6 m beside a corridor; a slit between two cupboards shows the wall."""
    cells = np.full((188, 168), 100, np.int8)
    cells[4:92, 4:112] = cells[96:184, 4:112] = cells[4:184, 116:164] = 0
    cells[60:78, 112:116] = cells[150:168, 112:116] = 0
    cells[74:92, 4:41] = cells[74:92, 44:76] = cells[96:114, 76:112] = 100
    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05))

    assert len(rooms.regions) == 3


def test_a_wall_that_cabinets_hide_from_both_sides_divides_two_rooms() -> None:
    """Cabinets stand back to back in the corner of both rooms, so that nothing sees the wall."""
    rooms = find_rooms(grid_from_text(CABINETS_BACK_TO_BACK, resolution_m=0.1))

    areas_m2 = sorted(region.floor_area_m2 for region in rooms.regions)
    assert areas_m2 == pytest.approx([5.76, 5.76], rel=0.02)


def test_a_desk_in_line_with_the_end_of_a_wall_divides_no_room() -> None:
    """An L-shaped room around a closet, with a desk of 0.9 m at the wall across from its corner."""
    cells = np.full((100, 116), 100, np.int8)
    cells[4:96, 4:112] = 0
    cells[4:54, 60:64] = cells[50:54, 60:112] = 100
    cells[42:60, 4:44] = 100
    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05))

    assert len(rooms.regions) == 2


def test_furniture_is_told_from_walls_however_the_map_is_turned() -> None:
    upright = _grid(CUPBOARDS_FACE_TO_FACE)
    mirrored = OccupancyGrid(cells=np.transpose(upright.cells), resolution_m=CELL_M)

    assert len(find_rooms(mirrored).regions) == 1


def test_walls_as_thick_as_furniture_are_walls() -> None:
    """Two rooms whose walls are all 0.75 m thick, with a door of a metre between them."""
    cells = np.full((60, 100), 100, np.int8)
    cells[6:54, 6:46] = cells[6:54, 52:94] = 0
    cells[26:33, 46:52] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.125)

    assert len(find_rooms(grid).regions) == 2


def test_no_wall_runs_on_behind_furniture_from_what_is_none() -> None:
    """A chair's shadow on the other side of a wall leads into no cupboard."""
    rooms = find_rooms(_grid(SHADOW_BEHIND_THE_WALL))

    assert len(rooms.regions) == 3


def _draw_hall_with_boards(*boards: slice) -> OccupancyGrid:
    """Draw a hall of 11.6 by 3.2 m, and across its middle boards of 0.2 m."""
    cells = np.full((72, 240), 100, np.int8)
    cells[4:68, 4:236] = 0
    for board in boards:
        cells[board, 118:122] = 100
    return OccupancyGrid(cells=cells, resolution_m=0.05)


def test_a_board_that_stands_out_from_a_wall_is_furniture() -> None:
    (hall,) = find_rooms(_draw_hall_with_boards(slice(4, 20))).regions

    assert hall.floor_area_m2 - hall.free_area_m2 == pytest.approx(0.8 * 0.2, rel=0.2)


def test_boards_on_both_sides_of_a_door_are_walls() -> None:
    rooms = find_rooms(_draw_hall_with_boards(slice(4, 28), slice(46, 68)))

    assert [room.floor_area_m2 for room in rooms.regions] == pytest.approx([18.3, 18.3], rel=0.02)
