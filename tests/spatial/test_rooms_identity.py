"""Rooms keep their ids while a map grows, moves its origin and changes its mind."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomMap, find_rooms, match_rooms

Cells = NDArray[np.int8]

RESOLUTION_M = 0.05
ROOM_CELLS = 80


def row_of_rooms(n_rooms: int, *, closed: tuple[int, ...] = (), open_wall: int = 0) -> Cells:
    """Draws rooms of 4 x 4 m in a row, a door of 0.9 m between each two.

    Args:
        n_rooms: How many.
        closed: Walls without a door, counted from 1.
        open_wall: A wall that is not there at all.
    """
    cells = np.zeros((ROOM_CELLS + 4, n_rooms * ROOM_CELLS + 4), np.int8)
    cells[:4] = cells[-4:] = 100
    for wall in range(n_rooms + 1):
        left = wall * ROOM_CELLS
        cells[:, left : left + 4] = 100
        if 0 < wall < n_rooms and wall not in closed:
            cells[30:48, left : left + 4] = 0
        if wall == open_wall != 0:
            cells[4:-4, left : left + 4] = 0
    return cells


def divide(cells: Cells, *, origin: Pose | None = None, previous: RoomMap | None = None) -> RoomMap:
    grid = OccupancyGrid(
        cells=cells, resolution_m=RESOLUTION_M, origin=origin or Pose(0.0, 0.0, 0.0)
    )
    return find_rooms(grid, previous=previous)


def id_at(rooms: RoomMap, x: float, y: float = 2.0) -> str:
    region = rooms.find_region_at(Point(x, y))
    assert region is not None
    return region.id


def heirs_of(rooms: RoomMap, lost_id: str) -> tuple[str, ...]:
    (gone,) = (each for each in rooms.vanished if each.id == lost_id)
    return gone.became


def test_the_same_map_again_has_the_same_ids() -> None:
    before = divide(row_of_rooms(3))

    after = divide(row_of_rooms(3), previous=before)

    assert after.regions == before.regions
    assert after.doors == before.doors
    assert after.vanished == ()


def test_matching_afterwards_is_the_same_as_finding_with_the_previous_map() -> None:
    before, grown = divide(row_of_rooms(2)), divide(row_of_rooms(4))

    matched = match_rooms(before, grown)

    assert matched.regions == divide(row_of_rooms(4), previous=before).regions


def test_a_room_found_later_gets_a_new_id() -> None:
    before = divide(row_of_rooms(2))

    after = divide(row_of_rooms(3), previous=before)

    assert id_at(after, 2.0) == id_at(before, 2.0)
    assert id_at(after, 6.0) == id_at(before, 6.0)
    assert id_at(after, 10.0) == "R3"
    assert {door.id for door in after.doors} == {"D1", "D2"}
    assert after.doors_between("R3", id_at(after, 6.0))[0].id == "D2"


def test_ids_stay_when_the_map_grows_to_the_left_and_moves_its_origin() -> None:
    before = divide(row_of_rooms(2))

    after = divide(row_of_rooms(4), origin=Pose(-8.0, 0.0), previous=before)

    assert [id_at(after, x) for x in (2.0, 6.0)] == [id_at(before, x) for x in (2.0, 6.0)]
    assert {id_at(after, x) for x in (-2.0, -6.0)} == {"R3", "R4"}


@settings(max_examples=10)
@given(quarter=st.integers(0, 3), x=st.floats(-20.0, 20.0), y=st.floats(-20.0, 20.0))
def test_ids_stay_when_the_grid_is_turned_about_the_same_building(
    quarter: int, x: float, y: float
) -> None:
    cells = row_of_rooms(3)
    frame = Pose(x, y, 0.3)
    before = divide(cells, origin=frame)
    height, width = (side * RESOLUTION_M for side in cells.shape)
    corner = (Pose(0, 0, 0), Pose(width, 0, np.pi / 2), Pose(width, height, np.pi))
    turn = (*corner, Pose(0, height, -np.pi / 2))[quarter]

    after = divide(np.rot90(cells, quarter), origin=frame @ turn, previous=before)

    for region in before.regions:
        there = after.find_region_at(region.widest)
        assert there is not None
        assert there.id == region.id
    assert {door.id for door in after.doors} == {door.id for door in before.doors}


def test_two_rooms_that_turn_out_to_be_one_are_remembered_as_merged() -> None:
    before = divide(row_of_rooms(3))
    first, second = id_at(before, 2.0), id_at(before, 6.0)

    after = divide(row_of_rooms(3, open_wall=1), previous=before)

    kept = id_at(after, 2.0)
    lost = second if kept == first else first
    assert id_at(after, 6.0) == kept
    assert heirs_of(after, lost) == (kept,)
    assert after.region(lost).id == kept


def test_rooms_and_doors_that_are_found_again_have_their_ids_again() -> None:
    first = divide(row_of_rooms(3))
    merged = divide(row_of_rooms(3, open_wall=1), previous=first)

    again = divide(row_of_rooms(3), previous=merged)

    for region in first.regions:
        assert id_at(again, region.widest.x) == region.id
    assert {door.id for door in again.doors} == {door.id for door in first.doors}
    assert again.vanished == ()


def test_an_id_that_was_given_up_is_not_given_to_anything_else() -> None:
    first = divide(row_of_rooms(3))
    merged = divide(row_of_rooms(3, open_wall=1), previous=first)
    lost = {gone.id for gone in merged.vanished}

    longer = divide(row_of_rooms(5, open_wall=1), previous=merged)

    names = {region.id for region in longer.regions} | {door.id for door in longer.doors}
    assert lost.isdisjoint(names)


def test_the_floor_of_a_vanished_room_is_followed_to_what_covers_it_now() -> None:
    first = divide(row_of_rooms(3))
    merged = divide(row_of_rooms(3, open_wall=1), previous=first)
    (lost,) = (gone for gone in merged.vanished if gone.floor_area_m2 is not None)

    other = row_of_rooms(3, open_wall=1)
    other[4:-4, 2 * ROOM_CELLS : 2 * ROOM_CELLS + 4] = 0
    joined = divide(other, previous=merged)

    assert heirs_of(joined, lost.id) == (id_at(joined, lost.place.x),)


def test_a_region_that_merged_twice_points_to_the_last_one() -> None:
    first = divide(row_of_rooms(3))
    second = divide(row_of_rooms(3, open_wall=1), previous=first)
    blank = row_of_rooms(3, open_wall=1)
    blank[4:-4, 2 * ROOM_CELLS : 2 * ROOM_CELLS + 4] = 0

    third = divide(blank, previous=second)

    (only,) = third.regions
    for region in first.regions:
        assert third.region(region.id).id == only.id


def test_an_id_does_not_move_on_to_what_has_only_a_rim_of_its_floor() -> None:
    cells = row_of_rooms(3)
    known = cells.copy()
    known[:, 2 * ROOM_CELLS + 4 :] = -1
    before = divide(known)
    moved = cells.copy()
    for wall, now in ((ROOM_CELLS, None), (2 * ROOM_CELLS, 2 * ROOM_CELLS - 16)):
        moved[4:-4, wall : wall + 4] = 0
        if now is not None:
            moved[4:-4, now : now + 4] = 100
            moved[30:48, now : now + 4] = 0

    after = divide(moved, previous=before)

    assert len(after.regions) == 2
    assert id_at(after, 2.0) == id_at(before, 2.0)
    assert id_at(after, 10.0) not in {region.id for region in before.regions}
    assert heirs_of(after, id_at(before, 6.0)) == (id_at(after, 2.0),)


def test_a_door_that_was_closed_is_remembered() -> None:
    before = divide(row_of_rooms(3))
    (door,) = before.doors_between(id_at(before, 2.0), id_at(before, 6.0))

    after = divide(row_of_rooms(3, closed=(1,)), previous=before)

    assert door.id not in {kept.id for kept in after.doors}
    assert heirs_of(after, door.id) == ()


def test_a_different_building_shares_no_ids() -> None:
    before = divide(row_of_rooms(2))

    after = divide(row_of_rooms(2), origin=Pose(100.0, 0.0), previous=before)

    assert {region.id for region in after.regions} == {"R3", "R4"}
    assert {gone.id for gone in after.vanished} == {"R1", "R2", "D1"}


def test_a_region_that_turns_out_to_be_a_corridor_keeps_its_number() -> None:
    seen_so_far = np.zeros((64, 84), np.int8)
    seen_so_far[:2] = seen_so_far[-2:] = seen_so_far[:, :2] = seen_so_far[:, -2:] = 100
    whole = np.zeros((64, 404), np.int8)
    whole[:2] = whole[-2:] = whole[:, :2] = whole[:, -2:] = 100
    before = divide(seen_so_far)
    after = divide(whole, previous=before)
    assert [region.id for region in before.regions] == ["R1"]
    assert [region.id for region in after.regions] == ["C1"]
    assert after.region("R1").id == "C1"
    assert not after.vanished


def rooms_with_opening(width_cells: int) -> Cells:
    """Draws two rooms of 3 x 4 m with an opening between them."""
    cells = np.zeros((84, 126), np.int8)
    cells[:2] = cells[-2:] = 100
    cells[:, :2] = cells[:, -2:] = cells[:, 62:64] = 100
    low = 42 - width_cells // 2
    cells[low : low + width_cells, 62:64] = 0
    return cells


def test_a_doubtful_opening_is_judged_as_before_until_the_map_really_shows_otherwise() -> None:
    narrow, wider, gone = map(rooms_with_opening, (52, 56, 76))
    two, one = divide(narrow), divide(wider)
    assert (len(two.regions), len(one.regions)) == (2, 1)

    kept_two, kept_one = divide(wider, previous=two), divide(narrow, previous=one)

    assert [each.id for each in kept_two.regions] == [each.id for each in two.regions]
    assert [each.id for each in kept_one.regions] == [each.id for each in one.regions]
    assert len(divide(gone, previous=kept_two).regions) == 1
    assert len(divide(rooms_with_opening(20), previous=kept_one).regions) == 2
    assert kept_two.doors[0].certainty < 0.6
