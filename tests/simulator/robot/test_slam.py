import math

import numpy as np
import pytest

from drawing import text_from_grid
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import LidarScan
from mapspeak.simulator.robot.gridmap import LogOddsMap
from mapspeak.simulator.robot.lidar import N_BEAMS, Lidar, measure_ranges
from mapspeak.simulator.robot.scanmatch import SurfaceField, match_scan, place_points
from mapspeak.simulator.robot.slam import Localiser, Mapper
from mapspeak.simulator.worlds.slices import Slice
from mapspeak.spatial import Cell, OccupancyGrid


def rectangle(x0: float, y0: float, x1: float, y1: float) -> np.ndarray[tuple[int, int]]:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


ROOM = Slice((rectangle(-3.02, -2.03, 4.01, 3.04), rectangle(1.0, 1.0, 1.6, 1.5)))
CORRIDOR = Slice((rectangle(-60, -1.0, 60, 1.0),))


def scan_from(solids: Slice, pose: Pose, *, seed: int = 0, stamp_s: float = 0.0) -> LidarScan:
    return Lidar(solids, random=np.random.default_rng(seed)).scan(pose, stamp_s=stamp_s)


def map_of(solids: Slice, *poses: Pose) -> LogOddsMap:
    log_odds_map = LogOddsMap()
    for seed, pose in enumerate(poses):
        scan = scan_from(solids, pose, seed=100 + seed)
        log_odds_map.insert(place_points(pose, scan.ends_in_base), scan.is_return)
    return log_odds_map


def drive_through(solids: Slice, poses: list[Pose], *, odometry_scale: float = 1.0) -> Mapper:
    """Lets a mapper follow a robot from pose to pose, by wheels that measure wrongly."""
    mapper = Mapper()
    odom = Pose(0.0, 0.0)
    for index, pose in enumerate(poses):
        if index:
            step = poses[index - 1].inverse() @ pose
            odom = odom @ Pose(
                odometry_scale * step.x, odometry_scale * step.y, odometry_scale * step.yaw_rad
            )
        mapper.follow_odometry(odom)
        mapper.add_scan(scan_from(solids, pose, seed=index, stamp_s=0.2 * index))
    return mapper


def value_at(grid: OccupancyGrid, point: Point) -> int:
    cell = grid.cell_at(point)
    return int(grid.cells[cell.row, cell.col]) if grid.contains(cell) else -1


def test_one_scan_shows_a_room_its_walls_and_nothing_behind_them() -> None:
    cells = 0.05 * np.array([[-4.5, -2.5], [5.5, -2.5], [5.5, 3.5], [-4.5, 3.5]])
    exact = LidarScan(measure_ranges(Slice((cells,)).edges, Pose(0.0, 0.0)), 0.0)
    log_odds_map = LogOddsMap()
    log_odds_map.insert(exact.ends_in_base, exact.is_return)

    grid = log_odds_map.publish(stamp_s=0.0)

    drawing = text_from_grid(grid).split("\n")
    assert drawing[0] == drawing[-1] == "#" * 11
    assert set(drawing[1:-1]) == {"#.........#"}


def test_the_map_grows_and_its_origin_moves_while_its_places_stay() -> None:
    hall = Slice((rectangle(-15.0, -1.0, 15.0, 1.0),))
    log_odds_map = map_of(ROOM, Pose(0.0, 0.0))
    before = log_odds_map.publish(stamp_s=0.0)
    scan = scan_from(hall, Pose(0.0, 0.0))
    log_odds_map.insert(scan.ends_in_base, scan.is_return)

    after = log_odds_map.publish(stamp_s=1.0)

    assert after.origin.x < before.origin.x - 5
    assert after.width_m > before.width_m + 10
    assert value_at(after, Point(-14.0, 0.0)) in range(50)
    assert value_at(before, Point(-1.0, 0.0)) in range(50)
    assert value_at(after, Point(-1.0, 0.0)) in range(50)
    assert value_at(before, Point(0.5, -2.03)) > 50
    assert value_at(after, Point(0.5, -2.03)) > 50


def test_published_values_are_those_of_cartographer() -> None:
    grid = map_of(ROOM, Pose(0.0, 0.0), Pose(0.5, 0.5, 1.0)).publish(stamp_s=2.5)

    assert (grid.resolution_m, grid.stamp_s) == (0.05, 2.5)
    assert value_at(grid, Point(0.0, 0.0)) in range(1, 49)
    assert value_at(grid, Point(4.02, 0.0)) in range(51, 100)
    assert value_at(grid, Point(1.3, 1.3)) == -1


def test_beams_without_return_mark_nothing() -> None:
    log_odds_map = LogOddsMap()

    log_odds_map.insert(np.zeros((N_BEAMS, 2)), np.zeros(N_BEAMS, dtype=bool))

    assert not log_odds_map.publish(stamp_s=0.0).occupied.any()


def test_beams_without_return_leave_the_robot_on_free_floor() -> None:
    log_odds_map = LogOddsMap()
    ranges = np.full(N_BEAMS, 2.0)
    ranges[::3] = np.inf
    scan = LidarScan(ranges, 0.0)

    log_odds_map.insert(scan.ends_in_base, scan.is_return)

    assert value_at(log_odds_map.publish(stamp_s=0.0), Point(0.0, 0.0)) in range(50)


@pytest.mark.parametrize(
    "off", [Pose(0.05, -0.04, 0.03), Pose(-0.1, 0.08, -0.06), Pose(0.3, -0.25, 0.2)]
)
def test_a_scan_is_placed_within_millimetres_from_a_wrong_guess(off: Pose) -> None:
    field = SurfaceField(map_of(ROOM, Pose(0.0, 0.0)))
    true = Pose(0.4, -0.3, 0.5)

    match = match_scan(field, scan_from(ROOM, true).points_in_base, true @ off)

    assert match.is_good
    assert match.map_from_base.point.distance_to(true.point) < 0.02
    assert match.map_from_base.yaw_rad == pytest.approx(true.yaw_rad, abs=math.radians(0.5))


def test_along_a_corridor_the_pose_follows_odometry_and_across_it_the_walls() -> None:
    field = SurfaceField(map_of(CORRIDOR, Pose(0.0, 0.0)))
    expected = Pose(0.5, 0.06, 0.0)

    match = match_scan(field, scan_from(CORRIDOR, Pose(0.45, 0.0)).points_in_base, expected)

    assert match.map_from_base.x == pytest.approx(0.5, abs=0.02)
    assert match.map_from_base.y == pytest.approx(0.0, abs=0.01)


def test_a_scan_of_another_place_does_not_fit() -> None:
    field = SurfaceField(map_of(ROOM, Pose(0.0, 0.0)))
    elsewhere = Slice((rectangle(-1.3, -0.9, 0.8, 1.7),))

    match = match_scan(field, scan_from(elsewhere, Pose(0.0, 0.0)).points_in_base, Pose(0.0, 0.0))

    assert not match.is_good


def test_slam_keeps_its_place_where_odometry_loses_it() -> None:
    around = [
        Pose(1.2 * math.sin(angle), 1.2 * math.cos(angle) - 1.2, -angle)
        for angle in np.linspace(0.0, 2 * math.tau, 120)
    ]

    mapper = drive_through(
        Slice((rectangle(-3.0, -4.0, 4.0, 3.0), rectangle(2.2, 1.0, 2.9, 1.5))),
        around,
        odometry_scale=1.03,
    )

    assert mapper.map_from_base.point.distance_to(around[-1].point) < 0.05


@pytest.mark.parametrize("n_returns", [0, 5])
def test_empty_and_short_scans_change_neither_map_nor_pose(n_returns: int) -> None:
    mapper = drive_through(ROOM, [Pose(0.0, 0.0)])
    before = mapper.publish(stamp_s=0.0)
    ranges = np.full(N_BEAMS, np.inf)
    ranges[:n_returns] = 1.0

    mapper.follow_odometry(Pose(0.5, 0.0))
    mapper.add_scan(LidarScan(ranges, 5.0))

    assert mapper.map_from_base == Pose(0.5, 0.0)
    assert mapper.publish(stamp_s=5.0) is before


def test_a_scan_that_contradicts_the_map_changes_nothing() -> None:
    mapper = drive_through(ROOM, [Pose(0.0, 0.0)])
    n_updates = mapper.n_updates
    elsewhere = Slice((rectangle(-1.3, -0.9, 0.8, 1.7),))

    mapper.follow_odometry(Pose(0.5, 0.0))
    mapper.add_scan(scan_from(elsewhere, Pose(0.0, 0.0), stamp_s=5.0))

    assert mapper.n_updates == n_updates
    assert mapper.map_from_base == Pose(0.5, 0.0)


def test_a_robot_that_stands_still_adds_no_scans_and_keeps_its_map() -> None:
    mapper = drive_through(ROOM, [Pose(0.0, 0.0)] * 20)

    assert mapper.n_updates == 1
    assert mapper.publish(stamp_s=1.0) is mapper.publish(stamp_s=2.0)


def test_a_slow_robot_adds_a_scan_every_second() -> None:
    mapper = drive_through(ROOM, [Pose(0.004 * index, 0.0) for index in range(16)])

    assert mapper.n_updates == 1 + 3


def test_a_map_published_after_each_scan_is_the_one_published_once() -> None:
    hall = Slice((rectangle(-15.0, -12.0, 2.0, 1.0),))
    often, once = LogOddsMap(), LogOddsMap()
    for seed, (solids, pose) in enumerate(
        [(ROOM, Pose(0.0, 0.0)), (hall, Pose(-2.0, -3.0, 1.0)), (hall, Pose(1.0, -2.0))]
    ):
        scan = scan_from(solids, pose, seed=seed)
        for log_odds_map in (often, once):
            log_odds_map.insert(place_points(pose, scan.ends_in_base), scan.is_return)
        often.publish(stamp_s=0.0)

    last, only = often.publish(stamp_s=1.0), once.publish(stamp_s=1.0)

    assert only.origin == last.origin
    assert np.array_equal(only.cells, last.cells)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_scan_that_is_turned_makes_the_same_map_turned(quarters: int) -> None:
    scan = LidarScan(measure_ranges(ROOM.edges, Pose(0.013, 0.021)), 0.0)
    plain, turned = LogOddsMap(), LogOddsMap()
    plain.insert(scan.ends_in_base, scan.is_return)
    turn = Pose(0.0, 0.0, quarters * math.pi / 2)
    turned.insert(place_points(turn, scan.ends_in_base), scan.is_return)

    before, after = plain.publish(stamp_s=0.0), turned.publish(stamp_s=0.0)

    expected = np.rot90(before.cells, -quarters)
    assert after.cells.shape == expected.shape
    assert np.count_nonzero(after.cells != expected) < 0.002 * expected.size


@pytest.mark.parametrize("step", [Pose(0.16, 0.0), Pose(0.0, 0.0, 0.11)])
def test_a_robot_that_drives_or_turns_fast_adds_each_scan(step: Pose) -> None:
    poses = [Pose(-0.3, 0.0)]
    for _ in range(4):
        poses.append(poses[-1] @ step)

    assert drive_through(ROOM, poses).n_updates == len(poses)


def test_a_robot_that_turns_between_scans_keeps_its_heading() -> None:
    turning = [Pose(0.0, 0.0, 0.25 * index) for index in range(9)]

    mapper = drive_through(ROOM, turning, odometry_scale=0.9)

    off = (turning[-1].inverse() @ mapper.map_from_base).yaw_rad
    assert abs(off) < math.radians(0.5)


FREE_ROOM = Slice((rectangle(-3.0, -2.0, 4.0, 3.0),))
CRATE = rectangle(1.0, 0.5, 1.4, 0.9)
FAR_WALL = Slice((rectangle(-3.0, -2.0, 12.0, 3.0),))


def localise(known: Slice, seen: Slice, *, n_scans: int, pose: Pose) -> Localiser:
    """Lets a robot that knows the map of one world stand in another one, shaking a little."""
    grid = map_of(known, *[Pose(0.0, 0.0, 0.3 * turn) for turn in range(8)]).publish(stamp_s=7.0)
    localiser = Localiser(grid, pose, random=np.random.default_rng(5))
    for index in range(n_scans):
        localiser.follow_odometry(Pose(0.0, 0.0, 0.02 * (index % 2)))
        there = pose @ Pose(0.0, 0.0, 0.02 * (index % 2))
        localiser.add_scan(scan_from(seen, there, seed=index, stamp_s=1.0 * index))
    return localiser


@pytest.mark.parametrize(("n_scans", "is_there"), [(2, False), (6, True)])
def test_what_the_map_does_not_show_is_planned_around_once_it_was_seen_often(
    n_scans: int, *, is_there: bool
) -> None:
    with_crate = Slice((*FREE_ROOM.outlines, CRATE))

    localiser = localise(FREE_ROOM, with_crate, n_scans=n_scans, pose=Pose(-1.0, 0.0))

    known, planned = localiser.publish(stamp_s=9.0), localiser.planning_map
    added = planned.occupied & ~known.occupied
    rows, cols = np.nonzero(added)
    assert bool(len(rows)) is is_there
    for row, col in zip(rows.tolist(), cols.tolist(), strict=True):
        place = planned.point_at(Cell(row, col))
        assert 0.9 <= place.x <= 1.5
        assert 0.4 <= place.y <= 1.0
    localiser.forget_obstacles()
    assert localiser.planning_map is known


def test_a_known_map_has_no_obstacles_of_its_own_nor_far_ones() -> None:
    far_crate = rectangle(6.5, 0.3, 6.9, 0.7)
    alone = localise(FAR_WALL, FAR_WALL, n_scans=6, pose=Pose(-1.0, 0.0))
    far_off = localise(
        FAR_WALL, Slice((*FAR_WALL.outlines, far_crate)), n_scans=6, pose=Pose(-1.0, 0.0)
    )

    assert alone.planning_map is alone.publish(stamp_s=0.0)
    assert far_off.planning_map is far_off.publish(stamp_s=0.0)


def test_localisation_mends_what_it_was_told_wrongly() -> None:
    localiser = localise(ROOM, ROOM, n_scans=3, pose=Pose(0.4, -0.3, 0.5))

    assert localiser.map_from_base.point.distance_to(Point(0.4, -0.3)) < 0.02
    assert localiser.map_from_base.yaw_rad == pytest.approx(0.5, abs=math.radians(0.5))
