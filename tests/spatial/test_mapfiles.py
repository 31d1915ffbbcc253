import math
import os
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from PIL import Image

from drawing import grid_from_text, text_from_grid
from mapspeak.errors import MapError
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import MapMode, MapOddity, load_map, load_picture
from mapspeak.spatial.mapwriting import write_map

USUAL = {
    "image": "map.pgm",
    "resolution": "0.05",
    "origin": "[-10.0, 5.5, 0.0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}


def write_yaml(folder: Path, **changes: str | None) -> Path:
    """Writes a map's .yaml with some lines changed, or left out where the change is None."""
    lines = {**USUAL, **changes}
    path = folder / "map.yaml"
    path.write_text("\n".join(f"{key}: {value}" for key, value in lines.items() if value), "utf-8")
    return path


def write_greys(folder: Path, *greys: int) -> None:
    """Writes a picture of one row."""
    (folder / "map.pgm").write_bytes(b"P5\n%d 1\n255\n" % len(greys) + bytes(greys))


def load_greys(folder: Path, *greys: int, **changes: str | None) -> list[int]:
    write_greys(folder, *greys)
    return [int(value) for value in load_map(write_yaml(folder, **changes)).grid.cells[0]]


def test_a_map_has_the_resolution_origin_and_name_of_its_file(tmp_path: Path) -> None:
    write_greys(tmp_path, 0, 254)
    loaded = load_map(write_yaml(tmp_path, origin="[-10.0, 5.5, 0.3]"))
    assert loaded.name == "map"
    assert loaded.grid.resolution_m == 0.05
    assert loaded.grid.origin == Pose(-10.0, 5.5, 0.3)
    assert loaded.warnings == ()


def test_the_top_line_of_the_picture_is_the_highest_row(tmp_path: Path) -> None:
    (tmp_path / "map.pgm").write_bytes(b"P5 2 2 255\n" + bytes([0, 254, 254, 205]))
    assert text_from_grid(load_map(write_yaml(tmp_path)).grid) == "#.\n.?"


@pytest.mark.parametrize(
    ("mode", "negate", "expected"),
    [
        # occupied from 0.65 on: grey 89 is (255 - 89) / 255 = 0.651; free up to 0.196: 206 is 0.192
        ("trinary", "0", {0: 100, 89: 100, 90: -1, 204: -1, 205: -1, 206: 0, 254: 0, 255: 0}),
        ("trinary", "1", {0: 0, 49: 0, 50: -1, 165: -1, 166: 100, 255: 100}),
        ("scale", "0", {0: 100, 89: 100, 90: 99, 147: 50, 205: 0, 206: 0, 255: 0}),
        ("raw", "0", {0: 0, 1: 1, 50: 50, 100: 100, 101: -1, 128: -1, 205: -1, 255: -1}),
        ("raw", "1", {0: 0, 100: 100, 255: -1}),
    ],
)
def test_each_mode_gives_greys_the_occupancy_that_map_server_gives_them(
    tmp_path: Path, mode: str, negate: str, expected: dict[int, int]
) -> None:
    values = load_greys(tmp_path, *expected, mode=mode, negate=negate)
    assert dict(zip(expected, values, strict=True)) == expected


def test_without_a_mode_a_map_is_trinary(tmp_path: Path) -> None:
    assert load_greys(tmp_path, 0, 147, 255) == [100, -1, 0]


def test_thresholds_themselves_are_occupied_and_free(tmp_path: Path) -> None:
    # grey 51 is exactly 0.2 dark from white, grey 204 exactly 0.8
    assert load_greys(tmp_path, 51, 204, occupied_thresh="0.8", free_thresh="0.2") == [100, 0]


@pytest.mark.parametrize("negate", ["true", "yes", "1"])
def test_negate_may_be_a_number_or_a_word(tmp_path: Path, negate: str) -> None:
    assert load_greys(tmp_path, 0, 255, negate=negate) == [0, 100]


@pytest.mark.parametrize("mode", ["Trinary", "RAW", "Scale"])
def test_a_mode_may_be_written_in_capitals(tmp_path: Path, mode: str) -> None:
    assert load_greys(tmp_path, 0, mode=mode) in ([100], [0])


def test_numbers_in_quotes_are_numbers(tmp_path: Path) -> None:
    write_greys(tmp_path, 0)
    assert load_map(write_yaml(tmp_path, resolution='"0.05"')).grid.resolution_m == 0.05


@pytest.mark.parametrize(("mode", "expected"), [("trinary", -1), ("scale", -1), ("raw", 0)])
def test_transparent_pixels_are_unknown_except_in_raw_maps(
    tmp_path: Path, mode: str, expected: int
) -> None:
    Image.fromarray(np.array([[[0, 0, 0, 254]]], dtype=np.uint8)).save(tmp_path / "map.png")
    loaded = load_map(write_yaml(tmp_path, image="map.png", mode=mode))
    assert loaded.grid.cells.tolist() == [[expected]]


def test_opaque_pixels_of_a_picture_with_transparency_keep_their_grey(tmp_path: Path) -> None:
    greys = np.array([[[0, 255], [205, 255], [254, 255]]], dtype=np.uint8)
    Image.fromarray(greys, "LA").save(tmp_path / "map.png")
    loaded = load_map(write_yaml(tmp_path, image="map.png"))
    assert loaded.grid.cells.tolist() == [[100, -1, 0]]


@pytest.mark.parametrize(
    "content",
    [
        b"P5\n# CREATOR: a map saver 0.050 m/pix\n3 1\n255\n\x00\xcd\xfe",
        b"P2\n# in words\n3 1 # columns and rows\n255\n0 205 254\n",
        b"P5 3 1 65535\n\x00\x00\xcd\xcd\xfe\xfe",
        b"P6 3 1 255\n\x00\x00\x00\xcd\xcd\xcd\xfe\xfe\xfe",
    ],
)
def test_every_kind_of_portable_grey_map_is_read(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "map.pgm").write_bytes(content)
    assert load_map(write_yaml(tmp_path)).grid.cells.tolist() == [[100, -1, 0]]


@pytest.mark.parametrize("mode", ["L", "P", "RGB", "1"])
def test_pictures_of_every_colour_type_are_read(tmp_path: Path, mode: str) -> None:
    Image.fromarray(np.array([[0, 255]], dtype=np.uint8)).convert(mode).save(tmp_path / "map.png")
    assert load_map(write_yaml(tmp_path, image="map.png")).grid.cells.tolist() == [[100, 0]]


def test_the_picture_is_looked_for_beside_the_yaml(tmp_path: Path) -> None:
    (tmp_path / "pictures").mkdir()
    (tmp_path / "maps").mkdir()
    write_greys(tmp_path / "pictures", 0)
    path = write_yaml(tmp_path / "maps", image="../pictures/map.pgm")
    assert load_map(path).grid.cells.tolist() == [[100]]


def test_the_picture_may_have_a_path_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    write_greys(tmp_path, 0)
    path = write_yaml(tmp_path / "maps", image=str(tmp_path / "map.pgm"))
    assert load_map(path).grid.cells.tolist() == [[100]]


def test_unknown_grey_that_loads_as_free_is_warned_about(tmp_path: Path) -> None:
    write_greys(tmp_path, 205, 205, 254, 0)
    loaded = load_map(write_yaml(tmp_path, free_thresh="0.25"))
    assert loaded.grid.cells.tolist() == [[0, 0, 0, 100]]
    [warning] = loaded.warnings
    assert warning.oddity is MapOddity.UNKNOWN_IS_FREE
    assert (warning.n_cells, warning.share_ratio, warning.free_thresh) == (2, 0.5, 0.25)


def test_a_map_with_no_free_cell_is_warned_about(tmp_path: Path) -> None:
    write_greys(tmp_path, 0, 0)
    [warning] = load_map(write_yaml(tmp_path)).warnings
    assert warning.oddity is MapOddity.NOTHING_FREE


def test_crossed_thresholds_are_warned_about(tmp_path: Path) -> None:
    write_greys(tmp_path, 0, 255)
    [warning] = load_map(write_yaml(tmp_path, free_thresh="0.7")).warnings
    assert warning.oddity is MapOddity.CROSSED_THRESHOLDS
    assert warning.free_thresh == 0.7


def test_a_picture_alone_is_a_map_once_its_resolution_is_known(tmp_path: Path) -> None:
    write_greys(tmp_path, 0, 205, 254, 255)
    loaded = load_picture(tmp_path / "map.pgm", resolution_m=0.1)
    assert loaded.grid.cells.tolist() == [[100, -1, 0, 0]]
    assert (loaded.grid.resolution_m, loaded.grid.origin) == (0.1, Pose(0.0, 0.0))


def test_a_picture_alone_needs_a_positive_resolution(tmp_path: Path) -> None:
    write_greys(tmp_path, 0)
    with pytest.raises(MapError, match="resolution"):
        load_picture(tmp_path / "map.pgm", resolution_m=0.0)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("resolution", "0"),
        ("resolution", "-0.05"),
        ("resolution", ".nan"),
        ("resolution", ".inf"),
        ("resolution", "fine"),
        ("origin", "[0, 0]"),
        ("origin", "[0, 0, north]"),
        ("origin", "5"),
        ("negate", "perhaps"),
        ("occupied_thresh", "[]"),
        ("free_thresh", "{}"),
        ("mode", "binary"),
        ("image", "[map.pgm]"),
        ("image", "''"),
    ],
)
def test_a_wrong_value_is_refused_with_its_line(tmp_path: Path, key: str, value: str) -> None:
    write_greys(tmp_path, 0)
    path = write_yaml(tmp_path, **{key: value})
    line = next(n for n, text in enumerate(path.read_text().split("\n"), 1) if text.startswith(key))
    with pytest.raises(MapError, match=f"line {line}: {key}"):
        load_map(path)


@pytest.mark.parametrize("key", list(USUAL))
def test_a_missing_line_is_refused_with_an_example(tmp_path: Path, key: str) -> None:
    write_greys(tmp_path, 0)
    with pytest.raises(MapError, match=f"no {key}") as caught:
        load_map(write_yaml(tmp_path, **{key: None}))
    assert f"{key}: " in caught.value.hint


@pytest.mark.parametrize(
    "text", ["", "just words", "- a\n- list", "image: [", "1: 2", "a: 1\na: 2", "? [a]\n: b"]
)
def test_a_file_that_describes_no_map_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "map.yaml"
    path.write_text(text)
    with pytest.raises(MapError, match=r"map\.yaml"):
        load_map(path)


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(MapError, match="not YAML"):
        load_map(path)


def test_a_picture_in_place_of_the_yaml_is_refused_with_what_to_give(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="is a picture") as caught:
        load_map(tmp_path / "map.pgm")
    assert "resolution" in caught.value.hint


def test_a_missing_yaml_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="no map file"):
        load_map(tmp_path / "map.yaml")


def test_a_folder_in_place_of_the_yaml_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="cannot be read"):
        load_map(tmp_path)


def test_a_missing_picture_is_refused_with_its_path(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"map\.pgm is missing"):
        load_map(write_yaml(tmp_path))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"GIF89a",
        b"P5",
        b"P5 2 x 255\n\x00",
        b"P5 100 100 255\n\x00\x01\x02",
        b"P2 3 1 255\n0 205\n",
        b"P5 -3 1 255\n\x00\x00\x00",
        b"P5 3 1 0\n\x00\x00\x00",
        b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00\x00",
    ],
)
def test_a_damaged_picture_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "map.pgm").write_bytes(content)
    with pytest.raises(MapError, match=r"map\.pgm cannot be read"):
        load_map(write_yaml(tmp_path))


def test_a_png_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    picture = tmp_path / "map.png"
    noise = np.random.default_rng(0).integers(0, 255, (60, 60), dtype=np.uint8)
    Image.fromarray(noise).save(picture)
    picture.write_bytes(picture.read_bytes()[:800])
    with pytest.raises(MapError, match=r"map\.png cannot be read"):
        load_map(write_yaml(tmp_path, image="map.png"))


@pytest.mark.parametrize("side", [9_000, 10_000, 60_000])
def test_a_picture_that_claims_too_many_cells_is_refused_before_it_is_read(
    tmp_path: Path, side: int
) -> None:
    (tmp_path / "map.pgm").write_bytes(b"P5\n%d %d\n255\n" % (side, side))
    with pytest.raises(MapError, match="80,000,000"):
        load_map(write_yaml(tmp_path))


shapes = st.tuples(st.integers(1, 8), st.integers(1, 8))
trinary_cells = arrays(np.int8, shapes, elements=st.sampled_from([-1, 0, 100]))
any_cells = arrays(np.int8, shapes, elements=st.integers(-1, 100))
metres = st.floats(-1e5, 1e5)
origins = st.builds(Pose, metres, metres, st.floats(-math.pi, math.pi))
resolutions = st.floats(1e-3, 10.0)


def written_and_read(grid: OccupancyGrid, mode: MapMode) -> OccupancyGrid:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a map: 1 #2.yaml"
        write_map(grid, path, mode=mode)
        return load_map(path).grid


@settings(max_examples=40)
@given(cells=trinary_cells, resolution_m=resolutions, origin=origins, mode=st.sampled_from(MapMode))
def test_a_written_map_is_read_back_the_same(
    cells: NDArray[np.int8], resolution_m: float, origin: Pose, mode: MapMode
) -> None:
    grid = OccupancyGrid(cells=cells, resolution_m=resolution_m, origin=origin)
    again = written_and_read(grid, mode)
    assert again.cells.tolist() == grid.cells.tolist()
    assert (again.resolution_m, again.origin) == (resolution_m, origin)


@settings(max_examples=40)
@given(cells=any_cells, mode=st.sampled_from([MapMode.SCALE, MapMode.RAW]))
def test_scale_and_raw_maps_keep_every_value(cells: NDArray[np.int8], mode: MapMode) -> None:
    grid = OccupancyGrid(cells=cells, resolution_m=0.05)
    assert written_and_read(grid, mode).cells.tolist() == cells.tolist()


def test_a_trinary_map_is_written_with_the_greys_of_map_saver(tmp_path: Path) -> None:
    values = np.array([[-1, 0, 25, 26, 64, 65, 100]], dtype=np.int8)
    picture = write_map(OccupancyGrid(cells=values, resolution_m=0.05), tmp_path / "map.yaml")
    assert picture == tmp_path / "map.pgm"
    assert list(picture.read_bytes()[-7:]) == [205, 254, 254, 205, 205, 0, 0]


def test_a_map_is_written_only_to_a_yaml_file(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"map\.pgm"):
        write_map(grid_from_text("."), tmp_path / "map.pgm")


def test_a_map_that_cannot_be_written_says_where(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="nowhere"):
        write_map(grid_from_text("."), tmp_path / "nowhere" / "map.yaml")


@pytest.mark.parametrize(
    "line",
    [
        "resolution: 2001-99-99",
        "resolution: !!int abc",
        "resolution: 1e-300",
        "resolution: 1e300",
        "origin: [1.0e300, 0, 0]",
        "resolution: " + 4000 * "[",
    ],
)
def test_a_value_that_no_map_can_have_is_refused_without_a_trace(tmp_path: Path, line: str) -> None:
    write_map(grid_from_text("..\n.."), tmp_path / "map.yaml")
    file = tmp_path / "map.yaml"
    key = line.partition(":")[0]
    kept = [each for each in file.read_text().splitlines() if not each.startswith(key)]
    file.write_text("\n".join([*kept, line]))
    with pytest.raises(MapError):
        load_map(file)


ALIAS_BOMB = """\
a: &a [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
b: &b [*a, *a, *a, *a, *a, *a, *a, *a, *a, *a]
c: &c [*b, *b, *b, *b, *b, *b, *b, *b, *b, *b]
d: &d [*c, *c, *c, *c, *c, *c, *c, *c, *c, *c]
e: &e [*d, *d, *d, *d, *d, *d, *d, *d, *d, *d]
f: &f [*e, *e, *e, *e, *e, *e, *e, *e, *e, *e]
g: &g [*f, *f, *f, *f, *f, *f, *f, *f, *f, *f]
image: map.pgm
origin: [*g, *g, *g]
"""


@pytest.mark.parametrize("text", [ALIAS_BOMB, "image: &name map.pgm\nmode: *name\n"])
def test_a_yaml_with_aliases_is_refused_before_it_is_unfolded(tmp_path: Path, text: str) -> None:
    path = tmp_path / "map.yaml"
    path.write_text(text)
    with pytest.raises(MapError, match="not YAML") as refused:
        load_map(path)
    assert "aliases" in refused.value.hint


def test_a_pipe_in_place_of_a_map_or_its_picture_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(MapError, match="not a regular file"):
        load_map(tmp_path / "pipe.yaml")
    os.mkfifo(tmp_path / "pipe.pgm")
    with pytest.raises(MapError, match="not a regular file"):
        load_map(write_yaml(tmp_path, image="pipe.pgm"))
