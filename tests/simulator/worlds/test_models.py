import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.errors import ConfigError
from mapspeak.geometry import Point
from mapspeak.simulator.worlds.models import Mesh, build_parts, find_kind, kind_names
from mapspeak.simulator.worlds.slices import footprint

ROUNDING_M = 0.01
WALL_HUNG = [name for name in kind_names() if find_kind(name).is_wall_hung]
FREE_STANDING = [name for name in kind_names() if not find_kind(name).is_wall_hung]
kinds = st.sampled_from(kind_names())
heights = st.floats(0.0, 2.6)


def all_corners(kind: str) -> np.ndarray:
    return np.concatenate([part.corners.reshape(-1, 3) for part in build_parts(kind)])


def turns_left(a: Point, b: Point, c: Point) -> bool:
    return (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) > -1e-6


def is_inside(point: Point, outline: tuple[Point, ...]) -> bool:
    following = (*outline[1:], outline[0])
    return all(
        ((b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x)) / a.distance_to(b)
        > -ROUNDING_M
        for a, b in zip(outline, following, strict=True)
    )


def signed_volume(part: Mesh) -> float:
    a, b, c = np.moveaxis(part.corners - part.corners.reshape(-1, 3).mean(axis=0), 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@given(kind=kinds, ends=st.tuples(heights, heights))
def test_footprints_are_convex_and_run_counter_clockwise(
    kind: str, ends: tuple[float, float]
) -> None:
    low, high = sorted(ends)
    for outline in footprint(kind, low, high):
        n = len(outline)
        assert n >= 3
        assert all(
            turns_left(outline[i], outline[(i + 1) % n], outline[(i + 2) % n]) for i in range(n)
        )


@given(kind=kinds, levels=st.tuples(heights, heights, heights, heights))
def test_a_wider_band_of_heights_holds_all_that_a_narrower_one_does(
    kind: str, levels: tuple[float, float, float, float]
) -> None:
    lowest, low, high, highest = sorted(levels)
    wide = footprint(kind, lowest, highest)
    for outline in footprint(kind, low, high):
        assert any(all(is_inside(point, other) for point in outline) for other in wide)


@pytest.mark.parametrize("kind", kind_names())
def test_every_kind_can_be_felt_at_some_height(kind: str) -> None:
    assert footprint(kind, 0.0, 3.0)


def test_a_table_is_its_legs_below_and_its_top_above() -> None:
    assert len(footprint("table", 0.1, 0.5)) == 4
    assert len(footprint("table", 0.1, 0.8)) == 1


def test_a_fire_extinguisher_hangs_over_a_low_laser_and_before_a_high_one() -> None:
    assert footprint("fire_extinguisher", 0.1, 0.5) == ()
    assert len(footprint("fire_extinguisher", 0.8, 1.2)) >= 1


@pytest.mark.parametrize("kind", WALL_HUNG)
def test_what_hangs_on_a_wall_has_its_back_at_zero(kind: str) -> None:
    assert all_corners(kind)[:, 0].min() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("kind", FREE_STANDING)
def test_what_stands_free_has_its_origin_in_its_middle(kind: str) -> None:
    corners = all_corners(kind)[:, :2]
    assert np.abs(corners.min(axis=0) + corners.max(axis=0)).max() / 2 < 0.07


@pytest.mark.parametrize("kind", kind_names())
def test_no_part_is_inside_out(kind: str) -> None:
    closed = [part for part in build_parts(kind) if len(part.corners) > 2]
    assert all(signed_volume(part) > 0 for part in closed)


@pytest.mark.parametrize("kind", kind_names())
def test_normals_point_out_of_their_triangles(kind: str) -> None:
    for part in build_parts(kind):
        first, second, third = np.moveaxis(part.corners, 1, 0)
        outward = np.cross(second - first, third - first)
        assert (np.einsum("ik,ijk->ij", outward, part.normals) > -1e-12).all()
        assert np.linalg.norm(part.normals, axis=-1) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", kind_names())
def test_drawn_surfaces_are_not_stretched_beyond_their_edges(kind: str) -> None:
    drawn = [part.uv for part in build_parts(kind) if part.surface is not None]
    assert all(uv.min() >= -1e-9 and uv.max() <= 1 + 1e-9 for uv in drawn)


def test_an_unknown_kind_is_refused_with_those_there_are() -> None:
    with pytest.raises(ConfigError, match="'unicorn'") as refused:
        footprint("unicorn", 0.0, 1.0)
    assert "forklift" in refused.value.hint


@pytest.mark.parametrize("kind", kind_names())
def test_what_is_drawn_on_a_part_is_shown_once(kind: str) -> None:
    for part in build_parts(kind):
        assert np.linalg.norm(part.normals, axis=2) == pytest.approx(1.0)
        if part.surface is not None:
            assert (part.uv.min(), part.uv.max()) == pytest.approx((0.0, 1.0))
