import dataclasses

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import (
    Frontier,
    FrontierReport,
    FrontierVerdict,
    estimate_known_ratio,
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
            frontiers=each,
            refused=(),
            verdict=FrontierVerdict.SOME_LEFT,
            n_named=len(each),
            floor_m2=8.0,
            known_ratio=0.5,
        )
        for each in ((old,), (far, near))
    )
    assert [each.id for each in match_frontiers(first, second).frontiers] == ["F2", "F1"]


def test_the_known_share_is_of_the_floor_on_the_map_and_of_more_than_frontiers_promise() -> None:
    found = report(room_with_openings(20, 0))
    (frontier,) = found.frontiers
    assert found.floor_m2 == 56 * 76 * 0.05**2 + 20 * 2 * 0.05**2
    assert found.floor_m2 / (found.floor_m2 + frontier.gain_m2) > found.known_ratio > 0.0


def test_behind_one_large_opening_more_is_expected_than_behind_small_ones_of_the_same_promise() -> (
    None
):
    assert estimate_known_ratio(50.0, [20.0]) < estimate_known_ratio(50.0, [5.0] * 4) < 1.0


def test_less_is_known_of_what_is_to_be_expected_while_little_is_known() -> None:
    """Twice the floor with the same openings: more than the growth of the floor would make it."""
    small, large = (estimate_known_ratio(floor_m2, [10.0, 10.0]) for floor_m2 in (20.0, 40.0))
    assert 1 / large - 1 < (1 / small - 1) / 2


def test_the_known_share_does_not_fall_when_more_is_seen_and_more_is_promised() -> None:
    first = report(room_with_openings(20, 0))
    second = report(room_with_openings(20, 20))
    assert second.known_ratio < first.known_ratio
    assert match_frontiers(first, second).known_ratio == first.known_ratio


def test_the_known_share_is_never_more_than_one_frontier_alone_leaves() -> None:
    whole, opened = report(room_with_openings(0, 0)), report(room_with_openings(20, 20))
    most_m2 = max(each.gain_m2 for each in opened.frontiers)
    assert whole.known_ratio == 1.0
    held_ratio = match_frontiers(whole, opened).known_ratio
    assert held_ratio == opened.floor_m2 / (opened.floor_m2 + most_m2) > opened.known_ratio


def test_the_known_share_begins_anew_where_floor_was_lost() -> None:
    cells = room_with_openings(20, 20)
    whole, other = report(room_with_openings(0, 0)), cells.copy()
    other[:, 86:] = -1
    smaller = report(other)
    assert smaller.floor_m2 < 0.9 * whole.floor_m2
    assert match_frontiers(whole, smaller).known_ratio == smaller.known_ratio
