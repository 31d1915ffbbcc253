"""What must not change when the same building is mapped in another way."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomMap, find_rooms
from mapspeak.spatial.rooms.floor import build_floor, find_walls
from mapspeak.spatial.rooms.raster import build_raster

Cells = NDArray[np.int8]
Labels = NDArray[np.int16]

RESOLUTION_M = 0.05
N_ROWS, N_COLS = 200, 280


def building() -> Cells:
    """Draws 14 x 10 m: three rooms above a corridor, two below, tables and chairs."""
    cells = np.zeros((N_ROWS, N_COLS), np.int8)
    for row in (0, 76, 116, N_ROWS - 4):
        cells[row : row + 4] = 100
    for col, rows in ((0, slice(None)), (N_COLS - 4, slice(None)), (150, slice(0, 76))):
        cells[rows, col : col + 4] = 100
    for col in (90, 180):
        cells[116:, col : col + 4] = 100
    for row, col in ((76, 60), (76, 200), (116, 30), (116, 120), (116, 220)):
        cells[row : row + 4, col : col + 18] = 0
    cells[150:156, 30:50] = cells[30:50, 60:64] = 100
    cells[170:172, 120:150:6] = cells[40:44, 200:240:10] = 100
    return cells


def divide(
    cells: Cells, *, resolution_m: float = RESOLUTION_M, origin: Pose | None = None
) -> RoomMap:
    origin = origin or Pose(0.0, 0.0, 0.0)
    return find_rooms(OccupancyGrid(cells=cells, resolution_m=resolution_m, origin=origin))


def assert_same_regions(expected: Labels, found: Labels, *, least: float = 0.9) -> None:
    """Checks that each region has a counterpart with an intersection over union of `least`."""
    n_expected, n_found = int(expected.max()), int(found.max())
    assert n_found == n_expected
    for i in range(1, n_expected + 1):
        mine = expected == i
        ratios = [
            (mine & (found == j)).sum() / (mine | (found == j)).sum() for j in range(1, n_found + 1)
        ]
        assert max(ratios) >= least


@pytest.fixture(scope="module")
def labels() -> Labels:
    return divide(building()).labels


def test_the_building_has_five_rooms_and_a_corridor() -> None:
    rooms = divide(building())

    assert sorted(region.id for region in rooms.regions) == ["C2", "R1", "R3", "R4", "R5", "R6"]
    assert len(rooms.doors) == 5


def test_the_same_map_gives_the_same_answer() -> None:
    first, second = divide(building()), divide(building())

    assert first.regions == second.regions
    assert first.doors == second.doors
    assert np.array_equal(first.labels, second.labels)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_mirrored_map_has_the_mirrored_rooms(labels: Labels, axis: int) -> None:
    mirrored = divide(np.flip(building(), axis)).labels

    assert_same_regions(labels, np.flip(mirrored, axis))


@settings(max_examples=15)
@given(angle_deg=st.floats(0.0, 360.0))
def test_a_turned_map_has_the_turned_rooms(angle_deg: float) -> None:
    side = 380
    there = cv2.getRotationMatrix2D((N_COLS / 2, N_ROWS / 2), angle_deg, 1.0)
    there[:, 2] += np.array([side / 2 - N_COLS / 2, side / 2 - N_ROWS / 2])
    picture = (building() + 1).astype(np.uint8)
    turned = cv2.warpAffine(picture, there, (side, side), flags=cv2.INTER_NEAREST, borderValue=0)

    found = divide(turned.astype(np.int8) - np.int8(1)).labels

    back = cv2.invertAffineTransform(there)
    upright = cv2.warpAffine(found, back, (N_COLS, N_ROWS), flags=cv2.INTER_NEAREST)
    free = building() == 0
    expected = divide(building()).labels
    assert_same_regions(np.where(free, expected, 0), np.where(free, upright, 0))


@pytest.mark.parametrize("angle_deg", [7.0, 20.0, 30.0])
def test_areas_and_doors_of_a_turned_map_are_those_of_the_upright_one(angle_deg: float) -> None:
    side = 780
    fine = np.kron(building(), np.ones((2, 2), np.int8))
    there = cv2.getRotationMatrix2D((N_COLS, N_ROWS), angle_deg, 1.0)
    there[:, 2] += np.array([side / 2 - N_COLS, side / 2 - N_ROWS])
    picture = (fine + 1).astype(np.uint8)
    turned = cv2.warpAffine(picture, there, (side, side), flags=cv2.INTER_NEAREST, borderValue=0)

    found = divide(turned.astype(np.int8) - np.int8(1), resolution_m=RESOLUTION_M / 2)

    upright = divide(building())
    areas_m2, expected_m2 = (
        [region.floor_area_m2 for region in rooms.regions] for rooms in (found, upright)
    )
    assert areas_m2 == pytest.approx(expected_m2, abs=0.25)
    widths_m, expected_m = (
        sorted(door.width_m for door in rooms.doors) for rooms in (found, upright)
    )
    assert widths_m == pytest.approx(expected_m, abs=0.06)


def test_a_map_of_twice_the_resolution_has_the_same_rooms(labels: Labels) -> None:
    fine = np.kron(building(), np.ones((2, 2), np.int8))

    found = divide(fine, resolution_m=RESOLUTION_M / 2).labels

    assert_same_regions(labels, found[::2, ::2])


def test_a_map_of_half_the_resolution_has_the_same_rooms(labels: Labels) -> None:
    coarse = building().reshape(N_ROWS // 2, 2, N_COLS // 2, 2).max(axis=(1, 3))

    found = divide(coarse, resolution_m=RESOLUTION_M * 2).labels

    assert_same_regions(labels[::2, ::2], found)


@settings(max_examples=10)
@given(before=st.integers(0, 40), after=st.integers(0, 40))
def test_unknown_ground_around_a_map_changes_nothing(before: int, after: int) -> None:
    padded = np.pad(building(), ((before, after), (after, before)), constant_values=-1)

    found = divide(padded).labels

    window = found[before : before + N_ROWS, after : after + N_COLS]
    assert np.array_equal(window, divide(building()).labels)


def furnished(seed: int) -> Cells:
    """Draws the building with boxes at its walls, unseen inside, a slanting wall and noise."""
    rng = np.random.default_rng(seed)
    cells = building()
    cv2.line(cells.view(np.uint8), (100, 130), (170, 190), (100,), 2)
    for _ in range(12):
        row, col = rng.integers(10, N_ROWS - 50), rng.integers(10, N_COLS - 50)
        high, wide = rng.integers(6, 40, 2)
        box = cells[row : row + high, col : col + wide]
        box[1:-1, 1:-1] = -1
        box[[0, -1]] = box[:, [0, -1]] = 100
    cells[(cells == 100) & (rng.random(cells.shape) < 0.1)] = -1
    return cells


def disc() -> Cells:
    """Draws 12.6 m2 of floor with nothing seen around it, tightly cropped."""
    rows, cols = np.mgrid[:81, :81] - 40
    return np.where(np.hypot(rows, cols) <= 40, 0, -1).astype(np.int8)


def half_seen() -> Cells:
    """Draws the building up to where rays fan out, and a corner of it that no ray has reached."""
    cells = building()
    rows, cols = np.mgrid[:N_ROWS, :N_COLS]
    cells[cols > 200 + 40 * np.cos(rows / 6)] = -1
    cells[:24, :20] = -1
    return cells


@pytest.mark.parametrize("cells", [building(), furnished(1), furnished(4), disc(), half_seen()])
@pytest.mark.parametrize("beyond", [6, 60])
def test_specks_seen_far_beyond_a_map_change_nothing(cells: Cells, beyond: int) -> None:
    wider = np.pad(cells, beyond, constant_values=-1)
    wider[1:4, 1:4] = wider[-4:-1, -4:-1] = 0

    found = divide(wider).labels

    assert np.array_equal(found[beyond:-beyond, beyond:-beyond], divide(cells).labels)


def test_unseen_corners_of_a_map_are_no_floor() -> None:
    (region,) = divide(disc()).regions

    assert region.floor_area_m2 == pytest.approx(region.free_area_m2)


@pytest.mark.parametrize("seed", [1, 4])
def test_a_map_upside_down_has_its_walls_and_floor_upside_down(seed: int) -> None:
    upright, inverted = (
        build_raster(OccupancyGrid(cells=cells, resolution_m=RESOLUTION_M))
        for cells in (furnished(seed), furnished(seed)[::-1, ::-1])
    )
    wall, inverted_wall = (find_walls(each, [0.5, 22.5, 37.0])[0] for each in (upright, inverted))
    floor, inverted_floor = (build_floor(each).floor for each in (upright, inverted))

    assert np.array_equal(inverted_wall[::-1, ::-1], wall)
    assert np.array_equal(inverted_floor[::-1, ::-1], floor)


def test_another_origin_moves_places_and_changes_nothing_else(labels: Labels) -> None:
    moved = divide(building(), origin=Pose(-12.3, 4.5, 2.0))

    assert np.array_equal(moved.labels, labels)


def test_free_cells_may_have_any_value_up_to_49(labels: Labels) -> None:
    cells = building()
    noise = np.random.default_rng(7).integers(0, 50, cells.shape).astype(np.int8)

    found = divide(np.where(cells == 0, noise, cells)).labels

    assert np.array_equal(found, labels)


@pytest.mark.parametrize("angle_deg", [10.0, 27.0, 45.0])
def test_walls_one_cell_thick_divide_rooms_at_any_angle(angle_deg: float) -> None:
    cells = np.full((300, 300), -1, np.int8)
    middle, turn = np.array([150.0, 150.0]), np.radians(angle_deg)
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])

    def corner(x: float, y: float) -> tuple[int, int]:
        u, v = np.round(middle + x * along + y * across).astype(int).tolist()
        return u, v

    outline = np.array([corner(x, y) for x, y in ((-90, -50), (90, -50), (90, 50), (-90, 50))])
    cv2.fillPoly(cells, [outline], (0,))
    cv2.polylines(cells, [outline], isClosed=True, color=(100,))
    cv2.line(cells, corner(0, -50), corner(0, 20), (100,))
    cv2.line(cells, corner(0, 38), corner(0, 50), (100,))

    rooms = find_rooms(OccupancyGrid(cells=cells, resolution_m=0.05))

    assert [round(region.floor_area_m2) for region in rooms.regions] == pytest.approx(
        [22, 22], abs=1
    )
    assert [door.width_m for door in rooms.doors] == pytest.approx([0.85], abs=0.15)
