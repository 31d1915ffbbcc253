import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.simulator.robot.lidar import (
    BEAM_ANGLES_RAD,
    MAX_RANGE_M,
    N_BEAMS,
    Lidar,
    LidarScan,
    measure_ranges,
)
from mapspeak.simulator.worlds.slices import Slice

AHEAD = N_BEAMS // 2
coordinates = st.floats(-5, 5)
edge_lists = st.lists(st.tuples(*[coordinates] * 4), min_size=1, max_size=8)


def box_around(half_m: float) -> Slice:
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return Slice((half_m * corners,))


def measure_by_brute_force(edges: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    """Meets every beam with every edge."""
    angles = pose.yaw_rad + BEAM_ANGLES_RAD[:, None]
    beam_x, beam_y = np.cos(angles), np.sin(angles)
    start_x, start_y = edges[:, 0] - pose.x, edges[:, 1] - pose.y
    edge_x, edge_y = edges[:, 2] - edges[:, 0], edges[:, 3] - edges[:, 1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        across = beam_x * edge_y - beam_y * edge_x
        distance = (start_x * edge_y - start_y * edge_x) / across
        share = (start_x * beam_y - start_y * beam_x) / across
        meets = (distance > 0) & (share >= 0) & (share <= 1)
    return np.asarray(np.where(meets, distance, np.inf).min(axis=1))


@given(edge_lists, coordinates, coordinates, st.floats(-math.pi, math.pi))
def test_ranges_equal_those_of_every_beam_met_with_every_edge(
    edges: list[tuple[float, float, float, float]], x: float, y: float, yaw: float
) -> None:
    solids = Slice(tuple(np.array(edge).reshape(2, 2) for edge in edges))
    pose = Pose(x, y, yaw)
    assume(solids.distance_to(pose.point) > 0.1)

    quick = measure_ranges(solids.edges, pose)
    slow = measure_by_brute_force(solids.edges, pose)

    # A beam may pass an edge's very end on either side.
    differs = ~np.isclose(quick, slow, rtol=1e-6, atol=1e-6)
    assert np.count_nonzero(differs) <= 2 * len(edges)


def test_the_middle_beam_looks_ahead_and_the_first_one_back() -> None:
    ranges = measure_ranges(box_around(2.0).edges, Pose(0.5, 0.0, 0.0))

    assert ranges[AHEAD] == pytest.approx(1.5)
    assert ranges[0] == pytest.approx(2.5)
    assert ranges[AHEAD + N_BEAMS // 4] == pytest.approx(2.0)


def test_no_beam_slips_through_a_corner() -> None:
    ranges = measure_ranges(box_around(2.0).edges, Pose(0.0, 0.0, math.pi / 4))

    assert np.isfinite(ranges).all()
    assert ranges[AHEAD] == pytest.approx(2.0 * math.sqrt(2))


def test_noise_is_about_a_centimetre_and_depends_on_the_seed_alone() -> None:
    def scan(seed: int) -> LidarScan:
        lidar = Lidar(box_around(2.0), random=np.random.default_rng(seed))
        return lidar.scan(Pose(0.0, 0.0), stamp_s=0.0)

    exact = measure_ranges(box_around(2.0).edges, Pose(0.0, 0.0))

    assert np.std(scan(1).ranges_m - exact) == pytest.approx(0.01, rel=0.15)
    assert np.array_equal(scan(1).ranges_m, scan(1).ranges_m)
    assert not np.array_equal(scan(1).ranges_m, scan(2).ranges_m)


def test_what_is_out_of_reach_gives_no_return() -> None:
    lidar = Lidar(box_around(MAX_RANGE_M + 1.0), random=np.random.default_rng(0))

    scan = lidar.scan(Pose(0.0, 0.0), stamp_s=3.0)

    assert scan.n_returns == 0
    assert scan.points_in_base.shape == (0, 2)
    assert scan.ends_in_base == pytest.approx(np.zeros((N_BEAMS, 2)))
    assert scan.stamp_s == 3.0


def test_a_scan_in_an_empty_world_is_empty() -> None:
    scan = Lidar(Slice(()), random=np.random.default_rng(0)).scan(Pose(0.0, 0.0), stamp_s=0.0)

    assert scan.n_returns == 0


def test_returns_are_points_on_the_walls_in_the_robots_frame() -> None:
    scan = LidarScan(measure_ranges(box_around(2.0).edges, Pose(0.5, 0.0, math.pi / 2)), 0.0)

    points = scan.points_in_base
    assert points[:, 0].max() == pytest.approx(2.0)
    assert points[:, 1].max() == pytest.approx(2.5)
    assert points[:, 1].min() == pytest.approx(-1.5)
