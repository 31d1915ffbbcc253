from drawing import grid_from_text
from mapspeak.geometry import Point
from mapspeak.spatial.frontiers import find_frontiers, rerank_frontiers
from mapspeak.spatial.paths import distances_from

HALF_SEEN = grid_from_text(
    """
    ##########################
    #...........#............?
    #...........#............?
    #........................?
    #........................?
    #...........#............?
    #...........#............?
    ######..##################
         #..#
         #..#
         #..#
         ????
    """,
    resolution_m=0.3,
)
HERE, THERE = Point(1.0, 2.0), Point(5.0, 2.0)


def test_a_robot_that_only_moved_sees_the_same_frontiers_from_farther_or_nearer() -> None:
    report = find_frontiers(HALF_SEEN, HERE, radius_m=0.2)
    distances = distances_from(HALF_SEEN, THERE, radius_m=0.2)
    moved = rerank_frontiers(report, distances)
    assert moved is not None
    before = {frontier.id: frontier for frontier in report.frontiers}
    assert {frontier.id for frontier in moved.frontiers} == before.keys()
    for frontier in moved.frontiers:
        assert frontier.pose == before[frontier.id].pose
        assert frontier.distance_m == distances.distance_to(frontier.pose.point)


def test_a_robot_that_stayed_has_its_frontiers_in_the_same_order() -> None:
    report = find_frontiers(HALF_SEEN, HERE, radius_m=0.2)
    again = rerank_frontiers(report, distances_from(HALF_SEEN, HERE, radius_m=0.2))
    assert again is not None
    assert [each.id for each in again.frontiers] == [each.id for each in report.frontiers]
    assert [each.merits for each in again.frontiers] == [each.merits for each in report.frontiers]


def test_the_order_after_a_move_is_that_of_a_fresh_look() -> None:
    report = find_frontiers(HALF_SEEN, HERE, radius_m=0.2)
    moved = rerank_frontiers(report, distances_from(HALF_SEEN, THERE, radius_m=0.2))
    fresh = find_frontiers(HALF_SEEN, THERE, radius_m=0.2)
    assert moved is not None
    for one, other in zip(moved.frontiers, fresh.frontiers, strict=True):
        assert one.anchor.distance_to(other.anchor) < 1.0


def test_frontiers_out_of_reach_from_the_new_place_are_not_kept() -> None:
    grid = grid_from_text("#########\n#...#...?\n#...#...?\n#########", resolution_m=0.5)
    report = find_frontiers(grid, Point(2.6, 1.0), radius_m=0.2)
    assert report.frontiers
    assert rerank_frontiers(report, distances_from(grid, Point(1.0, 1.0), radius_m=0.2)) is None
