import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapspeak.geometry import Pose
from mapspeak.simulator.camera.rasteriser import (
    NEAR_M,
    FloatArray,
    Viewpoint,
    find_nearest,
    project,
)

VIEWPOINT = Viewpoint(
    pose=Pose(0.3, -0.2, 0.4), height_m=1.0, horizontal_fov_rad=1.4, width_px=70, height_px=50
)


def scatter_triangles(n: int, seed: int) -> FloatArray:
    """Gives triangles around the camera: large and small, before, beside and behind it."""
    random = np.random.default_rng(seed)
    centres = random.uniform((-2, -3, -3), (6, 5, 5), (n, 1, 3))
    return np.asarray(centres + random.normal(size=(n, 3, 3)) * random.uniform(0.1, 4, (n, 1, 1)))


def cast_rays(corners: FloatArray, viewpoint: Viewpoint) -> FloatArray:
    """Gives the inverse depth along each pixel's ray as Moller and Trumbore find it."""
    cos, sin = np.cos(viewpoint.pose.yaw_rad), np.sin(viewpoint.pose.yaw_rad)
    v, u = np.mgrid[: viewpoint.height_px, : viewpoint.width_px] + 0.5
    right = (u - viewpoint.width_px / 2) / viewpoint.focal_px
    down = (v - viewpoint.height_px / 2) / viewpoint.focal_px
    rays = np.stack([cos + sin * right, sin - cos * right, -down], axis=-1)
    nearest = np.zeros(u.shape)
    for a, b, c in corners:
        across = np.cross(rays, c - a)
        volume = across @ (b - a)
        from_a = viewpoint.place - a
        with np.errstate(divide="ignore", invalid="ignore"):
            first = across @ from_a / volume
            second = rays @ np.cross(from_a, b - a) / volume
            depth = np.cross(from_a, b - a) @ (c - a) / volume
        hit = (volume > 0) & (first >= 0) & (second >= 0) & (first + second <= 1) & (depth > 0)
        inverse = np.where(hit, 1 / np.where(hit, depth, 1.0), 0.0)
        nearest = np.maximum(nearest, inverse)
    return nearest


@settings(max_examples=40)
@given(n=st.integers(1, 60), seed=st.integers(0, 10_000))
def test_each_pixel_shows_what_a_ray_through_it_meets_first(n: int, seed: int) -> None:
    corners = scatter_triangles(n, seed)
    rows, inverse_depth = find_nearest(*project(corners, VIEWPOINT)[1:], VIEWPOINT)
    truth = cast_rays(corners, VIEWPOINT)
    # Pixels whose centre lies on an edge may go either way.
    differs = np.abs(inverse_depth - truth) > 1e-3 * np.maximum(truth, 0.05)
    is_before_near_plane = truth > 1 / NEAR_M
    assert (differs & ~is_before_near_plane).mean() < 0.01
    assert ((rows >= 0) == (inverse_depth > 0)).all()


def test_nothing_shows_where_there_is_nothing() -> None:
    rows, inverse_depth = find_nearest(*project(np.empty((0, 3, 3)), VIEWPOINT)[1:], VIEWPOINT)
    assert rows.shape == (50, 70)
    assert (rows == -1).all()
    assert (inverse_depth == 0).all()
