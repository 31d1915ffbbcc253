"""`mapspeak map` as it is typed: which maps it finds, what it writes, and what it refuses."""

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from drawing import grid_from_text
from mapspeak.cli import main
from mapspeak.geometry import Pose
from mapspeak.spatial.areagraph.files import from_json, to_geojson, to_osm
from mapspeak.spatial.mapwriting import write_map

TWO_ROOMS = """
##############
#......#.....#
#......#.....#
#............#
#............#
#......#.....#
#......#.....#
##############
"""

KINDS = ("--out", "--json", "--rooms", "--graph", "--geojson", "--osm")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def put_map(path: Path) -> Path:
    """Writes a map of two rooms, 7 x 4 m, and gives its .yaml."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_map(grid_from_text(TWO_ROOMS, resolution_m=0.5, origin=Pose(-1, -2, 0)), path)
    return path


def run_map(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["mapspeak", "map", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_the_label_picture_has_the_size_and_orientation_of_the_map_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_map(folder / "map.yaml")

    assert run_map(monkeypatch, "map.yaml", "--rooms", "labels.png", "--json", "facts.json") == 0

    picture, labels = Image.open("map.pgm"), Image.open("labels.png")
    facts = json.loads(Path("facts.json").read_text())
    assert labels.mode == "I;16"
    assert labels.size == picture.size
    numbers = np.asarray(labels)
    assert (numbers[np.asarray(picture) == 0] == 0).all()
    for region in facts["regions"]:
        x, y = region["centre"]["x"], region["centre"]["y"]
        row_from_top = picture.height - 1 - int((y + 2) / 0.5)
        assert numbers[row_from_top, int((x + 1) / 0.5)] == region["label"]


def test_the_area_graph_is_the_same_in_all_its_files(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_map(folder / "office.yaml")
    files = ["--graph", "a.json", "--geojson", "a.geojson", "--osm", "a.osm"]

    assert run_map(monkeypatch, "office.yaml", "--json", "facts.json", *files) == 0

    graph = from_json(Path("a.json").read_text())
    assert graph.name == "office"
    assert Path("a.geojson").read_text() == to_geojson(graph)
    assert Path("a.osm").read_text() == to_osm(graph)
    facts = json.loads(Path("facts.json").read_text())
    assert {region["id"] for region in facts["regions"]} == {area.id for area in graph.areas}
    (door,), (passage,) = facts["doors"], graph.passages
    assert passage.line is not None
    assert [(end["x"], end["y"]) for end in door["line"]] == [(p.x, p.y) for p in passage.line]


def test_an_anchor_puts_the_graph_on_earth(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put_map(folder / "map.yaml")

    asked = ["map.yaml", "--anchor", "-33.5", "151.25", "90", "--geojson", "a.geojson"]
    assert run_map(monkeypatch, *asked, "--osm", "a.osm") == 0

    collection = json.loads(Path("a.geojson").read_text())
    lon, lat = collection["features"][0]["geometry"]["coordinates"][0][0]
    assert (lon, lat) == pytest.approx((151.25, -33.5), abs=1e-3)
    assert f'lat="{lat:.13f}" lon="{lon:.13f}"' in Path("a.osm").read_text()


def test_maps_of_the_same_folder_name_and_stem_get_names_of_their_own(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for place in ("a/lab/map.yaml", "b/lab/map.yaml", "b/lab_map.yaml"):
        put_map(folder / "maps" / place)

    assert run_map(monkeypatch, "maps", "--json", "out") == 0

    assert names_in(folder / "out")[0] == "a_lab_map.json"
    assert len(names_in(folder / "out")) == 3


def test_files_of_one_folder_and_stem_do_not_overwrite_each_other(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_map(folder / "map.yaml")
    (folder / "map.yml").write_bytes((folder / "map.yaml").read_bytes())

    assert run_map(monkeypatch, "map.yaml", "map.yml", "--out", "out", "--json", "out") == 0

    assert len(names_in(folder / "out")) == 4


def test_a_map_keeps_its_name_when_others_come_and_go(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_map(folder / "maps" / "a" / "lab" / "map.yaml")
    assert run_map(monkeypatch, "maps", "--json", "first/") == 0
    put_map(folder / "maps" / "b" / "lab" / "map.yaml")
    assert run_map(monkeypatch, "maps", "--json", "second") == 0

    assert names_in(folder / "first") == ["a_lab_map.json"]
    assert names_in(folder / "second") == ["a_lab_map.json", "b_lab_map.json"]


def test_all_results_of_many_maps_fit_in_one_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_map(folder / "one.yaml")
    put_map(folder / "two.yaml")
    kinds = [word for kind in KINDS for word in (kind, "out")]

    assert run_map(monkeypatch, "one.yaml", "two.yaml", *kinds) == 0

    endings = (".geojson", ".json", ".osm", ".png", "_graph.json", "_rooms.png")
    assert names_in(folder / "out") == [f"{n}{end}" for n in ("one", "two") for end in endings]


def test_a_quoted_pattern_finds_maps_in_folders_below(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for place in ("maps/a/map.yaml", "maps/b/c/map.yaml", "maps/b/other.yaml"):
        put_map(folder / place)

    assert run_map(monkeypatch, "maps/**/map.yaml") == 0

    said = capsys.readouterr().out
    assert [line.split(":")[0] for line in said.splitlines() if "cells" in line] == [
        "a_map",
        "b_c_map",
    ]


def test_a_folder_may_hold_other_yaml_files_and_bare_pictures(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_map(folder / "maps" / "map.yaml")
    Image.open(folder / "maps" / "map.pgm").save(
        put_map(folder / "maps/bare/map.yaml").parent / "map.png"
    )
    for leftover in ("map.yaml", "map.pgm"):
        (folder / "maps" / "bare" / leftover).unlink()
    (folder / "maps" / "nav2_params.yaml").write_text("amcl:\n  use_sim_time: true\n")
    (folder / "maps" / "compose.yaml").write_text("services:\n  ros:\n    image: ros:jazzy\n")
    (folder / "maps" / "ci.yml").write_text("image: python:3.11\n")

    assert run_map(monkeypatch, "maps", "--resolution", "0.5") == 0

    said = capsys.readouterr().out
    assert [line.split(":")[0] for line in said.splitlines() if "cells" in line] == [
        "bare_map",
        "map",
    ]


def test_the_same_map_named_twice_is_shown_once(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_map(folder / "maps" / "map.yaml")

    assert run_map(monkeypatch, "maps", "maps/../maps/map.yaml", "maps/*.yaml") == 0
    assert capsys.readouterr().out.count("cells") == 1


def test_broken_maps_are_told_of_and_the_others_shown(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b", "c"):
        put_map(folder / "maps" / f"{name}.yaml")
    (folder / "maps" / "a.pgm").write_bytes(b"P5\n14 8\n255\n")
    (folder / "maps" / "b.yaml").write_text("image: b.pgm\nresolution: [")

    assert run_map(monkeypatch, "maps", "--json", "out") == 1

    said = capsys.readouterr()
    assert "maps/a.yaml" in said.err
    assert "maps/b.yaml" in said.err
    assert said.err.splitlines()[-1] == "2 of 3 maps could not be read."
    assert "c: 14 x 8 cells" in said.out
    assert names_in(folder / "out") == ["c.json"]


class Terminal(io.StringIO):
    """What a person watches."""

    def isatty(self) -> bool:
        return True


def test_a_person_at_a_terminal_sees_how_far_it_is(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_map(folder / "one.yaml")
    put_map(folder / "two.yaml")
    monkeypatch.setattr("sys.stderr", terminal := Terminal())

    assert run_map(monkeypatch, "one.yaml", "two.yaml") == 0

    assert "2 of 2: two.yaml" in terminal.getvalue()
    assert terminal.getvalue().endswith("\r\x1b[2K")


def test_a_log_gets_no_progress(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_map(folder / "one.yaml")
    put_map(folder / "two.yaml")

    assert run_map(monkeypatch, "one.yaml", "two.yaml") == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["maps", "--out", "maps/map.pgm/"], "would be overwritten"),
        (["maps/map.yaml", "--out", "maps/map.pgm"], "would be overwritten"),
        (["maps/map.yaml", "--json", "maps/../maps/map.yaml"], "would be overwritten"),
        (["maps/map.yaml", "--json", "x.json", "--graph", "x.json"], "Two results"),
        (["maps/map.yaml", "--resolution", "0.1"], "bare pictures"),
        (["maps/map.yaml", "--anchor", "1", "2", "3"], "--geojson and --osm"),
        (["maps/map.yaml", "--anchor", "95", "2", "3", "--osm", "x"], "latitude from -85"),
        (["maps/map.pgm"], "--resolution"),
        (["maps/**/none.yaml"], "No map matches"),
        (["ma**/none.yaml"], "is no pattern"),
        (["empty"], "holds no map"),
        (["missing"], "There is no file missing"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_is_written(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    says: str,
) -> None:
    put_map(folder / "maps" / "map.yaml")
    (folder / "empty").mkdir()

    assert run_map(monkeypatch, *arguments) == 2

    assert says in capsys.readouterr().err
    assert sorted(str(path.relative_to(folder)) for path in folder.rglob("*")) == [
        "empty",
        "maps",
        "maps/map.pgm",
        "maps/map.yaml",
    ]


def test_results_beside_many_maps_do_not_overwrite_a_picture(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    first = put_map(folder / "one.yaml")
    Image.open("one.pgm").save("one.png")
    first.write_text(first.read_text().replace("one.pgm", "one.png"))
    put_map(folder / "two.yaml")
    before = Path("one.png").read_bytes()

    assert run_map(monkeypatch, "one.yaml", "two.yaml", "--out", ".") == 2

    assert "one.png is one of the maps" in capsys.readouterr().err
    assert Path("one.png").read_bytes() == before


@pytest.mark.skipif(os.geteuid() == 0, reason="everything is readable to root")
def test_a_folder_that_may_not_be_read_is_told_of(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_map(folder / "maps" / "closed" / "map.yaml")
    (folder / "maps" / "closed").chmod(0)

    assert run_map(monkeypatch, "maps") == 2
    assert "cannot be looked at" in capsys.readouterr().err
    (folder / "maps" / "closed").chmod(0o755)


def test_a_map_called_by_control_characters_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_map(folder / "of\x07fice.yaml")

    assert run_map(monkeypatch, "of\x07fice.yaml", "--osm", "x.osm") == 1
    assert "control characters" in capsys.readouterr().err
    assert not Path("x.osm").exists()


def test_a_text_file_is_told_to_be_no_picture(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "README.md").write_text("# A house\n")
    assert run_map(monkeypatch, "README.md") == 2
    assert "README.md is no picture, and no map's .yaml file." in capsys.readouterr().err


def test_results_of_several_maps_do_not_go_to_what_looks_like_one_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("hall", "yard"):
        put_map(folder / "maps" / f"{name}.yaml")
    assert run_map(monkeypatch, "maps", "--out", "depot.png") == 2
    assert "There are 2 maps" in capsys.readouterr().err
    assert names_in(folder) == ["maps"]


def test_what_was_written_is_told(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_map(folder / "hall.yaml")
    assert run_map(monkeypatch, "hall.yaml", "--out", "pictures", "--json", "facts.json") == 0
    assert "Written: pictures, facts.json\n" in capsys.readouterr().out


def test_sizes_doors_and_ways_are_told_without_a_robot(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_map(folder / "hall.yaml")
    assert run_map(monkeypatch, "hall.yaml", "--from", "0", "0") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("  The smaller room is R")
    assert [line.split()[0] for line in lines[2:]] == ["R2", "R1", "D1"]
    assert all(re.search(r"  way \d+\.\d m$", line) for line in lines[2:4])
    assert re.search(r"D1 +door +\d\.\d\d m +at 2\.\d+, -?0\.\d+  joins R1 and R2$", lines[4])


def test_a_picture_beside_the_yaml_is_read_where_the_path_is_dead(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    yaml = put_map(folder / "maps" / "map.yaml")
    yaml.write_text(yaml.read_text().replace("map.pgm", r"C:\robot\maps\map.pgm"))
    assert run_map(monkeypatch, "maps", "--json", "facts.json") == 0
    assert "map.pgm beside it was read" in capsys.readouterr().out
    (folder / "maps" / "map.pgm").rename(folder / "maps" / "other.pgm")
    assert run_map(monkeypatch, "maps/map.yaml") == 1
    assert "is missing" in capsys.readouterr().err


def test_grey_is_unknown_where_somebody_says_so(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    yaml = put_map(folder / "map.yaml")
    yaml.write_text(yaml.read_text().replace("free_thresh: 0.196", "free_thresh: 0.25"))
    pixels = np.array(Image.open(folder / "map.pgm"))
    pixels[1:7, 1:7] = 205
    Image.fromarray(pixels).save(folder / "map.pgm")
    assert run_map(monkeypatch, "map.yaml") == 0
    assert "load as free" in capsys.readouterr().out
    assert run_map(monkeypatch, "map.yaml", "--grey-unknown") == 0
    said = capsys.readouterr().out
    assert "load as free" not in said
    assert "The only room: R1" in said


def test_a_map_is_shown_without_loading_memory_or_driving() -> None:
    script = (
        "import sys, mapspeak.cli.mapping\n"
        "heavy = {'memory', 'driving', 'worldmodel', 'places', 'server.reports'}\n"
        "print(*({f'mapspeak.{name}' for name in heavy} & sys.modules.keys()))"
    )
    done = subprocess.run(  # noqa: S603 - our own words
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""
