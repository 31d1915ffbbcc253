import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomClass, RoomMap, find_rooms
from mapspeak.spatial.rooms.finding import find_openings, join_corridors, measure_regions
from mapspeak.spatial.rooms.floor import build_floor
from mapspeak.spatial.rooms.raster import build_raster
from mapspeak.spatial.rooms.segmentation import Segmentation

CELL_M = 0.25

BESIDE_AN_L = """
    #######################################
    #........##############################
    #........##############################
    #........##############################
    #........##############################
    #........#............................#
    #........#............................#
    #........#............................#
    #........#............................#
    #........#............................#
    #........#............................#
    #........#............................#
    #........#............................#
    #........#............................#
    #........#............................#
    #........##############################
    #........................#............#
    #........................#............#
    #........................#............#
    #........................#............#
    #.....................................#
    #.....................................#
    #.....................................#
    #.....................................#
    #######################################
"""

ARM_OF_AN_L = "#........##############################\n    #........................#............#"
DOOR_INTO_THE_ARM = (
    "#........######....####################\n    #........................#............#"
)

DEAD_END = """
    ################################################################
    #.........#.....................................................#
    #.........#.....................................................#
    #.........#.....................................................#
    #...............................................................#
    #...............................................................#
    #...............................................................#
    #...............................................................#
    #.........#.....................................................#
    #.........######################################################
    #.........######################################################
    ################################################################
"""

CLOSET = """
    ##########################################
    #.........#...............................#
    #.........#...............................#
    #.........#...............................#
    #.........................................#
    #.........................................#
    #.........................................#
    #.........................................#
    #.........#...............................#
    #.........################################
    #.........################################
    ##########################################
"""

AROUND_A_CORNER = """
    ########################################
    #..........#############################
    #..........#############################
    #..........#...........................#
    #......................................#
    #......................................#
    #......................................#
    #..........#...........................#
    #..........#######################.....#
    #..........#######################.....#
    ##################################.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #.....#
                                     #######
"""

PASSAGE = """
    #########################################
    #.............#.............#...........#
    #.............#.............#...........#
    #.............#.............#...........#
    #.............#.............#...........#
    #.............#.............#...........#
    #.............#.............#...........#
    #.............#.............#...........#
    #.............#.............#...........#
    #.............#.............#...........#
    ######...##########...#######...........#
    #...........................#...........#
    #...........................#...........#
    #...........................#...........#
    #.......................................#
    #.......................................#
    #.......................................#
    #...........................#...........#
    #...........................#...........#
    #...........................#...........#
    #...........................#...........#
    #...........................#...........#
    #########################################
"""


def divided(text: str) -> RoomMap:
    return find_rooms(grid_from_text(text, resolution_m=CELL_M))


@pytest.mark.parametrize("text", [BESIDE_AN_L, BESIDE_AN_L.replace(ARM_OF_AN_L, DOOR_INTO_THE_ARM)])
def test_an_l_shaped_room_that_leads_to_few_others_is_a_room(text: str) -> None:
    rooms = divided(text)

    assert [region.room_class for region in rooms.regions] == [RoomClass.ROOM] * 3


@pytest.mark.parametrize("text", [DEAD_END, AROUND_A_CORNER])
def test_a_strip_is_a_corridor_also_where_it_is_a_dead_end(text: str) -> None:
    rooms = divided(text)

    classes = [(region.room_class, len(region.door_ids)) for region in rooms.regions]
    assert sorted(classes) == [(RoomClass.CORRIDOR, 1), (RoomClass.ROOM, 1)]


def test_a_strip_behind_one_door_narrower_than_itself_is_a_closet() -> None:
    assert [region.room_class for region in divided(CLOSET).regions] == [RoomClass.ROOM] * 2


def test_a_slit_that_no_robot_can_stand_in_is_no_region() -> None:
    cells = np.full((120, 204), 100, np.int8)
    cells[10:110, 2:202] = 0
    cells[4:8, 2:202] = 0

    regions = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05)).regions

    assert [region.id for region in regions] == ["R1"]


def test_what_alone_leads_from_one_room_to_another_is_a_corridor() -> None:
    rooms = divided(PASSAGE)

    assert sorted(region.room_class for region in rooms.regions) == [
        RoomClass.CORRIDOR,
        *[RoomClass.ROOM] * 3,
    ]


def test_a_room_beside_others_that_lead_to_each_other_is_no_corridor() -> None:
    rows = PASSAGE.splitlines()
    for row in (5, 6, 7):
        rows[row] = "    #.......................................#"

    assert {region.room_class for region in divided("\n".join(rows)).regions} == {RoomClass.ROOM}


def _join_halves(high: int, wide: int) -> int:
    """Return how many regions remain of a floor that was cut in the middle, where nothing is."""
    cells = np.full((high + 8, wide + 8), 100, np.int8)
    cells[4:-4, 4:-4] = 0
    raster = build_raster(OccupancyGrid(cells=cells, resolution_m=0.05))
    floor = build_floor(raster)
    labels = floor.floor.astype(np.int32)
    labels[:, labels.shape[1] // 2 :] *= 2
    cut = Segmentation(raster=raster, floor=floor, labels=labels, doubts={})
    joined = join_corridors(cut, measure_regions(cut), find_openings(cut))
    return int(joined.labels.max())


def test_two_short_strips_that_nothing_narrows_between_are_one() -> None:
    assert _join_halves(40, 232) == 1
    assert _join_halves(100, 232) == 2
