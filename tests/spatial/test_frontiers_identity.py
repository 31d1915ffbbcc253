import dataclasses

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import (
    Frontier,
    FrontierReport,
    FrontierVerdict,
    find_frontiers,
    match_frontiers,
)

RADIUS_M = 0.2


def room_with_openings(n_rows_open_west: int, n_rows_open_east: int) -> np.ndarray:
    """A room of 4 m by 3 m in the unknown, open to the west, the east, or both."""
    cells = np.full((100, 160), -1, np.int8)
    cells[20:80, 40:120] = 100
    cells[22:78, 42:118] = 0
    cells[40 : 40 + n_rows_open_west, 40:42] = 0
    cells[40 : 40 + n_rows_open_east, 118:120] = 0
    return cells


def report(cells: np.ndarray, origin: Pose | None = None) -> FrontierReport:
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=origin or Pose(0.0, 0.0))
    return find_frontiers(grid, Point(4.0, 2.5), radius_m=RADIUS_M)


def eastern(found: FrontierReport) -> Frontier:
    return max(found.frontiers, key=lambda each: each.anchor.x)


def western(found: FrontierReport) -> Frontier:
    return min(found.frontiers, key=lambda each: each.anchor.x)


def test_a_frontier_keeps_its_id_while_others_come_and_go() -> None:
    first = report(room_with_openings(20, 20))
    name_of_the_east = eastern(first).id
    second = match_frontiers(first, report(room_with_openings(0, 20)))
    assert [each.id for each in second.frontiers] == [name_of_the_east]


def test_a_new_frontier_gets_a_number_that_was_never_given() -> None:
    first = report(room_with_openings(20, 20))
    second = match_frontiers(first, report(room_with_openings(0, 20)))
    third = match_frontiers(second, report(room_with_openings(20, 20)))
    assert eastern(third).id == eastern(first).id
    assert western(third).id == "F3"
    assert third.n_named == 3


def test_ids_survive_a_map_that_grows_and_moves_its_origin() -> None:
    first = report(room_with_openings(20, 20))
    grown = np.pad(room_with_openings(20, 20), ((30, 5), (50, 10)), constant_values=-1)
    second = match_frontiers(first, report(grown, Pose(-2.5, -1.5)))
    assert eastern(second).id == eastern(first).id
    assert western(second).id == western(first).id


def test_a_frontier_that_gives_way_a_little_keeps_its_id() -> None:
    first = report(room_with_openings(20, 20))
    seen_further = room_with_openings(20, 20)
    seen_further[38:62, 120:124] = 0
    second = match_frontiers(first, report(seen_further))
    assert eastern(second).id == eastern(first).id


def test_a_frontier_elsewhere_is_a_new_one() -> None:
    first = report(room_with_openings(20, 0))
    second = match_frontiers(first, report(room_with_openings(0, 20)))
    assert [each.id for each in second.frontiers] == ["F2"]


def test_two_pieces_of_one_frontier_do_not_share_its_id() -> None:
    first = report(room_with_openings(0, 34))
    split = room_with_openings(0, 34)
    split[54:60, 110:120] = 100
    second = match_frontiers(first, report(split))
    names = [each.id for each in second.frontiers]
    assert len(names) == len(set(names))


def test_points_of_a_frontier_cannot_be_changed() -> None:
    assert not eastern(report(room_with_openings(20, 20))).points.flags.writeable


def test_a_report_finds_a_frontier_by_its_id() -> None:
    found = report(room_with_openings(20, 20))
    assert found.find("F1") is found.frontiers[0]
    assert found.find("F9") is None


def test_an_id_passes_to_the_piece_near_its_place_and_not_to_one_far_off() -> None:
    before = eastern(report(room_with_openings(20, 20)))
    piece = np.stack([np.full(20, 6.0), np.arange(20) * 0.05], axis=1)
    old = dataclasses.replace(before, id="F1", points=piece, pose=Pose(5.8, 0.3))
    far = dataclasses.replace(old, points=piece[5:], pose=Pose(5.8, 3.0))
    near = dataclasses.replace(old, points=piece[:8], pose=Pose(5.8, 0.2))
    first, second = (
        FrontierReport(
            frontiers=each, refused=(), verdict=FrontierVerdict.SOME_LEFT, n_named=len(each)
        )
        for each in ((old,), (far, near))
    )
    assert [each.id for each in match_frontiers(first, second).frontiers] == ["F2", "F1"]
