import math

import numpy as np
import pytest

from drawing import grid_from_text
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import (
    CorridorWalk,
    DoorSide,
    Region,
    RoomClass,
    RoomMap,
    find_rooms,
    walk_along,
)

OFFICE = """
####################################################
#...........#...........#...........#..............#
#...........#...........#...........#..............#
#...........#...........#...........#..............#
#...........#...........#...........#..............#
#...........#...........#...........#..............#
#####...########...#########...##########...########
#...................................................
#...................................................
#...................................................
#...................................................
#...................................................
#...................................................
########...#########################...#############
#.......................#..........................#
#.......................#..........................#
#.......................#..........................#
#.......................#..........................#
#.......................#..........................#
####################################################
"""


def _walk(origin: Pose, resolution_m: float = 0.3) -> CorridorWalk:
    rooms = find_rooms(grid_from_text(OFFICE, resolution_m=resolution_m, origin=origin))
    corridors = [each for each in rooms.regions if each.room_class is RoomClass.CORRIDOR]
    walk = walk_along(rooms, max(corridors, key=lambda corridor: corridor.length_m))
    assert walk is not None
    return walk


def test_the_doors_of_a_corridor_come_in_their_order_on_their_sides() -> None:
    walk = _walk(Pose(0.0, 0.0))
    left = [stop.along_m for stop in walk.stops if stop.side is DoorSide.LEFT]
    right = [stop.along_m for stop in walk.stops if stop.side is DoorSide.RIGHT]
    assert (len(left), len(right)) == (4, 2)
    doors_x = [1.95, 5.25, 8.85, 12.75]
    assert left == pytest.approx([x - walk.start.x for x in doors_x], abs=0.5)
    assert walk.heading_rad == pytest.approx(0.0, abs=0.1)


def test_a_turned_map_leaves_left_and_right_as_they_are() -> None:
    walk = _walk(Pose(3.0, -2.0, math.pi / 4))
    assert [stop.side for stop in walk.stops] == [stop.side for stop in _walk(Pose(0, 0)).stops]
    assert walk.heading_rad == pytest.approx(math.pi / 4, abs=0.1)


def test_seen_from_the_other_end_left_is_right_and_the_first_door_is_the_last() -> None:
    walk, back = _walk(Pose(0.0, 0.0)), _walk(Pose(0.0, 0.0, math.pi))
    assert [stop.side for stop in back.stops].count(DoorSide.LEFT) == 2
    assert back.stops[0].along_m == pytest.approx(walk.length_m - walk.stops[-1].along_m, abs=0.3)


def test_a_room_as_small_as_a_cell_has_no_length_to_walk() -> None:
    rooms = find_rooms(grid_from_text("####\n#..#\n#..#\n####", resolution_m=1.0))
    assert all(
        walk is None or walk.length_m < 3.0
        for walk in (walk_along(rooms, region) for region in rooms.regions)
    )


def test_a_door_at_the_end_of_a_corridor_is_ahead_of_who_walks_there() -> None:
    rooms = find_rooms(
        grid_from_text(
            """
            #################################################
            #.......................................#.......#
            #.......................................#.......#
            #...............................................#
            #...............................................#
            #.......................................#.......#
            #.......................................#.......#
            ########################################.........
            """,
            resolution_m=0.3,
        )
    )
    corridor = next(each for each in rooms.regions if each.room_class is RoomClass.CORRIDOR)
    walk = walk_along(rooms, corridor)
    assert walk is not None
    assert [stop.side for stop in walk.stops] == [DoorSide.AHEAD]


BRANCHING = """
######################################################
#................#.................#.................#
#................#.................#.................#
#................#.................#.................#
#................#.................#.................#
#................#.................#.................#
#................#.................#.................#
#................#.................#.................#
#................#.................#.................#
########...###########....###############...##########
#....................................................#
#....................................................#
#....................................................#
#....................................................#
##########################......######################
##########################......######################
##########################......######################
##########################......######################
##########################......######################
##########################......#.......##############
##########################......#.......##############
##########################..............##############
##########################..............##############
##########################..............##############
##########################......#.......##############
##########################......#.......##############
######################################################
"""

ALL_AROUND = """
######################################################
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
############...#######################...#############
#....................................................#
#....................................................#
#....................................................#
#....................................................#
#.....##########################################.....#
#.....##########################################.....#
#.....##########################################.....#
#.....##########################################.....#
#.....##########################################.....#
#....................................................#
#....................................................#
#....................................................#
#....................................................#
########...##############################...##########
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
#.......................#............................#
######################################################
"""


def _walk_in(text: str) -> tuple[RoomMap, Region, CorridorWalk]:
    rooms = find_rooms(grid_from_text(text, resolution_m=0.3))
    (corridor,) = [each for each in rooms.regions if each.room_class is RoomClass.CORRIDOR]
    walk = walk_along(rooms, corridor)
    assert walk is not None
    return rooms, corridor, walk


def test_a_door_on_a_branch_is_neither_left_nor_right_of_the_walk_past_it() -> None:
    rooms, _, walk = _walk_in(BRANCHING)
    places = {door.id: door.place for door in rooms.doors}
    sides = {stop.door_id: stop.side for stop in walk.stops}
    above = {door_id for door_id, place in places.items() if place.y > 4.8}
    assert {sides[door_id] for door_id in above} == {DoorSide.LEFT}
    (branch,) = sides.keys() - above
    assert sides[branch] is DoorSide.ELSEWHERE


def test_a_corridor_that_leads_all_around_is_walked_on_one_side_of_its_core() -> None:
    rooms, corridor, walk = _walk_in(ALL_AROUND)
    assert rooms.find_region_at(walk.middle) == corridor
    places = {door.id: door.place for door in rooms.doors}
    is_above = walk.middle.y > 5.2
    elsewhere = {stop.door_id for stop in walk.stops if stop.side is DoorSide.ELSEWHERE}
    assert elsewhere
    assert all((places[door_id].y > 5.2) != is_above for door_id in elsewhere)


@pytest.mark.parametrize("niche", [slice(40, 40), slice(54, 60), slice(46, 54)])
def test_doors_beside_the_end_of_a_corridor_come_in_their_order_whatever_its_shape(
    niche: slice,
) -> None:
    cells = np.full((200, 120), 100, np.int8)
    cells[10:170, 40:60] = 0
    cells[5:45, 5:37] = cells[50:100, 5:37] = cells[5:60, 63:110] = cells[65:120, 63:110] = 0
    cells[17:26, 37:40] = cells[16:25, 60:63] = cells[70:80, 37:40] = cells[90:100, 60:63] = 0
    cells[10:14, niche] = 100
    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.1))
    (corridor,) = (each for each in rooms.regions if each.room_class is RoomClass.CORRIDOR)
    walk = walk_along(rooms, corridor)
    assert walk is not None
    places_y = [next(d.place.y for d in rooms.doors if d.id == s.door_id) for s in walk.stops]
    assert places_y == sorted(places_y)
    along_m = [stop.along_m for stop in walk.stops]
    assert along_m == pytest.approx([y - walk.start.y for y in places_y], abs=0.3)
    assert walk.heading_rad == pytest.approx(math.pi / 2, abs=0.05)
