import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapspeak.simulator.camera.textures import TILED, build_atlas, draw, look_up, pack
from mapspeak.simulator.worlds.models import Surface


@pytest.mark.parametrize("surface", Surface)
def test_every_surface_can_be_drawn(surface: Surface) -> None:
    picture = draw(surface)
    assert picture.dtype == np.uint8
    assert picture.shape[2] == 3
    assert picture.std() > 0.5


@pytest.mark.parametrize("surface", sorted(TILED))
def test_repeated_surfaces_have_no_seam(surface: Surface) -> None:
    picture = draw(surface).astype(float).mean(axis=2)
    seam = np.abs(picture[0] - picture[-1]).mean()
    steps = np.abs(np.diff(picture, axis=0)).mean(axis=1)
    assert seam <= max(3 * steps.mean(), 3.0)


RED, BLUE = (200, 0, 0), (0, 0, 200)


def sample(
    surfaces: list[NDArray[np.uint8]], which: int, uv: tuple[float, float], spread: float
) -> list[int]:
    atlas = build_atlas(surfaces, [True] * len(surfaces))
    at = np.array([uv], dtype=np.float32)
    colours = atlas.sample(np.array([which]), at, np.array([spread], dtype=np.float32))
    return [int(value) for value in colours[0]]


@given(st.lists(st.tuples(st.integers(1, 90), st.integers(1, 40)), min_size=1, max_size=40))
def test_packed_rectangles_lie_inside_and_do_not_overlap(sizes: list[tuple[int, int]]) -> None:
    corners, height = pack(np.array(sizes), 100)
    cover = np.zeros((height, 100), dtype=int)
    for (x, y), (width, rows) in zip(corners, sizes, strict=True):
        assert x + width <= 100
        cover[y : y + rows, x : x + width] += 1
    assert cover.max() == 1
    assert cover.sum() == sum(width * rows for width, rows in sizes)


def test_a_surface_is_looked_up_between_its_pixels() -> None:
    ramp = np.array([[0.0, 10.0], [20.0, 30.0]], dtype=np.float32)
    at = np.array([[0.5, 0.0], [0.5, 0.5], [-3.0, 0.0]], dtype=np.float32)
    assert look_up(ramp, at).tolist() == [5.0, 15.0, 0.0]


def test_surfaces_do_not_bleed_into_their_neighbours() -> None:
    plain = [np.full((64, 64, 3), colour, dtype=np.uint8) for colour in (RED, BLUE)]
    for spread in (1e-6, 1e-3, 0.1):
        for uv in ((0.0, 0.0), (0.999, 0.999), (0.5, 0.0)):
            assert sample(plain, 0, uv, spread) == list(RED)
            assert sample(plain, 1, uv, spread) == list(BLUE)


def test_a_repeated_surface_goes_on_beyond_its_edge() -> None:
    halves = np.zeros((64, 64, 3), dtype=np.uint8)
    halves[:, :32], halves[:, 32:] = RED, BLUE
    assert sample([halves], 0, (3.25, 0.5), 1e-6) == list(RED)
    assert sample([halves], 0, (-0.25, 0.5), 1e-6) == list(BLUE)


def test_a_far_surface_shows_the_mean_of_its_drawing() -> None:
    stripes = np.zeros((64, 64, 3), dtype=np.uint8)
    stripes[::2] = 200
    assert sample([stripes], 0, (0.3, 0.3), 0.01) == [100, 100, 100]


@pytest.mark.parametrize(("surface", "most_levels"), [(Surface.WALL, 5.0), (Surface.WOOD, 40.0)])
def test_plaster_is_even_and_wood_has_a_grain(surface: Surface, most_levels: float) -> None:
    assert most_levels / 10 < draw(surface).astype(float).std(axis=(0, 1)).mean() < most_levels


def test_a_ceiling_is_of_two_by_two_boards_with_joints_between_them() -> None:
    ceiling = draw(Surface.CEILING).astype(float).mean(axis=2)
    n = len(ceiling)
    for lines in (ceiling.mean(axis=1), ceiling.mean(axis=0)):
        is_joint = lines < lines.mean() - 5
        assert np.flatnonzero(is_joint).tolist() == [
            *(0, 1),
            *range(n // 2 - 2, n // 2 + 2),
            *(n - 2, n - 1),
        ]
