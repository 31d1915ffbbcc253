import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from drawing import grid_from_text
from mapspeak.cli import cli, main
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, SemanticMapStore, Waypoint
from mapspeak.memory.episodes.observation import EpisodeQuery, Observation, ObservationKind
from mapspeak.memory.episodes.store import EpisodeStore, memory_folder
from mapspeak.spatial.mapwriting import write_map

NINE = datetime(2026, 11, 20, 9, 0, tzinfo=UTC)
HALL = """
#########
#.......#
#.......#
#.......#
#########
"""


@pytest.fixture
def places(tmp_path: Path) -> Path:
    path = tmp_path / "places.yaml"
    store = SemanticMapStore(path, map_id="hall")
    store.write(
        Waypoint(
            name="dock corner",
            description="By the gate.",
            pose=Pose(1.25, 1.25),
            safety_landmarks=(Landmark(label="fire extinguisher", purpose="putting out fire"),),
            recorded_at=NINE,
            room_id="R1",
        )
    )
    store.write(Waypoint(name="kitchen", pose=Pose(2.25, 1.25), description="A sink and a fridge."))
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["memory", *map(str, arguments)])


def told(*arguments: object, code: int = 0) -> str:
    result = run(*arguments)
    assert result.exit_code == code, result.output + repr(result.exception)
    return result.output


def refused(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> None:
    monkeypatch.setattr("sys.argv", ["mapspeak", "memory", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2


def test_all_places_are_listed_with_where_they_are(places: Path) -> None:
    first, second, summary = told("list", "--semantic-map", places).splitlines()
    assert first == ("dock corner  (1.25, 1.25) m, 0 deg  R1  2026-11-20 09:00  fire extinguisher")
    assert second == "kitchen  (2.25, 1.25) m, 0 deg"
    assert summary == "2 places on the map hall."
    listed = json.loads(told("list", "--json", "--semantic-map", places))
    assert listed["map"] == "hall"
    assert listed["waypoints"][0]["x_m"] == 1.25
    assert listed["waypoints"][0]["safety_landmarks"][0]["label"] == "fire extinguisher"


def test_a_place_is_shown_whatever_the_case_of_its_name(places: Path) -> None:
    text = told("show", "Dock", "Corner", "--semantic-map", places)
    assert text.splitlines()[:4] == ["name: dock corner", "x_m: 1.25", "y_m: 1.25", "yaw_deg: 0.0"]
    assert "description: By the gate." in text
    assert "  - label: fire extinguisher, purpose: putting out fire" in text


def test_no_line_of_a_description_is_taken_for_another_fact(places: Path) -> None:
    two_lines = Waypoint(name="gate", pose=Pose(1.0, 1.0), description="Wide.\nroom_id: R9")
    SemanticMapStore(places).write(two_lines)
    lines = told("show", "gate", "--semantic-map", places).splitlines()
    assert [line for line in lines if line.startswith("room_id")] == []


def test_an_unknown_name_is_told_with_those_near_to_it(
    places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    refused(monkeypatch, "show", "kitchn", "--semantic-map", places)
    assert 'Near to it: "kitchen".' in capsys.readouterr().err


def test_words_find_a_place_or_say_that_nothing_is_remembered(places: Path) -> None:
    found = json.loads(told("find", "fridge", "--json", "--semantic-map", places, code=0))
    assert found["candidates"][0]["name"] == "kitchen"
    text = told("find", "kitchen", "--semantic-map", places)
    assert text.startswith("found: kitchen\n  1.00  kitchen")
    missing = told("find", "실로폰", "--semantic-map", places, code=1)
    assert missing.startswith("not remembered: 실로폰")


def test_a_check_says_what_is_odd_on_a_map(places: Path, tmp_path: Path) -> None:
    write_map(grid_from_text(HALL, resolution_m=0.5), tmp_path / "map.yaml")
    assert "2 places looked at, 0 findings." in told("check", "--semantic-map", places)
    SemanticMapStore(places).write(Waypoint(name="far away", pose=Pose(50.0, 50.0)))
    on_map = ("check", "--semantic-map", places, "--map", tmp_path / "map.yaml")
    text = told(*on_map, code=1)
    assert "off_map: " in text
    assert "far away" in text
    kinds = {each["kind"] for each in json.loads(told(*on_map, "--json", code=1))}
    assert "off_map" in kinds


def test_a_file_with_a_fault_is_told_with_its_line(
    places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    places.write_text(places.read_text().replace("x: 1.25", "x: here"))
    refused(monkeypatch, "check", "--semantic-map", places)
    assert 'line 7, column 15: pose.x, "here", is not a number' in capsys.readouterr().err


def test_what_is_exported_can_be_imported_elsewhere(places: Path, tmp_path: Path) -> None:
    out, other = tmp_path / "places.geojson", tmp_path / "other.yaml"
    assert "2 places written" in told("export", "--out", out, "--semantic-map", places)
    assert "2 places new or changed, 2 in" in told("import", out, "--semantic-map", other)
    assert SemanticMapStore(other).read() == SemanticMapStore(places).read()
    assert "0 places new or changed" in told("import", out, "--semantic-map", other)
    assert told("export", "--semantic-map", other) == out.read_text()


SIGNS = "\x1b[31mred\x1b[0m \u202eevil\u202c \x9b2J \u2028name: other"
"""Colours, a turned direction of reading, a cleared screen, a new line."""


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A memory whose every text tries to act on the terminal that shows it."""
    path = tmp_path / "hostile.yaml"
    said = json.dumps(SIGNS)
    path.write_text(
        f"version: 1\nmap: {said}\n{json.dumps('waypoint' + SIGNS[:4])}: []\nwaypoints:\n"
        f"  - name: {said}\n    description: {said}\n    pose: {{x: 1, y: 1, yaw_deg: 0}}\n"
        f"    room_id: {said}\n    picture: {said}\n    {json.dumps('pos' + SIGNS[:3])}: 1\n"
        f"    functional_landmarks: [{{label: {said}, note: {said}, purpose: {said}}}]\n",
        encoding="utf-8",
    )
    seen = Observation(
        recorded_at=NINE,
        pose=Pose(1.0, 1.0),
        kind=ObservationKind.NOTE,
        text=f"red {SIGNS}",
        labels=(SIGNS,),
        room_id=SIGNS,
        picture=SIGNS,
        map_id=SIGNS,
    )
    EpisodeStore(memory_folder(path)).write(seen)
    return path


@pytest.mark.parametrize(
    "arguments",
    [
        ["list"],
        ["show", "[31mred", "[0m", "evil", "2J", "name:", "other"],
        ["find", "red"],
        ["find", "red", "--json"],
        ["check"],
        ["check", "--map", "MAP"],
        ["episodes", "--words", "red"],
        ["episodes", "--near-words", "red"],
        ["episodes", "--json"],
        ["export"],
    ],
    ids=" ".join,
)
def test_nothing_that_a_memory_says_acts_on_the_terminal(
    hostile: Path, tmp_path: Path, arguments: list[str]
) -> None:
    write_map(grid_from_text(HALL, resolution_m=0.5), tmp_path / "map.yaml")
    named = [str(tmp_path / "map.yaml") if each == "MAP" else each for each in arguments]
    result = run(*named, "--semantic-map", hostile)
    assert "evil" in result.output or "1 finding." in result.output
    assert all(sign.isprintable() or sign == "\n" for sign in result.output + result.stderr)


@pytest.mark.parametrize(
    "line", ["    pose: {x: SIGNS, y: 1, yaw_deg: 0}", "  - SIGNS", "SIGNS: [", "    \x1b: 1"]
)
def test_a_fault_of_a_file_does_not_act_on_the_terminal(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    line: str,
) -> None:
    path = tmp_path / "broken.yaml"
    text = f"waypoints:\n  - name: a\n{line.replace('SIGNS', json.dumps(SIGNS))}\n"
    path.write_text(text, encoding="utf-8")
    refused(monkeypatch, "check", "--semantic-map", path)
    error = capsys.readouterr().err
    assert "broken.yaml" in error
    assert all(sign.isprintable() or sign == "\n" for sign in error)


def test_two_files_are_merged_into_a_third(places: Path, tmp_path: Path) -> None:
    other, out = tmp_path / "other.yaml", tmp_path / "both.yaml"
    SemanticMapStore(other).write(Waypoint(name="Kitchen", pose=Pose(9.0, 9.0), map_id="hall"))
    text = told("merge", places, other, "--out", out)
    assert "'Kitchen' is in both; they lie" in text
    names = [place.name for place in SemanticMapStore(out).read().waypoints]
    assert names == ["dock corner", "kitchen", "Kitchen (2)"]
    assert text.endswith("0 observations and 0 pictures came along.\n")


def test_the_observations_of_both_files_come_along_with_their_pictures(
    places: Path, tmp_path: Path
) -> None:
    other, out = tmp_path / "other.yaml", tmp_path / "both.yaml"
    SemanticMapStore(other).write(Waypoint(name="shed", pose=Pose(9.0, 9.0), map_id="hall"))
    mine, theirs = (EpisodeStore(memory_folder(path)) for path in (places, other))
    seen = Observation(
        recorded_at=NINE,
        pose=Pose(1.0, 1.0),
        kind=ObservationKind.PICTURE,
        labels=("ladder",),
        map_id="hall",
    )
    kept = mine.write(seen, picture=b"\xff\xd8\xffone")
    theirs.write(seen, picture=b"\xff\xd8\xffone")
    theirs.write(replace(seen, pose=Pose(3.0, 3.0)), picture=b"\xff\xd8\xfftwo")
    thinned = replace(seen, pose=Pose(5.0, 5.0), picture="20261120T090000Z-gone.jpg", id="")
    theirs.write(thinned)
    stranger = replace(seen, kind=ObservationKind.NOTE, picture="../../other.yaml", id="")
    theirs.write(stranger)

    text = told("merge", places, other, "--out", out)

    assert text.endswith("4 observations and 2 pictures came along.\n")
    both = EpisodeStore(memory_folder(out))
    found = both.find(EpisodeQuery(words="ladder"))
    pictures = [both.picture_path(match.observation) for match in found.matches]
    contents = {path.read_bytes() for path in pictures if path is not None}
    assert contents == {b"\xff\xd8\xffone", b"\xff\xd8\xfftwo"}
    assert found.n_matches == 4
    assert both.get(kept.id) == kept
    assert theirs.find(EpisodeQuery()).n_matches == 4


def test_a_merge_that_fails_leaves_nothing_behind(
    places: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "both.yaml"
    memory_folder(places).mkdir()
    (memory_folder(places) / "episodes.sqlite").write_text("no database")
    refused(monkeypatch, "merge", places, places, "--out", out)
    assert not out.exists()
    assert not memory_folder(out).exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["list", "--semantic-map", "none.yaml"], "no file none.yaml"),
        (["export", "--out", "places.csv", "--semantic-map", "PLACES"], ".geojson"),
        (["export", "--out", "/proc/x.geojson", "--semantic-map", "PLACES"], "--out"),
        (["import", "none.geojson", "--semantic-map", "PLACES"], "none.geojson cannot be read"),
        (["merge", "PLACES", "none.yaml", "--out", "c.yaml"], "no file none.yaml"),
        (["merge", "PLACES", "PLACES", "--out", "PLACES"], "there already"),
        (["episodes", "--since", "soon", "--semantic-map", "PLACES"], "09:30"),
        (["episodes", "--near", "here", "--semantic-map", "PLACES"], "x,y,radius"),
        (["episodes", "--near", "nan,1", "--semantic-map", "PLACES"], "x,y,radius"),
    ],
)
def test_what_cannot_be_done_is_said(
    places: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    says: str,
) -> None:
    named = [str(places) if each == "PLACES" else each for each in arguments]
    refused(monkeypatch, *named)
    error = capsys.readouterr().err
    assert says in error
    assert "Traceback" not in error


def test_the_only_memory_of_the_user_needs_no_name(
    places: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    (tmp_path / "mapspeak").mkdir()
    refused(monkeypatch, "list")
    assert "--memory" in capsys.readouterr().err
    places.rename(tmp_path / "mapspeak" / "hall.yaml")
    assert "2 places on the map hall." in told("list")


@pytest.fixture
def observed(places: Path) -> Path:
    store = EpisodeStore(memory_folder(places))
    for minutes, x, text in ((0, 1.0, "A ladder."), (30, 2.0, "A fridge."), (90, 8.0, "A door.")):
        observation = Observation(
            recorded_at=NINE + timedelta(minutes=minutes),
            pose=Pose(x, 0.0),
            kind=ObservationKind.PICTURE,
            text=text,
            room_id="R1",
            map_id="hall",
        )
        store.write(observation, picture=b"\xff\xd8\xff" + text.encode())
    return places


def episodes(path: Path, *arguments: object) -> list[dict[str, object]]:
    found = json.loads(told("episodes", "--json", "--semantic-map", path, *arguments))
    matches: list[dict[str, object]] = found["matches"]
    return matches


def test_observations_are_asked_by_words_place_and_time(observed: Path) -> None:
    assert [each["text"] for each in episodes(observed)] == ["A door.", "A fridge.", "A ladder."]
    (near,) = episodes(observed, "--near", "1,1,1.2", "--room", "R1")
    assert near["reasons"] == ["1.00 m from (1.00, 1.00)", "in R1"]
    assert Path(str(near["picture"])).is_file()
    span = ("--since", "2026-11-20T09:10+00:00", "--until", "2026-11-20T10:00+00:00")
    assert [each["text"] for each in episodes(observed, *span)] == ["A fridge."]
    assert episodes(observed, "--until", "9999d") == []
    first, *_ = episodes(observed, "--near-words", "ladder")
    assert (first["text"], first["distance_m"]) == ("A fridge.", 1.0)


def test_observations_are_listed_a_page_at_a_time(observed: Path) -> None:
    page = told("episodes", "--limit", 2, "--semantic-map", observed).splitlines()
    assert page[0].startswith("2026-11-20 10:30:00  (8.00, 0.00)  R1  picture  A door.  2026")
    assert page[-1] == "2 of 3 observations; more with --offset 2."
    rest = told("episodes", "--offset", 2, "--order", "newest", "--semantic-map", observed)
    assert "A ladder." in rest


def test_a_memory_without_episodes_has_none(places: Path) -> None:
    assert told("episodes", "--semantic-map", places) == "0 of 0 observations.\n"
