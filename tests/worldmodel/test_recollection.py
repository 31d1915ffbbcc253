"""Things that are kept beside a large memory, and what becomes of them in a later session."""

import pickle
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from drawing import grid_from_text
from embedding import ConceptEmbedder
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, LaserFan, SemanticMap, SemanticMapStore, Waypoint
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.keptvalues import PlainReader, load_value
from mapspeak.worldmodel.recollection import (
    INDEX_FILE,
    KEPT_FROM,
    THINGS_FILE,
    KeptMemory,
    Recollection,
    Recollector,
)
from mapspeak.worldmodel.thingids import IDS_FILE

HALL = """
    ####################
    #..................#
    #..................#
    #..................#
    ####################
    """
N_PLACES = KEPT_FROM // 2


def _draw(cells: str = HALL) -> OccupancyGrid:
    return grid_from_text(cells, resolution_m=0.5)


def _remember(n_places: int = N_PLACES, *, label: str = "sink") -> SemanticMap:
    return SemanticMap(
        waypoints=tuple(
            Waypoint(
                name=f"place {number}",
                pose=Pose(1.0 + number % 8, 1.2, 0.1 * number),
                recorded_at=datetime(2026, 11, 2, tzinfo=UTC),
                functional_landmarks=(
                    Landmark(
                        label=f"{label} {number}",
                        bearing_rad=0.1,
                        range_m=1.0,
                        laser=LaserFan.read("from -4.0 to 4.0 deg at 2.2 2.1 - >20 3.4 m"),
                    ),
                    Landmark(label=f"tap {number}", bearing_rad=-0.1),
                ),
            )
            for number in range(n_places)
        )
    )


def _keep(folder: Path, memory: SemanticMap) -> Recollector:
    recollector = Recollector(kept=folder)
    recollector.recollect(memory, _draw())
    recollector.keep_things()
    return recollector


def test_a_later_session_takes_the_things_that_were_kept(tmp_path: Path) -> None:
    first = _keep(tmp_path, _remember()).latest
    kept = load_value(tmp_path / THINGS_FILE, KeptMemory)

    later = Recollector(kept=tmp_path)
    again = later.recollect(_remember(), _draw())

    assert first is not None
    assert kept is not None
    assert kept.found.things == again.found.things == first.found.things
    written = (tmp_path / THINGS_FILE).stat().st_mtime_ns
    later.keep_things()
    assert (tmp_path / THINGS_FILE).stat().st_mtime_ns == written


def test_what_was_made_of_kept_things_serves_the_next_question_too(tmp_path: Path) -> None:
    _keep(tmp_path, _remember())
    memory, grid, later = _remember(), _draw(), Recollector(kept=tmp_path)

    made = later.recollect(memory, grid)

    assert later.recollect(memory, grid) is made
    assert all(made.found.seen[place.name][0].of is place for place in memory.waypoints), (
        "later questions compare records by identity"
    )


def test_a_later_session_parses_only_the_records_that_changed(tmp_path: Path) -> None:
    path, folder = tmp_path / "places.yaml", tmp_path / "kept"
    SemanticMapStore(path).write_all(lambda _: _remember().waypoints)
    folder.mkdir()
    for _ in ("the first session", "a later one"):
        store, recollector = SemanticMapStore(path), Recollector(kept=folder)
        store.kept = recollector
        memory = store.read()
        found = recollector.recollect(memory, _draw()).found
        recollector.keep_things()
    made_of = (found.seen[place.name][0].sightings[0].waypoint for place in memory.waypoints)
    assert all(each is place for each, place in zip(made_of, memory.waypoints, strict=True))

    path.write_text(path.read_text().replace("sink 7", "basin 7"))
    store = SemanticMapStore(path)
    store.kept = Recollector(kept=folder)
    assert store.read().waypoints[7].landmarks[0].label == "basin 7"
    assert store.read().waypoints[8] == memory.waypoints[8]


def test_what_changed_since_is_joined_anew(tmp_path: Path) -> None:
    _keep(tmp_path, _remember())
    changed = _remember(label="basin")
    other_map = _draw(HALL.replace("...........", ".....#.....", 1))

    for memory, grid in ((changed, _draw()), (_remember(), other_map)):
        again = Recollector(kept=tmp_path).recollect(memory, grid)
        assert again.found.things == Recollector().recollect(memory, grid).found.things


def test_the_things_of_a_small_memory_are_joined_and_not_kept(tmp_path: Path) -> None:
    _keep(tmp_path, _remember(3))
    assert not (tmp_path / THINGS_FILE).exists()


def _prepare(folder: Path, memory: SemanticMap, embedder: ConceptEmbedder) -> Recollector:
    recollector = Recollector(lambda: embedder, kept=folder)
    recollector.recollect(memory, _draw()).prepare()
    recollector.keep_things()
    recollector.keep()
    return recollector


def test_a_later_session_takes_the_index_that_was_kept(tmp_path: Path) -> None:
    first = _prepare(tmp_path, _remember(), ConceptEmbedder()).latest
    assert first is not None
    written = (tmp_path / INDEX_FILE).stat().st_mtime_ns

    asked = ConceptEmbedder()
    later = _prepare(tmp_path, _remember(), asked).latest

    assert later is not None
    assert later.find("somewhere to wash") == first.find("somewhere to wash")
    assert asked.asked == ["somewhere to wash"]
    assert (tmp_path / INDEX_FILE).stat().st_mtime_ns == written


def test_a_kept_index_answers_as_a_new_one_does_when_places_came_and_went(tmp_path: Path) -> None:
    _prepare(tmp_path, _remember(), ConceptEmbedder())
    places = _remember(N_PLACES + 2).waypoints
    changed = SemanticMap(waypoints=(*places[3:40], *places[41:]))

    later = _prepare(tmp_path, changed, ConceptEmbedder()).latest
    (tmp_path / "no index").mkdir()
    shutil.copy(tmp_path / IDS_FILE, tmp_path / "no index")
    kept = tmp_path / "no index"
    new = Recollector(ConceptEmbedder, kept=kept).recollect(changed, _draw())

    assert later is not None
    for words in ("sink 2", "sink 40", "sink 501", "somewhere to wash", "place 499", "ladder"):
        assert later.find(words) == new.find(words)


def test_an_index_of_another_model_or_with_a_flaw_is_passed_over(tmp_path: Path) -> None:
    memory, path = _remember(), tmp_path / INDEX_FILE
    _prepare(tmp_path, memory, ConceptEmbedder())
    other = ConceptEmbedder()
    other.name = "others"
    flawed = bytearray(path.read_bytes())
    flawed[200] ^= 1
    for content, embedder in ((path.read_bytes(), other), (flawed, ConceptEmbedder())):
        path.write_bytes(content)
        later = _prepare(tmp_path, memory, embedder).latest
        assert later is not None
        assert later.find("sink 7").candidates[0].entry.name == "sink 7"


@pytest.mark.parametrize("n_kept", [0, 10, 36, 1000, -1])
def test_a_file_that_is_cut_off_is_passed_over(n_kept: int, tmp_path: Path) -> None:
    _keep(tmp_path, _remember())
    path = tmp_path / THINGS_FILE
    path.write_bytes(path.read_bytes()[:n_kept])
    assert load_value(path, KeptMemory) is None
    assert len(Recollector(kept=tmp_path).recollect(_remember(), _draw()).things) > 0


def test_a_file_of_other_code_or_with_a_flaw_is_passed_over(tmp_path: Path) -> None:
    _keep(tmp_path, _remember())
    path = tmp_path / THINGS_FILE
    content = path.read_bytes()
    begin = content.index(pickle.PROTO + b"\x05")
    for at in (0, begin + 50):
        path.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        assert load_value(path, KeptMemory) is None
    path.write_bytes(content)
    assert load_value(path, KeptMemory) is not None


@pytest.mark.parametrize("name", ["os.system", "mapspeak.cli.main", "builtins.eval"])
def test_a_file_that_names_a_function_is_not_obeyed(name: str) -> None:
    module, _, function = name.rpartition(".")
    told = f"c{module}\n{function}\n(S'x'\ntR.".encode()
    with pytest.raises(pickle.UnpicklingError):
        PlainReader(memoryview(told), ()).load()


def test_things_that_cannot_be_kept_are_used_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert _keep(tmp_path / "file", _remember()).latest is not None


def test_sessions_that_share_a_memory_give_no_id_to_two_things(tmp_path: Path) -> None:
    one, other = Recollector(kept=tmp_path), Recollector(kept=tmp_path)
    one.recollect(_remember(2), _draw())
    with (tmp_path / IDS_FILE).open("a") as log:
        log.write("[7, half a line")
    first = other.recollect(_remember(3), _draw())
    second = one.recollect(_remember(4), _draw())
    again = other.recollect(_remember(4), _draw())

    assert _ids(first).items() < _ids(second).items()
    assert _ids(again) == _ids(second)
    assert sorted(_ids(again).values()) == [f"T{number}" for number in range(1, 9)]


@pytest.mark.parametrize(
    "said",
    [
        "[" * 100_000,
        '[1e999, "hall", "shelf", 0.0, null, 0]',
        '[-3, "hall", "shelf", 0.0, null, 0]',
        '[1000000000, "hall", "shelf", 0.0, null, 0]',
        '[3, ["hall"], {}, 0.0, null, 0]',
        "\x00\ufffd",
    ],
)
def test_what_is_no_id_in_the_log_gives_none(tmp_path: Path, said: str) -> None:
    (tmp_path / IDS_FILE).write_text(f"{said}\n", encoding="utf-8")
    things = Recollector(kept=tmp_path).recollect(_remember(2), _draw())
    assert sorted(_ids(things).values()) == [f"T{number}" for number in range(1, 5)]


def test_a_log_of_ids_that_cannot_be_written_costs_no_answer(tmp_path: Path) -> None:
    (tmp_path / IDS_FILE).mkdir()
    things = Recollector(kept=tmp_path).recollect(_remember(2), _draw())
    assert sorted(_ids(things).values()) == [f"T{number}" for number in range(1, 5)]


def _ids(recollection: Recollection) -> dict[str, str]:
    return {each.thing.label: each.id for each in recollection.things}
