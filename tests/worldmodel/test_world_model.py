from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMap
from mapspeak.spatial.frontiers import Tried
from mapspeak.worldmodel.model import WorldModel

TWO_HALVES = grid_from_text(
    """
    #####################
    #.........#.........?
    #.........#.........?
    #.........#.........?
    #.........#.........?
    #.........#.........?
    #####################
    """,
    resolution_m=0.4,
)
LEFT, RIGHT = Pose(2.0, 1.4), Pose(6.0, 1.4)


def _world(robot: Pose, previous: WorldModel | None = None, *looked_from: Point) -> WorldModel:
    return WorldModel(
        TWO_HALVES,
        robot,
        SemanticMap(),
        radius_m=0.2,
        previous=previous,
        tried=Tried(looked_from=looked_from),
    )


def test_what_holds_for_all_places_of_a_floor_is_kept_while_the_robot_moves_on_it() -> None:
    first = _world(LEFT)
    reach = first.reach
    assert _world(Pose(2.6, 1.6), first).reach is reach


def test_a_robot_that_was_carried_behind_a_wall_gets_what_holds_there() -> None:
    first = _world(LEFT)
    assert first.frontiers.frontiers == ()
    second = _world(RIGHT, first)
    assert second.reach is not first.reach
    assert len(second.frontiers.frontiers) == 1
    assert second.frontiers.frontiers[0].distance_m < 3.0


def test_frontiers_keep_ids_and_poses_while_only_the_robot_moves() -> None:
    first = _world(RIGHT)
    second = _world(Pose(6.8, 1.2), first)
    (before,), (after,) = first.frontiers.frontiers, second.frontiers.frontiers
    assert (after.id, after.pose) == (before.id, before.pose)
    assert after.distance_m < before.distance_m


def test_a_frontier_that_was_looked_from_is_judged_anew_though_the_map_is_the_same() -> None:
    first = _world(RIGHT)
    (frontier,) = first.frontiers.frontiers
    second = _world(frontier.pose, first, frontier.pose.point)
    assert frontier.pose not in [each.pose for each in second.frontiers.frontiers]
