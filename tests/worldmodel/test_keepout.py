import numpy as np
import pytest

from drawing import grid_from_text, text_from_grid
from guarding import corners
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMap
from mapspeak.places.goalcheck import GoalVerdict, check_goal, say_check
from mapspeak.places.relations.choosing import check_place, find_place
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import distances_from
from mapspeak.worldmodel.keepout import MARGIN_M, ClosedArea, close_floor
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.revision import MapRevision

HALL = grid_from_text(
    """
    #####################
    #.........#.........?
    #.........#.........?
    #...................?
    #.........#.........?
    #.........#.........?
    #####################
    """,
    resolution_m=0.4,
)
START = Pose(2.0, 1.4)


def area(low: tuple[float, float], high: tuple[float, float], name: str = "pit") -> ClosedArea:
    return ClosedArea(name=name, outline=corners(low, high))


def world_with(*areas: ClosedArea, grid: OccupancyGrid = HALL) -> WorldModel:
    revision = MapRevision(grid, radius_m=0.2, areas=areas)
    return WorldModel(grid, START, SemanticMap(), radius_m=0.2, revision=revision)


def test_a_closed_area_is_no_floor_and_the_map_itself_stays() -> None:
    closed = close_floor(HALL, [area((2.1, 0.9), (2.3, 1.5))])
    assert text_from_grid(closed).splitlines() == [
        "#####################",
        "#.........#.........?",
        "#...###...#.........?",
        "#...###.............?",
        "#...###...#.........?",
        "#...###...#.........?",
        "#####################",
    ]
    assert close_floor(HALL, []) is HALL


def test_what_lies_around_an_area_within_the_margin_is_closed_too() -> None:
    floor = OccupancyGrid(
        cells=np.zeros((100, 100), dtype=np.int8), resolution_m=0.05, origin=Pose(0.0, 0.0)
    )
    pit = area((2.02, 2.02), (3.01, 3.01))
    distances = distances_from(close_floor(floor, [pit]), Point(0.5, 0.5), radius_m=0.3)
    points = floor.points_at(*np.nonzero(distances.reachable)).tolist()
    nearest_m = min(pit.distance_to(Point(x, y)) for x, y in points)
    assert 0.3 + MARGIN_M <= nearest_m <= 0.3 + MARGIN_M + 0.1


@pytest.mark.parametrize(
    ("point", "away_m"),
    [(Point(2.5, 1.0), -0.1), (Point(2.4, 1.2), 0.0), (Point(2.1, 1.0), 0.3)],
)
def test_how_deep_a_point_lies_in_an_area_is_told_by_a_negative_distance(
    point: Point, away_m: float
) -> None:
    pit = area((2.4, 0.5), (3.0, 1.7))
    assert pit.distance_to_border(point) == pytest.approx(away_m)
    assert pit.distance_to(point) == pytest.approx(max(away_m, 0.0))


def test_a_turned_map_is_closed_at_the_same_place() -> None:
    turned = OccupancyGrid(
        cells=HALL.cells, resolution_m=HALL.resolution_m, origin=Pose(3.0, 1.0, 0.7)
    )
    middle = turned.origin.transform(Point(2.2, 1.4))
    pit = area((middle.x - 0.3, middle.y - 0.3), (middle.x + 0.3, middle.y + 0.3))
    floor = close_floor(turned, [pit])
    cell = floor.cell_at(middle)
    assert floor.occupied[cell.row, cell.col]


def test_an_area_that_lies_off_the_map_closes_nothing_on_it() -> None:
    far = area((1e5, 1e5), (2e5, 2e5))
    assert text_from_grid(close_floor(HALL, [far])) == text_from_grid(HALL)


def test_an_area_larger_than_any_map_closes_all_of_it() -> None:
    everywhere = area((-1e5, -1e5), (1e5, 1e5))
    assert not close_floor(HALL, [everywhere]).free.any()


def test_no_way_leads_through_a_closed_area_and_the_way_round_is_taken() -> None:
    open_m = world_with().path_m(Point(3.7, 1.4))
    round_m = world_with(area((2.5, 0.5), (2.7, 1.4))).path_m(Point(3.7, 1.4))
    assert open_m is not None
    assert round_m is not None
    assert round_m > open_m + 0.5


def test_rooms_and_their_ids_do_not_change_when_something_is_closed() -> None:
    open_, closed = world_with(), world_with(area((3.6, 0.5), (4.4, 2.0)))
    assert [each.id for each in closed.rooms.regions] == [each.id for each in open_.rooms.regions]


def test_a_revision_with_other_areas_has_the_same_rooms() -> None:
    revision = MapRevision(HALL, radius_m=0.2)
    rooms = revision.rooms
    assert revision.with_areas([area((0, 0), (1, 1))]).rooms is rooms


def test_what_lies_behind_a_closed_area_is_offered_neither_as_room_nor_as_frontier() -> None:
    assert world_with().frontiers.frontiers
    world = world_with(area((3.9, 0.0), (4.1, 2.8), name="door"))
    assert not world.frontiers.frontiers
    east = max(world.rooms.regions, key=lambda region: region.widest.x)
    verdict = check_place(world, find_place(world, east.id)).check.verdict
    assert verdict is GoalVerdict.UNREACHABLE


def test_a_room_is_stood_in_beside_its_closed_part() -> None:
    west = world_with().rooms.find_region_at(START.point)
    assert west is not None
    widest = west.widest
    pit = area((widest.x - 0.3, widest.y - 0.3), (widest.x + 0.3, widest.y + 0.3))
    world = world_with(pit)
    goal = check_place(world, find_place(world, west.id))
    assert goal.check.is_ok
    assert pit.distance_to(goal.pose.point) > 0.1


@pytest.mark.parametrize(
    ("goal", "says"),
    [
        (Pose(2.9, 1.0), "lies in the keep-out area 'pit'"),
        (Pose(3.2, 1.0), "0.20 m from the keep-out area 'pit'"),
        (Pose(40.0, 40.0), "off the map"),
    ],
)
def test_a_goal_is_refused_for_the_area_it_lies_in_or_touches(goal: Pose, says: str) -> None:
    pit = area((2.4, 0.5), (3.0, 1.7))
    floor = close_floor(HALL, [pit])
    check = check_goal(HALL, distances_from(floor, START.point, radius_m=0.3), goal)
    assert says in say_check(check)
    assert check.nearest is not None
    assert pit.distance_to(check.nearest.point) > 0.1


def test_a_closed_goal_in_the_unknown_is_closed_first_of_all() -> None:
    pit = area((7.8, 0.5), (8.6, 1.7))
    floor = close_floor(HALL, [pit])
    check = check_goal(HALL, distances_from(floor, START.point, radius_m=0.2), Pose(8.2, 1.0))
    assert check.verdict is GoalVerdict.CLOSED


TABLE_IN_THE_MIDDLE = grid_from_text(
    """
    ################################
    #.............#................#
    #.............#................#
    #.............#................#
    #.............#................#
    #.............#.....#####......#
    #...................#####......#
    #...................#####......#
    #...................#####......#
    #.............#.....#####......#
    #.............#................#
    #.............#................#
    #.............#................#
    #.............#................#
    ################################
    """,
    resolution_m=0.25,
)


def test_a_room_behind_a_closed_area_is_cut_off_and_not_too_tight() -> None:
    shut = ClosedArea(name="wet floor", outline=corners((2.7, 0.0), (3.2, 4.0)), event_id="E2")
    world = world_with(shut, grid=TABLE_IN_THE_MIDDLE)
    east = max(world.rooms.regions, key=lambda region: region.widest.x)
    cell = TABLE_IN_THE_MIDDLE.cell_at(east.widest)
    assert TABLE_IN_THE_MIDDLE.occupied[cell.row, cell.col]
    check = check_place(world, find_place(world, east.id)).check
    assert check.verdict is GoalVerdict.UNREACHABLE
    assert 'is closed; the shortest leads over the area "wet floor", closed by event' in (
        say_check(check)
    )


def test_a_door_with_a_bucket_in_it_is_cut_off_too_and_not_too_tight() -> None:
    cells = np.zeros((80, 160), dtype=np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = cells[:, 79:82] = 100
    cells[28:52, 79:82] = 0
    cells[36:40, 79:82] = 100
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    shut = ClosedArea(name="wet floor", outline=corners((2.7, 0.0), (3.2, 4.0)), event_id="E2")
    open_, closed = world_with(grid=grid), world_with(shut, grid=grid)
    (door,) = open_.rooms.doors
    assert check_place(open_, find_place(open_, door.id)).check.is_ok
    check = check_place(closed, find_place(closed, door.id)).check
    assert check.verdict is GoalVerdict.UNREACHABLE
    assert "closed by event E2" in say_check(check)


def test_a_room_without_a_door_is_out_of_reach_and_not_in_the_way_of_its_table() -> None:
    cells = TABLE_IN_THE_MIDDLE.cells.copy()
    cells[:, 14] = 100
    world = world_with(grid=OccupancyGrid(cells=cells, resolution_m=0.25))
    east = max(world.rooms.regions, key=lambda region: region.widest.x)
    check = check_place(world, find_place(world, east.id)).check
    assert check.verdict is GoalVerdict.UNREACHABLE


@pytest.mark.parametrize("hole_m", [0.3, 0.6])
def test_no_hop_leads_out_of_a_closed_ring_around_the_robot(hole_m: float) -> None:
    hall = OccupancyGrid(cells=np.zeros((100, 100), dtype=np.int8), resolution_m=0.05)
    inner, outer = hole_m / 2, hole_m / 2 + 0.1
    ring = ClosedArea(
        name="ring",
        outline=corners((2.5 - outer, 2.5 - outer), (2.5 + outer, 2.5 + outer)),
        further_outlines=(corners((2.5 - inner, 2.5 - inner), (2.5 + inner, 2.5 + inner)),),
    )
    revision = MapRevision(hall, radius_m=0.2, areas=(ring,))
    robot = Pose(2.5, 2.5)
    world = WorldModel(hall, robot, SemanticMap(), radius_m=0.2, revision=revision)
    check = check_place(world, find_place(world, "4.2, 4.2")).check
    assert check.verdict is GoalVerdict.UNREACHABLE
    assert "is closed; the shortest leads over the keep-out area 'ring'" in say_check(check)
    assert check.nearest is None


def test_a_robot_that_stands_in_a_closed_area_still_hops_out_of_it() -> None:
    hall = OccupancyGrid(cells=np.zeros((100, 100), dtype=np.int8), resolution_m=0.05)
    pit = area((1.9, 1.3), (2.1, 1.5))
    world = world_with(pit, grid=hall)
    assert check_place(world, find_place(world, "4.0, 4.0")).check.is_ok
